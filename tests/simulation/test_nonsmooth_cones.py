"""Non-smooth steps with friction in space: first order to located instants, exact cones, redundant feet, impacts."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from tests.simulation import test_cones as cones, test_spheres as spheres

G = 9.81
UP = mbd.Plane(normal=(0.0, 0.0, 1.0))
STEPS = {"contact": "nonsmooth"}


@lru_cache(maxsize=4)
def on_feet(feet, mass=2.0, inertia=(0.02, 0.03, 0.04), center=0.05, friction=0.4, restitution=0.0):
    """A body on point feet, `center` [m] above them, with a push at a place of its own."""
    model = mbd.Model("on feet", gravity=(0.0, 0.0, -G))
    body = mbd.RigidBody("body", mass, inertia)
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    for k, (x, y) in enumerate(feet):
        foot = mbd.touchdown(body.point(x, y, -center), UP)
        model.constrain(mbd.Unilateral(f"foot {k}", foot, friction=friction, restitution=restitution))
    model.apply(mbd.Applied("push", body.point(-0.1, 0.25, 0.3 - center), (0.0, 0.0, 0.0)))
    return model


FOUR = ((0.15, 0.1), (-0.15, 0.1), (-0.15, -0.1), (0.15, -0.1))


def loads(run, count):
    """Forces p and sizes of friction of so many feet, (feet, rows)."""
    feet = [f"foot {k}" for k in range(count)]
    push = np.array([run[f"{foot}.force"] for foot in feet])
    return push, np.array(
        [np.hypot(run[f"{foot}.friction.forward"], run[f"{foot}.friction.sideways"]) for foot in feet]
    )


def test_a_block_slides_along_a_curve_and_stops_within_a_step_of_the_located_stop():
    for scheme in (mbd.HHT(0.05), mbd.HHT(0.05, formulation="ggl"), mbd.RadauIIA(), mbd.RungeKutta853()):
        for dt in (2e-2, 1e-2):
            run = cones.slid(cones.on_incline(), (1.0, 2.0), scheme, dt=dt, **STEPS)
            assert [event.kind for event in run.events] == ["stuck"]
            assert abs(run.events[0].time - cones.STOP) <= dt
            assert np.max(np.abs(cones.place(run) - cones.PLACE)) < 0.01 * dt
            assert np.hypot(run["slide.x.rate"][-1], run["slide.z.rate"][-1]) < 1e-15
            assert len(run.time) < 2.5 / dt + 4  # fixed steps, whatever the direction does


def test_a_ball_slides_on_a_parabola_until_it_rolls():
    model, place = spheres.ball(0.17, 0.028575, 0.2), (0.9454457236161168, -0.13444809373354089)
    errors = []
    for dt in (4e-3, 2e-3):
        start = (0.0, 0.0, 0.028575), (1.5, 0.0), (20.0, -30.0, 45.0)
        run = spheres.rolled(model, *start, mbd.HHT(0.05), dt=dt, until=1.0, **STEPS)
        assert [event.kind for event in run.events] == ["stuck"]
        assert abs(run.events[0].time - 0.35321669967666464) <= dt
        errors.append(np.max(np.abs(spheres.end(run) - place)))
    assert errors[1] < 0.6 * errors[0] < 2e-3


@pytest.mark.parametrize(("friction", "rolls"), [(0.11, True), (0.08, False)])
def test_a_ball_rolls_down_a_slope_or_slips(friction, rolls):
    model, speed = spheres.ball(0.5, 0.05, friction, 0.35), -0.8 if rolls else 0.0
    spin = (-12.0, 20.0 * speed, 25.0)
    run = spheres.rolled(model, (0.0, 0.0, 0.05), (speed, 0.6), spin, mbd.RadauIIA(), dt=4e-3, until=1.0, **STEPS)
    fall = 5.0 / 7.0 * G * np.sin(0.35) if rolls else G * (np.sin(0.35) - friction * np.cos(0.35))
    assert spheres.end(run) == pytest.approx([speed + 0.5 * fall, 0.6], abs=1e-7)
    assert run.stats["cone_residual"] <= 1e-10


@settings(max_examples=4)
@given(
    friction=st.sampled_from([0.1, 0.8]), restitution=st.sampled_from([0.0, 0.5]), seed=st.integers(0, 10**6),
)  # fmt: skip
def test_a_box_thrown_on_its_feet_obeys_all_laws(friction, restitution, seed):
    rng = np.random.default_rng(seed)
    run = thrown(rng.normal(size=3) * (1.0, 1.0, 0.5), 4.0 * rng.normal(size=3), friction, restitution)
    push, pull = loads(run, 4)
    assert np.all(push >= 0.0)
    assert np.all(pull <= friction * push + 1e-9)
    gaps = np.array([run[f"foot {k}.gap"] for k in range(4)])
    assert gaps.min() > -1e-9  # at the ends of steps
    assert np.all(push * np.maximum(gaps, 0.0) < 1e-8)
    total = run.energy["total"]
    impacts = np.diff(run.time) == 0.0
    assert np.all(np.diff(total)[impacts] <= 1e-12 * total[0])
    assert np.all(np.diff(total)[~impacts] < 2.0 * G * 0.1)  # what lifts it out of the floor
    assert run.stats["cone_residual"] <= 1e-10


def thrown(velocity, spin, friction, restitution, turn=0.0, feet=FOUR, until=0.3):
    """The motion of a box thrown on its feet, its start turned about the vertical."""
    c, s = np.cos(turn), np.sin(turn)
    x, y, z = velocity
    start = mbd.assemble(
        on_feet(feet, friction=friction, restitution=restitution),
        position={"float.orientation": ((0.0, 0.0, 1.0), turn), "float.z": 0.1},
        velocity={"float.x.rate": c * x - s * y, "float.y.rate": s * x + c * y, "float.z.rate": z,
                  "float.angular_velocity": tuple(0.3 * np.asarray(spin))},
    )  # fmt: skip
    model = on_feet(feet, friction=friction, restitution=restitution)
    return mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=until, **STEPS)


def test_neither_the_order_of_feet_nor_a_turn_about_the_vertical_matters():
    motion = (0.8, -0.4, -0.5), (2.0, 1.0, -3.0), 0.4, 0.0
    whole = thrown(*motion)
    assert len(whole.events) > 4
    turned, ordered = thrown(*motion, turn=0.7), thrown(*motion, feet=FOUR[::-1])
    x, y = turned["float.x"], turned["float.y"]
    back = np.array([np.cos(0.7) * x + np.sin(0.7) * y, np.cos(0.7) * y - np.sin(0.7) * x, turned["float.z"]])
    there = np.array([whole[f"float.{axis}"] for axis in "xyz"])
    assert np.allclose(back[:, -1], there[:, -1], atol=1e-8)
    assert np.allclose([ordered[f"float.{axis}"][-1] for axis in "xyz"], there[:, -1], atol=1e-8)


@pytest.mark.parametrize("part", [0.99, 1.01])
def test_a_pile_stands_while_friction_holds_its_lowest(part):
    """Three masses on a floor carry a fourth without friction: each is pushed out by W tan θ/3 and carries 4 W/3."""
    model, a, h = pile()
    limit = a / h / 4.0
    values = {f"floor {k}.mu": part * limit for k in range(3)}
    places = {"top.z": h}
    for k in range(3):
        places |= {
            f"{k}.x": a * np.cos(2.0 * np.pi * k / 3.0),
            f"{k}.y": a * np.sin(2.0 * np.pi * k / 3.0),
            f"{k}.z": 0.0,
        }
    closed = [f"{kind} {k}" for k in range(3) for kind in ("floor", "lean")]
    start = mbd.assemble(model, position=places, closed=closed, parameters=values)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.2, parameters=values, **STEPS)
    fall = run["top.z"][0] - run["top.z"][-1]
    assert abs(fall) < 1e-15 if part > 1.0 else fall > 1e-4
    assert len(run.events) == 0


@lru_cache(maxsize=1)
def pile(radius=0.1):
    """Balls that do not turn, of 1 kg: three at a distance a of the middle on the floor, one on top at the height h."""
    model = mbd.Model("pile", gravity=(0.0, 0.0, -G))
    masses = {name: mbd.PointMass(f"ball {name}", 1.0) for name in ("0", "1", "2", "top")}
    for name, mass in masses.items():
        model.connect(mbd.Translation(name, model.ground.origin, mass.origin, axes="xyz"))
    for name in ("0", "1", "2"):
        floor = mbd.touchdown(masses[name].origin, UP)
        model.constrain(mbd.Unilateral(f"floor {name}", floor, friction=0.2))
        ends = [f"{who}.{axis}" for who in (name, "top") for axis in "xyz"]
        apart = mbd.measure(
            lambda x, y, z, u, v, w: mbd.sqrt((x - u) ** 2 + (y - v) ** 2 + (z - w) ** 2) - 2.0 * radius, *ends
        )
        model.constrain(mbd.Unilateral(f"lean {name}", apart))
    a = 1.2 * radius
    return model, a, np.sqrt(4.0 * radius**2 - a * a)


@lru_cache(maxsize=1)
def mixed():
    """A sledge on a rail with dry friction carries a plate on feet that rub, slide freely and hold, and a hinge."""
    model = mbd.Model("mixed", gravity=(0.0, 0.0, -G))
    sledge, plate = mbd.RigidBody("sledge", 3.0, (0.1, 0.1, 0.1)), mbd.RigidBody("plate", 2.0, (0.02, 0.03, 0.04))
    model.connect(
        mbd.Prismatic("rail", model.ground.origin, sledge.origin, axis=(1.0, 0.0, 0.0), loss=mbd.Coulomb(4.0)),
        mbd.Free("float", model.ground.origin, plate.origin),
    )
    deck = mbd.Plane(normal=(0.0, 0.0, 1.0), frame=sledge.origin)
    for k, ((x, y), friction) in enumerate(zip(FOUR, (0.4, 0.4, 0.0, 0.2), strict=True)):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(plate.point(x, y, -0.05), deck), friction=friction))
    return model


def test_feet_of_all_kinds_and_dry_joints_are_solved_together():
    """Momentum of plate and sledge changes by the friction of the rail alone; at last both stand."""
    model, feet = mixed(), [f"foot {k}" for k in range(4)]
    start = mbd.assemble(
        model, position={"float.z": 0.05}, closed=feet,
        velocity={"float.x.rate": 1.5, "float.y.rate": 0.3, "float.angular_velocity.z": 2.0},
    )  # fmt: skip
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=2.0, **STEPS)
    assert np.max(np.abs(np.diff(run.energy["total"]).clip(0.0))) < 1e-6
    speed = 3.0 * run["rail.rate"] + 2.0 * run["float.x.rate"]
    early = (run.time > 0.01) & (run.time < 0.1)
    assert np.diff(speed[early]) == pytest.approx(-4.0 * np.diff(run.time[early]), abs=1e-9)
    assert abs(run["rail.rate"][-1]) < 1e-12 and np.hypot(run["float.x.rate"][-1], run["float.y.rate"][-1]) < 1e-12
