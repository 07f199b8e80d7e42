"""Laws of integrators."""

import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.errors import ModelError, nearest
from mbd.integrators.base import Integrator
from mbd.state import Mode, State
from mbd.testing.findings import Findings, Verdict
from mbd.testing.problems import PROBLEMS, Problem, broken, problem

ERROR_FLOOR = 1e-11
"""Errors below are round-off, of the scheme or of the reference."""
ORDER_ATOL = 0.15
"""How near the observed order must come to the promised one."""
MODE = Mode()


def check_integrator(
    integrator: Integrator | Callable[[], Integrator],
    *,
    problems: Sequence[str] = tuple(PROBLEMS),
    dt: float = 0.2,
    halvings: int = 4,
) -> Verdict:
    """A scheme has the order it promises, leaves its inputs alone, fails openly, and remembers nothing by itself.

    Parameters
    ----------
    integrator : a scheme, or a function that makes one
    problems : on which it is tried: 'varying mass', 'driven pendulum', 'first-order state', 'row' (left out where
        ``integrator.check(1)`` refuses rows)
    dt, halvings : the steps from which the order is measured, over 2 s

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws.
    """
    scheme = integrator if isinstance(integrator, Integrator) else integrator()
    findings = Findings(f"integrator {scheme!r}")
    for name in problems:
        if name not in PROBLEMS:
            raise ModelError("check_integrator: " + nearest(name, PROBLEMS, "problem", "There are"))
        posed = problem(name, scheme.stabilized)
        refusal = scheme.check(posed.rows) if posed.rows else None
        if refusal:
            findings.note(f"problem '{name}': {refusal}")
            continue
        findings.where = f"problem '{name}', {type(posed.system).__doc__}"
        before = _bytes(findings, scheme)
        with np.errstate(all="ignore"):
            _transaction(findings, scheme, posed, dt)
            _failure(findings, scheme, posed, dt)
            if not findings.broken:
                _advance(findings, scheme, posed, dt)
                _order(findings, scheme, posed, dt, halvings)
        hint = "an integrator holds parameters only; what changes travels in the memory"
        same = before == _bytes(findings, scheme)
        findings.holds("the scheme holds no state", same, "the integrator changed while it stepped", hint)
    return findings.verdict()


def _bytes(findings: Findings, value: Any) -> bytes | None:
    """Everything in a value, to tell whether it was changed."""
    try:
        return pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError):
        findings.note(f"whether {type(value).__name__} is left alone: it does not pickle")
        return None


def _numbers(state: State) -> Vector:
    return np.concatenate([state.q, state.v, state.z])


def _stepped(scheme: Integrator, posed: Problem, state: State, memory: Any, dt: float, steps: int) -> tuple[State, Any]:
    for k in range(steps):
        result = scheme.step(posed.system, state, dt, MODE, memory)
        if not result.report.converged:
            raise AssertionError(
                f"{scheme!r} did not converge in step {k + 1} of size {dt:g} s on {type(posed.system).__doc__}: "
                f"{result.report.message or 'no message'}"
            )
        state, memory = result.state, result.memory
    return state, memory


def _transaction(findings: Findings, scheme: Integrator, posed: Problem, dt: float) -> None:
    """start and step change nothing that was given, and give the same bits again."""
    state = posed.start
    law, hint = "transaction: inputs are left alone", "work on copies: q = state.q + …, never state.q += …"
    first = _numbers(state)
    memory = scheme.start(posed.system, state, MODE, dt)
    findings.equal(law, "state after start()", _numbers(state), first, hint, 0.0)
    state, memory = _stepped(scheme, posed, State(0.0, state.q.copy(), state.v.copy(), state.z.copy()), memory, dt, 2)
    given, held, time = _numbers(state), _bytes(findings, memory), state.time
    result = scheme.step(posed.system, state, dt, MODE, memory)
    findings.equal(law, "state after step()", _numbers(state), given, hint, 0.0)
    same = held == _bytes(findings, memory)
    findings.holds(law, same, "step() changed the memory it was given", "return a new memory with the step")
    findings.equal("a step ends at t + dt", "time", result.state.time, time + dt, "set the time of the state", 1e-12)
    again = scheme.step(posed.system, state, dt, MODE, memory)
    hint = "step() may depend on its arguments alone; nothing may hide on the integrator"
    findings.equal(
        "determinism: the same inputs give the same bits", "state of the step taken again", _numbers(again.state),
        _numbers(result.state), hint, 0.0,
    )  # fmt: skip
    sizes = [len(part) for part in (result.state.q, result.state.v, result.state.z)]
    wanted = [len(part) for part in (posed.start.q, posed.start.v, posed.start.z)]
    findings.equal("q, v and z keep their sizes", "sizes", sizes, wanted, "velocities and states are advanced apart")


