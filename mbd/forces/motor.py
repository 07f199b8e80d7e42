"""A drive on the coordinate of a joint."""

from collections.abc import Mapping
from typing import Any

from mbd.bodies.by_mode import by_mode_of, require_use
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result, joint_of
from mbd.forces.quantities import Mention, OfQuantities, Quantity, arguments_of, mentioned, quantity_of, scalar
from mbd.joints.base import Joint


@dataclass(frozen=True)
class Motor(OfQuantities, Force):
    """A torque, or force, on the one coordinate of a joint, on the child and back on the parent: power ``T q̇``.

    ``Motor("drive", hinge, torque=2.0)``, ``Motor("drive", slider, force=50.0)``

    Parameters
    ----------
    name : its name
    joint : a Revolute, Screw or Prismatic joint
    torque : T [N m], positive along the coordinate: a number (the parameter 'name.torque'), a function, a sympy
        expression or `Samples`, and so is the result called. Along a slider it is a force [N], and so is the result
    arguments : what a function is called with, as for `Applied`
    force : the same along a slider [N], under the name that its result has: the parameter 'name.force'
    by : name of a mode, whose states have torques of their own: ``torque={"stance": f, "swing": 2.0}, by="phase"``; in
        states that are left out there is none. A number is the parameter 'name.torque.swing'
    """

    name: str
    joint: Joint
    torque: Quantity | Mapping[str, Quantity] | None = None
    arguments: Any = ("t",)
    force: Quantity | Mapping[str, Quantity] | None = None
    by: str | None = None

    kind = "applied"
    column = "motor"

    def __post_init__(self) -> None:
        name_of(self.name, "Motor")
        joint_of(self.joint, f"joint of Motor '{self.name}'")
        if (self.torque is None) == (self.force is None):
            raise ModelError(
                f"Motor '{self.name}' takes torque=… of an angle, or force=… along a slider, one of the two"
            )
        if self.force is not None and self.joint.labels[0].unit == "rad":
            raise ModelError(
                f"Motor '{self.name}' turns '{self.joint.name}', so that it has a torque: give torque=… [N m]"
            )
        effort = by_mode_of(self.effort, self.by, f"{self.field} of '{self.name}'", quantity_of)
        object.__setattr__(self, self.field, effort)
        require_use(self.by, f"Motor '{self.name}'", effort)
        object.__setattr__(self, "arguments", arguments_of(self.arguments, f"Motor '{self.name}'"))

    @property
    def quantities(self) -> tuple[str, ...]:
        """The one that was given."""
        return (self.field,)

    @property
    def field(self) -> str:
        """'torque' or 'force': which was given."""
        return "torque" if self.force is None else "force"

    @property
    def effort(self) -> Any:
        """The torque or force."""
        return self.torque if self.force is None else self.force

    def mentions(self) -> list[Mention]:
        """Its joint, and what its function is called with."""
        return [self.joint, *mentioned(self.arguments)]

    def act(self, scope: Scope) -> Action:
        """The torque on the rate."""
        (rate,) = scope.joint(self.joint.name).rates
        return Action(pairs=((rate, scalar(self.effort, self.arguments, scope, self.name, self.field)),))

    def results(self) -> dict[str, Result]:
        """'torque', or 'force' along a slider."""
        return {
            "torque" if self.joint.labels[0].unit == "rad" else "force": Result(
                lambda scope: self.act(scope).pairs[0][1]
            )
        }
