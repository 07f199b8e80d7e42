"""Where events lie in time: to round-off, or by one linear interpolation; rows on both sides; many in one step."""

from dataclasses import replace

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import G, ball, falling, kneed_walker, kneed_walker_start, run, two_balls
from tests.simulation.wild import wild_scene

DROP = np.sqrt(2.0 / G)
"""When a ball dropped from 1 m lands [s]."""


@pytest.mark.parametrize("dt", [1e-6, 1e-4, 1e-2, 0.3, 10.0, 1e4])
def test_a_falling_ball_lands_on_time_whatever_the_step(dt):
    height = 1.0 if dt > 1e-5 else 1e-8 * 100
    trajectory = run(ball(), {"fall.displacement": height}, dt=dt, until=max(1e-3 if height < 1 else 1.0, dt))
    (event,) = trajectory.events
    assert event.time == pytest.approx(np.sqrt(2.0 * height / G), rel=1e-11)
    assert abs(trajectory["floor.gap"][event.row]) < 1e-15
    assert event.impulse[0] == pytest.approx(2.0 * np.sqrt(2.0 * G * height), rel=1e-9)


@pytest.mark.parametrize("height", [0.5 * G * 0.04, 0.5 * G * 0.01, 0.5 * G * 0.16])
def test_an_event_at_a_grid_point_happens_once(height):
    trajectory = run(ball(), {"fall.displacement": height}, dt=0.1)
    (event,) = trajectory.events
    assert event.time == pytest.approx(np.sqrt(2.0 * height / G), abs=1e-14)
    assert trajectory["floor.force"][-1] == pytest.approx(2.0 * G)


def test_rows_before_and_after_an_event_have_equal_times_and_their_own_sides():
    trajectory = run(ball(restitution=0.5), {"fall.displacement": 1.0}, until=0.6)
    (event,) = trajectory.events
    left, right = event.row - 1, event.row
    assert trajectory.time[left] == trajectory.time[right] == event.time
    assert trajectory["fall.rate"][left] == pytest.approx(-G * DROP, rel=1e-9)
    assert trajectory["fall.rate"][right] == pytest.approx(0.5 * G * DROP, rel=1e-9)
    assert trajectory.at(event.time, side="left")["fall.rate"] == trajectory["fall.rate"][left]
    assert trajectory.at(event.time, side="right")["fall.rate"] == trajectory["fall.rate"][right]
    assert np.all(np.diff(trajectory.time) >= 0.0)


def test_full_steps_follow_an_event():
    trajectory = run(ball(restitution=0.5), {"fall.displacement": 1.0}, until=0.6)
    after = trajectory.time[trajectory.events[0].row :]
    np.testing.assert_allclose(np.diff(after)[:-1], 0.01, rtol=1e-12)
    assert after[-1] == 0.6


