"""A constraint that always acts."""

from typing import Any

from mbd.bodies.domains import Domain
from mbd.bodies.given import Expression
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.constraints.base import Constraint
from mbd.constraints.expressions import is_expression
from mbd.constraints.law import Equation, Hold, Law
from mbd.constraints.measure import Measure, gap_of
from mbd.constraints.measures import JointMeasure
from mbd.constraints.user_measure import measure
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import joint_of
from mbd.forces.quantities import Mention, OfQuantities, Quantity, arguments_of, mentioned, quantity_of, scalar
from mbd.forces.samples import Samples
from mbd.joints.base import Joint
from mbd.tape.derivatives import live
from mbd.tape.functions import atan2, cos, sin
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class Bilateral(OfQuantities, Constraint):
    """``h = g(q, t) − value(t) = 0`` at all times: a rod, a slot, a prescribed motion.

    Parameters
    ----------
    name : its name
    subject : a measure, or a joint whose one coordinate is prescribed
    value : a number (the run-time parameter 'name.value'), a function, a sympy expression, or `Samples` of a kind
        that has accelerations: 'spline', the default here, or 'smooth'
    arguments : what a function is called with, in order; the time by default
    """

    name: str
    subject: Joint | Measure | Expression
    value: Quantity = 0.0
    arguments: Any = ("t",)

    kind = "bilateral"
    quantities = ("value",)

    def __post_init__(self) -> None:
        name_of(self.name, "Bilateral")
        if isinstance(self.subject, Joint):
            joint_of(self.subject, f"joint of Bilateral '{self.name}'")
        elif is_expression(self.subject):
            object.__setattr__(self, "subject", measure(self.subject))
        elif not isinstance(self.subject, Measure):
            raise ModelError(
                f"Bilateral '{self.name}' needs a joint or a measure such as mbd.distance(a, b), got {self.subject!r}"
            )
        object.__setattr__(self, "value", quantity_of(self.value, f"value of '{self.name}'"))
        object.__setattr__(self, "arguments", arguments_of(self.arguments, f"Bilateral '{self.name}'"))
        if isinstance(self.value, Samples):
            self.value.require_motion(f"value of '{self.name}'")

    @property
    def measure(self) -> Measure:
        """The measure it holds."""
        if isinstance(self.subject, Joint):
            return JointMeasure(self.subject)
        assert isinstance(self.subject, Measure)  # expressions have become one
        return self.subject

    def residual(self, scope: Scope) -> Scalar:
        """h = g − value [m or rad].

        The angle of a cut joint is read off its frames and jumps by a turn; there
        ``h = atan2(sin(g − value), cos(g − value))``.
        """
        gap = gap_of(self.measure, scope)
        h = gap - scalar(self.value, self.arguments, scope, self.name, "value", "spline")
        wraps = isinstance(self.subject, Joint) and isinstance(gap, Node) and any(n.op == "atan2" for n in live([gap]))
        return atan2(sin(h), cos(h)) if wraps else h

    def act(self, scope: Scope, hold: Hold) -> Law:
        """Its row."""
        measure, wraps = self.measure, isinstance(self.subject, Joint)
        return Law([Equation(self.residual(scope), unit=measure.unit, reaction=measure.reaction, wraps=wraps)])

    @property
    def details(self) -> str:
        """What it holds at which value."""
        return f", {self.measure.details} = {self.value}"

    def mentions(self) -> list[Mention]:
        """What its measure and its value depend on."""
        return [*self.measure.mentions(), *mentioned(self.arguments)]

    def parameters(self) -> dict[str, float]:
        """`value` where it is a number, arguments given as numbers, and those of its measure."""
        return super().parameters() | self.measure.parameters()

    def domains(self) -> dict[str, Domain]:
        """Those of its measure."""
        return self.measure.domains()

    def faults(self) -> list[str]:
        """Those of its measure."""
        return self.measure.faults(self.name)
