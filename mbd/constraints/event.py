"""A user's own event."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mbd.bodies.domains import Domain
from mbd.bodies.promises import function_of
from mbd.bodies.values import among, flag, name_of, names_of
from mbd.constraints.base import Constraint
from mbd.constraints.expressions import is_expression, plain
from mbd.constraints.measure import Measure
from mbd.constraints.unilateral import measure_of
from mbd.errors import ModelError
from mbd.forces.quantities import Mention

__all__ = ["Event"]


@dataclass(frozen=True)
class Event(Constraint):
    """Something that happens as a measure crosses zero.

    Parameters
    ----------
    name : its name, under which it stands in the run
    guard : the measure
    reset : named values to set, {'hip.rate': 0.0}, or a function that makes them from named values; None for no change.
        A value may be a function of named values, or a sympy expression: ``{theta.q: -theta.q, phi.v: 0}``
    terminal : whether the run ends there
    direction : −1 as the guard falls through zero, +1 as it rises, 0 both
    """

    name: str
    guard: Measure
    reset: Any = field(default=None, hash=False)
    terminal: bool = False
    direction: int = 0

    def __post_init__(self) -> None:
        name_of(self.name, "Event")
        object.__setattr__(self, "guard", measure_of(self.guard, f"Event '{self.name}'"))
        if not (self.reset is None or isinstance(self.reset, Mapping) or callable(self.reset)):
            raise ModelError(f"reset of Event '{self.name}' maps names to values, got {self.reset!r}")
        if isinstance(self.reset, Mapping):
            named = {str(key) if is_expression(key) else key: plain(value) for key, value in self.reset.items()}
            object.__setattr__(self, "reset", named)
            names_of(self.reset, f"each key of the reset of Event '{self.name}'")
        for value in self.reset.values() if isinstance(self.reset, Mapping) else (self.reset,):
            if callable(value) and not is_expression(value):
                function_of(value, f"reset of Event '{self.name}'", "named")
        object.__setattr__(self, "terminal", flag(self.terminal, f"terminal of Event '{self.name}'"))
        if not among(self.direction, (-1, 0, 1)):
            raise ModelError(f"direction of Event '{self.name}' is -1, 0 or 1, got {self.direction!r}")

    @property
    def kind(self) -> str:
        """'event'."""
        return "event"

    @property
    def details(self) -> str:
        """Nothing more."""
        return ""

    def mentions(self) -> list[Mention]:
        """What its guard depends on, and the names that it resets."""
        return [*self.guard.mentions(), *(self.reset if isinstance(self.reset, Mapping) else ())]

    def parameters(self) -> dict[str, float]:
        """Those of its guard."""
        return self.guard.parameters()

    def domains(self) -> dict[str, Domain]:
        """Those of its guard."""
        return self.guard.domains()

    def faults(self) -> list[str]:
        """Those of its guard."""
        return self.guard.faults(self.name)
