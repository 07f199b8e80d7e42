"""When an open contact may close: arming, `only_while`, grazing, contacts that meet at one instant."""

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import G, ball, falling, point, run, two_balls


def closings(trajectory, name):
    return [event.time for event in trajectory.events if event.name == name and event.kind == "closed"]


# arming -------------------------------------------------------------------------------------------------------------
def released_ball(lift):
    """Ball b rests on its floor until ball a strikes; then it sinks, and `lift(t)` brings it up again."""
    model, a, b = two_balls()
    model.constrain(
        mbd.Unilateral("A", mbd.height(a.origin)), mbd.Unilateral("B", mbd.height(b.origin), release=mbd.When("A"))
    )
    model.apply(mbd.Applied("lift", b.origin, force=(0.0, lift, 0.0)))
    return run(model, {"a.displacement": 0.5}, closed=["B"], until=3.0)


def test_a_released_contact_is_ignored_until_it_has_risen_and_then_closes_again():
    strike = np.sqrt(2 * 0.5 / G)
    trajectory = released_ball(lambda t: mbd.where(t > 0.5, mbd.where(t < 1.0, 30.0, 0.0), 0.0))
    assert trajectory.events[0].time == pytest.approx(strike, abs=1e-9)
    height = trajectory["b.displacement"]
    assert height.min() < -0.2
    closed = closings(trajectory, "B")
    assert len(closed) == 1
    before = np.searchsorted(trajectory.time, closed[0])
    assert height[:before].max() > 0.1, "it rose above the ground before it came down on it"
    assert trajectory["B.force"][-1] == pytest.approx(G, rel=1e-9)
    ignored = (trajectory.time > strike) & (trajectory.time < closed[0])
    assert np.all(trajectory["B.force"][ignored] == 0.0)


def test_a_released_contact_that_never_rises_never_pushes():
    trajectory = released_ball(lambda t: 0.0)
    assert closings(trajectory, "B") == []
    fall = 3.0 - trajectory.events[0].time
    assert trajectory["b.displacement"][-1] == pytest.approx(-0.5 * G * fall**2, rel=1e-9)
    assert any("'B'" in note and "below" in note for note in trajectory.stats["notes"])


def test_a_contact_opened_by_pull_is_ready_to_close_at_once():
    model, body = falling()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    model.apply(mbd.Applied("push", body.origin, force=(0.0, lambda t: 40.0 * mbd.sin(8.0 * t), 0.0)))
    trajectory = run(model, closed=["floor"], until=1.2, dt=2e-3)
    kinds = [event.kind for event in trajectory.events]
    assert kinds[:2] == ["opened", "closed"]
    assert trajectory.events[0].time == pytest.approx(np.arcsin(2 * G / 40.0) / 8.0, abs=2e-6)
    assert trajectory["floor.gap"].min() > -1e-12
    assert trajectory["floor.force"].min() >= 0.0


def test_a_contact_named_open_below_its_surface_waits_until_it_has_risen():
    model = ball()
    trajectory = run(model, {"fall.displacement": -0.2}, {"fall.displacement": 4.0}, open=["floor"])
    (instant,) = closings(trajectory, "floor")
    assert instant == pytest.approx((4.0 + np.sqrt(16.0 - 2 * G * 0.2)) / G, abs=1e-9)


# only_while ---------------------------------------------------------------------------------------------------------
FALL = np.sqrt(2 * 0.05 / G)
"""When a ball dropped from 0.05 m reaches the ground [s]."""


def watched_by_measure(early, speed=1.0, until=0.4):
    """A point falls from 0.05 m; its contact is watched where x > 0, which it enters `early` before it lands."""
    model, body = point()
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), only_while=mbd.measure("place.x")))
    start = -speed * (FALL - early)
    return run(model, {"place.x": start, "place.y": 0.05}, {"place.x": speed, "place.y": 0.0}, until=until)


