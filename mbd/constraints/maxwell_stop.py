"""A stop of viscoelastic rubber."""

from collections.abc import Mapping
from typing import ClassVar

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.constraints.law import Closing, Hold, Law
from mbd.constraints.measure import gap_of
from mbd.constraints.stop_with_memory import StopWithMemory
from mbd.dataclass import dataclass
from mbd.tape.functions import maximum


@dataclass(frozen=True)
class MaxwellStop(StopWithMemory):
    """Viscoelastic rubber (standard linear solid): a spring k beside a spring k₁ in series with a dashpot c.

    ``p = k δ + k₁ (δ − x)``, ``c ẋ = k₁ (δ − x)``, with δ the depth of the rubber's surface. Pressed slowly it has the
    stiffness k, fast k + k₁; it loses most in a cycle of the rate ``k₁/c``. It never pulls: where it would, its surface
    stands free at ``δ = k₁ x/(k + k₁)`` and comes back with the time ``c (1/k + 1/k₁)``, also while it is open, so
    that a second impact soon after is softer. W. N. Findley, J. S. Lai & K. Onaran, Creep and Relaxation of Nonlinear
    Viscoelastic Materials (1976), § 5.6.

    Parameters
    ----------
    name, measure : its name, and where: δ = −g of the measure while it is pressed
    stiffness : k > 0 [N/m or N m/rad]
    branch_stiffness : k₁ > 0 [N/m or N m/rad]
    branch_damping : c > 0 [N s/m or N m s/rad]

    Results: 'name.flow' x [m or rad], a first-order state; 'name.force', 'name.gap'.
    """

    stiffness: float
    branch_stiffness: float
    branch_damping: float

    NUMBERS: ClassVar[dict[str, Domain]] = {
        "stiffness": positive("does not push it back; give a positive one"),
        "branch_stiffness": positive("does not push; give a positive one, or take mbd.Penalty"),
        "branch_damping": positive("would let it flow freely; give a positive one, or take mbd.Penalty"),
    }

    def full_stiffness(self, values: Mapping[str, float]) -> float:
        """k + k₁."""
        return values.get(f"{self.name}.stiffness", 0.0) + values.get(f"{self.name}.branch_stiffness", 0.0)

    def act(self, scope: Scope, hold: Hold) -> Law:
        """Its force, its flow, and the energy of both springs."""
        k, branch, c = self.numbers(scope)
        gap, x = gap_of(self.measure, scope), scope.state(self.name, "flow", 0.0)
        free = branch * x / (k + branch)
        depth = maximum(-gap, free)
        stretch = depth - x
        return Law(
            contact=Closing(gap, self.measure.unit, "gap"), push=k * depth + branch * stretch,
            elastic=0.5 * (k * depth * depth + branch * stretch * stretch), rates=[(x, branch * stretch / c)],
            rates_while_open=[branch * (free - x) / c],
        )  # fmt: skip
