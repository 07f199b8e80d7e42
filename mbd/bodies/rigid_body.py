"""A rigid body in space."""

from collections.abc import Mapping

from mbd.bodies.algebra import ZERO, Triple
from mbd.bodies.base import Body, Parameter, ParameterSource
from mbd.bodies.given import GivenInertia, Numbers
from mbd.bodies.mass import (
    Inertia,
    MassProperties,
    inertia_faults,
    inertia_fields,
    inertia_matrix,
    inertia_of,
)
from mbd.bodies.values import Vector3, among, name_of, number, triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError, nearest

FORMS = ("box", "cylinder", "ball")
"""As which a body may be drawn."""


@dataclass(frozen=True, init=False)
class RigidBody(Body):
    """A rigid body, ``T = ½ m |v_c|² + ½ ωᵀ I ω`` with v_c the velocity of its center of mass.

    Parameters
    ----------
    name : its name
    mass : m [kg]
    inertia : I about the center of mass in body axes [kg m²]: a number (about z, for planar motion),
        (Ixx, Iyy, Izz), (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), the elements of the matrix, or the 3 × 3 matrix itself
    center : place of the center of mass in body axes [m]; kept as `center_offset`, since `center` is the frame there
    form : 'box', 'cylinder' or 'ball', as which pictures in space show it, of its inertia; '': what its contacts tell,
        else a cylinder where two moments are equal, a box where none or all are
    """

    name: str
    mass: float
    inertia: Inertia
    center_offset: Vector3
    form: str = ""

    def __init__(
        self, name: str, mass: float, inertia: GivenInertia, center: Numbers = ZERO, *, form: str = ""
    ) -> None:
        put = object.__setattr__
        put(self, "name", name_of(name, "RigidBody"))
        put(self, "mass", number(mass, f"mass of '{name}'"))
        put(self, "inertia", inertia_of(inertia, f"inertia of '{name}'"))
        put(self, "center_offset", triple(center, f"center of '{name}'"))
        if not among(form, ("", *FORMS)):
            raise ModelError(f"form of '{name}': " + nearest(form, FORMS, "form", "There are"))
        put(self, "form", form)

    def fields(self) -> dict[str, float]:
        """`mass`, `center.x` …, `inertia` or `inertia.xx` …"""
        x, y, z = self.center_offset
        return {"mass": self.mass, "center.x": x, "center.y": y, "center.z": z, **inertia_fields(self.inertia)}

    def landmarks(self, parameter: Parameter) -> dict[str, Triple]:
        """`origin` and `center`."""
        return {"origin": ZERO, "center": (parameter("center.x"), parameter("center.y"), parameter("center.z"))}

    def mass_properties(self, scope: ParameterSource) -> MassProperties:
        """m, center, I."""
        parameter = self.parameter(scope)
        return MassProperties(
            parameter("mass"), self.landmarks(parameter)["center"], inertia_matrix(self.inertia, parameter)
        )

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        """A negative mass, an impossible inertia."""
        return super().value_faults(values) + inertia_faults(self.name, self.inertia, values)
