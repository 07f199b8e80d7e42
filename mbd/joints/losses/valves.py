"""One loss for motion backwards and another for motion forwards: one-way valves."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from mbd.bodies.scope import Scope
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss, LossSum, StateRates, rates_of
from mbd.tape.functions import maximum, minimum, where
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class Valves(Loss):
    """``F = F_forward(max(v, 0)) + F_backward(min(v, 0))``: check valves lead each direction through its own orifice.

    A knee bends with negative rates and stretches with positive ones; a damper between two points shortens and extends.

    Losses with memory share one deflection z, 'owner.deflection': oil that is compressed opens the valve of the
    direction in which it presses, and what is stored goes back first when the motion reverses. Force and rate of z are
    those of `forward` where z > 0, else those of `backward`, so that ``F v ≥ U̇`` holds as for each of them.

    Parameters
    ----------
    backward : a loss at negative rates; its parameters are 'owner.backward.coefficient', …
    forward : a loss at positive rates

    Raises
    ------
    ModelError
        for a loss that truly sticks or follows the force in the joint, which no direction tells apart; add such to the
        sum instead: ``Valves(…) + Coulomb(2.0)``. For a loss with memory beside another kind, or within a sum.
    """

    backward: Loss
    forward: Loss

    def __post_init__(self) -> None:
        for field, loss in self.parts().items():
            if not isinstance(loss, Loss):
                raise ModelError(f"{field} of Valves is a loss such as mbd.Quadratic(0.5), got {loss!r}")
            if loss.needs_reaction or loss.sticks:
                raise ModelError(
                    f"{field} of Valves is a loss that sticks, {loss!r}, which acts at rest where there is no "
                    "direction; add it: Valves(…) + Coulomb(…), or give it a smoothing"
                )
        one_kind = type(self.forward) is type(self.backward) and not isinstance(self.forward, LossSum | Valves)
        if self.has_states and not one_kind:
            raise ModelError(
                f"Valves of {self.backward!r} and {self.forward!r}: losses with memory share one deflection, so that "
                "both directions take the same kind, each alone; put others beside them: Valves(…) + Valves(…)"
            )

    def parts(self) -> dict[str, Loss]:
        """Both losses by direction."""
        return {"backward": self.backward, "forward": self.forward}

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """The force of the direction of motion, or of the deflection."""
        if self.has_states:
            return self._of_deflection(scope, owner, lambda loss, own, name: loss.force(rate, own, name))[1]
        ahead, back = maximum(rate, 0.0), minimum(rate, 0.0)
        sides: tuple[Loss, Loss] = (self.forward, self.backward)
        return sides[0].force(ahead, scope, f"{owner}.forward") + sides[1].force(back, scope, f"{owner}.backward")

    def rates(self, rate: Scalar, scope: Scope, owner: str) -> StateRates:
        """The rate of the deflection, if they have one."""
        return [self._of_deflection(scope, owner, partial(_bending, rate))] if self.has_states else []

    def elastic(self, scope: Scope, owner: str) -> Scalar:
        """What the deflection stores."""
        return self._of_deflection(scope, owner, lambda loss, own, name: loss.elastic(own, name))[1]

    def _of_deflection(self, scope: Scope, owner: str, part: Callable[[Loss, Any, str], Scalar]) -> tuple[Node, Scalar]:
        """The deflection that both share, and what the side to which it points has of something."""
        shared = _SharedState(scope, owner)
        ahead, back = part(self.forward, shared, f"{owner}.forward"), part(self.backward, shared, f"{owner}.backward")
        return shared.node, where(shared.node > 0.0, ahead, back)

    @property
    def has_states(self) -> bool:
        """Whether one of both does."""
        return any(loss.has_states for loss in self.parts().values())

    @property
    def is_directed(self) -> bool:
        """Always: each direction has run-time parameters of its own."""
        return True

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


class _SharedState:
    """A scope in which the states of both sides are one."""

    def __init__(self, scope: Scope, owner: str) -> None:
        self._scope, self._owner = scope, owner
        self.node: Any = 0.0

    def state(self, owner: str, field: str, initial: float) -> Node:
        """The one of the owner of both."""
        self.node = self._scope.state(self._owner, field, initial)
        found: Node = self.node
        return found

    def __getattr__(self, name: str) -> Any:
        return getattr(self._scope, name)


def _bending(rate: Scalar, loss: Loss, scope: Any, name: str) -> Scalar:
    """The rate of the one state of a loss."""
    pairs = rates_of(loss, rate, scope, name)
    if len(pairs) != 1:
        raise ModelError(f"Valves take losses of one state each, but {loss!r} has {len(pairs)}")
    return pairs[0][1]
