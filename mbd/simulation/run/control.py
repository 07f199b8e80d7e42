"""Between the calls of the kernel: controllers, resets of users' events, and instants that must be step boundaries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mbd.bodies.values import is_finite_number
from mbd.compile.mechanism import rate_names
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.constraints.expressions import evaluated, is_expression
from mbd.equal import EQUAL_RTOL
from mbd.equations.equations import Equations, Guard
from mbd.errors import ModelError, SimulationError, UnknownNameError, nearest
from mbd.simulation.run.boundaries import RESTARTS, without_sharing
from mbd.simulation.run.data import RunData
from mbd.simulation.run.parameters import change_parameters, residuals_now, violations_now
from mbd.simulation.run.user_calls import call_user

PRESCRIBED_JUMP = (
    "t = {:.9g} s: a prescribed motion jumps there, which would need an infinite force: {}; let its value and its rate "
    "be continuous. Samples are constant before the first and after the last: end the run there, repeat them with "
    "periodic=True, or let them begin and end at rest with ends='clamped'"
)


class Named(Mapping[str, float]):
    """Any named quantity at the present state of a run, evaluated when it is asked for."""

    def __init__(self, run: RunData) -> None:
        self._run = run

    def __getitem__(self, name: str) -> float:
        run = self._run
        mechanism, v = run.mechanism, run.kernel

        def made() -> ScalarFunction | None:
            equations = mechanism.equations
            if name not in equations.output_names() and name in {**run.model.parameters, **run.changed}:
                return None
            return scalar_function([equations.output(name)], mechanism.layout, "named")

        value = mechanism.kept((Named, name), made)
        if value is None:
            return float({**run.model.parameters, **run.changed}[name])
        layout, flags = mechanism.layout, v.closed[: v.n_contacts]
        block = mechanism.block(
            run.now, v.q[: v.n_q], v.y[: v.n], v.anchors[: v.n_anchors], run.manager.penalties(flags)
        )
        block[layout.a : layout.lam] = v.rate[: v.n]
        block[layout.lam : layout.anchor] = v.lam[: v.n_rows]
        out = np.zeros(1)
        value(block, v.params, out)
        return float(out[0])

    def __iter__(self) -> Iterator[str]:
        return iter(self._run.mechanism.equations.output_names())

    def __len__(self) -> int:
        return len(self._run.mechanism.equations.output_names())


def apply_reset(run: RunData, guard: Guard) -> None:
    """Set the coordinates and rates that a user's event resets; rows must still hold."""
    what = f"the reset of {guard.name!r} at t = {run.now:.6g} s"
    wanted = _finite_numbers(f"{what} sets", call_user(what, _reset_values, guard.reset, Named(run)))
    equations, v = run.mechanism.equations, run.kernel
    usual = residuals_now(run)[:2]
    positions = {coordinate.name: k for k, coordinate in enumerate(equations.coordinates)}
    rates = {name: k for name, k in rate_names(equations).items() if name not in positions}
    states = {state.name: equations.n_v + k for k, state in enumerate(equations.states)}
    places = rates | states
    wanted = {_spelled(name, places): number for name, number in wanted.items()}
    unknown = _not_reset(equations, wanted, f"{what}: ")
    if unknown:
        raise UnknownNameError(unknown)
    for name, number in wanted.items():
        if name in positions:
            v.q[positions[name]] = number
        else:
            v.y[places[name]] = number
    if misplaced := equations.configuration.misplaced(v.q, EQUAL_RTOL):
        raise SimulationError(f"{what} gives {'; '.join(misplaced)}")
    off = violations_now(run, residuals_now(run), usual)
    if off:
        raise SimulationError(f"{what} breaks constraints: {'; '.join(off)}; reset all that they bind, velocities too")


def reset_faults(equations: Equations) -> list[str]:
    """What is wrong with the names that events reset, as far as they are known before a run."""
    return [
        fault
        for guard in equations.guards
        if isinstance(guard.reset, Mapping)
        for fault in _not_reset(equations, guard.reset, f"the reset of {guard.name!r}: ")
    ]


def _not_reset(equations: Equations, wanted: Iterable[str], what: str) -> list[str]:
    """Names among those `wanted` that are no coordinate, rate or state, with what to reset in their place."""
    known = [coordinate.name for coordinate in equations.coordinates]
    known += [*rate_names(equations), *(state.name for state in equations.states)]
    places = dict.fromkeys(known, 0)
    known, faults = list(places), []
    for name in wanted:
        if _spelled(name, places) in places:
            continue
        if any(name == machine.name or name.startswith(f"{machine.name}.") for machine in equations.machines):
            faults.append(
                f"{what}{name!r} is held by a mode or a sampled law; let a mbd.Transition on= the event change it"
            )
        elif name in equations.output_names():
            faults.append(
                f"{what}{name!r} is a result, such as what a cut joint or a place has, and cannot be set; reset the "
                f"coordinates and rates that it follows from: {', '.join(map(repr, known[:12]))}"
                f"{', …' if len(known) > 12 else ''}"
            )
        else:
            faults.append(what + nearest(name, known, "quantity"))
    return faults


