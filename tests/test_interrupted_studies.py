"""Ctrl-C in a study gives back what was finished: what is there is, to the bit, the beginning of the whole study."""

from typing import Any

import numpy as np
import pytest

import mbd
from mbd.simulation import marching
from mbd.simulation.many_runs import ManyRuns
from tests.analysis.test_fit import TIMES, pendulum, seen
from tests.gait.test_branches import cycle_of
from tests.gait.walkers import simplest


@pytest.fixture
def whole_and_interrupted(monkeypatch):
    """What a study gives, and what it gives where Ctrl-C comes after a share of its calls of the kernel."""
    calls, last = 0, float("inf")

    def counted(original):
        def call(*given):
            nonlocal calls
            calls += 1
            if calls == last:
                raise KeyboardInterrupt
            return original(*given)

        return call

    monkeypatch.setattr(marching, "advance", counted(marching.advance))
    monkeypatch.setattr(ManyRuns, "__call__", counted(ManyRuns.__call__))

    def both(study, share: float) -> tuple[Any, Any]:
        nonlocal calls, last
        calls, last = 0, float("inf")
        whole = study()
        calls, last = 0, max(int(share * calls), 1)
        return whole, study()

    return both


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_branch_keeps_its_points(whole_and_interrupted, share):
    gait = cycle_of("p + x - x**2", "0.5*y", 0.25, 0.5, 0.0)
    whole, found = whole_and_interrupted(lambda: mbd.branch(gait, "scale", 0.9, step=0.1), share)
    assert whole.complete and not found.complete and 1 < len(found) < len(whole)
    assert found.stopped == f"interrupted after {len(found)} points" and found.stopped in repr(found)
    for title in whole.columns:
        np.testing.assert_array_equal(found[title], whole[title][: len(found)])
    assert [point.value for point in found.special] == [point.value for point in whole.special[: len(found.special)]]


def test_a_curve_of_special_points_keeps_its_points(whole_and_interrupted):
    found = mbd.branch(cycle_of("p + x - k*x**2", "0.3*y", 0.75, 0.775, 0.0), "scale", 0.85, step=0.1)
    (doubling,) = found.points("doubling")
    whole, curve = whole_and_interrupted(lambda: found.follow(doubling, "bend", 1.3, steps=3), 0.6)
    assert whole.complete and not curve.complete and 1 < len(curve) < len(whole)
    assert curve.stopped == f"interrupted after {len(curve)} points"
    np.testing.assert_array_equal(curve["scale"], whole["scale"][: len(curve)])


@pytest.mark.parametrize("share", [0.0, 0.7])
def test_a_search_for_gaits_keeps_its_tries(whole_and_interrupted, share):
    model, _ = simplest()

    def study():
        return mbd.find_gait(
            model, {"theta": (0.15, 0.25), "phi": (0.3, 0.5)}, {"theta": (-0.25, -0.15), "phi": 0.0}, closed=(),
            section="heel strike", tries=8, longest=8.0, all_gaits=True,
        )  # fmt: skip

    whole, found = whole_and_interrupted(study, share)
    assert whole.complete and not found.complete and "(interrupted)" in repr(found)
    assert min(share, 1) <= len(found.tries) < len(whole.tries)
    for one, other in zip(found.tries, whole.tries, strict=False):
        assert one.values == other.values and str(one.outcome) == str(other.outcome)
        assert (one.gait < 0) == (other.gait < 0)
        if one.gait >= 0:
            assert found.gaits[one.gait].period == whole.gaits[other.gait].period


@pytest.mark.parametrize("share", [0.4, 0.8])
def test_a_fit_keeps_its_best_trial(whole_and_interrupted, share):
    model, start = pendulum()
    values = seen(**{"rod.center": 1.0, "pin loss.coefficient": 0.4})
    guess = {"rod.center": 1.3, "pin loss.coefficient": 0.2}
    how = {"integrator": mbd.Newmark(), "dt": 0.02}

    def study():
        return mbd.fit(model, start, {"time": TIMES, "pin.angle": values}, guess, **how)

    whole, found = whole_and_interrupted(study, share)
    assert whole.converged and not found.converged and found.message.startswith("interrupted")
    first = mbd.simulate(model, start, **how, until=2.0, parameters=guess).at(TIMES)["pin.angle"] - values
    best = found.residuals["pin.angle"] * found.scales["pin.angle"]
    assert whole.noise < found.noise and best @ best <= first @ first
    np.testing.assert_allclose(best, values - found.run.at(TIMES)["pin.angle"], rtol=1e-15)
    with pytest.raises(KeyboardInterrupt):  # nothing was finished
        whole_and_interrupted(study, 0.0)


@pytest.mark.parametrize("share", [0.4, 0.8])
def test_an_optimization_of_a_model_keeps_its_best_trial(whole_and_interrupted, share):
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=2.0, length=1.0, center=0.8, inertia=0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    model.constrain(mbd.Event("below", mbd.measure(lambda a: a, "pin.angle"), terminal=True))
    start, guess = mbd.assemble(model, {"pin.angle": 0.01}), {"rod.center": (0.8, 0.1, 1.0)}

    def study():
        return mbd.optimize(model, guess, start, mbd.RungeKutta853(), 0.01, until="below", minimize="time")

    whole, found = whole_and_interrupted(study, share)
    assert whole.success and not found.success and found.message.startswith("interrupted")
    assert found.objective == min(trial.objective for trial in found.trials)
    trials = [trial.objective for trial in whole.trials[: len(found.trials)]]
    assert 1 <= len(trials) < len(whole.trials) and [trial.objective for trial in found.trials] == trials
