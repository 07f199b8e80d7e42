"""Going on from the end of a run, stored rows, and what they cost."""

import tracemalloc

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import G, ball, falling, kneed_walker, kneed_walker_start, pendulum, run

# going on -----------------------------------------------------------------------------------------------------------


def test_a_released_contact_stays_ignored_in_the_continued_run():
    model, body = falling()
    other = mbd.PointMass("other", mass=1.0)
    model.connect(mbd.Prismatic("drop", model.ground.origin, other.origin, axis=(0, 1, 0)))
    model.constrain(
        mbd.Unilateral("A", mbd.height(other.origin)),
        mbd.Unilateral("B", mbd.height(body.origin), release=mbd.When("A")),
    )
    first = run(model, {"drop.displacement": 0.1}, closed=["B"], until=0.3)
    assert "B" not in first.final.armed and first.final["fall.displacement"] < -0.01
    second = mbd.simulate(model, first.final, mbd.HHT(0.05), dt=0.01, until=0.6)
    assert second.events == []
    fall = 0.6 - first.events[0].time
    assert second["fall.displacement"][-1] == pytest.approx(-0.5 * G * fall**2, rel=1e-6)


def test_changed_parameters_travel_with_the_state():
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 0.3}, parameters={"rod.length": 2.0})
    first = mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=0.5)
    second = mbd.simulate(model, first.final, mbd.HHT(0.05), dt=0.01, until=1.0)
    assert second.parameters["rod.length"] == 2.0


# rows ---------------------------------------------------------------------------------------------------------------
def test_a_run_of_no_length_is_its_start():
    trajectory = run(pendulum(), {"hinge.angle": 0.4}, until=0.0)
    assert len(trajectory.time) == 1 and trajectory["hinge.angle"][0] == 0.4
    assert trajectory["hinge.acceleration"][0] == pytest.approx(-1.5 * G * np.sin(0.4), rel=1e-12)
    assert trajectory.success


@pytest.mark.parametrize("store", [1, 7, 1000])
def test_a_stride_keeps_events_the_start_and_the_end(store):
    trajectory = run(ball(restitution=0.5), {"fall.displacement": 1.0}, dt=1e-3, until=1.2, store=store)
    every = run(ball(restitution=0.5), {"fall.displacement": 1.0}, dt=1e-3, until=1.2)
    assert trajectory.time[0] == 0.0 and trajectory.time[-1] == 1.2
    np.testing.assert_array_equal(trajectory.record.q[-1], every.record.q[-1])
    for event, other in zip(trajectory.events, every.events, strict=True):
        assert event.time == other.time == trajectory.time[event.row] == trajectory.time[event.row - 1]
    assert len(trajectory.time) <= 1210 / store + 3 * len(every.events) + 3


def test_the_memory_of_a_long_run_grows_with_its_stored_rows_only():
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 0.4})
    mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.1)
    peaks = []
    for steps in (100_000, 1_000_000):
        tracemalloc.start()
        trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=steps * 1e-3, store=100_000)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert trajectory.stats["steps"] == steps and len(trajectory.time) == 1 + steps // 100_000
    assert peaks[1] < peaks[0] + 50_000


# what a run leaves alone ---------------------------------------------------------------------------------------------


def test_a_state_is_never_changed_by_a_run():
    walker = kneed_walker()
    start = kneed_walker_start(walker)
    before = [np.copy(part) for part in (start.q, start.v, start.anchors)]
    mbd.simulate(walker, start, mbd.HHT(0.05), dt=5e-3, until=0.7)
    for old, new in zip(before, (start.q, start.v, start.anchors), strict=True):
        assert np.array_equal(old, new)