@pytest.mark.parametrize("locate", ["root", "linear"])
def test_event_instants_are_of_second_order(locate):
    walker = kneed_walker()
    start = kneed_walker_start(walker)
    scheme = mbd.GeneralizedAlpha(0.9)
    reference = mbd.simulate(walker, start, scheme, dt=1e-4, until=1.0)
    errors = []
    for dt in (8e-3, 4e-3, 2e-3, 1e-3):
        trajectory = mbd.simulate(walker, start, scheme, dt=dt, until=1.0, locate=locate)
        assert [(e.name, e.kind) for e in trajectory.events] == [(e.name, e.kind) for e in reference.events]
        errors.append(max(abs(e.time - r.time) for e, r in zip(trajectory.events, reference.events, strict=True)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    if locate == "root":
        assert np.all((orders > 1.85) & (orders < 2.15))
    else:  # the error depends on where in its step the event falls: judged over all three halvings
        assert np.log2(errors[0] / errors[-1]) / 3 == pytest.approx(2.0, abs=0.25)
    if locate == "root":
        gaps = [abs(trajectory[f"{e.name}.gap"][e.row]) for e in trajectory.events if e.kind == "closed"]
        assert max(gaps) < 1e-14


def test_linear_location_interpolates_the_chord():
    trajectory = run(ball(), {"fall.displacement": 1.0}, dt=0.1, locate="linear")
    before, after = 1.0 - 0.5 * G * 0.16, 1.0 - 0.5 * G * 0.25
    assert trajectory.events[0].time == pytest.approx(0.4 + 0.1 * before / (before - after), rel=1e-9)


def test_many_events_in_one_step_come_in_their_order():
    model, a, b = two_balls()
    model.constrain(
        mbd.Event("b at half", mbd.measure(lambda p: p[1] - 0.5, b.origin)),
        mbd.Unilateral("A", mbd.height(a.origin)),
        mbd.Event("b at quarter", mbd.measure(lambda p: p[1] - 0.25, b.origin)),
        mbd.Unilateral("B", mbd.height(b.origin), restitution=0.6),
    )
    trajectory = run(model, {"a.displacement": 0.7, "b.displacement": 1.0}, dt=0.7, until=0.7)
    found = [(event.name, event.time) for event in trajectory.events]
    names, times = zip(*found, strict=True)
    assert names == ("b at half", "A", "b at quarter", "B", "b at quarter")
    speed = 0.6 * G * DROP
    up = DROP + (speed - np.sqrt(speed**2 - 0.5 * G)) / G
    np.testing.assert_allclose(
        times, [np.sqrt(1.0 / G), np.sqrt(1.4 / G), np.sqrt(1.5 / G), DROP, up], rtol=0, atol=1e-9
    )


def test_a_guard_that_is_not_finite_stops_the_run_by_name():
    model, body = falling()
    model.constrain(mbd.Unilateral("floor", mbd.measure(lambda p: mbd.sqrt(p[1] - 0.5), body.origin)))
    trajectory = run(model, {"fall.displacement": 1.0}, on_failure="return")
    assert not trajectory.success and "'floor'" in trajectory.message
    assert np.isfinite(trajectory.record.q).all()


@pytest.mark.parametrize("begin", [-5.0, 1e3, 1e6, 1e9])
def test_a_late_start_changes_nothing_but_the_round_off_of_time(begin):
    model = ball(restitution=0.5)
    start = replace(mbd.assemble(model, {"fall.displacement": 1.0}), time=begin)
    trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=begin + 2.0)
    expected = DROP * np.array([1.0, 2.0, 2.5, 2.75])
    found = np.array([event.time for event in trajectory.events[:4]]) - begin
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 + 1e-15 * abs(begin) * 100)
    assert trajectory["floor.gap"].min() > -1e-9
    assert trajectory["floor.force"][-1] == pytest.approx(2.0 * G)


@pytest.mark.parametrize("late", [0.0, 1e-15, -1e-15, 1e-12, -1e-12])
def test_an_event_at_the_very_end_of_a_run_happens_there_or_at_once_in_the_next(late):
    model = ball()
    first = run(model, {"fall.displacement": 1.0}, until=DROP + late)
    second = mbd.simulate(model, first.final, mbd.HHT(0.05), dt=0.01, until=1.0)
    (event,) = first.events + second.events
    assert event.time == pytest.approx(DROP, abs=1e-11)
    assert event.impulse[0] == pytest.approx(2.0 * np.sqrt(2 * G), rel=1e-9)
    assert second["fall.displacement"].min() > -1e-11


@pytest.mark.parametrize("seed", [207, 1370], ids=["an opening that is none", "another branch of cranks"])
def test_the_state_is_that_of_its_time_and_on_its_rows_until_a_wild_run_ends(seed):
    """A guard that seemed to fire before another had left the state of the other's instant under a later time."""
    trajectory = wild_scene(seed).run()
    assert max(trajectory.violation.length, trajectory.violation.angle) < 1e-7
