"""A contact by a force law."""

from __future__ import annotations

from dataclasses import dataclass

from mbd.bodies.values import name_of, number
from mbd.constraints.base import Constraint, Measure
from mbd.constraints.unilateral import measure_of
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.scope import Scope
from mbd.tape.functions import maximum
from mbd.tape.node import Scalar

__all__ = ["Penalty"]


@dataclass(frozen=True)
class Penalty(Constraint):
    """``p = k δⁿ + c δ̇`` with the penetration ``δ = −g``, while it acts: a rubber stop (Kelvin & Voigt for n = 1).

    It begins to act as g falls through zero.

    Parameters
    ----------
    name : its name
    measure : where
    stiffness : k [N/mⁿ, or N m/radⁿ]
    damping : c [N s/m, or N m s/rad]
    exponent : n ≥ 1, fixed when the model is built (3/2 for Hertz)
    release : 'gap': it acts until g > 0 again and may pull just before; 'pull': until the force would attract
    """

    name: str
    measure: Measure
    stiffness: float
    damping: float = 0.0
    exponent: float = 1.0
    release: str = "gap"

    def __post_init__(self) -> None:
        name_of(self.name, "Penalty")
        measure_of(self.measure, f"Penalty '{self.name}'")
        for field in ("stiffness", "damping", "exponent"):
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of '{self.name}'"))
        if self.release not in ("gap", "pull"):
            raise ModelError(f"release of Penalty '{self.name}' is 'gap' or 'pull', got {self.release!r}")

    @property
    def kind(self) -> str:
        """'penalty'."""
        return "penalty"

    @property
    def opens_on(self) -> str:
        """'gap' or 'pull'."""
        return self.release

    def force(self, gap: Scalar, gap_rate: Scalar, scope: Scope) -> Scalar:
        """k δⁿ + c δ̇ [N or N m], of g and ġ."""
        depth: Scalar = -gap if self.exponent == int(self.exponent) else maximum(-gap, 0.0)
        power: Scalar = scope.tape.power(depth, self.exponent)
        k = scope.parameter(self.name, "stiffness", self.stiffness)
        return k * power - scope.parameter(self.name, "damping", self.damping) * gap_rate

    def mentions(self) -> list[Mention]:
        """What its measure depends on."""
        return self.measure.mentions()

    def parameters(self) -> dict[str, float]:
        """`stiffness` and `damping`."""
        return {f"{self.name}.stiffness": self.stiffness, f"{self.name}.damping": self.damping}

    def faults(self) -> list[str]:
        """A law that would not push, or would feed energy in."""
        faults = self.measure.faults(self.name)
        if self.stiffness <= 0.0:
            faults.append(f"'{self.name}': stiffness {self.stiffness:g} does not push; give a positive one")
        if self.damping < 0.0:
            faults.append(f"'{self.name}': damping {self.damping:g} would feed energy in; give a value ≥ 0")
        if self.exponent < 1.0:
            faults.append(f"'{self.name}': exponent {self.exponent:g} is below 1, endlessly stiff at touch; give n ≥ 1")
        return faults
