"""Runs in one call of the kernel are, to the bit, those that are made one by one."""

from functools import cache

import numpy as np
import pytest

import mbd
from mbd.simulation.many_runs import ManyRuns, start_line
from mbd.simulation.marching import Run
from mbd.simulation.repeated import RepeatedRun
from mbd.simulation.simulate import REST_SPEED, laid_out
from tests.cases.walkers import kneed, standing
from tests.gait.walkers import simplest
from tests.problems import case
from tests.simulation.mechanisms import ball

SCHEMES = (mbd.HHT(alpha=0.05), mbd.RungeKutta853(), mbd.RadauIIA())
OPTIONS = {"impact": "newton", "locate": "root", "store": 1, "rest_speed": REST_SPEED, "backend": "auto"}
LENGTH = 0.6


def same(one: mbd.State, other: mbd.State) -> bool:
    """Whether two states are one, to the bit."""
    arrays = all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("q", "v", "z", "anchors"))
    return arrays and (one.time, one.mode, one.armed) == (other.time, other.mode, other.armed)


def starts_of(model: mbd.Model, rng: np.random.Generator, count: int) -> list[mbd.State]:
    """States with velocities drawn at random, all contacts open."""
    base = mbd.assemble(model)
    return [mbd.assemble(model, velocity={n: rng.uniform(-1, 1) for n in base.velocity_names}) for _ in range(count)]


@cache
def walker() -> tuple[mbd.Model, mbd.State]:
    """The kneed walker just after a heel strike."""
    reference = case("f3-kneed-walker-chen")
    model = kneed(reference.definition)
    return model, beginning(-1.1014, -0.0399)


def beginning(*rates: float) -> mbd.State:
    """The walker with both feet on the slope."""
    sizes = case("f3-kneed-walker-chen").definition
    angles = (0.1877, -2.0 * sizes["slope"] - 0.1877)
    return standing(kneed(sizes), [*angles, *rates], sizes["slope"])


def test_repeated_runs_of_a_walker_are_the_same_together():
    model, start = walker()
    repeated = RepeatedRun(model, start, mbd.RungeKutta853(), 0.02, ("right foot", 2.0), {"gravity.x": 0.5})
    rng = np.random.default_rng(1)
    starts = [beginning(*rng.uniform(-1.2, 0.2, 2)) for _ in range(6)]
    values = [{"gravity.x": float(g)} for g in rng.uniform(0.2, 0.9, 6)]
    for one, k in zip(repeated.many(starts, values), range(6), strict=True):
        other = repeated(starts[k], values[k])
        assert same(one.state, other.state)
        assert one.state.parameters == values[k]
        assert (one.stopped_by, one.before, one.problem) == (other.stopped_by, other.before, other.problem)
        told = [[(e.time, e.kind, e.name, e.energy_loss, dict(e.impulses)) for e in end.events] for end in (one, other)]
        assert repr(told[0]) == repr(told[1])


def test_starts_that_are_none_and_runs_that_fail_stop_no_other():
    model, start = walker()
    repeated = RepeatedRun(model, start, mbd.RungeKutta853(), 0.02, ("right foot", 2.0), {})
    wrong = mbd.State(0.0, start.q + 0.1, start.v, start.z, start.mode, start.armed, start.anchors, start.names,
                      start.velocity_names)  # fmt: skip
    ends = repeated.many([start, wrong, start])
    assert ends[1].state is None and "does not satisfy its constraints" in ends[1].problem
    assert same(ends[0].state, ends[2].state)
    with pytest.raises(mbd.ModelError, match="2 starts and 1 sets"):
        repeated.many([start, start], [{}])


def test_the_twin_takes_many_runs_too():
    model = ball()
    starts = [mbd.assemble(model, position={"fall.displacement": h}) for h in (0.01, 0.02)]
    scheme, options = mbd.RungeKutta853(), {**OPTIONS, "contact": "events", "backend": "python"}
    run = laid_out(model, starts[0], scheme, 0.02, ("floor", 0.2), {}, options)
    ends = ManyRuns(run)(np.array([start_line(run, start) for start in starts]))
    for k, start in enumerate(starts):
        alone = mbd.simulate(model, start, scheme, 0.02, until=("floor", 0.2), contact="events", backend="python")
        assert same(ends.state(run, k, {}), alone.final)


def test_another_step_and_latest_time_are_those_of_a_run_prepared_with_them():
    sizes = case("f3-kneed-walker-chen").definition
    model = kneed(sizes)
    start = standing(model, case("f3-kneed-walker-chen")["fixed point"].value, sizes["slope"])
    for scheme in SCHEMES:
        adjusted = RepeatedRun(model, start, scheme, 0.02, ("right foot", 3.0), {})
        adjusted.many([start])
        for dt, latest in ((5e-3, 3.0), (0.01, 0.2)):
            adjusted.adjust(dt, latest)
            prepared = RepeatedRun(model, start, scheme, dt, ("right foot", latest), {})
            for ends in ((adjusted(start), prepared(start)), (adjusted.many([start])[0], prepared.many([start])[0])):
                assert same(ends[0].state, ends[1].state) and ends[0].stopped_by == ends[1].stopped_by


def test_repeated_runs_that_a_reset_ends_are_the_same_together():
    model, start = simplest()
    repeated = RepeatedRun(model, start, mbd.RungeKutta853(), 0.1, ("heel strike", 9.0), {"gamma": 0.009})
    values = [{"gamma": gamma} for gamma in (0.009, 0.0095, 0.02)]
    assert repeated.alone == ""
    for one, value in zip(repeated.many([start] * 3, values), values, strict=True):
        other = repeated(start, value)
        assert same(one.state, other.state) and one.stopped_by == other.stopped_by == "heel strike"


def test_an_interruption_ends_what_repeats_a_run(monkeypatch):
    """A run that Python drives ends in order as somebody interrupts it; searches must not take that for a failure."""
    model = ball()
    start = mbd.assemble(model, position={"fall.displacement": 1.0})
    run, march = RepeatedRun(model, start, mbd.HHT(), 0.01, ("floor", 1.0), {}), Run._march
    whole = run(start)

    def interrupted(run):
        raise KeyboardInterrupt

    monkeypatch.setattr(Run, "_march", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(start)
    monkeypatch.setattr(Run, "_march", march)
    assert (run(start).stopped_by, run(start).time) == (whole.stopped_by, whole.time)
