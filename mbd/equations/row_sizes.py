"""How large the parts of a row's Jacobian are before they cancel.

A row is written in places and directions of bodies (views). Its derivative by a coordinate x_j is the sum over these of
``∂h/∂view · ∂view/∂x_j``, with ``∂p/∂x_j = û_j + ω̂_j × (p − o_j)`` and ``∂R/∂x_j = ω̂_j × R``. The sizes

``Σ |∂h/∂view| · (|û_j| + |ω̂_j| (|p| + |o_j|))`` for places,  ``Σ |∂h/∂view| · |ω̂_j|`` for directions

do not vanish where the parts cancel, as those of two frames on one axis do: what is left of a derivative below its
round-off says that the row does not depend on x_j at all.
"""

from __future__ import annotations

from collections.abc import Sequence

from mbd.bodies.algebra import norm
from mbd.equations.kinematic_proxies import KinematicProxies, View
from mbd.equations.placement import Placement, Point
from mbd.tape.derivatives import gradient
from mbd.tape.node import Node, Scalar

__all__ = ["row_sizes"]


def row_sizes(
    placement: Placement, views: KinematicProxies, viewed: Node, inputs: Sequence[Node], motion: bool
) -> list[Node]:
    """Σ|parts| of the derivative of a row by each coordinate.

    Parameters
    ----------
    viewed : the value of the row in views, or the rate of one on velocities
    inputs : x, or v of a row on velocities
    motion : whether the row holds velocities
    """
    inside = [view for view in views.inside([viewed]) if view.motion == motion]
    slopes = [abs(slope) for slope in views.real(gradient(viewed, [*inputs, *(view.node for view in inside)]))]
    sizes: list[Scalar] = list(slopes[: len(inputs)])
    for view, slope in zip(inside, slopes[len(inputs) :], strict=True):
        for j in view.of.carrier.path:
            sizes[j] = sizes[j] + slope * _motion(placement, view, j)
    return [placement.tape.lift(size) for size in sizes]


def _motion(placement: Placement, view: View, j: int) -> Scalar:
    """How far coordinate j moves a place or turns a direction, without cancellation."""
    mover = placement.movers[j]
    assert mover.edge is not None
    column = placement.columns(mover)[j - mover.edge.first]
    turn = norm(column.angular)
    if not isinstance(view.of, Point):
        return turn
    return norm(column.linear) + turn * (norm(view.of.position) + norm(placement.joint(mover).position))
