"""What balances stays at rest, and what nothing acts on keeps its speed: each scheme, dt and tol, tree and cut."""

import random

import numpy as np
import pytest

import mbd

SCHEMES = [
    mbd.HHT(0.05), mbd.HHT(0.05, start="consistent"), mbd.GeneralizedAlpha(0.0), mbd.Newmark(),
    mbd.HHT(0.05, formulation="index3"), mbd.RadauIIA(), mbd.RungeKutta4(), mbd.RungeKutta853(),
]  # fmt: skip
DOUBTS = ("not resolved", "uncertain", "were passed", "numerical energy", "shortened")
"""Words of notes that would doubt a motion that any step resolves."""


def steps(scheme):
    """A step far too long, one as usual, and a tolerance where the scheme follows one."""
    follows = scheme.stabilized if hasattr(scheme, "stabilized") else True
    return [{"dt": 0.1}, {"dt": 2e-3}, *([{"tol": 1e-6}] if follows else [])]


def hung(rng, cut):
    """Links that hang straight, some with dry joints or springs at rest, some driven to stay where they are."""
    model = mbd.Model("hung", gravity=(0.0, rng.choice([0.0, -9.81]), 0.0), cut=cut)
    end = model.ground.origin
    for k in range(rng.randint(1, 3)):
        length = rng.uniform(0.2, 1.0)
        link = mbd.Link(f"link {k}", rng.uniform(0.1, 5.0), length, rng.choice([0.0, 0.5, 0.7]) * length, 0.02)
        loss = rng.choice([None, mbd.Coulomb(0.1), mbd.Stribeck(0.2, 0.1, 0.1), mbd.Viscous(0.3)])
        joint = mbd.Revolute(f"joint {k}", end, link.start, loss=loss, stiffness=rng.choice([0.0, 2.0]))
        model.connect(joint)
        if rng.random() < 0.4:
            model.constrain(mbd.Bilateral(f"hold {k}", joint, value=lambda t: 0.0 * t))
        end = link.end
    return model, {}, {}


def standing(rng, cut):
    """A box on feet that stick, rub or slide, or a ball, on the floor or on one that moves with it: not pushed."""
    model, speed = mbd.Model("standing", cut=cut), rng.choice([0.0, 0.5])
    spatial, mu = rng.random() < 0.5, rng.choice([None, 0.0, 0.4])
    floor = mbd.Plane((0.0, 1.0, 0.0), 0.0, velocity=(speed, 0.0, 0.0))
    height = rng.uniform(0.1, 0.4)
    box = mbd.RigidBody("box", rng.uniform(0.5, 5.0), (0.1, 0.1, 0.1) if spatial else 0.1)
    kind = mbd.Free if spatial else mbd.Planar
    model.connect(kind("place", model.ground.origin, box.origin))
    corners = [(0.3, 0.2), (0.3, -0.2), (-0.3, 0.1)] if spatial else [(0.3, 0.0), (-0.2, 0.0)]
    for k, (x, z) in enumerate(corners):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(box.point(x, -height, z), floor), friction=mu))
    return model, {"place.y": height}, {"place.x": speed}


def gliding(rng, cut):
    """Bodies on which nothing acts: one that spins about an axis of inertia, with a slide along it."""
    model = mbd.Model("gliding", gravity=(0.0, 0.0, 0.0), cut=cut)
    hull, slide = mbd.RigidBody("hull", 2.0, (0.3, 0.2, 0.4)), mbd.PointMass("slide", rng.uniform(0.1, 1.0))
    model.connect(
        mbd.Free("flight", model.ground.origin, hull.origin),
        mbd.Prismatic("rail", hull.origin, slide.origin, axis=(0.0, 0.0, 1.0)),
    )
    axis, spin = (0.0, 0.0, rng.choice([0.0, 3.0])), rng.uniform(-1.0, 1.0)
    velocity = {"flight.x": spin, "flight.y": 1.0, "flight.z": 0.0, "rail": rng.choice([0.0, 0.5])}
    velocity["flight.angular_velocity"] = axis
    return model, {}, {name if name != "rail" else "rail.displacement": value for name, value in velocity.items()}


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("made", [hung, standing, gliding])
def test_nothing_changes_its_speed(made, scheme):
    for seed in range(3):
        rng = random.Random(f"{made.__name__} {seed}")
        model, position, velocity = made(rng, ("auto", "all")[seed % 2])
        start = mbd.assemble(model, position, velocity)
        for step in steps(scheme):
            run = mbd.simulate(model, start, scheme, until=0.7, **step)
            case = (model, seed, step)
            drift = np.max(np.abs(run.record.v - run.record.v[0]), initial=0.0)
            assert drift <= 1e-10, case
            assert np.ptp(run.energy.kinetic) <= 1e-10 * (1.0 + run.energy.kinetic[0]), case
            assert not any(word in note for note in run.stats["notes"] for word in DOUBTS), (case, run.stats["notes"])
            assert not [event for event in run.events if event.time > 0.0], case
            if made is standing:
                feet = [name for name in run.names if name.endswith(".force")]
                weight = sum(run[name] for name in feet)
                blur = 1e-7 if "index3" in repr(scheme) else 1e-9  # round-off of positions over dt²
                np.testing.assert_allclose(weight, 9.81 * model.bodies["box"].mass, rtol=blur)
