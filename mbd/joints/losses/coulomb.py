"""Dry friction, smoothed."""

from __future__ import annotations

from dataclasses import dataclass

from mbd.bodies.values import number
from mbd.errors import CapabilityError, ModelError
from mbd.joints.losses.base import DissipationFunction
from mbd.scope import Scope
from mbd.tape.functions import sqrt
from mbd.tape.node import Scalar

__all__ = ["Coulomb"]


@dataclass(frozen=True)
class Coulomb(DissipationFunction):
    """``D = T (√(v² + ε²) − ε)``, ``F = T v/√(v² + ε²)``: dry friction whose step at rest is smoothed over ε.

    Far from rest F is T sign v, less by a part ε²/(2 v²); at rest it creeps with the viscous coefficient T/ε.

    Parameters
    ----------
    torque : T ≥ 0, the friction torque or force [N m or N]
    smoothing : ε > 0, the rate over which it sets in [rad/s or m/s]
    """

    torque: float
    smoothing: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "torque", number(self.torque, "torque of Coulomb"))
        if self.smoothing is None:
            raise CapabilityError(
                f"Coulomb({self.torque:g}) without smoothing truly sticks, which this version does not solve; "
                f"give the rate over which it sets in, such as Coulomb({self.torque:g}, smoothing=0.01)"
            )
        object.__setattr__(self, "smoothing", number(self.smoothing, "smoothing of Coulomb"))
        if self.smoothing <= 0.0:
            raise ModelError(f"smoothing of Coulomb must be positive, got {self.smoothing:g}; try 0.01 rad/s")

    def fields(self) -> dict[str, float]:
        """`torque` and `smoothing`."""
        assert self.smoothing is not None
        return {"torque": self.torque, "smoothing": self.smoothing}

    def dissipation(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """T (√(v² + ε²) − ε)."""
        T, eps = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        root: Scalar = sqrt(rate * rate + eps * eps)
        return T * (root - eps)

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """T v/√(v² + ε²), the derivative of D in its shortest form."""
        T, eps = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        root: Scalar = sqrt(rate * rate + eps * eps)
        return T * rate / root
