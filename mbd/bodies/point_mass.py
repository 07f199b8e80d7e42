"""A mass without extent."""

from mbd.bodies.algebra import ZERO, Triple
from mbd.bodies.base import Body, Parameter, ParameterSource
from mbd.bodies.mass import MassProperties
from mbd.bodies.values import name_of, number
from mbd.dataclass import dataclass


@dataclass(frozen=True)
class PointMass(Body):
    """A mass in one point, ``T = ½ m |ṗ|²``; a joint that turns it about its own point would turn nothing.

    Parameters
    ----------
    name : its name
    mass : m [kg]; zero is allowed where the motion stays determined
    """

    name: str
    mass: float

    def __post_init__(self) -> None:
        name_of(self.name, "PointMass")
        object.__setattr__(self, "mass", number(self.mass, f"mass of '{self.name}'"))

    def fields(self) -> dict[str, float]:
        """`mass`."""
        return {"mass": self.mass}

    def landmarks(self, parameter: Parameter) -> dict[str, Triple]:
        """`origin` and `center`, the point itself."""
        return {"origin": ZERO, "center": ZERO}

    def mass_properties(self, scope: ParameterSource) -> MassProperties:
        """m at the origin."""
        return MassProperties(self.parameter(scope)("mass"))
