"""Steps that follow their error where a first-order state of a user's force passes through zero, or begins there."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.forces import Action, Force

FAMILY = [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.9)]


@dataclass(frozen=True)
class Filtered(Force):
    """A force along a rail behind two lags: ``τ ż₁ = cos(ωt + φ) − z₁``, ``τ ż₂ = z₁ − z₂``; z₂ pushes."""

    name: str
    joint: mbd.Prismatic
    kind = "applied"

    def mentions(self):
        return [self.joint]

    def parameters(self):
        return {f"{self.name}.lag": 0.1, f"{self.name}.frequency": 6.0, f"{self.name}.phase": 0.0}

    def act(self, scope):
        lag, frequency, phase = (scope.parameter(self.name, *each) for each in FIELDS)
        first, second = (scope.state(self.name, name, 0.0) for name in ("first", "second"))
        (rate,) = scope.joint(self.joint.name).rates
        command = mbd.cos(frequency * scope.time + phase)
        rates = ((first, (command - first) / lag), (second, (first - second) / lag))
        return Action(pairs=((rate, second),), rates=rates)


FIELDS = (("lag", 0.1), ("frequency", 6.0), ("phase", 0.0))


@cache
def pushed():
    model, body = mbd.Model("pushed point", gravity=(0, 0, 0)), mbd.PointMass("body", mass=1.3)
    rail = mbd.Prismatic("rail", model.ground.origin, body.origin)
    model.connect(rail)
    model.apply(Filtered("push", rail))
    return model


def within(scheme, tol, position, parameters, until=0.6):
    """The largest error of the coordinate and of both states in a run."""
    start = mbd.assemble(pushed(), position=position)
    run, exact = (
        mbd.simulate(pushed(), start, each, until=until, parameters=parameters, **how)
        for each, how in ((scheme, {"tol": tol}), (mbd.RungeKutta853(), {"dt": 0.01}))
    )
    names = ("rail.displacement", "push.first", "push.second")
    return [np.max(np.abs(run[name] - exact.at(run.t)[name])) for name in names]


@settings(max_examples=6)
@given(
    scheme=st.sampled_from(FAMILY),
    lag=st.floats(0.05, 0.2),
    frequency=st.floats(8.0, 14.0),
    phase=st.floats(0.0, 6.0),
    begin=st.floats(-1.0, 1.0),
)
def test_a_state_may_pass_through_zero(scheme, lag, frequency, phase, begin):
    """Within half a turn of its command, a state crosses zero; the run is as accurate as asked there too."""
    parameters = {"push.lag": lag, "push.frequency": frequency, "push.phase": phase}
    errors = within(scheme, 1e-6, {"push.first": begin, "push.second": -0.2 - 0.5 * begin}, parameters)
    assert errors[0] <= 1e-6
    assert max(errors[1:]) <= 1e-3


@pytest.mark.parametrize("scheme", FAMILY, ids=repr)
def test_states_that_follow_each_other_may_begin_at_zero(scheme):
    """The second one begins like t²: beside that no step of order 2 is short enough to be accurate."""
    errors = within(scheme, 1e-6, {}, {}, until=0.2)
    assert errors[0] <= 1e-6
    assert max(errors[1:]) <= 1e-4


@pytest.mark.parametrize("scheme", FAMILY, ids=repr)
def test_twins_take_the_same_steps_over_zero(scheme):
    """Interpreted steps are those of machine code, also where a state changes its sign."""
    start = mbd.assemble(pushed(), position={"push.first": -0.01, "push.second": -0.0005})
    runs = [mbd.simulate(pushed(), start, scheme, tol=1e-4, until=0.04, backend=each) for each in ("llvm", "python")]
    assert runs[0]["push.second"].min() < 0.0 < runs[0]["push.second"].max()
    np.testing.assert_allclose(runs[0].t, runs[1].t, rtol=1e-9)
    np.testing.assert_allclose(runs[0].record.z, runs[1].record.z, rtol=1e-7, atol=1e-12)
