"""Ctrl-C ends a batch: the runs that were over are those of the whole batch, the others were not run."""

import _thread
import time

import numpy as np
import pytest

import mbd
from mbd.kernel import codes
from mbd.simulation.many_runs import ManyRuns
from tests.simulation.mechanisms import ball

COUNT = 24
HEIGHTS = np.linspace(0.5, 2.0, COUNT)


def batch(model, workers=1, **more):
    start = mbd.assemble(model, position={"fall.displacement": 1.0})
    return mbd.batch(
        model, (start, {"fall.displacement": HEIGHTS}), mbd.HHT(), 0.05, until=0.4, results=["kinetic_energy"],
        workers=workers, **more,
    )  # fmt: skip


def check(found, whole, least, most):
    """What is there is what would have been there."""
    done = found.outcome != "not run"
    assert not found.complete and whole.complete
    assert least <= done.sum() <= most, done.sum()
    for name in ("outcome", "time", "q", "v", "steps", "stopped_by"):
        np.testing.assert_array_equal(getattr(found, name)[done], getattr(whole, name)[done])
    np.testing.assert_array_equal(found.results["kinetic_energy"][done], whole.results["kinetic_energy"][done])
    assert not found.success[~done].any() and np.isnan(found.q[~done]).all() and np.isnan(found.time[~done]).all()
    assert np.isnan(found.results["kinetic_energy"][~done]).all()
    assert f"{(~done).sum()} × not run" in repr(found) and len(found.to_dataframe()) == COUNT
    left = int(np.flatnonzero(~done)[0])
    assert found.message(left) == "not run: interrupted"
    with pytest.raises(mbd.SimulationError, match=rf"was not made: the batch was interrupted; batch.run\({left}\)"):
        found.final(left)
    np.testing.assert_array_equal(found.run(left).final.q, whole.final(left).q)


@pytest.mark.parametrize("calls", [0, 1, 7])
def test_runs_that_python_makes_are_kept(calls):
    """One by one, as a controller asks for it."""
    left = [None]

    def update(time, values, state):
        if left[0] == 0:
            left[0] = None
            raise KeyboardInterrupt
        left[0] = None if left[0] is None else left[0] - 1
        return

    model = ball()
    model.apply(mbd.Controller("clock", update, period=0.1, reads=("fall.displacement",), writes=(), state=0))
    whole = batch(model)
    assert whole.how and whole.success.all()
    left[0] = 4 * calls + 2
    found = batch(model)
    check(found, whole, calls, calls + 1)


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("calls", [0, 1, 3])
def test_runs_of_the_kernel_are_kept(monkeypatch, workers, calls):
    model = ball(restitution=0.5)
    whole = batch(model, workers)
    assert not whole.how
    march, left = ManyRuns.until_stopped, [calls]

    def interrupted(self, *given, **named):
        left[0] -= 1
        if left[0] < 0 and workers == 1:
            self.run.stepper.march_many = _raising
        elif left[0] < 0:
            self.run.stepper.march_many = _waiting  # until the other thread, which heard it, tells
            if left[0] == -1:
                _thread.interrupt_main()
        return march(self, *given, **named)

    monkeypatch.setattr(ManyRuns, "until_stopped", interrupted)
    found = batch(model, workers)
    size = -(-COUNT // (4 * workers))
    check(found, whole, calls * size if workers == 1 else 0, COUNT - size)


def _waiting():
    time.sleep(0.01)
    return codes.NEEDS_PYTHON


def _raising():
    raise KeyboardInterrupt


def test_a_second_study_finds_the_kernel_whole(monkeypatch):
    """A batch after an interrupted one, and a gait whose search is interrupted, are as ever."""
    model = ball()
    whole = batch(model)
    march = ManyRuns.until_stopped
    monkeypatch.setattr(ManyRuns, "until_stopped", _interrupting(march))
    assert not batch(model).complete
    monkeypatch.undo()
    np.testing.assert_array_equal(batch(model).q, whole.q)


def _interrupting(march):
    def call(self, *given, **named):
        self.run.stepper.march_many = _raising
        return march(self, *given, **named)

    return call
