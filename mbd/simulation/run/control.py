"""Between the calls of the kernel: controllers, resets of users' events, and instants that must be step boundaries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import is_finite_number
from mbd.compile.mechanism import rate_names
from mbd.compile.python import scalar_function
from mbd.constraints.expressions import evaluated, is_expression
from mbd.equations.equations import Guard
from mbd.errors import ModelError, SimulationError, UnknownNameError, nearest
from mbd.kernel import fields as F
from mbd.simulation.asked import asked
from mbd.simulation.parameters import residuals_now, violations_now
from mbd.simulation.run.memory import without_sharing

if TYPE_CHECKING:
    from mbd.simulation.run.run import Run

__all__ = ["Boundaries", "Named", "apply_reset"]


class Named(Mapping[str, float]):
    """Any named quantity at the present state of a run, evaluated when it is asked for."""

    def __init__(self, run: Run) -> None:
        self._run = run

    def __getitem__(self, name: str) -> float:
        run = self._run
        mechanism, v = run.mechanism, run.values
        known = mechanism.named.get(name)
        if known is None and name not in mechanism.equations.output_names():
            given = {**run.model.parameters, **run.changed}.get(name)
            if given is not None:
                return float(given)
        if known is None:
            with mechanism.equations.tape.lock:
                output = mechanism.equations.output(name)
                known = mechanism.named[name] = scalar_function([output], mechanism.layout, "named")
        layout, flags = mechanism.layout, v["closed"][: v["n_contacts"]]
        block = mechanism.block(
            run.now, v["q"][: v["n_q"]], v["y"][: v["n"]], v["anchors"][: v["n_anchors"]], run.manager.penalties(flags)
        )
        block[layout.a : layout.lam] = v["rate"][: v["n"]]
        block[layout.lam : layout.anchor] = v["lam"][: v["n_rows"]]
        out = np.zeros(1)
        known(block, v["params"], out)
        return float(out[0])

    def __iter__(self) -> Iterator[str]:
        return iter(self._run.mechanism.equations.output_names())

    def __len__(self) -> int:
        return len(self._run.mechanism.equations.output_names())


def apply_reset(run: Run, guard: Guard) -> None:
    """Set the coordinates and rates that a user's event resets; rows must still hold."""
    what = f"the reset of {guard.name!r} at t = {run.now:.6g} s"
    wanted = _finite_numbers(f"{what} sets", asked(what, _reset_values, guard.reset, run.named()))
    equations, v = run.mechanism.equations, run.values
    usual = residuals_now(run)[:2]
    positions = {coordinate.name: k for k, coordinate in enumerate(equations.coordinates)}
    rates = {name: k for name, k in rate_names(equations).items() if name not in positions}
    states = {state.name: equations.n_v + k for k, state in enumerate(equations.states)}
    places = rates | states
    wanted = {_spelled(name, places): number for name, number in wanted.items()}
    unknown = [name for name in wanted if name not in positions and name not in places]
    if unknown:
        raise UnknownNameError(f"{what}: " + nearest(unknown[0], [*positions, *places], "quantity"))
    for name, number in wanted.items():
        if name in positions:
            v["q"][positions[name]] = number
        else:
            v["y"][places[name]] = number
    off = violations_now(run, residuals_now(run), usual)
    if off:
        raise SimulationError(f"{what} breaks constraints: {'; '.join(off)}; reset all that they bind, velocities too")


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


NEAR = 8.0 * F.EPS
"""Two instants are one where they differ by less, relative: round-off of a sum of steps [-]."""
CROWD = 32
"""Breaks within 64 steps before and after one, above which it is stepped over as one of a dense signal."""


def _sparse(instants: Vector, dt: float) -> Vector:
    """The breaks at which steps end: not those of samples about as dense as the steps.

    Judged around each of them, so that it does not depend on where a run begins or ends.
    """
    if not len(instants):
        return instants
    window = 64.0 * dt
    around = np.searchsorted(instants, instants + window) - np.searchsorted(instants, instants - window)
    return np.asarray(instants[around <= CROWD])


