"""Damping in proportion to the rate."""

from __future__ import annotations

from dataclasses import dataclass

from mbd.bodies.values import number
from mbd.joints.losses.base import DissipationFunction
from mbd.scope import Scope
from mbd.tape.node import Scalar

__all__ = ["Viscous"]


@dataclass(frozen=True)
class Viscous(DissipationFunction):
    """``D = ½ c v²``, ``F = c v``.

    Parameters
    ----------
    coefficient : c ≥ 0 [N s/m or N m s/rad]
    """

    coefficient: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", number(self.coefficient, "coefficient of Viscous"))

    def fields(self) -> dict[str, float]:
        """`coefficient`."""
        return {"coefficient": self.coefficient}

    def dissipation(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """½ c v²."""
        return 0.5 * rate * self.force(rate, scope, owner)

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """c v, the derivative of D in its shortest form."""
        return scope.parameter(owner, "coefficient", self.coefficient) * rate
