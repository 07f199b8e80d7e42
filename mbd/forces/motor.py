"""A drive on the coordinate of a joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mbd.bodies.values import name_of
from mbd.forces.base import Action, Force, joint_of
from mbd.forces.quantities import (
    Instants,
    Mention,
    arguments_of,
    kinks,
    law_names,
    mentioned,
    quantity_of,
    scalar,
    value_parameters,
)
from mbd.joints.base import Joint
from mbd.scope import Scope

__all__ = ["Motor"]


@dataclass(frozen=True)
class Motor(Force):
    """A torque (or force) on the one coordinate of a joint, on the child and back on the parent: power ``T q̇``.

    Parameters
    ----------
    name : its name
    joint : a Revolute, Screw or Prismatic joint
    torque : T [N m or N], positive along the coordinate: a number (the parameter 'name.torque'), a function, a sympy
        expression or `Samples`
    arguments : what a function is called with, as for `Applied`
    """

    name: str
    joint: Joint
    torque: Any
    arguments: Any = ("t",)

    def __post_init__(self) -> None:
        name_of(self.name, "Motor")
        joint_of(self.joint, f"joint of Motor '{self.name}'")
        object.__setattr__(self, "torque", quantity_of(self.torque, f"torque of '{self.name}'"))
        object.__setattr__(self, "arguments", arguments_of(self.arguments, f"Motor '{self.name}'"))

    @property
    def kind(self) -> str:
        """'applied'."""
        return "applied"

    @property
    def column(self) -> str:
        """'motor'."""
        return "motor"

    def mentions(self) -> list[Mention]:
        """Its joint, and what its function is called with."""
        return [self.joint, *mentioned(self.arguments)]

    def parameters(self) -> dict[str, float]:
        """`torque` where it is a number, and arguments given as numbers."""
        return value_parameters(self.torque, self.arguments, self.name, "torque")

    def laws(self) -> tuple[str, ...]:
        """`torque` where it is no number."""
        return law_names(self.torque, self.name, "torque")

    def instants(self) -> Instants:
        """Kinks of its samples."""
        return kinks(self.torque)

    def act(self, scope: Scope) -> Action:
        """The torque on the rate."""
        (rate,) = scope.joint(self.joint.name).rates
        return Action(pairs=((rate, scalar(self.torque, self.arguments, scope, self.name, "torque")),))
