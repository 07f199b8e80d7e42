"""The promise of discrete states: what they hold, and how they change at instants.

A machine holds numbers that are constant between its changes: the number of its state first, then whatever it
remembers. They are inputs of the equations, as what a contact holds is. Each change has a name, a source and a target
among the states, and one cause: a guard that crosses zero, or something else that happens.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field
from typing import Any

from mbd.bodies.scope import Scope
from mbd.constraints.base import Constraint
from mbd.dataclass import dataclass
from mbd.tape.node import Node, Scalar

SEPARATOR = ": "
"""Between the name of a machine and that of a state: 'knee phase: stance'."""


@dataclass(frozen=True)
class Change:
    """One way in which a machine changes.

    Parameters
    ----------
    name : of its event
    source, target : numbers of states
    guard : what crosses zero as it happens; None where another event is its cause
    direction : of the crossing, as of `mbd.Event`
    on : name of the other event that is its cause
    contact : name of a contact that must be closed for it to happen; '' for none
    condition : what must be positive for it to happen
    stored : by the number of the field, what the machine holds from then on
    reset, terminal : of its event, as of `mbd.Event`
    timed : whether the guard is a time that is still to come as the state is entered, so that it is due at once if not
    """

    name: str
    source: int
    target: int
    guard: Scalar | None = None
    direction: int = 0
    on: str = ""
    contact: str = ""
    condition: Scalar | None = None
    stored: Mapping[int, Scalar] = field(default_factory=dict)
    reset: Any = None
    terminal: bool = False
    timed: bool = False


class Machine(Constraint):
    """Discrete states and held numbers; see `mbd.Mode` and `mbd.SampledLaw`."""

    @property
    def kind(self) -> str:
        """'machine'."""
        return "machine"

    @property
    def reads_before(self) -> bool:
        """Whether forces that it stores are those just before the instant, as a sensor reads them."""
        return False

    @property
    @abstractmethod
    def state_names(self) -> tuple[str, ...]:
        """Names of its states."""

    @property
    def state_titles(self) -> tuple[str, ...]:
        """'knee phase: stance' of each state."""
        return tuple(f"{self.name}{SEPARATOR}{state}" for state in self.state_names)

    @property
    @abstractmethod
    def fields(self) -> tuple[str, ...]:
        """Names of the numbers that it holds, that of the state first."""

    @property
    def times(self) -> tuple[int, ...]:
        """Which of them are instants [s]."""
        return ()

    @abstractmethod
    def initial(self, values: Mapping[str, float]) -> tuple[float, ...]:
        """What it holds before the start, at which it stores `first_values`; instants are that of the start.

        values : of the model's parameters
        """

    @property
    @abstractmethod
    def quantity_names(self) -> tuple[str, ...]:
        """Names of `quantities`."""

    @abstractmethod
    def quantities(self, scope: Scope, held: Sequence[Node]) -> Mapping[str, Scalar]:
        """Named quantities that others may ask for; `held` are its numbers on the tape."""

    def parameters_by_state(self) -> Mapping[str, Mapping[str, float]]:
        """Parameters of other words that it sets: {'knee loss.coefficient': {'stance': 5.0}}."""
        return {}

    def stands_for(self) -> dict[str, str]:
        """The parameters of each state, and those in whose place they are."""
        return {f"{name}.{state}": name for name, values in self.parameters_by_state().items() for state in values}

    def held_parameters(self) -> Mapping[str, int]:
        """Parameters of other words that are among the numbers that it holds, with the number of the field."""
        return {}

    def without_parameters(self, known: Collection[str]) -> Machine | None:
        """What is left of it where only these parameters exist, which it may set; None where nothing is."""
        return self

    @abstractmethod
    def changes(self, scope: Scope, held: Sequence[Node]) -> Sequence[Change]:
        """Its changes in the order in which they are looked at."""

    @abstractmethod
    def first_values(self, scope: Scope, held: Sequence[Node]) -> Mapping[int, Scalar]:
        """By the number of the field, what it stores at the start."""


def state_of(text: str, machines: Mapping[str, Sequence[str]]) -> tuple[str, int] | None:
    """The machine and the number of the state that 'knee phase: stance' names; None for any other text."""
    name, separator, state = text.rpartition(SEPARATOR)
    if not separator or name not in machines or state not in machines[name]:
        return None
    return name, list(machines[name]).index(state)
