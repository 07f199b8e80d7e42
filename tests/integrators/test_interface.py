"""The stepping interface suffices for an integrator of one's own; what a scheme cannot do it refuses, with a reason."""

import pickle
from dataclasses import dataclass

import numpy as np
import pytest

import mbd
from mbd.integrators import Integrator, StepReport, StepResult, Terms
from mbd.state import Mode, State
from tests.integrators.own import ProjectedMidpoint, SemiImplicitEuler
from tests.integrators.test_order import started
from tests.simulation.mechanisms import G, ball, kneed_walker, kneed_walker_start, pendulum, run

OWN = {"semi-implicit Euler": (SemiImplicitEuler(), 1), "projected midpoint": (ProjectedMidpoint(), 2)}


def walk(scheme, dt, until=0.6, **settings):
    walker = kneed_walker()
    return mbd.simulate(walker, kneed_walker_start(walker), scheme, dt=dt, until=until, **settings)


@pytest.mark.parametrize(("scheme", "order"), OWN.values(), ids=OWN)
def test_an_integrator_of_ones_own_walks_through_knee_lock_and_heel_strike(scheme, order):
    exact = walk(mbd.HHT(0.05), 1e-4)
    errors = []
    for dt in (4e-3, 2e-3):
        trajectory = walk(scheme, dt)
        assert trajectory.success and not trajectory.stats["compiled"]
        assert [(e.name, e.kind) for e in trajectory.events] == [(e.name, e.kind) for e in exact.events]
        errors.append(max(abs(e.time - r.time) for e, r in zip(trajectory.events, exact.events, strict=True)))
        strike = next(event for event in trajectory.events if event.name == "right foot")
        assert strike.impulse[0] == pytest.approx(0.974, rel=0.05)
        assert trajectory["right foot.force"][-1] > 5.0, "its multipliers are those of the motion"
    assert errors[1] < (5e-3 if order == 1 else 5e-5)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.4)


@pytest.mark.parametrize("scheme", [scheme for scheme, _ in OWN.values()], ids=OWN)
def test_an_integrator_of_ones_own_locates_events_and_bounces(scheme):
    trajectory = run(ball(restitution=0.5), {"fall.displacement": 1.0}, integrator=scheme, dt=1e-3, until=0.8)
    assert abs(trajectory["floor.gap"][trajectory.events[0].row]) < 1e-14
    assert trajectory.events[0].time == pytest.approx(np.sqrt(2 / G), abs=1e-3)


def test_an_integrator_of_ones_own_that_gives_up_says_so():
    @dataclass(frozen=True)
    class Tired(SemiImplicitEuler):
        def step(self, system, state, dt, mode, memory):
            if state.time > 0.3:
                return StepResult(state, memory, StepReport(False, 7, 3.0, "too tired"))
            return super().step(system, state, dt, mode, memory)

    with pytest.raises(mbd.SimulationError, match="too tired") as failed:
        run(pendulum(), {"hinge.angle": 1.0}, integrator=Tired())
    assert failed.value.run.time[-1] == pytest.approx(0.31)


def test_an_integrator_of_ones_own_that_returns_nan_is_stopped():
    @dataclass(frozen=True)
    class Lost(SemiImplicitEuler):
        def step(self, system, state, dt, mode, memory):
            result = super().step(system, state, dt, mode, memory)
            if state.time > 0.3:
                return StepResult(
                    State(result.state.time, result.state.q * np.nan, result.state.v), memory, result.report
                )
            return result

    trajectory = run(pendulum(), {"hinge.angle": 1.0}, integrator=Lost(), on_failure="return")
    assert not trajectory.success and np.isfinite(trajectory.record.q).all()


def test_an_integrator_of_ones_own_that_raises_keeps_the_run():
    @dataclass(frozen=True)
    class Broken(SemiImplicitEuler):
        def step(self, system, state, dt, mode, memory):
            if state.time > 0.3:
                raise ZeroDivisionError("oops")
            return super().step(system, state, dt, mode, memory)

    with pytest.raises(mbd.SimulationError, match="oops") as failed:
        run(pendulum(), {"hinge.angle": 1.0}, integrator=Broken())
    assert failed.value.run.time[-1] == pytest.approx(0.31)


def test_an_integrator_without_a_step_cannot_be_made():
    class Half(Integrator):
        def start(self, system, state, mode, dt):
            return None

    with pytest.raises(TypeError):
        Half()


# three lines stand in for a walker ----------------------------------------------------------------------------------
class Oscillator:
    """r = v̇ + ω² q."""

    def __init__(self, omega):
        self.omega = omega

    def evaluate(self, point, mode, tangent):
        _c_C, c_K = tangent or (0.0, 0.0)
        return Terms(point.rate + self.omega**2 * (point.q + point.x), np.array([[1.0 + c_K * self.omega**2]]))


@pytest.mark.parametrize("scheme", [mbd.Newmark(), mbd.HHT(0.1), mbd.GeneralizedAlpha(0.7)], ids=repr)
def test_a_class_with_an_evaluate_stands_in_for_a_mechanism(scheme):
    omega, dt, steps = 2.0, 1e-3, 1000
    system, state = Oscillator(omega), State(0.0, np.array([1.0]), np.array([0.0]))
    result = scheme.advance(system, state, dt, steps * dt, Mode(), scheme.start(system, state, Mode(), dt))
    assert result.steps == steps and result.report.converged and not result.rejected
    assert result.state.q[0] == pytest.approx(np.cos(omega * steps * dt), abs=5e-6)
    assert result.memory.rate[0] == pytest.approx(-(omega**2) * result.state.q[0], rel=1e-9)


