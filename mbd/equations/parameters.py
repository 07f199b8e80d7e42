"""Parameters of a derivation: run-time inputs by name, with exact 0 and ±1 folded into the structure."""

from collections.abc import Collection, Mapping

from mbd.bodies.promises import line_of_user
from mbd.equations.equations import Parameter
from mbd.errors import ModelError
from mbd.forces.quantities import INCREMENT_PREFIX
from mbd.tape.node import Node, Scalar, Tape

STRUCTURAL = (0.0, 1.0, -1.0)
"""Values that fold away when the equations are built, unless their name is tunable."""


class ParameterTable:
    """The parameters met so far, numbered by first use."""

    def __init__(self, tape: Tape, tunable: Collection[str] = ()) -> None:
        self._tape = tape
        self._tunable = frozenset(tunable)
        self._nodes: dict[str, Node] = {}
        self._values: dict[str, float] = {}
        self._found: list[Parameter] = []
        self._declared: Mapping[str, float] | None = None

    def expect(self, declared: Mapping[str, float]) -> None:
        """From here on, only parameters that words declare are given out, with the values that they declare."""
        self._declared = declared

    def node(self, name: str, value: float) -> Node:
        """The input of a parameter, or a constant where its value is structural."""
        value = float(value)
        known = self._nodes.get(name)
        if known is not None:
            if value != self._values[name]:
                raise ModelError(
                    f"two things have a parameter {name!r}, {self._values[name]:g} and {value:g}; rename one of them"
                )
            return known
        self._judge(name, value)
        self._values[name] = value
        if value in STRUCTURAL and name not in self._tunable:
            node = self._tape.constant(value)
        else:
            node = self._tape.input("p", len(self._found))
            self._found.append(Parameter(name, value))
        self._nodes[name] = node
        return node

    def _judge(self, name: str, value: float) -> None:
        """Raise a `ModelError` for a parameter that no word declares, or declares with another value.

        It would be no parameter of the model: not listed, not judged by domains, and of the value that is asked here.
        """
        if self._declared is None or self._declared.get(name) == value or name.startswith(INCREMENT_PREFIX):
            return
        owner, _, field = name.rpartition(".")
        asked = f"scope.parameter({owner!r}, {field!r}, {value:g}){line_of_user()} asks for a parameter that"
        if name in self._declared:
            raise ModelError(
                f"{asked} parameters() declares as {self._declared[name]:g}; give one value in both places"
            )
        mine = [each for each in self._declared if each.rpartition(".")[0] == owner]
        raise ModelError(
            f"{asked} is not declared; let parameters() return {{{name!r}: {value:g}}} too; of {owner!r} it declares "
            f"{', '.join(map(repr, mine)) or 'none'}"
        )

    def declared(self, name: str) -> float | None:
        """The value that a word declares for a parameter; None where none does."""
        return None if self._declared is None else self._declared.get(name)

    def increment(self, name: str) -> Scalar:
        """What is added to the law of that name: a run-time input where it is asked for, 0 otherwise."""
        if f"{INCREMENT_PREFIX}{name}" not in self._tunable:
            return 0.0
        return self.node(f"{INCREMENT_PREFIX}{name}", 0.0)

    @property
    def found(self) -> tuple[Parameter, ...]:
        """The run-time inputs in the order of their numbers."""
        return tuple(self._found)

    def __contains__(self, name: str) -> bool:
        return name in self._nodes

    def __getitem__(self, name: str) -> Node:
        return self._nodes[name]