def _spelled(name: str, rates: Mapping[str, int]) -> str:
    """'theta.rate' where a reset says 'theta_rate', as its symbol in energies is called."""
    rate = f"{name.removesuffix('_rate')}.rate"
    return rate if name.endswith("_rate") and name not in rates and rate in rates else name


def _reset_values(reset: Any, named: Named) -> dict[str, Any]:
    """What a reset sets, by name."""
    wanted = reset(named) if callable(reset) else reset
    if not isinstance(wanted, Mapping):
        raise ModelError(f"a reset maps names to values, such as {{'hip.rate': 0.0}}, not {wanted!r}")
    return {name: _reset_value(value, named) for name, value in wanted.items()}


def _reset_value(value: Any, named: Named) -> Any:
    """A value that a reset sets: a number, an expression or a function of named values before it."""
    if is_expression(value):
        return evaluated(value, named)
    return value(named) if callable(value) else value


def _finite_numbers(what: str, values: Mapping[str, Any]) -> dict[str, float]:
    """Values that users' functions gave, by name, as floats."""
    for name, value in values.items():
        if not is_finite_number(value):
            raise SimulationError(f"{what} {name!r} to {value!r}; give a finite number")
    return {name: float(value) for name, value in values.items()}


class Readings(dict[str, float]):
    """What a controller reads, by name; a name that it does not read is an error that says so."""

    def __init__(self, owner: str, values: Mapping[str, float]) -> None:
        super().__init__(values)
        self._owner = owner

    def __missing__(self, name: str) -> float:
        raise UnknownNameError(nearest(name, self, "entry of reads", "It reads") + "; name it in reads=")


def _written(what: str, answer: Any, writes: Sequence[str]) -> dict[str, float]:
    """The parameters that a controller's answer writes, by name; None writes nothing."""
    answer = {} if answer is None else answer
    if not isinstance(answer, Mapping):
        raise SimulationError(
            f"{what} must return the parameters to write, such as {{{writes[0] if writes else 'name'!r}: 1.0}}, None, "
            f"or the pair (these, next state); it returned {answer!r}"
        )
    wrong = [name for name in answer if name not in writes]
    if wrong:
        raise UnknownNameError(f"{what}: " + nearest(wrong[0], writes, "entry of writes", "It may write"))
    return _finite_numbers(f"{what} sets", answer)


def begin_controllers(run: RunData) -> None:
    """The first call of every sampled controller; names that no result has are errors before the first step."""
    boundaries = run.boundaries
    for controller in boundaries.controllers:
        for name in controller.reads:
            run.mechanism.equations.output(name)
    for controller in boundaries.controllers:
        if controller.period is not None:
            _call(run, controller)
            boundaries.count(controller)


def arrive(run: RunData, target: float) -> None:
    """Do what is due at a boundary before the end of the run."""
    boundaries = run.boundaries
    jump = boundaries.ahead
    if jump is not None and jump.left <= target:
        boundaries.place += 1
        if jump.level <= RESTARTS:
            usual = residuals_now(run)[:2] if jump.owner else None
            run.move_to(jump.right)
            run.kernel.restart_due = 1
            off = violations_now(run, residuals_now(run), usual) if jump.owner else []
            if off:
                raise SimulationError(PRESCRIBED_JUMP.format(run.now, "; ".join(off)))
    for controller in boundaries.controllers:
        if controller.period is not None and boundaries.sample(controller) <= target:
            _call(run, controller)
            boundaries.count(controller)


def call_controllers(run: RunData, name: str) -> None:
    """Call the controllers that listen to an event."""
    for controller in run.boundaries.controllers:
        if any(run.manager.happens(each, name) for each in controller.on):
            _call(run, controller)


def _call(run: RunData, controller: Any) -> None:
    boundaries, named = run.boundaries, Named(run)
    what = f"Controller {controller.name!r} at t = {run.now:.6g} s"
    values = Readings(what, {name: named[name] for name in controller.reads})
    state = without_sharing(boundaries.states[controller.name])  # the one before the call stays as it was
    answer = call_user(what, controller.update, run.now, values, state)
    if isinstance(answer, tuple) and len(answer) == 2:
        answer, state = answer
    written = _written(what, answer, controller.writes)
    boundaries.states = {**boundaries.states, controller.name: state}
    if written:
        change_parameters(run, written, what)
