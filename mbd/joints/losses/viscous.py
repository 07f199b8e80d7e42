"""Damping in proportion to the rate."""

from dataclasses import field

from mbd.bodies.by_mode import number_by_mode, parameter_by_mode, parameters_by_mode, require_use
from mbd.bodies.given import NumberByMode
from mbd.bodies.scope import Scope
from mbd.dataclass import dataclass
from mbd.joints.losses.base import DissipationFunction
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Viscous(DissipationFunction):
    """``D = ½ c v²``, ``F = c v``.

    Parameters
    ----------
    coefficient : c ≥ 0 [N s/m or N m s/rad]
    by : name of a mode whose states have coefficients of their own: ``Viscous({"stance": 5.0}, by="phase")``; in states
        that are left out there is none. Each is the parameter 'owner.coefficient.stance'
    """

    coefficient: NumberByMode
    by: str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", number_by_mode(self.coefficient, self.by, "coefficient of Viscous"))
        require_use(self.by, "Viscous", self.coefficient)

    def fields(self) -> dict[str, float]:
        """`coefficient`."""
        found = parameters_by_mode("", "coefficient", self.coefficient)
        return {name.removeprefix("."): value for name, value in found.items()}

    def dissipation(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """½ c v²."""
        return 0.5 * rate * self.force(rate, scope, owner)

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """c v, the derivative of D in its shortest form."""
        return parameter_by_mode(scope, owner, "coefficient", self.coefficient, 0.0) * rate
