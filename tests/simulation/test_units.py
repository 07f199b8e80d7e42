"""Lengths, masses and times in other units: a mechanism assembles to the same posture and makes the same motion."""

import random
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

import mbd
from tests.parts.benches import SI, Units

FAR = [
    Units(m=1e-9, kg=1.0, s=1.0), Units(m=1e-6, kg=1e3, s=1e-3), Units(m=1e6, kg=1.0, s=1.0),
    Units(m=1.0, kg=1e-9, s=1e4), Units(m=1e-4, kg=1e9, s=1e-5), Units(m=1e-8, kg=1e-6, s=1e2),
]  # fmt: skip
"""Units in which lengths, masses and times are far from 1."""


def plane_linkage(rng: random.Random, u: Units) -> tuple[mbd.Model, list[str]]:
    """A chain of links whose end a hinge or a slider holds, some with a spring, a drive or joints that are cut."""
    count = rng.randint(2, 3)
    model = mbd.Model("linkage", gravity=(0.0, -9.81 * u.m / u.s**2, 0.0))
    frame, last = model.ground.origin, model.ground.origin
    for k in range(count):
        size, mass = rng.uniform(0.5, 1.0), rng.uniform(0.5, 2.0)
        link = mbd.Link(f"link {k}", mass * u.kg, size * u.m, 0.5 * size * u.m, mass * size**2 / 12.0 * u.inertia)
        model.connect(mbd.Revolute(f"pin {k}", frame, link.start))
        last, frame = frame, link.end
    if rng.random() < 0.5:
        model.connect(mbd.Revolute("closer", model.ground.point(rng.uniform(0.6, 1.0) * u.m, 0.1 * u.m), frame))
    else:
        slider = mbd.PointMass("slider", rng.uniform(0.5, 2.0) * u.kg)
        rail = mbd.Prismatic("rail", model.ground.point(0.0, rng.uniform(-0.2, 0.2) * u.m), slider.origin)
        model.connect(rail, mbd.Revolute("closer", slider.origin, frame))
    names = [joint.name for joint in model.joints]
    model.cut = rng.choice(["auto", "all", (rng.choice(names),), tuple(rng.sample(names, 2))])
    if rng.random() < 0.5:
        ends = model.ground.point(0.3 * u.m, 1.5 * u.m), last
        model.apply(mbd.Spring("spring", *ends, stiffness=20.0 * u.N / u.m, length=0.5 * u.m))
    if rng.random() < 0.3:
        model.constrain(mbd.Bilateral("drive", model.joints[0], value=lambda t: 0.3 + 2.0 * t / u.s))
    return model, ["pin 0.angle", "pin 1.angle", "closer.angle"]


def space_linkage(rng: random.Random, u: Units) -> tuple[mbd.Model, list[str]]:
    """Bodies in space on hinges, universal and ball joints, the last held by a ball joint, some joints cut."""
    model = mbd.Model("linkage in space", gravity=(0.0, -9.81 * u.m / u.s**2, 1.0 * u.m / u.s**2))
    frame = model.ground.origin

    def place(size: float = 0.5) -> tuple[float, float, float]:
        x, y, z = (rng.uniform(-size, size) * u.m for _ in range(3))
        return x, y, z

    def axis() -> tuple[float, float, float]:
        a = np.array([rng.gauss(0.0, 1.0) for _ in range(3)])
        x, y, z = (a / np.linalg.norm(a)).tolist()
        return x, y, z

    for k in range(3):
        body = mbd.RigidBody(
            f"body {k}", rng.uniform(0.5, 2.0) * u.kg, tuple(rng.uniform(0.1, 0.15) * u.inertia for _ in range(3))
        )
        ends = frame, body.point(*place(), name="a")
        kind = (mbd.Revolute, mbd.Spherical, rng.choice([mbd.Spherical, mbd.Revolute]))[k]
        model.connect(kind(f"hinge {k}", *ends, **({"axis": axis()} if k == 0 else {})))
        frame = body.point(*place(), name="b")
    model.connect(mbd.Spherical("closer", frame, model.ground.point(*place(0.3))))
    model.cut = rng.choice(["auto", ("hinge 1",), ("hinge 0", "closer")])
    return model, ["hinge 0.angle"]