@pytest.mark.parametrize("away", [0.09, 0.003, 1e-5, 1e-9])
@pytest.mark.parametrize("speed", [1.0, -1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_contact_closes_as_it_lands_where_it_is_watched_then_and_else_falls_through(side, speed, away):
    """It enters the watched side, or leaves it, a little before it lands or a little later."""
    trajectory = watched_by_measure(side * away, speed)
    if side == speed:
        assert closings(trajectory, "foot") == [pytest.approx(FALL, abs=1e-9)]
        assert trajectory["place.y"].min() > -1e-12
    else:
        assert closings(trajectory, "foot") == [] and np.all(trajectory["foot.force"] == 0.0)
        assert trajectory["place.y"][-1] == pytest.approx(0.05 - 0.5 * G * 0.16, rel=1e-9)


def test_a_condition_that_starts_at_zero_and_rises_is_in_force_at_once():
    trajectory = watched_by_measure(FALL)
    assert trajectory["place.x"][0] == 0.0
    assert len(closings(trajectory, "foot")) == 1


def test_a_contact_below_ground_closes_after_it_has_risen_while_watched():
    model, body = point()
    model.constrain(mbd.Unilateral("foot", mbd.height(body.origin), only_while=mbd.measure("place.x")))
    trajectory = run(
        model, {"place.x": -0.05, "place.y": -0.1}, {"place.x": 1.0, "place.y": 3.0}, open=["foot"], until=0.8
    )
    assert closings(trajectory, "foot") == [pytest.approx((3.0 + np.sqrt(9.0 - 0.2 * G)) / G, abs=1e-9)]


def watched_by_name(early):
    """Ball b, which falls from 0.05 m, is watched while ball a stands on its floor; a lands `early` before b."""
    model, a, b = two_balls()
    model.constrain(
        mbd.Unilateral("A", mbd.height(a.origin)), mbd.Unilateral("B", mbd.height(b.origin), only_while="A")
    )
    return run(model, {"a.displacement": 0.5 * G * (FALL - early) ** 2, "b.displacement": 0.05}, until=0.3)


@pytest.mark.parametrize("early", [0.05, 0.003, 1e-6, 0.0, -1e-6, -0.003, -0.05])
def test_a_contact_watched_while_another_is_closed_closes_behind_it_or_with_it(early):
    trajectory = watched_by_name(early)
    assert closings(trajectory, "A") == [pytest.approx(FALL - early, abs=1e-9)]
    assert closings(trajectory, "B") == ([pytest.approx(FALL, abs=1e-9)] if early >= 0.0 else [])


# grazing ------------------------------------------------------------------------------------------------------------
def parabola(depth):
    """A point at 1 m/s whose gap is ½ (x − 0.505)² − depth: steps of 0.01 s see only its two sides."""
    model, body = point(gravity=(0.0, 0.0, 0.0))
    gap = mbd.measure(lambda p: 0.5 * (p[0] - 0.505) ** 2 - depth, body.origin)
    model.constrain(mbd.Unilateral("hill", gap))
    return run(model, {"place.x": 0.0}, {"place.x": 1.0})


@pytest.mark.parametrize("depth", [1e-5, 1e-7, 1e-9, 1e-11, 0.0, -1e-12, -1e-9, -1e-6])
def test_a_dip_within_one_step_is_found_and_a_tangent_touch_or_a_near_miss_gives_no_impulse(depth):
    trajectory = parabola(depth)
    if depth > 0.0:
        assert closings(trajectory, "hill") == [pytest.approx(0.505 - np.sqrt(2 * depth), abs=1e-6)]
    else:
        assert trajectory.events == [] and trajectory["place.x"][-1] == pytest.approx(1.0, abs=1e-12)


def test_a_dip_that_begins_at_zero_is_found():
    model, body = falling()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    model.apply(mbd.Applied("up", body.origin, force=(0.0, 200.0, 0.0)))
    trajectory = run(model, {"fall.displacement": 0.0}, {"fall.displacement": -0.1}, until=0.1)
    (event,) = [event for event in trajectory.events if event.kind == "closed"]
    assert event.time == 0.0 and event.impulse[0] == pytest.approx(0.2)
    assert trajectory["fall.displacement"].min() > -1e-12


# contacts that meet -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("force", "stays"), [(-5.0, True), (0.0, True), (5.0, False)])
def test_a_contact_that_touches_at_rest_is_decided_by_its_acceleration(force, stays):
    model, body = point(gravity=(0.0, 0.0, 0.0))
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    model.apply(mbd.Applied("push", body.origin, force=(0.0, force, 0.0)))
    trajectory = run(model, {"place.y": 0.0}, until=0.1)
    expected = 0.0 if stays else 0.5 * force * 0.01
    assert trajectory["place.y"][-1] == pytest.approx(expected, abs=1e-12)
    assert trajectory["floor.force"][-1] == pytest.approx(max(-force, 0.0))
    assert all(not event.impulse.any() for event in trajectory.events), "touching at rest is no impact"


def test_a_contact_closed_at_the_start_that_would_pull_opens_there():
    model, body = point()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    model.apply(mbd.Applied("lift", body.origin, force=(0.0, 15.0, 0.0)))
    trajectory = run(model, closed=["floor"], until=0.1)
    (event,) = trajectory.events
    assert (event.time, event.kind) == (0.0, "opened")
    assert trajectory["place.y"][-1] == pytest.approx(0.005 * (15.0 - G), rel=1e-9)
