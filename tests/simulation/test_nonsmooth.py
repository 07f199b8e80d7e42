"""Non-smooth steps: laws that hold at the end of every step, whatever the contacts do."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanisms import mechanism_of
from tests.equations.mechanisms import four_bar
from tests.simulation.judging import complaints
from tests.simulation.mechanisms import G, ball, box, falling, point, run
from tests.simulation.test_impact import impacts
from tests.simulation.wild import wild_scene

same_box = cache(box)


def nonsmooth(model, position=None, velocity=None, **more):
    return run(model, position, velocity, contact="nonsmooth", **more)


def deepest(trajectory, names):
    return max(-float(trajectory[f"{name}.gap"].min()) for name in names)


def check_impact(model, trajectory, row, friction):
    """Row `row` against the one before it: momentum, laws of contact, and energy."""
    mechanism, record = mechanism_of(model), trajectory.record
    assert record.time[row] == record.time[row - 1]
    np.testing.assert_array_equal(record.q[row], record.q[row - 1])
    anchors, parameters = trajectory.columns.anchors[row], mechanism.parameters()
    start, left, right = (
        mechanism.acceleration_terms(record.time[k], record.q[k], record.v[k], parameters, anchors)
        for k in (row - 2, row - 1, row)
    )
    closed = {event.name: event for event in trajectory.events if event.row == row and event.kind == "closed"}
    contacts = mechanism.equations.contacts
    part = [c for k, c in enumerate(contacts) if record.closed[row - 1, k] or record.closed[row, k] or c.name in closed]
    rows = [k for k, each in enumerate(mechanism.equations.rows) if each.contact < 0]
    rows += [k for contact in part for k in contact.rows]
    change = record.v[row] - record.v[row - 1]
    B, momentum = left.B[rows], left.M @ change
    impulse, *_ = np.linalg.lstsq(B.T, momentum, rcond=None)
    size = max(1.0, np.abs(momentum).max())
    np.testing.assert_allclose(B.T @ impulse, momentum, rtol=0, atol=1e-11 * size, err_msg="momentum")
    speed = max(1.0, np.abs(record.v[row - 1]).max())
    for contact in part:
        normal = contact.rows[0]
        assert right.rate[normal] > -1e-11 * speed, "no approach is left"
        if contact.name in closed and not friction:
            push = closed[contact.name].impulse[0]
            before = max(start.rate[normal], min(left.rate[normal], 0.0))
            rebound = right.rate[normal] + contact.restitution * before
            assert push > -1e-11 * size
            assert push * min(abs(rebound), abs(right.rate[normal])) < 1e-11 * size * speed, "it rests or rebounds by e"
    kinetic = trajectory.energy.kinetic
    assert kinetic[row] < kinetic[row - 1] + 1e-11 * max(1.0, kinetic[row - 1])


motions = {
    "angle": st.floats(-1.2, 1.2), "spin": st.floats(-3.0, 3.0), "forward": st.floats(-3.0, 3.0),
    "dt": st.sampled_from([1e-3, 5e-3, 2e-2, 0.1]),
}  # fmt: skip


@settings(max_examples=40)
@given(restitution=st.sampled_from([0.0, 0.3, 1.0]), friction=st.sampled_from([0.0, 0.4]), **motions)
def test_a_box_never_ends_a_step_inside_the_ground_nor_gains_energy_in_a_blow(
    angle, spin, forward, dt, restitution, friction
):
    model = same_box(friction, restitution)
    position = {"place.y": 0.6, "place.angle": angle}
    velocity = {"place.x": forward, "place.y": -1.0, "place.angle": spin}
    trajectory = nonsmooth(model, position, velocity, until=0.6, dt=dt)
    pairs = impacts(trajectory)
    assert pairs
    assert deepest(trajectory, ["left", "right"]) < 1e-10 + 1e-8 * dt**2
    for _, row in pairs:
        check_impact(model, trajectory, row, friction > 0.0)


@settings(max_examples=15)
@given(**motions)
def test_a_box_whose_corners_stick_never_ends_a_step_inside_the_ground(angle, spin, forward, dt):
    model = same_box(None, 0.0)
    position = {"place.y": 0.6, "place.angle": angle}
    velocity = {"place.x": forward, "place.y": -1.0, "place.angle": spin}
    trajectory = nonsmooth(model, position, velocity, until=0.6, dt=dt, on_failure="return")
    assert impacts(trajectory) or not trajectory.success
    assert deepest(trajectory, ["left", "right"]) < 1e-10 + 1e-8 * dt**2
    if not trajectory.success:  # a corner that sticks whatever its force may have none, and no smaller step either
        assert "whatever its" in trajectory.message


@cache
def stopped_four_bar():
    """A four-bar whose rocker strikes a stop."""
    model = four_bar()
    model.constrain(mbd.Unilateral("stop", mbd.measure(lambda angle: angle - 0.3, "D.angle"), restitution=0.4))
    return model


LOOPS = [
    mbd.HHT(0.05, tolerance=1e-13), mbd.HHT(0.05, formulation="index3", tolerance=1e-13),
    mbd.GeneralizedAlpha(0.8, tolerance=1e-13), mbd.Newmark(),
]  # fmt: skip


@pytest.mark.parametrize("scheme", LOOPS, ids=repr)
def test_loops_stay_closed_to_round_off_when_a_stop_is_struck(scheme):
    model = stopped_four_bar()
    start = mbd.assemble(model, position={"A.angle": 1.4}, velocity={"A.angle": 0.0})
    trajectory = mbd.simulate(model, start, scheme, dt=4e-3, until=2.0, contact="nonsmooth")
    assert len(impacts(trajectory)) > 1
    assert trajectory.violation.length < 1e-12 and deepest(trajectory, ["stop"]) < 1e-12
    for _, row in impacts(trajectory):
        check_impact(model, trajectory, row, False)


# contact that persists ----------------------------------------------------------------------------------------------
def bead():
    """A bead in a bowl y = x²/2, which it never leaves."""
    model, _body = point()
    bowl = mbd.measure(lambda x, y: y - 0.5 * x * x, "place.x", "place.y")
    model.constrain(mbd.Unilateral("bowl", bowl))
    return model, {"place.x": 0.5, "place.y": 0.125}, "bowl", "place.x"


def swept():
    """The tip of a double pendulum that slides on the ground while a load varies."""
    model = mbd.Model("arm")
    upper, lower = (mbd.Link(name, length=1.0, **mbd.rod(mass=1.0, length=1.0).link) for name in ("upper", "lower"))
    shoulder = mbd.Revolute("shoulder", model.ground.point(0.0, 1.0), upper.start)
    model.connect(shoulder, mbd.Revolute("elbow", upper.end, lower.start))
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(lower.end), friction=0))
    model.apply(mbd.Applied("load", lower.end, force=(0.0, lambda t: -5.0 + 4.0 * mbd.sin(7.0 * t), 0.0)))
    return model, {"shoulder.angle": 0.5}, "tip", "shoulder.angle"


@pytest.mark.parametrize("scene", [bead, swept])
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.Newmark()], ids=repr)
def test_motion_and_force_of_a_persistent_contact_are_of_second_order(scheme, scene):
    model, place, contact, coordinate = scene()
    common = {"closed": [contact], "integrator": scheme, "until": 0.3}
    exact = run(model, place, dt=0.3 / 4800, contact="events", **common)
    errors, names = [], (coordinate, f"{contact}.force")
    for steps in 75, 150, 300:
        trajectory = nonsmooth(model, place, dt=0.3 / steps, **common)
        assert not trajectory.events
        late = slice(2 * steps // 3, None)
        errors.append([np.abs(trajectory[n] - exact[n][:: 4800 // steps])[late].max() for n in names])
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(np.abs(orders - 2.0) < 0.15), orders


# impacts ------------------------------------------------------------------------------------------------------------
def test_the_first_impact_is_found_within_a_step_and_the_motion_after_it_has_first_order():
    model, until = ball(restitution=0.5), 0.8
    first = np.sqrt(2 / G)
    since = until - first
    place, speed = since * (0.5 * G * first - 0.5 * G * since), 0.5 * G * first - G * since
    for dt in 0.02, 0.01, 1e-3, 1e-4:
        trajectory = nonsmooth(model, {"fall.displacement": 1.0}, until=until, dt=dt)
        assert len(trajectory.events) == 1
        assert 0.0 <= trajectory.events[0].time - first <= dt
        assert trajectory["fall.displacement"][-1] == pytest.approx(place, abs=10.0 * dt)
        assert trajectory["fall.rate"][-1] == pytest.approx(speed, abs=3.0 * G * dt)


@pytest.mark.parametrize("dt", [1e-4, 1e-3, 0.05, 1.0])
@pytest.mark.parametrize("impact", ["newton", "poisson", "sequential"])
def test_a_ball_passes_its_zeno_point_and_rests_with_its_weight(dt, impact):
    trajectory = nonsmooth(ball(restitution=0.5), {"fall.displacement": 1.0}, until=3.0, dt=dt, impact=impact)
    assert trajectory["floor.force"][-1] == pytest.approx(2.0 * G, rel=1e-10)
    assert abs(trajectory["fall.displacement"][-1]) < 1e-12 and abs(trajectory["fall.rate"][-1]) < 1e-12
    assert len(trajectory.events) < 20 and trajectory.stats["steps"] < 3.0 / dt + 20


@pytest.mark.parametrize("dt", [1e-2, 1e-3])
def test_a_ball_that_slows_on_its_way_to_a_ceiling_gains_nothing(dt):
    """The gap rate before the step is larger than that at its end; with e = 1 it would create energy."""
    model, _ = falling()
    ceiling = mbd.measure(lambda y: 1.0 - y, "fall.displacement")
    model.constrain(mbd.Unilateral("ceiling", ceiling, restitution=1.0))
    trajectory = nonsmooth(model, {"fall.displacement": 0.5}, {"fall.displacement": 5.0}, until=0.5, dt=dt)
    (event,) = trajectory.events
    kinetic = trajectory.energy.kinetic
    assert kinetic[event.row] <= kinetic[event.row - 1] * (1.0 + 1e-12)
    assert trajectory.stats["energetic_impacts"] == 0


def test_a_contact_that_pulls_over_a_step_has_let_go_before_it():
    model, body = point()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    model.apply(mbd.Applied("lift", body.origin, force=(0.0, lambda t: 20.0 * t, 0.0)))
    for dt in 0.02, 0.01, 0.003:
        trajectory = nonsmooth(model, closed=["floor"], dt=dt)
        assert trajectory.events[0].kind == trajectory.events[-1].kind == "opened"
        assert all(abs(event.time - G / 20.0) <= dt for event in trajectory.events)
        assert trajectory["floor.force"].min() >= 0.0 and trajectory["floor.gap"].min() > -1e-12


@pytest.mark.parametrize(("loss", "speed", "turn"), [(0.1, 2.0, 0.0), (1.5, 0.0, 3.0)], ids=["rest", "release"])
@pytest.mark.parametrize("seed", range(4))
def test_a_dry_joint_rests_and_is_released_within_a_step_as_where_events_are_located(seed, loss, speed, turn):
    """Turned around with the friction of before, a light link is driven by it for the rest of the step.

    Released at the start of the step, before the load reaches the limit, it goes the way that the friction pulls.
    """
    rng = np.random.default_rng(seed)
    model, end = mbd.Model("dry chain"), None
    for k in range(3):
        link = mbd.Link(f"link {k}", *rng.uniform((0.01, 0.3, 0.1, 1e-4), (1.0, 0.5, 0.2, 1e-2)))
        law = mbd.Coulomb(rng.uniform(0.1 * loss, loss))
        model.connect(mbd.Revolute(f"hinge {k}", end or model.ground.origin, link.start, loss=law))
        end = link.end
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(end, mbd.Plane(offset=-10.0))))
    velocity = {f"hinge {k}.angle": rng.uniform(-speed, speed) for k in range(3)}
    start = mbd.assemble(model, {f"hinge {k}.angle": rng.uniform(-turn, turn) for k in range(3)}, velocity)
    runs = [mbd.simulate(model, start, dt=2e-3, until=0.4, contact=contact) for contact in ("events", "nonsmooth")]
    np.testing.assert_allclose(runs[1].record.q[-1], runs[0].record.q[-1], rtol=0.0, atol=1e-9)
    for part in runs[1].energy.parts:
        assert part.kind != "friction" or np.max(np.diff(part.energy)) < 1e-9


@pytest.mark.parametrize("seed", [0, 116, 420, 672, 1201])
def test_a_dry_joint_of_a_wild_scene_gives_no_energy(seed):
    assert complaints(wild_scene(seed, interpreted=()).run()) == []


# order, schemes, forms ----------------------------------------------------------------------------------------------


SCHEMES = [
    mbd.HHT(0.3), mbd.HHT(0.05, formulation="index3"), mbd.GeneralizedAlpha(0.0), mbd.GeneralizedAlpha(1.0),
    mbd.GeneralizedAlpha(0.8, formulation="index3"), mbd.Newmark(), mbd.Newmark(0.3025, 0.6),
]  # fmt: skip


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_every_scheme_brings_a_box_to_rest_on_its_two_corners(scheme):
    position, velocity = {"place.y": 0.3, "place.angle": 0.1}, {"place.angle": 0.2, "place.x": 0.3}
    trajectory = nonsmooth(same_box(0.4, 0.4), position, velocity, until=2.0, dt=5e-3, integrator=scheme)
    assert deepest(trajectory, ["left", "right"]) < 1e-10
    assert trajectory["left.force"][-1] + trajectory["right.force"][-1] == pytest.approx(2.0 * G, rel=1e-9)
    assert np.abs(trajectory.record.v[-1]).max() < 1e-9


@pytest.mark.parametrize("dt", [1e-7, 1e-5, 0.1, 0.3, 1.0])
def test_steps_far_too_small_or_too_large_stay_above_the_ground(dt):
    until = max(1.5, 3.0 * dt) if dt > 1e-3 else 200.0 * dt
    height = 0.3 if dt > 1e-3 else 0.15 + until
    position, velocity = {"place.y": height, "place.angle": 0.0}, {"place.y": -2.0, "place.x": 0.3}
    for friction, restitution in (0.0, 0.6), (0.4, 0.3), (None, 0.0):
        trajectory = nonsmooth(same_box(friction, restitution), position, velocity, until=until, dt=dt)
        assert impacts(trajectory) and trajectory.stats["steps"] < until / dt + 20
        assert deepest(trajectory, ["left", "right"]) < 1e-10 + 1e-8 * dt**2