def floor(rng: random.Random, u: Units) -> tuple[mbd.Model, list[str]]:
    """A double pendulum on a cart that falls upon the ground, on which it rubs."""
    model = mbd.Model("falls", gravity=(0.0, -9.81 * u.m / u.s**2, 0.0))
    body = mbd.RigidBody("box", rng.uniform(1.0, 2.0) * u.kg, rng.uniform(0.1, 0.3) * u.inertia)
    rod = mbd.Link("rod", 0.5 * u.kg, 0.4 * u.m, 0.2 * u.m, 0.01 * u.inertia)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin), mbd.Revolute("pin", body.origin, rod.start))
    bounce, mu = rng.choice([0.0, 0.4]), rng.choice([0.0, 0.3, None])
    for name, x in (("left", -0.25), ("right", 0.25)):
        foot = mbd.touchdown(body.point(x * u.m, -0.15 * u.m))
        model.constrain(mbd.Unilateral(name, foot, restitution=bounce, friction=mu))
    return model, ["place.angle", "pin.angle"]


MAKERS = (plane_linkage, space_linkage, floor)


def start_of(number: int, u: Units) -> tuple[mbd.Model, mbd.State | None]:
    """The mechanism of a number and its start; None where it is refused."""
    rng = random.Random(f"units {number}")
    model, names = MAKERS[number % 3](rng, u)
    position: dict[str, float] = {"place.y": 0.3 * u.m} if number % 3 == 2 else {}
    angles = names if number % 3 == 2 else [rng.choice(names)]
    position |= {name: rng.uniform(-0.7, 0.7) for name in angles}
    velocity = {angles[0]: rng.uniform(1.0, 3.0) / u.s}
    if any(word.name == "drive" for word in model.constraints):
        position, velocity = {}, {}
    if number % 3 == 1:
        position = {}
    try:
        return model, mbd.assemble(model, position, velocity)
    except mbd.AssemblyError:
        return model, None


def factors(names: Iterable[str], u: Units) -> np.ndarray:
    """What coordinates and rates of these names are multiplied by, seconds apart."""
    turning = ("orientation", "angular_velocity", "angle")
    return np.array([1.0 if any(word in name for word in turning) else u.m for name in names])


SCHEMES = (mbd.HHT(alpha=0.05), mbd.RungeKutta853(), mbd.RadauIIA(), mbd.GeneralizedAlpha(0.9), mbd.Newmark())


def moved(model: mbd.Model, start: mbd.State, scheme: Any, dt: float) -> mbd.Trajectory | None:
    """Some steps; None where the run ends with an error."""
    try:
        return mbd.simulate(model, start, scheme, dt=dt, until=60 * dt)
    except mbd.SimulationError:
        return None


def in_other_units(number: int, u: Units) -> None:
    (model, start), (other, far) = start_of(number, SI), start_of(number, u)
    assert (start is None) == (far is None)
    if start is None or far is None:
        return
    place, speed = factors(start.names, u), factors(start.velocity_names, u) / u.s
    np.testing.assert_allclose(far.q / place, start.q, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(far.v / speed, start.v, rtol=1e-7, atol=1e-7 * float(np.max(np.abs(start.v))))
    if number % 3 == 2:  # postures only
        return
    scheme, dt = SCHEMES[number % len(SCHEMES)], 0.005
    here, there = moved(model, start, scheme, dt), moved(other, far, scheme, dt * u.s)
    if here is None:
        return
    assert there is not None
    assert [event.name for event in here.events] == [event.name for event in there.events]
    np.testing.assert_allclose(there.final.q / place, here.final.q, rtol=1e-6, atol=1e-6)
    assert here.stats["steps"] == there.stats["steps"]


@pytest.mark.parametrize("number", [*range(8), *(pytest.param(k, marks=pytest.mark.slow) for k in range(8, 40))])
def test_a_mechanism_in_other_units_is_assembled_to_the_same_posture_and_makes_the_same_motion(number: int) -> None:
    for k in (number, number + 3):
        in_other_units(number, FAR[k % len(FAR)])
