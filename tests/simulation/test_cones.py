"""Friction of contacts in space: opposite to the velocity in the plane, within the exact cone, and its changes."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd

G = 9.81
STOP, PLACE = 1.857666936441707, (1.359920604114329, 1.007360888766033)
"""Of the block of `on_incline` that starts with (1, 2) m/s: the integral in logarithmic time, dt = ‖γ‖ ds (DOP853)."""


@lru_cache(maxsize=16)
def on_incline(friction=0.3, slope=0.2, turn=0.0):
    """A mass on an incline that falls along (cos turn, sin turn) of x and z."""
    along, down = G * np.sin(slope), -G * np.cos(slope)
    model = mbd.Model("block", gravity=(along * np.cos(turn), down, along * np.sin(turn)))
    mass = mbd.PointMass("block", mass=2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, mass.origin, axes="xyz"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(mass.origin), friction=friction))
    return model


def slid(model, speed, scheme=None, turn=0.0, **how):
    x, z = speed
    velocity = {"slide.x": x * np.cos(turn) - z * np.sin(turn), "slide.z": x * np.sin(turn) + z * np.cos(turn)}
    start = mbd.assemble(model, velocity=velocity, closed="foot")
    return mbd.simulate(model, start, scheme or mbd.HHT(0.05), **{"dt": 1e-2, "until": 2.5} | how)


def place(run, row=-1):
    return np.array([run["slide.x"][row], run["slide.z"][row]])


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.HHT(0.05, formulation="ggl")])
def test_a_block_slides_along_a_curve_and_stops_with_order_two(scheme):
    errors = []
    for dt in (2e-2, 1e-2):
        run = slid(on_incline(), (1.0, 2.0), scheme, dt=dt)
        assert [event.kind for event in run.events] == ["stuck"]
        assert np.hypot(run["slide.x.rate"][-1], run["slide.z.rate"][-1]) < 1e-15
        errors.append([abs(run.events[0].time - STOP), *np.abs(place(run) - PLACE)])
    assert np.log2(np.divide(*errors)) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize(
    ("scheme", "how", "bound"),
    [(mbd.RadauIIA(), {"dt": 5e-3}, 1e-10), (mbd.RungeKutta853(), {"dt": 2.5e-3}, 1e-10),
     (mbd.RadauIIA(), {"tol": 1e-9}, 3e-9), (mbd.RungeKutta853(), {"tol": 1e-9}, 3e-9)],
)  # fmt: skip
def test_schemes_of_higher_order_find_the_stop(scheme, how, bound):
    run = slid(on_incline(), (1.0, 2.0), scheme, **{"dt": None} | how)
    assert abs(run.events[0].time - STOP) < bound
    assert np.max(np.abs(place(run) - PLACE)) < bound


@pytest.mark.parametrize("dt", [0.1, 0.02, 0.01])
def test_explicit_steps_that_are_looked_at_in_parts_let_friction_follow_the_velocity(dt):
    """Parts that end before the rest: they kept the direction that leads there, 1e-2 of the friction beside γ."""
    run = slid(on_incline(), (1.0, 2.0), mbd.RungeKutta853(), dt=dt)
    speed = np.array([run["slide.x.rate"], run["slide.z.rate"]])
    push = np.array([run["foot.friction.forward"], run["foot.friction.sideways"]])
    slides = np.hypot(*speed) > 1e-9
    across = (speed[0] * push[1] - speed[1] * push[0]) / (np.hypot(*speed) * np.hypot(*push) + 1e-300)
    assert np.max(np.abs(across[slides])) < 1e-14
    assert abs(run.events[0].time - STOP) < 1e-11
    assert np.max(np.abs(place(run) - PLACE)) < 1e-9


def test_directions_of_the_plane_do_not_matter():
    straight, turned = slid(on_incline(), (1.0, 2.0)), slid(on_incline(turn=0.7), (1.0, 2.0), turn=0.7)
    x, z = place(turned)
    back = np.cos(0.7) * x + np.sin(0.7) * z, np.cos(0.7) * z - np.sin(0.7) * x
    assert np.max(np.abs(back - place(straight))) < 1e-12
    assert abs(turned.events[0].time - straight.events[0].time) < 1e-12


def test_in_a_plane_it_is_the_friction_of_a_planar_model():
    slope, friction = 0.2, 0.3
    flat = mbd.Model("block", gravity=(G * np.sin(slope), -G * np.cos(slope)))
    mass = mbd.PointMass("block", mass=2.0)
    flat.connect(mbd.Translation("slide", flat.ground.origin, mass.origin))
    flat.constrain(mbd.Unilateral("foot", mbd.touchdown(mass.origin), friction=friction))
    for speed in (1.5, -1.5):
        start = mbd.assemble(flat, velocity={"slide.x": speed}, closed="foot")
        planar = mbd.simulate(flat, start, mbd.HHT(0.05), dt=1e-2, until=2.5)
        space = slid(on_incline(friction, slope), (speed, 0.0))
        assert [(e.kind, e.time) for e in space.events] == [
            (e.kind, pytest.approx(e.time, abs=1e-12)) for e in planar.events
        ]
        assert np.max(np.abs(space["slide.x"] - planar["slide.x"])) < 1e-13
        assert np.max(np.abs(space["slide.z"])) < 1e-15


NORMAL = np.array([0.2, 1.0, -0.3]) / np.linalg.norm([0.2, 1.0, -0.3])


@lru_cache(maxsize=16)
def thrown(friction, restitution):
    model = mbd.Model("ball", gravity=(0.0, 0.0, 0.0))
    ball = mbd.PointMass("ball", mass=2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, ball.origin, axes="xyz"))
    floor = mbd.touchdown(ball.origin, mbd.Plane(normal=tuple(NORMAL)))
    model.constrain(mbd.Unilateral("foot", floor, friction=friction, restitution=restitution))
    return model


@settings(max_examples=12)
@given(
    law=st.sampled_from(["newton", "poisson", "sequential"]), friction=st.sampled_from([0.1, 0.7]),
    restitution=st.sampled_from([0.0, 0.6]), along=st.floats(-1.5, 1.5), across=st.floats(-1.5, 1.5),
)  # fmt: skip
@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
def test_impacts_obey_the_cone(contact, law, friction, restitution, along, across):
    model, before = thrown(friction, restitution), np.array([along, -1.0, across])
    fall = before @ NORMAL
    start = mbd.assemble(
        model, position={"slide.y": 0.01}, velocity=dict(zip(("slide.x", "slide.y", "slide.z"), before, strict=True))
    )
    run = mbd.simulate(model, start, dt=5e-3, until=0.1, impact=law, contact=contact)
    slip, push = before - fall * NORMAL, -(1.0 + restitution) * fall
    size = np.linalg.norm(slip)
    left = slip * max(1.0 - friction * push / size, 0.0) if size > 0.0 else slip
    after = [run[f"slide.{axis}.rate"][-1] for axis in "xyz"]
    assert np.allclose(after, left - restitution * fall * NORMAL, atol=1e-12)


def test_on_a_belt_it_sticks_until_springs_pull_it_off_and_slides_opposite_to_its_slip():
    model = mbd.Model("belt", gravity=(0.0, -G, 0.0))
    block = mbd.PointMass("block", mass=2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, block.origin, axes="xyz"))
    belt = mbd.Plane(velocity=(0.5, 0.0, 0.2))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin, belt), friction=0.4))
    model.apply(mbd.Potential("springs", lambda x, z: 30.0 * x * x + 12.5 * z * z, ("slide.x", "slide.z")))
    start = mbd.assemble(model, velocity={"slide.x": 0.5, "slide.z": 0.2}, closed="foot")
    for scheme, bound in ((mbd.HHT(0.05), 2e-5), (mbd.RadauIIA(), 1e-9)):
        run = mbd.simulate(model, start, scheme, dt=4e-3, until=3.0)
        pull = 0.4 * 2.0 * G / np.hypot(60.0 * 0.5, 25.0 * 0.2)
        assert [event.kind for event in run.events] == ["slipped"]
        assert run.events[0].time == pytest.approx(pull, abs=1e-9)
        force = np.array([run["foot.friction.forward"], run["foot.friction.sideways"]])
        slip = np.array([run["slide.x.rate"] - 0.5, run["slide.z.rate"] - 0.2])
        limit = 0.4 * run["foot.force"]
        assert np.all(np.linalg.norm(force, axis=0) <= limit * (1.0 + 1e-9))
        later = run.time > pull + 0.02
        assert np.allclose(
            force[:, later], -limit[later] * slip[:, later] / np.linalg.norm(slip[:, later], axis=0), atol=1e-7 + bound
        )


@lru_cache(maxsize=1)
def three_feet():
    """A block on three feet (see tests/cases): mass 2 kg, J_z = 0.01 kg m², 0.05 m high."""
    model = mbd.Model("block", gravity=(0.0, 0.0, -G))
    block = mbd.RigidBody("block", 2.0, (0.02, 0.02, 0.01))
    model.connect(mbd.Free("float", model.ground.origin, block.origin))
    for k, (x, y) in enumerate(((0.15, 0.0), (-0.1, 0.12), (-0.1, -0.12))):
        floor = mbd.touchdown(block.point(x, y, -0.05), mbd.Plane(normal=(0.0, 0.0, 1.0)))
        model.constrain(mbd.Unilateral(f"foot {k}", floor, friction=0.3))
    return model


@pytest.mark.parametrize(
    ("scheme", "how", "bound"),
    [(mbd.HHT(0.05), {"dt": 1e-3}, 5e-6), (mbd.GeneralizedAlpha(0.8), {"dt": 1e-3}, 5e-6),
     (mbd.RadauIIA(), {"dt": 2e-3}, 1e-11), (mbd.RungeKutta853(), {"tol": 1e-8}, 2e-9)],
)  # fmt: skip
def test_a_block_on_three_feet_stops_sliding_and_turning_at_once(scheme, how, bound):
    model = three_feet()
    feet = ["foot 0", "foot 1", "foot 2"]
    speed = {"float.x.rate": 1.2, "float.y.rate": 0.3, "float.angular_velocity.z": 8.0}
    start = mbd.assemble(model, position={"float.z": 0.05}, velocity=speed, closed=feet)
    run = mbd.simulate(model, start, scheme, until=0.5, **how)
    assert [run[f"{foot}.force"][0] for foot in feet] == pytest.approx(
        [8.63425046622514, 5.525947436585309, 5.459802097189552], abs=1e-10
    )
    assert [event.kind for event in run.events] == ["stuck"] * 3
    assert all(event.time == pytest.approx(0.4462068377620775, abs=bound) for event in run.events)
    yaw = 2.0 * np.arctan2(run["float.orientation.z"][-1], run["float.orientation.w"][-1])
    assert [run["float.x"][-1], run["float.y"][-1], yaw] == pytest.approx(
        [0.2796055695309647, 0.06853206174213983, 0.8296938955141766], abs=bound
    )
    total = run.energy["total"]
    assert total[-1] - total[0] == pytest.approx(-1.85, abs=1e-9)
    if scheme == mbd.HHT(0.05):
        assert np.max(np.diff(total)) < 1e-6


@pytest.mark.parametrize("speed", [(1.0, 2.0), (3.0, -1.0), (1.0, 1.0)])
@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.Newmark(), mbd.RadauIIA(), mbd.RungeKutta4()], ids=str)
def test_a_block_may_stop_at_the_end_of_a_step(scheme, speed):
    """‖γ‖ = 3 m/s falls by 3 m/s² to round-off of either sign at 1 s, where a step of 0.01 s ends."""
    model = mbd.Model("block", gravity=(0.0, -10.0, 0.0))
    mass = mbd.PointMass("block", mass=1.0)
    model.connect(mbd.Translation("slide", model.ground.origin, mass.origin, axes="xyz"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(mass.origin), friction=0.3))
    run = slid(model, 3.0 * np.array(speed) / np.hypot(*speed), scheme, until=1.5)
    assert [event.kind for event in run.events] == ["stuck"] and run.events[0].time == pytest.approx(1.0, abs=1e-9)
    assert np.hypot(*place(run)) == pytest.approx(1.5, abs=1e-9) and not run.stats["notes"]
