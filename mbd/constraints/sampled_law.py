"""Feedback that is computed at sample instants and held between them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from mbd.bodies.domains import Domain, at_least_zero, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of, names_of, number
from mbd.constraints.machine import SEPARATOR, Change, Machine
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest
from mbd.forces.quantities import Mention, arguments_of, mentioned, resolved
from mbd.tape.functions import floor
from mbd.tape.node import Node, Scalar
from mbd.tape.tracing import traced_scalar

INDEX, NEXT, FIRST = 0, 1, 2
"""Numbers that a sampled law holds: whether it waits to put out, when its next sample is, then its values."""

MAX_WAITS = 1000
"""Periods of a delay at most, each of which keeps its outputs [-]."""


@dataclass(frozen=True)
class SampledLaw(Machine):
    """Difference equations ``u_k = f(y_k, x_k)``, ``x_{k+1} = g(y_k, x_k)`` of samples y_k, with outputs that are held.

    The first sample is that of the start, with the parameters of the run; one that falls on the end of a run is taken
    there, and not again by a run that continues. Steps end at samples, whose instants are exact. Functions are traced,
    so that they run in machine code, and gaits and derivatives know them. Decisions of any kind in Python are a
    `mbd.Controller`.

    Parameters
    ----------
    name : its name
    period : time between samples [s]; the parameter 'name.period'
    outputs : functions u by what they set: parameters of the model ('knee motor.torque'), or labels of its own ('u'),
        which laws know as 'name.u'
    arguments : what all functions are called with, in order: names of quantities, its states ('name.sum') among them,
        frames, joints, or (label, number) for a parameter
    states : functions x_{k+1} by label; their values are the quantities 'name.label'
    start : the x_0 of states by label; 0 where they are left out
    delay : time from a sample to its outputs [s], up to 1000 periods. Until the first outputs a parameter has its own
        value, an output of its own is 0. A whole number of periods is a number of samples, also where the period is
        changed; any other delay is the parameter 'name.delay', with as many samples between it and the period
    resolution : steps to which values are rounded, of outputs and of arguments by their names: {'knee.angle': 1e-3}
    restart_on : names of contacts, events or states of modes: a sample is taken as they happen, and the next one a
        period later, so that the samples of each step are the same. A gait without it lasts a whole number of samples

    Raises
    ------
    ModelError
        for a period that is not positive, for states and labels that do not exist, and what is no function.

    Examples
    --------
    >>> import mbd
    >>> mbd.SampledLaw(
    ...     "PD", 0.01, {"knee motor.torque": lambda q, v: -20.0 * q - v}, arguments=("knee.angle", "knee.rate"),
    ... ).parameters()
    {'PD.period': 0.01}
    """

    name: str
    period: float
    outputs: Mapping[str, Any] = field(hash=False)
    arguments: Any = ()
    states: Mapping[str, Any] = field(default_factory=dict, hash=False)
    start: Mapping[str, float] = field(default_factory=dict, hash=False)
    delay: float = 0.0
    resolution: Mapping[str, float] = field(default_factory=dict, hash=False)
    restart_on: Sequence[str] = ()

    reads_before = True  # a sample reads what was before its outputs change

    def __post_init__(self) -> None:
        put, title = object.__setattr__, f"SampledLaw '{self.name}'"
        name_of(self.name, "SampledLaw")
        put(self, "period", number(self.period, f"period of {title}"))
        put(self, "delay", number(self.delay, f"delay of {title}"))
        if self.period <= 0.0:
            raise ModelError(f"the period of {title}, {self.period:g} s, is not positive; give a time > 0")
        if self.delay < 0.0:
            raise ModelError(f"the delay of {title}, {self.delay:g} s, is negative; give a time ≥ 0")
        if self.delay > MAX_WAITS * self.period:
            raise ModelError(f"the delay of {title}, {self.delay:g} s, is more than {MAX_WAITS} periods of "
                             f"{self.period:g} s, of which each keeps its outputs; give a longer period")  # fmt: skip
        put(self, "arguments", arguments_of(self.arguments, title))
        for kind in ("outputs", "states"):
            given = getattr(self, kind)
            if not isinstance(given, Mapping) or not all(isinstance(name, str) and name for name in given):
                raise ModelError(f"{kind} of {title} map names to functions, such as {{'u': f}}, got {given!r}")
            wrong = [name for name, law in given.items() if not (callable(law) or hasattr(law, "free_symbols"))]
            if wrong:
                raise ModelError(f"{title}: {wrong[0]!r} is given by {given[wrong[0]]!r}; give a function")
            put(self, kind, dict(given))
        if not self.outputs:
            raise ModelError(f"{title} has no outputs; give at least one, such as {{'knee motor.torque': f}}")
        for kind in ("start", "resolution"):
            given = getattr(self, kind)
            if not isinstance(given, Mapping) or not all(isinstance(name, str) and name for name in given):
                raise ModelError(f"{kind} of {title} maps names to numbers, got {given!r}")
        put(self, "start", {name: number(x, f"start of {name!r} of {title}") for name, x in self.start.items()})
        put(self, "resolution", {name: number(x, f"resolution of {name!r}") for name, x in self.resolution.items()})
        on = (self.restart_on,) if isinstance(self.restart_on, str) else self.restart_on
        put(self, "restart_on", names_of(on, f"restart_on of {title}"))
        if faults := list(self._name_faults()):
            raise ModelError(faults)

    def _name_faults(self) -> Iterable[str]:
        """Names of what there is not, and steps that are none."""
        labels = [label for label, _ in self.arguments]
        for name in self.start:
            if name not in self.states:
                yield f"SampledLaw '{self.name}', start: " + nearest(name, self.states, "state", "There are")
        for name, step in self.resolution.items():
            if name not in (*labels, *self.outputs):
                known = [*self.outputs, *labels]
                yield f"SampledLaw '{self.name}', resolution: " + nearest(
                    name, known, "output or argument", "There are"
                )
            if step <= 0.0:
                yield f"SampledLaw '{self.name}': the resolution of {name!r}, {step:g}, is not positive"
        for name in (*self.own_outputs, *self.states):
            if name in ("period", "delay", *labels) or (name in self.states and name in self.outputs):
                yield f"SampledLaw '{self.name}': {name!r} names two things; rename one"

    # what it holds --------------------------------------------------------------------------------------------------
    @property
    def own_outputs(self) -> tuple[str, ...]:
        """Outputs that are no parameters of other words."""
        return tuple(name for name in self.outputs if "." not in name)

    @property
    def waits(self) -> int:
        """Registers that each output passes before it is put out."""
        return math.ceil(self.delay / self.period - 1e-9)

    @property
    def puts_out_late(self) -> bool:
        """Whether outputs come between samples."""
        return self.waits > 0 and self.delay < (self.waits - 1e-9) * self.period

    @property
    def state_names(self) -> tuple[str, ...]:
        """'sampling', and where outputs come between samples 'computed', from a sample to the outputs."""
        return ("sampling", "computed") if self.puts_out_late else ("sampling",)

    @property
    def fields(self) -> tuple[str, ...]:
        """'index', 'next', the outputs, what comes before them with a delay, and the states."""
        registers = tuple(f"{name} {k}" for k in range(1, self.waits + 1) for name in self.outputs)
        return ("index", "next", *self.outputs, *registers, *self.states)

    @property
    def times(self) -> tuple[int, ...]:
        """When its next sample is."""
        return (NEXT,)

    def initial(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """Own values of the parameters that it sets, states as they start."""
        outputs = [values.get(name, 0.0) for name in self.outputs] * (1 + self.waits)
        return (float(self.puts_out_late), 0.0, *outputs, *(self.start.get(name, 0.0) for name in self.states))

    @property
    def quantity_names(self) -> tuple[str, ...]:
        """Its own outputs and its states: 'PD.u', 'PD.sum'."""
        return tuple(f"{self.name}.{name}" for name in (*self.own_outputs, *self.states))

    def quantities(self, scope: Scope, held: Sequence[Node]) -> Mapping[str, Scalar]:
        """Its own outputs and its states."""
        place = {name: k for k, name in enumerate(self.fields)}
        return {f"{self.name}.{name}": held[place[name]] for name in (*self.own_outputs, *self.states)}

    def held_parameters(self) -> Mapping[str, int]:
        """The parameters that it sets."""
        return {name: FIRST + k for k, name in enumerate(self.outputs) if "." in name}

    def without_parameters(self, known: Collection[str]) -> SampledLaw | None:
        """Without the outputs that would be set in vain."""
        left = {name: law for name, law in self.outputs.items() if "." not in name or name in known}
        if len(left) == len(self.outputs) or not left:
            return self if left else None
        gone = set(self.outputs) - set(left)
        steps = {name: step for name, step in self.resolution.items() if name not in gone}
        return replace(self, outputs=left, resolution=steps)

    # how it changes -------------------------------------------------------------------------------------------------
    def changes(self, scope: Scope, held: Sequence[Node]) -> Sequence[Change]:
        """Its samples, those that restart it, and its outputs where they come later."""
        period, sampled = scope.parameter(self.name, "period", self.period), self.first_values(scope, held)
        computed = int(self.puts_out_late)
        since_next = scope.time - held[NEXT]
        found = [Change(f"{self.name}{SEPARATOR}sample", 0, computed, since_next, 1, stored=sampled, timed=True)]
        for name in self.restart_on:
            title = f"{self.name}{SEPARATOR}restart by {name}"
            names = (title, f"{title} (2)")[: computed + 1]
            found += [Change(each, k, computed, on=name, stored=sampled) for k, each in enumerate(names)]
        if computed:
            late = scope.parameter(self.name, "delay", self.delay) - (self.waits - 1) * period
            put_out = {FIRST + k: held[FIRST + len(self.outputs) * self.waits + k] for k in range(len(self.outputs))}
            since_put_out = since_next + (period - late)
            found.append(Change(
                f"{self.name}{SEPARATOR}output", 1, 0, since_put_out, 1, stored=put_out, timed=True
            ))  # fmt: skip
        return found

    def first_values(self, scope: Scope, held: Sequence[Node]) -> Mapping[int, Scalar]:
        """What a sample stores: the next instant, outputs or the first registers, the others moved on, states."""
        given = [(label, self._rounded(label, value)) for label, value in resolved(self.arguments, scope, self.name)]
        count, place = len(self.outputs), {name: k for k, name in enumerate(self.fields)}
        found: dict[int, Scalar] = {NEXT: scope.time + scope.parameter(self.name, "period", self.period)}
        for k, (name, law) in enumerate(self.outputs.items()):
            value = traced_scalar(law, given, f"{name!r} of SampledLaw '{self.name}'", scope.tape)
            found[FIRST + k + (count if self.waits else 0)] = self._rounded(name, value)
            if self.waits and not self.puts_out_late:
                found[FIRST + k] = held[FIRST + k + self.waits * count]
            for register in range(2, self.waits + 1):
                found[FIRST + k + register * count] = held[FIRST + k + (register - 1) * count]
        for name, law in self.states.items():
            found[place[name]] = traced_scalar(law, given, f"{name!r} of SampledLaw '{self.name}'", scope.tape)
        return found

    def _rounded(self, name: str, value: Any) -> Any:
        """A value, or the components of one, rounded to its resolution."""
        step = self.resolution.get(name)
        if step is None:
            return value
        if isinstance(value, tuple | list):
            return tuple(self._rounded(name, each) for each in value)
        return step * floor(value / step + 0.5)

    # the promise of words -------------------------------------------------------------------------------------------
    def mentions(self) -> list[Mention]:
        """What its functions are called with."""
        return mentioned(self.arguments)

    @property
    def details(self) -> str:
        """Its period and outputs."""
        return f", every {self.period:g} s, sets {', '.join(map(repr, self.outputs))}"

    def parameters(self) -> dict[str, float]:
        """'name.period', 'name.delay' of outputs between samples, and arguments given as numbers."""
        found = {f"{self.name}.period": self.period}
        found |= {f"{self.name}.delay": self.delay} if self.puts_out_late else {}
        return found | {f"{self.name}.{label}": x for label, x in self.arguments if isinstance(x, float)}

    def domains(self) -> dict[str, Domain]:
        """Periods are positive."""
        return {f"{self.name}.period": positive("is not positive; give a time > 0", "s"),
                f"{self.name}.delay": at_least_zero("is negative; give a time ≥ 0", "s")}  # fmt: skip

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        """Those of its numbers, and a delay of more or fewer samples than it was made for."""
        found = super().value_faults(values)
        if found or not self.puts_out_late:
            return found
        period, delay = values[f"{self.name}.period"], values[f"{self.name}.delay"]
        if self.waits - 1 - 1e-9 <= delay / period <= self.waits + 1e-9:
            return []
        return [
            f"SampledLaw '{self.name}': '{self.name}.delay' must be {self.waits - 1} to {self.waits} periods, as in "
            f"the model, got {delay:g} s with '{self.name}.period' {period:g} s; make a model with a SampledLaw of "
            "these values"
        ]
