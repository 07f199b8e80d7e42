"""A spring on the coordinate of a joint."""

from mbd.bodies.by_mode import number_by_mode, parameter_by_mode, parameters_by_mode, require_use
from mbd.bodies.given import NumberByMode
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.dataclass import dataclass
from mbd.forces.base import Action, Force, Result, joint_of
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class TorsionSpring(Force):
    """A linear spring on the one coordinate q of a joint: ``V = ½ k (q − rest)²``.

    Parameters
    ----------
    name : its name
    joint : a Revolute, Screw or Prismatic joint
    stiffness : k [N m/rad or N/m]
    rest : coordinate at which it is slack [rad or m]
    by : name of a mode whose states have values of their own: ``stiffness={"stance": 500.0}, by="phase"``; in states
        that are left out there is no spring. Each is the parameter 'name.stiffness.stance'
    """

    name: str
    joint: Joint
    stiffness: NumberByMode
    rest: NumberByMode = 0.0
    by: str | None = None

    kind = "potential"

    def __post_init__(self) -> None:
        name_of(self.name, "TorsionSpring")
        joint_of(self.joint, f"joint of TorsionSpring '{self.name}'")
        object.__setattr__(self, "stiffness", number_by_mode(self.stiffness, self.by, f"stiffness of '{self.name}'"))
        object.__setattr__(self, "rest", number_by_mode(self.rest, self.by, f"rest of '{self.name}'"))
        require_use(self.by, f"TorsionSpring '{self.name}'", self.stiffness, self.rest)

    def mentions(self) -> list[Mention]:
        """Its joint."""
        return [self.joint]

    def parameters(self) -> dict[str, float]:
        """`stiffness` and `rest`."""
        stiffness = parameters_by_mode(self.name, "stiffness", self.stiffness)
        return stiffness | parameters_by_mode(self.name, "rest", self.rest)

    def act(self, scope: Scope) -> Action:
        """Its potential."""
        stiffness, stretch = self._stiffness_and_stretch(scope)
        return Action(potential=0.5 * stiffness * stretch * stretch)

    def results(self) -> dict[str, Result]:
        """'torque' [N m], or 'force' along a slider [N]: −k (q − rest), positive along the coordinate."""
        return {"torque" if self.joint.labels[0].unit == "rad" else "force": Result(self._effort)}

    def _effort(self, scope: Scope) -> Scalar:
        stiffness, stretch = self._stiffness_and_stretch(scope)
        return -stiffness * stretch

    def _stiffness_and_stretch(self, scope: Scope) -> tuple[Scalar, Scalar]:
        (q,) = scope.joint(self.joint.name).coordinates
        stretch = q - parameter_by_mode(scope, self.name, "rest", self.rest)
        return parameter_by_mode(scope, self.name, "stiffness", self.stiffness, 0.0), stretch
