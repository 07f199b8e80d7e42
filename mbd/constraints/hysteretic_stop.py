"""A stop of rubber with inner dry friction."""

from collections.abc import Mapping
from typing import ClassVar

from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.constraints.law import Closing, Hold, Law
from mbd.constraints.measure import gap_of
from mbd.constraints.stop_with_memory import StopWithMemory
from mbd.dataclass import dataclass
from mbd.tape.functions import maximum
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class HystereticStop(StopWithMemory):
    """Rubber with inner dry friction: a spring beside one that yields, the same at every speed (Bouc–Wen).

    ``p = (1 − η) k δ + η k z``, ``ż = δ̇ − |δ̇| z/d``, with δ the depth of the rubber's surface: it begins with the
    stiffness k, falls to (1 − η) k over the travel d, and gives back less than it took. From rest to the depth δ it is
    ``p = (1 − η) k δ + η k d (1 − e^{−δ/d})``. It does not pull: where it would,
    p = 0. While it is open it keeps its deflection, so that the first impact is stiffer than those that follow.
    Y.-K. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102 (1976) 249, with n = 1,
    β = 1/d, γ = 0, with which it takes energy along every motion.

    Parameters
    ----------
    name, measure : its name, and where: δ = −g of the measure while it is pressed
    stiffness : k > 0, at first touch [N/m or N m/rad]
    share : η of the part that yields, 0 < η < 1 [-]
    travel : d > 0, over which it yields [m or rad]

    Results: 'name.deflection' z [m or rad], a first-order state; 'name.force', 'name.gap'.
    """

    stiffness: float
    share: float
    travel: float

    NUMBERS: ClassVar[dict[str, Domain]] = {
        "stiffness": positive("does not push; give a positive one"),
        "share": Domain(0.0, 1.0, (0.0, 1.0), "is not between 0 and 1; give the share that yields, such as 0.4"),
        "travel": positive("is no travel; give the one over which it yields"),
    }

    def full_stiffness(self, values: Mapping[str, float]) -> float:
        """k."""
        return values.get(f"{self.name}.stiffness", 0.0)

    def act(self, scope: Scope, hold: Hold) -> Law:
        """Its force, its deflection, and the energy of both springs."""
        k, share, travel = self.numbers(scope)
        gap, z = gap_of(self.measure, scope), scope.state(self.name, "deflection", 0.0)
        depth, speed = -gap, -scope.rate(gap)
        push: Scalar = maximum(k * ((1.0 - share) * depth + share * z), 0.0)
        bending = speed - abs(speed) * z / travel
        stored = 0.5 * k * ((1.0 - share) * depth * depth + share * z * z)
        return Law(
            contact=Closing(gap, self.measure.unit, "gap"),
            push=push,
            elastic=stored,
            rates=[(z, bending)],
            rates_while_open=False,
        )
