"""A spring between two points."""

from mbd.bodies.algebra import difference, dot, norm
from mbd.bodies.base import Frame
from mbd.bodies.by_mode import number_by_mode, parameter_by_mode, parameters_by_mode, require_use
from mbd.bodies.domains import Domain, at_least_zero
from mbd.bodies.given import NumberByMode
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.dataclass import dataclass
from mbd.forces.base import Action, Force, Result, frame_of
from mbd.forces.quantities import Mention
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Spring(Force):
    """A linear spring between two points: ``V = ½ k (|p_b − p_a| − length)²``.

    With the length an exact 0 there is no root: ``V = ½ k |p_b − p_a|²``. With a length, the points must not meet.

    Parameters
    ----------
    name : its name
    a, b : its end frames
    stiffness : k [N/m]
    length : unstretched [m]
    by : name of a mode whose states have values of their own: ``length={"stance": 0.9, "push": 1.0}, by="phase"``; in
        states whose stiffness is left out there is no spring. Each is the parameter 'name.length.push'
    """

    name: str
    a: Frame
    b: Frame
    stiffness: NumberByMode
    length: NumberByMode = 0.0
    by: str | None = None

    kind = "potential"

    def __post_init__(self) -> None:
        name_of(self.name, "Spring")
        frame_of(self.a, f"first end of Spring '{self.name}'")
        frame_of(self.b, f"second end of Spring '{self.name}'")
        object.__setattr__(self, "stiffness", number_by_mode(self.stiffness, self.by, f"stiffness of '{self.name}'"))
        object.__setattr__(self, "length", number_by_mode(self.length, self.by, f"length of '{self.name}'"))
        require_use(self.by, f"Spring '{self.name}'", self.stiffness, self.length)

    def mentions(self) -> list[Mention]:
        """Its ends."""
        return [self.a, self.b]

    def parameters(self) -> dict[str, float]:
        """`stiffness` and `length`."""
        stiffness = parameters_by_mode(self.name, "stiffness", self.stiffness)
        return stiffness | parameters_by_mode(self.name, "length", self.length)

    def domains(self) -> dict[str, Domain]:
        """A length ≥ 0."""
        names = parameters_by_mode(self.name, "length", self.length)
        return dict.fromkeys(names, at_least_zero("is negative; give the unstretched length", "m"))

    @property
    def known_as(self) -> str:
        """ "spring 'tendon'"."""
        return f"spring '{self.name}'"

    def faults(self) -> list[str]:
        """A negative length, ends that are one."""
        faults = super().faults()
        if self.a.body is self.b.body:
            faults.append(f"spring '{self.name}': both ends are on '{self.a.body.name}', so it does nothing")
        return faults

    def act(self, scope: Scope) -> Action:
        """Its potential."""
        arm = difference(scope.frame(self.b).position, scope.frame(self.a).position)
        k = parameter_by_mode(scope, self.name, "stiffness", self.stiffness, 0.0)
        length = parameter_by_mode(scope, self.name, "length", self.length)
        if length.is_zero:
            return Action(potential=0.5 * k * dot(arm, arm))
        stretch = norm(arm) - length
        return Action(potential=0.5 * k * stretch * stretch)

    def results(self) -> dict[str, Result]:
        """'force': k (|p_b − p_a| − length), which pulls its ends together where it is positive [N]."""
        return {"force": Result(self._tension)}

    def _tension(self, scope: Scope) -> Scalar:
        arm = difference(scope.frame(self.b).position, scope.frame(self.a).position)
        k = parameter_by_mode(scope, self.name, "stiffness", self.stiffness, 0.0)
        return k * (norm(arm) - parameter_by_mode(scope, self.name, "length", self.length))
