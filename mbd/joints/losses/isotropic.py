"""A loss of a velocity in a plane or in space, against it whatever its direction."""

from collections.abc import Sequence

from mbd.bodies.scope import Scope
from mbd.equal import MIN_SQUARED_SPEED
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss, LossSum
from mbd.joints.losses.viscous import Viscous
from mbd.tape.functions import sqrt
from mbd.tape.node import Scalar


def isotropic(loss: Loss, velocity: Sequence[Scalar], scope: Scope, owner: str) -> list[Scalar]:
    """``F(‖v‖) v/‖v‖`` of the smooth part of a loss, for the components v along perpendicular axes.

    Raises
    ------
    ModelError
        for a loss that differs by direction where v has several components, so that no direction is positive.
    """
    if len(velocity) > 1 and loss.is_directed:
        raise ModelError(
            f"'{owner}': {loss!r} differs by the sign of a rate, which a velocity of {len(velocity)} components does "
            "not have; give a loss with F(−v) = −F(v), or losses of single velocities, "
            "loss={'angular_velocity.x': …}"
        )
    if isinstance(loss, LossSum):
        parts = [isotropic(part, velocity, scope, name) for name, part in loss.named(owner)]
        return [_sum(forces) for forces in zip(*parts, strict=True)]
    if len(velocity) == 1 or isinstance(loss, Viscous):
        return [loss.force(rate, scope, owner) for rate in velocity]
    size: Scalar = sqrt(_sum([MIN_SQUARED_SPEED, *(rate * rate for rate in velocity)]))
    share = loss.force(size, scope, owner) / size
    return [share * rate for rate in velocity]


def _sum(values: Sequence[Scalar]) -> Scalar:
    result: Scalar = 0.0
    for value in values:
        result = result + value
    return result
