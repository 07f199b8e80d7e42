"""The rotor of a drive behind a gear: inertia on the coordinate of a joint."""

from mbd.bodies.domains import Domain, at_least_zero
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of, number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, joint_of
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.tape.node import Node


@dataclass(frozen=True)
class Rotor(Force):
    """A rotor J that turns r times as fast as a joint: ``T = ½ J r² q̇²``, armature or reflected inertia.

    It is felt as J r² on q̈, and in impacts. Its mass belongs to the body that carries it. That it turns with that body
    besides, ``J r ω · q̇``, is left out, as is usual for r ≫ 1 (R. Featherstone, Rigid Body Dynamics Algorithms, 2008,
    § 9.6). For a drive on the ground it is exact.

    Parameters
    ----------
    name : its name
    joint : what it drives: a joint of one coordinate
    inertia : J ≥ 0 about the rotor's axis [kg m²]; at a sliding joint r has the unit rad/m
    ratio : r, turns of the rotor per turn of the joint
    """

    name: str
    joint: Joint
    inertia: float
    ratio: float = 1.0

    kind = "potential"

    def __post_init__(self) -> None:
        name_of(self.name, "Rotor")
        joint_of(self.joint, f"joint of Rotor '{self.name}'")
        for field in ("inertia", "ratio"):
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of '{self.name}'"))
        wrong = self.domains()[f"{self.name}.inertia"].faults(f"Rotor '{self.name}'", "inertia", self.inertia)
        if wrong:
            raise ModelError(wrong)

    def mentions(self) -> list[Mention]:
        """Its joint."""
        return [self.joint]

    def parameters(self) -> dict[str, float]:
        """`inertia` and `ratio`."""
        return {f"{self.name}.inertia": self.inertia, f"{self.name}.ratio": self.ratio}

    def domains(self) -> dict[str, Domain]:
        """J ≥ 0."""
        return {f"{self.name}.inertia": at_least_zero("is negative; give a value ≥ 0", "kg m²")}

    def reflected(self, scope: Scope) -> Node:
        """J r²."""
        ratio = scope.parameter(self.name, "ratio", self.ratio)
        return scope.parameter(self.name, "inertia", self.inertia) * ratio * ratio

    def act(self, scope: Scope) -> Action:
        """J r² on q̇."""
        (rate,) = scope.joint(self.joint.name).rates
        return Action(inertias=((rate, self.reflected(scope)),))
