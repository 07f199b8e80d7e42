"""Decisions in plain Python at sample instants and events."""

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any

from mbd.bodies.promises import function_of
from mbd.bodies.values import name_of, names_of, number
from mbd.dataclass import dataclass
from mbd.errors import ModelError

Update = Callable[[float, Mapping[str, float], Any], Any]
"""``update(time, values, state)`` → the parameters to write {name: value}, or (that, next state)."""


@dataclass(frozen=True)
class Controller:
    """A function that is called at sample instants and events, and writes parameters: the state machine of a knee.

    Its instants are step boundaries. It keeps nothing itself: its state travels through its arguments.

    Parameters
    ----------
    name : its name
    update : ``update(time, values, state)`` gives the parameters to write {name: value}, or (that, next state)
    period : time between samples [s]; None for events only
    on : names of contacts, as which close, and of events, as which happen, it is called
    reads : names of the quantities in `values`
    writes : names of the parameters that it may write
    state : what the first call receives
    """

    name: str
    update: Update
    period: float | None = None
    on: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    state: Any = field(default=None, hash=False)

    def __post_init__(self) -> None:
        name_of(self.name, "Controller")
        put = object.__setattr__
        for names in ("on", "reads", "writes"):
            put(self, names, names_of(getattr(self, names), f"{names} of Controller '{self.name}'"))
        if not callable(self.update):
            raise ModelError(f"Controller '{self.name}' needs update(time, values, state), got {self.update!r}")
        function_of(self.update, f"Controller '{self.name}'", "time", "values", "state")
        if self.period is not None:
            put(self, "period", number(self.period, f"period of '{self.name}'"))
            if self.period <= 0.0:
                raise ModelError(f"period of Controller '{self.name}' must be positive, got {self.period:g}")
        elif not self.on:
            raise ModelError(f"Controller '{self.name}' is never called: give a period or on=('left foot', …)")
