"""A run that takes the arrays of an earlier one of its kind is, to the bit, the run that has new ones."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.simulation.run import idle, stepper
from mbd.simulation.run.begin import guard_values, require_consistent, set_side
from mbd.simulation.simulate import REST_SPEED, laid_out
from mbd.testing.mechanisms import random_scene
from tests.comparisons import at_least, compared
from tests.simulation.mechanisms import ball, kneed_walker, kneed_walker_start

SCHEMES = (mbd.HHT(alpha=0.05), mbd.RungeKutta853(), mbd.RadauIIA())
OPTIONS = {
    "contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": REST_SPEED, "backend": "auto",
}  # fmt: skip
TOLD = ("steps", "iterations", "tangents", "residuals", "factorizations", "events", "restarts", "impacts", "modes")


def assert_same(one: mbd.Trajectory, other: mbd.Trajectory) -> None:
    """All rows, events, counts and notes, and what the ends remember."""
    for name in ("time", "q", "v", "z", "a", "lam", "closed", "phase"):
        np.testing.assert_array_equal(getattr(one.record, name), getattr(other.record, name), err_msg=name)
    assert [repr(event) for event in one.events] == [repr(event) for event in other.events]
    assert {name: one.stats[name] for name in TOLD} == {name: other.stats[name] for name in TOLD}
    assert (one.message, one.stats["notes"]) == (other.message, other.stats["notes"])
    assert one.final.memory.seal == other.final.memory.seal


@at_least(10)
@settings(max_examples=12)
@given(seed=st.integers(0, 300), scheme=st.sampled_from(SCHEMES), contact=st.sampled_from(["events", "nonsmooth"]))
def test_a_run_after_others_is_the_same(seed, scheme, contact):
    model, rng = random_scene(seed, bodies=2), np.random.default_rng(seed)
    if not isinstance(scheme, mbd.HHT):
        contact = "auto"
    base = mbd.assemble(model)
    starts = [mbd.assemble(model, velocity={n: rng.uniform(-1, 1) for n in base.velocity_names}) for _ in range(2)]

    def run(start, parameters=None):
        return mbd.simulate(
            model, start, scheme, dt=0.01, until=0.4, contact=contact, on_failure="return", parameters=parameters
        )

    inputs = [each for each in mechanism_of(model).equations.parameters if each.value]
    new = run(starts[0])
    other = run(starts[1], {each.name: 1.01 * each.value for each in inputs[:1]})
    again = run(starts[0])  # in the arrays of the last one
    if new.success and other.success:
        compared()
    if new.success:
        assert_same(new, again)


def test_a_mechanism_with_one_mode_is_not_asked_for_it(monkeypatch):
    """Its start is judged, then come the steps to the end on their grid: nothing else enters the kernel."""
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", 1.0, 1.0, 0.5, 0.1)
    model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start))
    start, enter, calls = mbd.assemble(model, position={"hinge.angle": 0.3}), stepper.Stepper._enter, []

    def counted(self, address):
        calls.append(address)
        return enter(self, address)

    monkeypatch.setattr(stepper.Stepper, "_enter", counted)
    for _ in range(2):
        calls.clear()
        run = mbd.simulate(model, start, dt=1e-3, until=0.1)
        assert (len(calls), run.stats["modes"], run.stats["steps"]) == (2, 1, 100)


def test_a_run_is_not_asked_for_modes_that_earlier_ones_have_met(monkeypatch):
    model, asked = kneed_walker(), []
    start, add_mode = kneed_walker_start(model), stepper.Stepper.add_mode

    def counted(self):
        asked.append(self)
        add_mode(self)

    monkeypatch.setattr(stepper.Stepper, "add_mode", counted)
    brief = mbd.simulate(model, start, dt=1e-3, until=1.0)
    first = mbd.simulate(model, start, dt=1e-3, until=("right foot", 1.0))
    assert len(asked) == max(brief.stats["modes"], first.stats["modes"]) > 1
    asked.clear()
    assert_same(mbd.simulate(model, start, dt=1e-3, until=1.0), brief)
    assert not asked


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_derivatives_by_others_follow_in_modes_that_earlier_runs_have_met(scheme, monkeypatch):
    """The programs of a mode that is known are those of the parameters that are asked for now."""

    def found(model, names):
        return mbd.sensitivities(model, kneed_walker_start(model), scheme, dt=5e-3, until="right foot", wrt=names)

    one, other = ["left hip.angle", "hip.mass"], ["left thigh.mass", "right hip.angle.rate", "left shank.length"]
    fresh = [found(kneed_walker(), names).matrix for names in (one, other)]
    model, asked, add_mode = kneed_walker(), [], stepper.Stepper.add_mode
    monkeypatch.setattr(stepper.Stepper, "add_mode", lambda self: (asked.append(self), add_mode(self)))
    for k in (0, 1, 0, 1):
        asked.clear()
        np.testing.assert_allclose(found(model, (one, other)[k]).matrix, fresh[k], rtol=1e-9, atol=1e-11)
    assert not asked


@pytest.mark.parametrize("scheme", SCHEMES[1:], ids=repr)
def test_trial_runs_of_a_tolerance_take_the_arrays_of_each_other(scheme, monkeypatch):
    model, made = ball(), []
    start, begin = mbd.assemble(model, position={"fall.displacement": 1.0}), stepper.Stepper.__init__

    def counted(self, *given):
        made.append(self)
        begin(self, *given)

    monkeypatch.setattr(stepper.Stepper, "__init__", counted)
    runs = [mbd.simulate(model, start, scheme, tol=tol, until=1.0) for tol in (1e-4, 1e-7, 1e-4)]
    assert len(made) == 2 and len(runs[0].stats["tolerance"]["runs"]) > 1, "one for each tolerance"
    assert_same(runs[0], runs[2])
    monkeypatch.setattr(idle, "_key", lambda *given: None)
    assert_same(runs[0], mbd.simulate(model, start, scheme, tol=1e-4, until=1.0))
    assert len(made) > 3


def test_arrays_are_taken_and_given_back():
    model = kneed_walker()
    start, idle = kneed_walker_start(model), mechanism_of(model).idle
    mbd.simulate(model, start, dt=1e-3, until=0.01)
    (left,) = idle.values()
    mbd.simulate(model, start, dt=1e-3, until=0.01)
    assert list(idle.values()) == [left]
    mbd.simulate(model, start, dt=1e-3, until=0.01, parameters={"hip.mass": 0.6})
    mbd.simulate(model, start, dt=2e-3, until=0.01)  # of another kind
    assert left in idle.values() and len(idle) == 2


def test_arrays_that_are_kept_have_no_more_numbers_than_their_limit_with_those_of_derivatives(monkeypatch):
    model = kneed_walker()
    start, idle = kneed_walker_start(model), mechanism_of(model).idle
    idle.clear()
    mbd.simulate(model, start, dt=1e-3, until=0.01)
    (left,) = idle.values()
    monkeypatch.setattr(stepper, "MAX_IDLE_SIZE", 2 * left.size)
    mbd.simulate(model, start, dt=1e-3, until=0.01)
    assert list(idle.values()) == [left]
    mbd.simulate(model, start, dt=1e-3, until=0.01, wrt=["gravity.x"])
    assert list(idle.values()) == [left]


def test_a_run_within_a_run_has_arrays_of_its_own():
    """An observer, a controller or a reset may simulate the same model while a run is under way."""
    model = ball()
    start, inner = mbd.assemble(model, position={"fall.displacement": 1.0}), []

    def observer(time: float, state: mbd.State) -> None:
        if len(inner) < 3:
            inner.append(mbd.simulate(model, start, dt=1e-3, until=0.6))

    outer = mbd.simulate(model, start, dt=1e-3, until=0.6, observers=[observer])
    assert_same(outer, mbd.simulate(model, start, dt=1e-3, until=0.6))
    assert inner
    for each in inner:
        assert_same(each, outer)


@at_least(10)
@settings(max_examples=12)
@given(seed=st.integers(0, 300))
def test_compiled_code_judges_starts_as_python_does(seed):
    """Sides of guards and contacts that touch; a start that breaks rows is left to Python, which names them."""
    model, rng = random_scene(seed, bodies=2), np.random.default_rng(seed)
    base = mbd.assemble(model)
    start = mbd.assemble(model, velocity={n: rng.uniform(-1, 1) for n in base.velocity_names})
    run = laid_out(model, start, mbd.HHT(), 0.01, 0.1, {}, OPTIONS).at_start()
    v = run.kernel
    touched, sides = v.touched[: v.n_contacts].copy(), v.side[: v.n_guards].copy()
    compared()
    require_consistent(run, start)
    guards = guard_values(run)
    for e in range(v.n_guards):
        set_side(run, e, guards)
    np.testing.assert_array_equal(v.side[: v.n_guards], sides)
    assert set(touched) <= {0, 1}