def _failure(findings: Findings, scheme: Integrator, posed: Problem, dt: float) -> None:
    """A balance that is not a number: the step fails in its report, or shows it in its state."""
    state = posed.start
    memory = scheme.start(posed.system, state, MODE, dt)
    given, held = _numbers(state), _bytes(findings, memory)
    result = scheme.step(broken(posed.system), state, dt, MODE, memory)
    finite = bool(np.isfinite(_numbers(result.state)).all())
    sentence = "the balance was not a number, and the step reported convergence to a finite state"
    hint = "report converged=False when Newton does not converge; compare with < so that NaN is no success"
    findings.holds("a failed step says so", not (result.report.converged and finite), sentence, hint)
    law, hint = "transaction: a failed step leaves state and memory", "a failed step must change nothing it was given"
    findings.equal(law, "state after the failed step", _numbers(state), given, hint, 0.0)
    same = held == _bytes(findings, memory)
    findings.holds(law, same, "the failed step changed the memory it was given", hint)
    if not result.report.converged:
        returned = result.state
        findings.equal(law, "state returned with the failure", _numbers(returned), given, "return the state given", 0.0)


def _advance(findings: Findings, scheme: Integrator, posed: Problem, dt: float) -> None:
    """Many steps at once are as many steps; a guard stops before what it rejects."""
    memory = scheme.start(posed.system, posed.start, MODE, dt)
    state, _ = _stepped(scheme, posed, posed.start, memory, dt, 5)
    many = scheme.advance(posed.system, posed.start, dt, 5.0 * dt, MODE, memory)
    hint = "advance() must repeat step()"
    findings.equal("advance is a loop of steps", "state", _numbers(many.state), _numbers(state), hint, 1e-12)
    findings.equal("advance is a loop of steps", "count", many.steps, 5, hint)
    barred = scheme.advance(posed.system, posed.start, dt, 5.0 * dt, MODE, memory, lambda now: now.time < 3.5 * dt)
    sentence = f"rejected is {barred.rejected}, the state at t = {barred.state.time:g} (guard holds until {3.5 * dt:g})"
    kept = barred.rejected and abs(barred.state.time - 3.0 * dt) < 1e-9
    findings.holds("a guard stops before the step it rejects", kept, sentence, "return the last accepted state")


def _order(findings: Findings, scheme: Integrator, posed: Problem, dt: float, halvings: int) -> None:
    promised = scheme.order(posed.system)
    hint = "order() must tell what the scheme reaches on this system; check its start, its formula and its tolerance"
    for law, parts in ("order", 1), ("order after a restart", 2):
        errors = []
        for k in range(halvings + 1):
            step, state = dt / 2**k, posed.start
            steps = round(posed.duration / step / parts)
            for _ in range(parts):
                memory = scheme.start(posed.system, state, MODE, step)
                state, _ = _stepped(scheme, posed, state, memory, step, steps)
            errors.append(float(np.max(np.abs(_numbers(state) - posed.end))))
        order = observed_order(errors, ERROR_FLOOR)
        if np.isnan(order):
            findings.note(f"{law} on {findings.where}: every error is below {ERROR_FLOOR:g}; give a larger dt")
            continue
        shown = ", ".join(f"{error:.3g}" for error in errors)
        sentence = f"promised {promised}, observed {order:.2f}; errors at dt = {dt:g}, dt/2, …: {shown}"
        findings.holds(f"{law}: as promised, within {ORDER_ATOL}", abs(order - promised) <= ORDER_ATOL, sentence, hint)


def observed_order(errors: Any, floor: float = 0.0) -> float:
    """log₂ of the last fall of an error under halving of dt, above the floor of round-off; NaN where there is none.

    >>> observed_order([1.0, 0.3, 0.075])
    2.0
    """
    sizes = np.asarray(errors, dtype=float)
    clear = np.flatnonzero((sizes[1:] > floor) & (sizes[:-1] > floor))
    return float(np.log2(sizes[clear[-1]] / sizes[clear[-1] + 1])) if len(clear) else float("nan")
