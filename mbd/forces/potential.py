"""A user's own potential."""

from typing import Any

from mbd.bodies.given import Function
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force
from mbd.forces.quantities import Mention, arguments_of, mentioned, quantity_of, scalar, value_parameters


@dataclass(frozen=True)
class Potential(Force):
    """Forces with a potential V of the user's own: ``f = +∂V/∂q``.

    Parameters
    ----------
    name : its name
    function : V [J], a function or a sympy expression
    arguments : what it is called with: names of coordinates ('left hip.angle'), frames (their positions), joints (their
        coordinates), (label, number) for a run-time parameter
    """

    name: str
    function: Function
    arguments: Any

    kind = "potential"

    def __post_init__(self) -> None:
        name_of(self.name, "Potential")
        object.__setattr__(self, "function", quantity_of(self.function, f"function of '{self.name}'"))
        object.__setattr__(self, "arguments", arguments_of(self.arguments, f"Potential '{self.name}'"))
        if not mentioned(self.arguments):
            raise ModelError(f"Potential '{self.name}': say what it depends on, such as arguments=('left hip.angle',)")

    def mentions(self) -> list[Mention]:
        """What it depends on."""
        return mentioned(self.arguments)

    def parameters(self) -> dict[str, float]:
        """Arguments given as numbers."""
        return value_parameters(None, self.arguments, self.name, "function")

    def act(self, scope: Scope) -> Action:
        """Its potential."""
        return Action(potential=scalar(self.function, self.arguments, scope, self.name, "function"))
