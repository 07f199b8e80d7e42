"""A measured spring on the coordinate of a joint."""

from typing import Any

from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of, numbers
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result, joint_of
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.tape.interpolation import Pieces, integral
from mbd.tape.node import Scalar


@dataclass(frozen=True, init=False)
class TabulatedSpring(Force):
    """``V = ∫ T dq`` of a measured T(q), so that what it stores it gives back: an ankle from the test bench.

    T passes through the points by quadratics with a continuous slope that keep their shape (Schumaker 1983), and goes
    on as a straight line beyond its ends.

    Parameters
    ----------
    name : its name
    joint : a Revolute, Screw or Prismatic joint
    angle : (n ≥ 2,) of the coordinate, increasing [rad or m]
    torque : (n,) T, which the spring opposes to the motion: the joint feels −T [N m or N]
    """

    name: str
    joint: Joint
    angle: tuple[float, ...]
    torque: tuple[float, ...]

    kind = "potential"

    def __init__(self, name: str, joint: Joint, angle: Any, torque: Any) -> None:
        put = object.__setattr__
        put(self, "name", name_of(name, "TabulatedSpring"))
        put(self, "joint", joint_of(joint, f"joint of TabulatedSpring '{name}'"))
        put(self, "angle", numbers(angle, f"angle of TabulatedSpring '{name}'"))
        put(self, "torque", numbers(torque, f"torque of TabulatedSpring '{name}'"))
        if len(self.angle) != len(self.torque) or len(self.angle) < 2:
            raise ModelError(
                f"TabulatedSpring '{name}' needs as many torques as angles, two at least; got {len(self.angle)} angles "
                f"and {len(self.torque)} torques"
            )
        if any(b <= a for a, b in zip(self.angle, self.angle[1:], strict=False)):
            raise ModelError(f"angles of TabulatedSpring '{name}' must increase; sort the table, drop repeated angles")

    def mentions(self) -> list[Mention]:
        """Its joint."""
        return [self.joint]

    def parameters(self) -> dict[str, float]:
        """None: the table is stored beside the parameters."""
        return {}

    def pieces(self) -> Pieces:
        """V as a piecewise cubic."""
        return integral(self.angle, self.torque, self.name)

    def act(self, scope: Scope) -> Action:
        """V looked up."""
        return Action(potential=self._lookup(scope, 0))

    def results(self) -> dict[str, Result]:
        """'torque' [N m], or 'force' along a slider [N]: −T(q), positive along the coordinate."""
        field = "torque" if self.joint.labels[0].unit == "rad" else "force"
        return {field: Result(lambda scope: -self._lookup(scope, 1))}

    def _lookup(self, scope: Scope, order: int) -> Scalar:
        (q,) = scope.joint(self.joint.name).coordinates
        return scope.tape.lookup(scope.table(self.name, *self.pieces()), q, order)
