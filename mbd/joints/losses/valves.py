"""One loss for motion backwards and another for motion forwards: one-way valves."""

from __future__ import annotations

from collections.abc import Mapping

from mbd.bodies.scope import Scope
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss, StateRates
from mbd.tape.functions import maximum, minimum
from mbd.tape.node import Scalar

__all__ = ["Valves"]


@dataclass(frozen=True)
class Valves(Loss):
    """``F = F_forward(max(v, 0)) + F_backward(min(v, 0))``: check valves lead each direction through its own orifice.

    A knee bends with negative rates and stretches with positive ones; a damper between two points shortens and extends.

    Parameters
    ----------
    backward : a loss at negative rates; its parameters are 'owner.backward.coefficient', …
    forward : a loss at positive rates

    Raises
    ------
    ModelError
        for a loss that truly sticks or follows the force in the joint, which no direction tells apart; add such to the
        sum instead: ``Valves(…) + Coulomb(2.0)``.
    """

    backward: Loss
    forward: Loss

    def __post_init__(self) -> None:
        for field, loss in self.parts().items():
            if not isinstance(loss, Loss):
                raise ModelError(f"{field} of Valves is a loss such as mbd.Quadratic(0.5), got {loss!r}")
            if loss.needs_reaction or (type(loss).dry is not Loss.dry and loss.smooth != loss):
                raise ModelError(
                    f"{field} of Valves is a loss that sticks, {loss!r}, which acts at rest where there is no "
                    "direction; add it: Valves(…) + Coulomb(…), or give it a smoothing"
                )

    def parts(self) -> dict[str, Loss]:
        """Both losses by direction."""
        return {"backward": self.backward, "forward": self.forward}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """The force of the direction of motion."""
        ahead, back = maximum(rate, 0.0), minimum(rate, 0.0)
        sides: tuple[Loss, Loss] = (self.forward, self.backward)
        return sides[0].force(ahead, scope, f"{owner}.forward") + sides[1].force(back, scope, f"{owner}.backward")

    def rates(self, rate: Scalar, scope: Scope, owner: str) -> StateRates:
        """The states of both, each bent by the motion in its direction."""
        ahead, back = maximum(rate, 0.0), minimum(rate, 0.0)
        sides: tuple[Loss, Loss] = (self.forward, self.backward)
        return [
            *sides[0].rates(ahead, scope, f"{owner}.forward"), *sides[1].rates(back, scope, f"{owner}.backward"),
        ]  # fmt: skip

    def elastic(self, scope: Scope, owner: str) -> Scalar:
        """What both store."""
        sides: tuple[Loss, Loss] = (self.forward, self.backward)
        return sides[0].elastic(scope, f"{owner}.forward") + sides[1].elastic(scope, f"{owner}.backward")

    @property
    def has_states(self) -> bool:
        """Whether one of both does."""
        return any(loss.has_states for loss in self.parts().values())

    def fields(self) -> dict[str, float]:
        """Those of both: 'backward.coefficient', 'forward.coefficient'."""
        return {
            f"{side}.{field}": value for side, loss in self.parts().items() for field, value in loss.fields().items()
        }

    def value_faults(self, owner: str, values: Mapping[str, float]) -> list[str]:
        """Those of both."""
        return [fault for side, loss in self.parts().items() for fault in loss.value_faults(f"{owner}.{side}", values)]

    def faults(self, owner: str) -> list[str]:
        """Those of both."""
        return [fault for side, loss in self.parts().items() for fault in loss.faults(f"{owner}.{side}")]
