"""A straight link, the bone of walkers and linkages."""

from collections.abc import Mapping

from mbd.bodies.algebra import ZERO, Triple
from mbd.bodies.base import Body, Frame, Parameter, ParameterSource
from mbd.bodies.domains import Domain, at_least_zero
from mbd.bodies.given import GivenInertia
from mbd.bodies.mass import (
    Inertia,
    MassProperties,
    inertia_faults,
    inertia_fields,
    inertia_matrix,
    inertia_of,
)
from mbd.bodies.values import name_of, number
from mbd.dataclass import dataclass


@dataclass(frozen=True, init=False)
class Link(Body):
    """A straight link that lies along −y of its own axes, so that at angle zero it hangs.

    ``start = (0, 0, 0)``, ``end = (0, −length, 0)``, center of mass ``(0, −center, 0)``.

    Parameters
    ----------
    name : its name
    mass : m [kg]
    length : from start to end [m]
    center : from the start to the center of mass [m]; kept as `center_distance`, since `center` is the frame there
    inertia : about the center of mass [kg m²]: a number about z, or three or six as for `RigidBody`
    """

    name: str
    mass: float
    length: float
    center_distance: float
    inertia: Inertia

    def __init__(self, name: str, mass: float, length: float, center: float, inertia: GivenInertia = 0.0) -> None:
        put = object.__setattr__
        put(self, "name", name_of(name, "Link"))
        put(self, "mass", number(mass, f"mass of '{name}'"))
        put(self, "length", number(length, f"length of '{name}'"))
        put(self, "center_distance", number(center, f"center of '{name}'"))
        put(self, "inertia", inertia_of(inertia, f"inertia of '{name}'"))

    def fields(self) -> dict[str, float]:
        """`mass`, `length`, `center`, `inertia` or `inertia.xx` …"""
        return {
            "mass": self.mass,
            "length": self.length,
            "center": self.center_distance,
            **inertia_fields(self.inertia),
        }

    def landmarks(self, parameter: Parameter) -> dict[str, Triple]:
        """`origin` and `start` at one end, `end` at the other, `center` between."""
        end, center = -parameter("length"), -parameter("center")
        return {"origin": ZERO, "start": ZERO, "end": (0.0, end, 0.0), "center": (0.0, center, 0.0)}

    @property
    def start(self) -> Frame:
        """The frame at the upper end."""
        return self.frame("start")

    @property
    def end(self) -> Frame:
        """The frame at the lower end."""
        return self.frame("end")

    def mass_properties(self, scope: ParameterSource) -> MassProperties:
        """m, center, I."""
        parameter = self.parameter(scope)
        return MassProperties(
            parameter("mass"), self.landmarks(parameter)["center"], inertia_matrix(self.inertia, parameter)
        )

    def domains(self) -> dict[str, Domain]:
        """Mass and length ≥ 0."""
        length = at_least_zero("is negative; turn the joint's frame instead", "m")
        return {**super().domains(), f"{self.name}.length": length}

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        """A negative mass or length, an impossible inertia."""
        return super().value_faults(values) + inertia_faults(self.name, self.inertia, values)
