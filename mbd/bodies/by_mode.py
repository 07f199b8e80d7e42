"""Quantities that depend on the state of a mode: one for each state, of which that of now acts."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest
from mbd.tape.node import Node, Scalar
from mbd.tape.selection import by_state


class Modes(Protocol):
    """What of a `mbd.bodies.scope.Scope` is asked here."""

    def state_names(self, mode: str) -> Sequence[str]:
        """The states of a mode."""

    def named(self, name: str) -> Node:
        """A named quantity, the number of a state among them."""

    def parameter(self, owner: str, field: str, value: float) -> Node:
        """A run-time parameter."""


@dataclass(frozen=True)
class ByMode:
    """The quantity of each state; in states without one there is none, which is 0.

    mode : name of the mode; values : (state, quantity)
    """

    mode: str
    values: tuple[tuple[str, Any], ...]

    def select(
        self, scope: Modes, what: str, of_state: Callable[[str, Any], Scalar], otherwise: Scalar | None
    ) -> Scalar:  # fmt: skip
        """What `of_state` makes of the quantity of the present state; `otherwise` in states that have none.

        Raises
        ------
        ModelError
            for a mode or a state that does not exist, and states without a quantity where `otherwise` is None.
        """
        states = scope.state_names(self.mode)
        unknown = [state for state, _ in self.values if state not in states]
        if unknown:
            named = [nearest(state, states, "state", f"{self.mode!r} has") for state in unknown]
            raise ModelError([f"{what}: {each}" for each in named])
        missing = [state for state in states if state not in dict(self.values)]
        if missing and otherwise is None:
            raise ModelError(
                f"{what} has no value for {', '.join(map(repr, missing))} of {self.mode!r}; give one for each"
            )
        found = {state: of_state(state, value) for state, value in self.values}
        return by_state(
            scope.named(self.mode), [found.get(state, 0.0 if otherwise is None else otherwise) for state in states]
        )


def by_mode_of(value: Any, by: Any, what: str, each: Callable[[Any, str], Any]) -> Any:
    """A quantity, or one for each state of the mode `by`, checked at the border by `each`."""
    if isinstance(value, ByMode):
        return value
    if not isinstance(value, Mapping):
        if by is not None and (not isinstance(by, str) or not by):
            raise ModelError(f"{what}: by is the name of a mode, got {by!r}")
        return each(value, what)
    if not isinstance(by, str) or not by:
        raise ModelError(f"{what} is given by state; name the mode too: by='knee phase'")
    if not value or not all(isinstance(state, str) for state in value):
        raise ModelError(f"{what} by {by!r} maps names of states to quantities, got {value!r}")
    return ByMode(by, tuple((state, each(part, f"{what} in {state!r}")) for state, part in value.items()))


def require_use(by: Any, what: str, *values: Any) -> None:
    """Raise a `ModelError` where a mode is named and none of the quantities is given by its states."""
    if by is not None and not any(isinstance(value, ByMode) for value in values):
        raise ModelError(f"{what} has by={by!r}, but nothing by state: give {{state: value}}, or leave out by=")


def number_by_mode(value: Any, by: Any, what: str) -> Any:
    """A number, or one for each state of the mode `by`."""
    return by_mode_of(value, by, what, number)


def parameter_by_mode(
    scope: Modes, owner: str, field: str, value: Any, otherwise: float | None = None
) -> Node:  # fmt: skip
    """The run-time parameter 'owner.field', of a state 'owner.field.state'; `otherwise` where that has none."""
    if not isinstance(value, ByMode):
        return scope.parameter(owner, field, value)
    found = value.select(
        scope, f"{field} of '{owner}'", lambda state, each: scope.parameter(owner, f"{field}.{state}", each), otherwise
    )
    return scope.named(value.mode).tape.lift(found)


def parameters_by_mode(owner: str, field: str, value: Any) -> dict[str, float]:
    """The run-time parameters of a number, or of one for each state, by full name."""
    if not isinstance(value, ByMode):
        return {f"{owner}.{field}": value}
    return {f"{owner}.{field}.{state}": each for state, each in value.values}
