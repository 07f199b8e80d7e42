"""Quantities that depend on the state of a mode: one for each state, of which that of now acts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from mbd.bodies.values import is_number
from mbd.errors import ModelError, nearest
from mbd.scope import Scope
from mbd.tape.node import Scalar
from mbd.tape.selection import by_state

__all__ = ["ByMode", "by_mode_of"]


@dataclass(frozen=True)
class ByMode:
    """The quantity of each state; in states without one there is none, which is 0.

    mode : name of the mode; values : (state, quantity)
    """

    mode: str
    values: tuple[tuple[str, Any], ...]

    def select(self, scope: Scope, what: str, of_state: Callable[[str, Any], Scalar], otherwise: Scalar) -> Scalar:
        """What `of_state` makes of the quantity of the present state; `otherwise` in states that have none.

        Raises
        ------
        ModelError
            for a mode or a state that does not exist.
        """
        states = scope.state_names(self.mode)
        unknown = [state for state, _ in self.values if state not in states]
        if unknown:
            named = [nearest(state, states, "state", f"{self.mode!r} has") for state in unknown]
            raise ModelError([f"{what}: {each}" for each in named])
        found = {state: of_state(state, value) for state, value in self.values}
        return by_state(scope.named(self.mode), [found.get(state, otherwise) for state in states])

    def numbers(self) -> dict[str, float]:
        """Those of its quantities that are numbers, by state."""
        return {state: float(value) for state, value in self.values if is_number(value)}


def by_mode_of(value: Any, by: Any, what: str, each: Callable[[Any, str], Any]) -> Any:
    """A quantity, or one for each state of the mode `by`, checked at the border by `each`."""
    if isinstance(value, ByMode):
        return value
    if not isinstance(value, Mapping):
        return each(value, what)
    if not isinstance(by, str) or not by:
        raise ModelError(f"{what} is given by state; name the mode too: by='knee phase'")
    if not value or not all(isinstance(state, str) for state in value):
        raise ModelError(f"{what} by {by!r} maps names of states to quantities, got {value!r}")
    return ByMode(by, tuple((state, each(part, f"{what} in {state!r}")) for state, part in value.items()))
