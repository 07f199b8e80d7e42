"""Wrong integrators of a user: each is caught by the law it breaks."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

import mbd
from mbd.integrators import Integrator, StepReport, StepResult
from mbd.integrators.base import Advance, Point, consistent_rates
from mbd.state import State
from mbd.testing import LawBroken, check_integrator

SMOOTH = ("varying mass", "driven pendulum")


@dataclass(frozen=True)
class Midpoint(Integrator):
    """The explicit midpoint rule on coordinates of the tree, right as it stands."""

    def order(self, system=None):
        return 2

    def check(self, rows):
        return "Midpoint keeps no rows" if rows else None

    def start(self, system, state, mode, dt):
        return SimpleNamespace(steps=np.zeros(1))

    def slope(self, system, t, y, n, mode):
        rates, _ = consistent_rates(system, t, y[:n], y[n:], mode)
        return np.concatenate([y[n : 2 * n], rates])

    def step(self, system, state, dt, mode, memory):
        y, n = np.concatenate([state.q, state.v, state.z]), len(state.q)
        half = y + 0.5 * dt * self.slope(system, state.time, y, n, mode)
        y = y + dt * self.slope(system, state.time + 0.5 * dt, half, n, mode)
        after = State(state.time + dt, y[:n], y[n : 2 * n], y[2 * n :])
        return StepResult(after, SimpleNamespace(steps=memory.steps + 1), StepReport(True, 1))


class Euler(Midpoint):
    """Of order 1, though it promises 2."""

    def step(self, system, state, dt, mode, memory):
        y, n = np.concatenate([state.q, state.v, state.z]), len(state.q)
        y = y + dt * self.slope(system, state.time, y, n, mode)
        return StepResult(State(state.time + dt, y[:n], y[n : 2 * n], y[2 * n :]), memory, StepReport(True))


class Early(Midpoint):
    """It asks for the drive at the start of the step; where nothing depends on time it is of order 2."""

    def step(self, system, state, dt, mode, memory):
        frozen = SimpleNamespace(evaluate=lambda point, *rest: system.evaluate(replace(point, t=state.time), *rest))
        return super().step(frozen, state, dt, mode, memory)


class BadStart(Midpoint):
    """It loses a whole order in each start."""

    def start(self, system, state, mode, dt):
        return SimpleNamespace(steps=np.zeros(1), first=True)

    def step(self, system, state, dt, mode, memory):
        if memory.steps[0]:
            return super().step(system, state, dt, mode, memory)
        result = super().step(system, state, dt, mode, memory)
        return replace(result, state=replace(result.state, v=result.state.v + 0.1 * dt))


class InPlace(Midpoint):
    """It moves the state that it was given."""

    def step(self, system, state, dt, mode, memory):
        result = super().step(system, state, dt, mode, memory)
        state.q[:] = result.state.q
        return result


class InPlaceMemory(Midpoint):
    """It counts in the memory that it was given."""

    def step(self, system, state, dt, mode, memory):
        memory.steps += 1
        return replace(super().step(system, state, dt, mode, memory), memory=memory)


class StartsInPlace(Midpoint):
    """Its start changes the state."""

    def start(self, system, state, mode, dt):
        state.v[:] = state.v + 1e-9
        return super().start(system, state, mode, dt)


class Remembering(Midpoint):
    """It keeps something on itself, and adds it to the next step."""

    def step(self, system, state, dt, mode, memory):
        kept = vars(self).get("kept", 0.0)
        object.__setattr__(self, "kept", kept + 1e-9)
        result = super().step(system, state, dt, mode, memory)
        return replace(result, state=replace(result.state, q=result.state.q + kept))


class Counting(Midpoint):
    """It counts on itself, which changes no result."""

    def step(self, system, state, dt, mode, memory):
        object.__setattr__(self, "count", vars(self).get("count", 0) + 1)
        return super().step(system, state, dt, mode, memory)


class Confident(Midpoint):
    """A number that is none it takes for zero, and reports success."""

    def step(self, system, state, dt, mode, memory):
        result = super().step(system, state, dt, mode, memory)
        sound = {name: np.nan_to_num(getattr(result.state, name)) for name in "qvz"}
        return replace(result, state=replace(result.state, **sound))


class Littering(Midpoint):
    """Where it fails it returns the half-made state."""

    def step(self, system, state, dt, mode, memory):
        result = super().step(system, state, dt, mode, memory)
        if np.isfinite(result.state.q).all() and np.isfinite(result.state.v).all():
            return result
        half = replace(state, q=state.q + dt * state.v)
        return StepResult(half, memory, StepReport(False, 1, message="not finite"))


class LateClock(Midpoint):
    """It forgets to move the time."""

    def step(self, system, state, dt, mode, memory):
        result = super().step(system, state, dt, mode, memory)
        return replace(result, state=replace(result.state, time=state.time))


class OwnAdvance(Midpoint):
    """Its own advance goes through guards."""

    def advance(self, system, state, dt, until, mode, memory, guards=None):
        return super().advance(system, state, dt, until, mode, memory, None)


class Hasty(Midpoint):
    """Its own advance takes one long step."""

    def advance(self, system, state, dt, until, mode, memory, guards=None):
        result = self.step(system, state, until - state.time, mode, memory)
        return Advance(result.state, result.memory, 5, result.report)


class Shapeless(Midpoint):
    """It puts the first-order states among the velocities."""

    def step(self, system, state, dt, mode, memory):
        result = super().step(system, state, dt, mode, memory)
        y = np.concatenate([result.state.v, result.state.z])
        return replace(result, state=replace(result.state, v=y, z=y[:0]))


FAULTS = {
    Euler: (
        "order: as promised, within 0.15",
        r"promised 2, observed (0\.9|1\.[01])\d*; errors at dt = 0\.2, dt/2, …: ",
    ),
    Early: ("order: as promised, within 0.15", r"problem 'driven pendulum'"),
    BadStart: ("order after a restart: as promised, within 0.15", r"check its start"),
    InPlace: ("transaction: inputs are left alone", r"state after step\(\).*never state\.q \+="),
    InPlaceMemory: ("transaction: inputs are left alone", r"step\(\) changed the memory it was given"),
    StartsInPlace: ("transaction: inputs are left alone", r"state after start\(\)"),
    Remembering: ("determinism: the same inputs give the same bits", r"nothing may hide on the integrator"),
    Counting: ("the scheme holds no state", r"the integrator changed while it stepped"),
    Confident: ("a failed step says so", r"reported convergence to a finite state"),
    Littering: ("transaction: a failed step leaves state and memory", r"state returned with the failure"),
    LateClock: ("a step ends at t + dt", r"time: expected 0\.6, found 0\.4|time: expected 0\.2, found 0"),
    OwnAdvance: ("a guard stops before the step it rejects", r"rejected is False"),
    Hasty: ("advance is a loop of steps", r"advance\(\) must repeat step\(\)"),
}


@pytest.mark.parametrize("kind", FAULTS, ids=lambda kind: kind.__name__)
def test_a_wrong_integrator_is_caught(kind):
    law, reason = FAULTS[kind]
    with pytest.raises(LawBroken, match=f"(?s){reason}") as caught:
        check_integrator(kind, problems=SMOOTH)
    assert law in caught.value.laws


def test_first_order_states_in_the_wrong_place_are_caught():
    with pytest.raises(LawBroken, match=r"sizes entry 1: expected 1, found 2"):
        check_integrator(Shapeless(), problems=["first-order state"])


def test_rows_that_drift_away_are_caught():
    """A scheme that says it keeps rows and ignores them."""

    class Careless(Midpoint):
        def check(self, rows):
            return None

        def slope(self, system, t, y, n, mode):
            point = Point(t, y[:n], np.zeros(n), y[n:], np.zeros(len(y) - n), np.zeros(1))
            terms = system.evaluate(point, mode, (0.0, 0.0))
            return np.concatenate([y[n : 2 * n], -np.linalg.solve(terms.S, terms.r)])

    with pytest.raises(LawBroken, match=r"(?s)promised 2, observed .*problem 'row'"):
        check_integrator(Careless(), problems=["row"])


def test_a_step_that_gives_up_on_a_smooth_problem_is_told():
    class Tired(Midpoint):
        def step(self, system, state, dt, mode, memory):
            return StepResult(state, memory, StepReport(False, 20, message="no more"))

    with pytest.raises(AssertionError, match=r"did not converge in step 1 of size 0\.2 s .*no more"):
        check_integrator(Tired())


def test_a_correct_integrator_of_ones_own_passes():
    verdict = check_integrator(Midpoint())
    assert verdict.laws["order: as promised, within 0.15"] == 3
    assert "Midpoint keeps no rows" in verdict.notes[0]


def test_what_cannot_be_tried_is_said():
    class Local(Midpoint):
        def start(self, system, state, mode, dt):
            return SimpleNamespace(steps=np.zeros(1), call=lambda: None)

    assert any("does not pickle" in note for note in check_integrator(Local(), problems=SMOOTH[:1]).notes)


def test_a_wrong_problem_is_told_the_right_ones():
    with pytest.raises(mbd.ModelError, match="did you mean 'row'"):
        check_integrator(Midpoint(), problems=["rows"])
