"""What stops with memory have in common: where they are, and numbers of which each is a parameter."""

from collections.abc import Mapping
from typing import ClassVar

from mbd.bodies.domains import Domain
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of, number
from mbd.constraints.base import Constraint
from mbd.constraints.measure import Measure
from mbd.constraints.penalty_parameters import largest_dt
from mbd.constraints.unilateral import measure_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.tape.node import Node


@dataclass(frozen=True)
class StopWithMemory(Constraint):
    """A force law on a measure whose `NUMBERS` are its fields, with what each may be; a stop gives its `act`."""

    name: str
    measure: Measure

    NUMBERS: ClassVar[dict[str, Domain]] = {}

    kind = "penalty"

    def __post_init__(self) -> None:
        title = type(self).__name__
        name_of(self.name, title)
        object.__setattr__(self, "measure", measure_of(self.measure, f"{title} '{self.name}'"))
        for field in self.NUMBERS:
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of '{self.name}'"))
        wrong = [fault for field, domain in self.NUMBERS.items()
                 for fault in domain.faults(f"{title} '{self.name}'", field, getattr(self, field))]  # fmt: skip
        if wrong:
            raise ModelError(wrong)

    def mentions(self) -> list[Mention]:
        """What its measure depends on."""
        return self.measure.mentions()

    def parameters(self) -> dict[str, float]:
        """Its numbers, and those of its measure."""
        own = {f"{self.name}.{field}": float(getattr(self, field)) for field in self.NUMBERS}
        return own | self.measure.parameters()

    def domains(self) -> dict[str, Domain]:
        """Those of its numbers."""
        return {f"{self.name}.{field}": domain for field, domain in self.NUMBERS.items()} | self.measure.domains()

    def faults(self) -> list[str]:
        """Those of its measure."""
        return self.measure.faults(self.name) + super().faults()

    def resolving_dt(self, values: Mapping[str, float], mass: float, speed: float) -> float:
        """A fifth of the time until the deepest point of a spring of its stiffness."""
        return largest_dt(self.full_stiffness(values), 1.0, 0.0, 0.0, mass, speed)

    def full_stiffness(self, values: Mapping[str, float]) -> float:
        """Of a fast impact [N/m or N m/rad]."""
        raise NotImplementedError

    @property
    def details(self) -> str:
        """Where, and its numbers."""
        return f", {self.measure.details}, " + ", ".join(f"{n} {getattr(self, n):.6g}" for n in self.NUMBERS)

    def numbers(self, scope: Scope) -> list[Node]:
        return [scope.parameter(self.name, field, getattr(self, field)) for field in self.NUMBERS]