class Boundaries:
    """Instants at which a step must end: samples of controllers, jumps and kinks of signals in time."""

    def __init__(
        self, controllers: Sequence[Any], instants: Sequence[float], begin: float, dt: float, end: float
    ) -> None:
        self.controllers = tuple(controllers)
        fast = [c for c in self.controllers if c.period is not None and c.period < 1e-6 * dt]
        if fast:
            raise ModelError(
                [f"the period of {c.name!r}, {c.period:g} s, is far below dt = {dt:g} s; lower dt too" for c in fast]
            )
        self.states = {controller.name: without_sharing(controller.state) for controller in self.controllers}
        self.begin_time = begin
        self.samples = {c.name: 0 for c in self.controllers if c.period is not None}
        self.breaks = _sparse(np.asarray(instants, dtype=float), dt)
        self.place = int(np.searchsorted(self.breaks, begin, side="right"))
        self.near = min(NEAR * abs(end), 1e-6 * dt)

    # what a run keeps of it -----------------------------------------------------------------------------------------
    def kept(self) -> tuple[Any, ...]:
        """What changes as the run goes on; for `restore`."""
        return self.begin_time, self.samples, self.states, self.place

    def restore(self, kept: tuple[Any, ...]) -> None:
        """As it was."""
        self.begin_time, self.samples, self.states, self.place = kept

    def remembered(self) -> dict[str, Any]:
        """For a run that goes on from here."""
        return {"begin": self.begin_time, "samples": dict(self.samples), "states": without_sharing(self.states)}

    def take_up(self, remembered: Mapping[str, Any], now: float) -> None:
        """Go on with the samples and states of an earlier run."""
        self.begin_time, self.samples = remembered["begin"], dict(remembered["samples"])
        self.states = without_sharing(dict(remembered["states"]))
        self.place = int(np.searchsorted(self.breaks, now, side="right"))

    # the run --------------------------------------------------------------------------------------------------------
    def _sample(self, controller: Any) -> float:
        return float(self.begin_time + self.samples[controller.name] * controller.period)

    def _count(self, controller: Any) -> None:
        self.samples = {**self.samples, controller.name: self.samples[controller.name] + 1}

    def begin(self, run: Run) -> None:
        """The first call of every sampled controller; names that no result has are errors before the first step."""
        for controller in self.controllers:
            for name in controller.reads:
                run.mechanism.equations.output(name)
        for controller in self.controllers:
            if controller.period is not None:
                self._call(run, controller)
                self._count(controller)

    def next(self, end: float) -> tuple[float, bool]:
        """Where the kernel must stop next, and whether a boundary is there; one at round-off of the end is the end.

        Just before a break, so that the step sees its left side.
        """
        due = [float(np.nextafter(time, -np.inf)) for time in self.breaks[self.place : self.place + 1]]
        due += [self._sample(controller) for controller in self.controllers if controller.period is not None]
        first = min(due, default=np.inf)
        return (first, True) if first <= end + self.near else (end, False)

    def arrive(self, run: Run, target: float, end: float) -> bool:
        """Do what is due at a boundary; False at the end of the run, where it is left to a run that goes on."""
        if target >= end - self.near:
            return False
        if self.place < len(self.breaks) and self.breaks[self.place] <= np.nextafter(target, np.inf):
            run.move_to(float(self.breaks[self.place]))
            self.place += 1
            run.values["state"][F.RESTART] = 1
        for controller in self.controllers:
            if controller.period is not None and self._sample(controller) <= target:
                self._call(run, controller)
                self._count(controller)
        return True

    def call(self, run: Run, name: str) -> None:
        """Call the controllers that listen to an event."""
        for controller in self.controllers:
            if name in controller.on:
                self._call(run, controller)

    def _call(self, run: Run, controller: Any) -> None:
        named = run.named()
        what = f"Controller {controller.name!r} at t = {run.now:.6g} s"
        values = Readings(what, {name: named[name] for name in controller.reads})
        state = without_sharing(self.states[controller.name])  # the one before the call stays as it was
        answer = asked(what, controller.update, run.now, values, state)
        if isinstance(answer, tuple) and len(answer) == 2:
            answer, state = answer
        written = _written(what, answer, controller.writes)
        self.states = {**self.states, controller.name: state}
        if written:
            run.change_parameters(written, what)
