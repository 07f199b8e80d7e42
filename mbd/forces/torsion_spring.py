"""A spring on the coordinate of a joint."""

from __future__ import annotations

from dataclasses import dataclass

from mbd.bodies.values import name_of, number
from mbd.forces.base import Action, Force, Result, joint_of
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.scope import Scope
from mbd.tape.node import Scalar

__all__ = ["TorsionSpring"]


@dataclass(frozen=True)
class TorsionSpring(Force):
    """A linear spring on the one coordinate q of a joint: ``V = ½ k (q − rest)²``.

    Parameters
    ----------
    name : its name
    joint : a Revolute, Screw or Prismatic joint
    stiffness : k [N m/rad or N/m]
    rest : coordinate at which it is slack [rad or m]
    """

    name: str
    joint: Joint
    stiffness: float
    rest: float = 0.0

    def __post_init__(self) -> None:
        name_of(self.name, "TorsionSpring")
        joint_of(self.joint, f"joint of TorsionSpring '{self.name}'")
        object.__setattr__(self, "stiffness", number(self.stiffness, f"stiffness of '{self.name}'"))
        object.__setattr__(self, "rest", number(self.rest, f"rest of '{self.name}'"))

    @property
    def kind(self) -> str:
        """'potential'."""
        return "potential"

    def mentions(self) -> list[Mention]:
        """Its joint."""
        return [self.joint]

    def parameters(self) -> dict[str, float]:
        """`stiffness` and `rest`."""
        return {f"{self.name}.stiffness": self.stiffness, f"{self.name}.rest": self.rest}

    def act(self, scope: Scope) -> Action:
        """Its potential."""
        (q,) = scope.joint(self.joint.name).coordinates
        stretch = q - scope.parameter(self.name, "rest", self.rest)
        return Action(potential=0.5 * scope.parameter(self.name, "stiffness", self.stiffness) * stretch * stretch)

    def results(self) -> dict[str, Result]:
        """'torque' [N m], or 'force' along a slider [N]: −k (q − rest), positive along the coordinate."""
        return {"torque" if self.joint.labels[0].unit == "rad" else "force": Result(self._effort)}

    def _effort(self, scope: Scope) -> Scalar:
        (q,) = scope.joint(self.joint.name).coordinates
        stretch = q - scope.parameter(self.name, "rest", self.rest)
        return -scope.parameter(self.name, "stiffness", self.stiffness) * stretch