def test_advance_stops_before_the_step_that_a_guard_rejects():
    scheme, system = mbd.Newmark(), Oscillator(1.0)
    state = State(0.0, np.array([1.0]), np.array([0.0]))
    memory = scheme.start(system, state, Mode(), 0.1)
    result = scheme.advance(system, state, 0.1, 10.0, Mode(), memory, guards=lambda candidate: candidate.q[0] > 0.0)
    assert result.rejected and result.state.q[0] > 0.0
    assert result.state.time == pytest.approx(1.5)


def test_a_step_never_changes_what_it_is_given():
    scheme, system = mbd.GeneralizedAlpha(0.7), Oscillator(3.0)
    state = State(0.0, np.array([1.0]), np.array([0.5]))
    memory = scheme.start(system, state, Mode(), 0.1)
    kept = pickle.dumps((state.q, state.v, memory))
    first = scheme.step(system, state, 0.1, Mode(), memory)
    second = scheme.step(system, state, 0.1, Mode(), memory)
    assert pickle.dumps((state.q, state.v, memory)) == kept
    assert np.array_equal(first.state.q, second.state.q) and np.array_equal(first.memory.rate, second.memory.rate)


def test_a_system_that_is_not_finite_or_singular_is_reported_not_raised():
    class Bad(Oscillator):
        def evaluate(self, point, mode, tangent):
            terms = super().evaluate(point, mode, tangent)
            return Terms(terms.r * self.factor, terms.S * self.mass)

    scheme, state = mbd.HHT(0.05), State(0.0, np.array([1.0]), np.array([0.0]))
    good = Oscillator(1.0)
    memory = scheme.start(good, state, Mode(), 0.1)
    for factor, mass in ((np.nan, 1.0), (1.0, 0.0)):
        bad = Bad(1.0)
        bad.factor, bad.mass = factor, mass
        result = scheme.step(bad, state, 0.1, Mode(), memory)
        assert not result.report.converged and result.report.message
        assert result.state is state


# refusals -----------------------------------------------------------------------------------------------------------
WRONG = {
    "alpha": (lambda: mbd.HHT(0.5), "alpha"),
    "alpha nan": (lambda: mbd.HHT(float("nan")), "alpha"),
    "rho": (lambda: mbd.GeneralizedAlpha(1.1), "rho_inf"),
    "gamma": (lambda: mbd.Newmark(0.25, 0.4), "gamma"),
    "beta": (lambda: mbd.Newmark(0.0, 0.5), "beta"),
    "formulation": (lambda: mbd.HHT(formulation="index2"), "formulation"),
    "start": (lambda: mbd.HHT(start="guess"), "start"),
    "form": (lambda: mbd.HHT(form="midpoint"), "form"),
    "tolerance": (lambda: mbd.HHT(tolerance=0.0), "tolerance"),
    "averaged ggl": (lambda: mbd.HHT(form="averaged", formulation="ggl"), "index3"),
}


@pytest.mark.parametrize(("make", "said"), WRONG.values(), ids=WRONG)
def test_a_parameter_that_no_scheme_has_is_refused(make, said):
    with pytest.raises(mbd.CapabilityError, match=said):
        make()


@pytest.mark.parametrize(
    "scheme",
    [mbd.Newmark(formulation="index3"), mbd.HHT(0.0, formulation="index3"), mbd.HHT(0.0, form="averaged"),
     mbd.GeneralizedAlpha(1.0, formulation="index3")],
    ids=repr,
)  # fmt: skip
def test_undamped_index_3_is_refused_where_there_are_rows_and_allowed_where_there_are_none(scheme):
    with pytest.raises(mbd.CapabilityError, match="without bound"):
        walk(scheme, 1e-3)
    assert run(pendulum(), {"hinge.angle": 1.0}, integrator=scheme, until=0.1).success


def test_undamped_index_3_is_refused_for_a_reason():
    """The multipliers of the trapezoidal rule at index 3 ring for ever; a little damping quiets them."""

    class Stubborn(mbd.Newmark):
        def check(self, rows):
            return None

    model, start = started("double pendulum in absolute coordinates")
    fine = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=2e-4, until=1.0).record.lam[::5]

    def error(scheme):
        lam = mbd.simulate(model, start, scheme, dt=1e-3, until=1.0).record.lam
        return np.abs(lam[-20:] - fine[-20:]).max()

    assert error(Stubborn(formulation="index3")) > 1.0
    assert error(mbd.HHT(0.05, formulation="index3")) < 1e-3


def test_integrators_are_values():
    schemes = [
        mbd.Newmark(),
        mbd.HHT(0.05),
        mbd.HHT(0.1, form="averaged"),
        mbd.GeneralizedAlpha(0.8, start="consistent"),
    ]
    for scheme in schemes:
        copy = pickle.loads(pickle.dumps(scheme))
        assert copy == scheme and hash(copy) == hash(scheme) and repr(copy) == repr(scheme)
        assert eval(repr(scheme), {k: getattr(mbd, k) for k in ("Newmark", "HHT", "GeneralizedAlpha")}) == scheme
        with pytest.raises(AttributeError):
            scheme.tolerance = 1e-3
    assert len(set(schemes)) == 4 and mbd.HHT(0.05) != mbd.HHT(0.06)
