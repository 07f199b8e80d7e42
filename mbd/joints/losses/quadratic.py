"""Hydraulic damping: an orifice."""

from mbd.bodies.scope import Scope
from mbd.bodies.values import number
from mbd.dataclass import dataclass
from mbd.joints.losses.base import DissipationFunction
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Quadratic(DissipationFunction):
    """``D = c |v|³/3``, ``F = c |v| v``: turbulent flow through an orifice.

    Parameters
    ----------
    coefficient : c ≥ 0 [N s²/m² or N m s²/rad²]
    """

    coefficient: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", number(self.coefficient, "coefficient of Quadratic"))

    def fields(self) -> dict[str, float]:
        """`coefficient`."""
        return {"coefficient": self.coefficient}

    def dissipation(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """c |v|³/3."""
        return self.force(rate, scope, owner) * rate / 3.0

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """c |v| v, the derivative of D in its shortest form."""
        return scope.parameter(owner, "coefficient", self.coefficient) * scope.tape.unary("abs", rate) * rate
