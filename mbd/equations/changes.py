"""How places and rotations change: derivatives by geometry, and forces on them as forces on the bodies.

For a coordinate x_j that turns all bodies beyond its joint at o_j about ω̂_j and moves them by û_j,

``∂p/∂x_j = û_j + ω̂_j × (p − o_j)``,  ``∂R/∂x_j = ω̂_j × R``,  ``ṗ`` and ``ω × R`` in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mbd.bodies.algebra import ZERO, cross, difference, rotate, total, transpose
from mbd.equations.kinematics import Moving
from mbd.equations.placement import Axes, Mark, Placement, Point
from mbd.scope import Triple
from mbd.tape.derivatives import live, vjp
from mbd.tape.node import Node, Scalar

__all__ = ["Pull", "motion_seeds", "partials", "pulls", "rates"]


def partials(placement: Placement, outputs: Sequence[Node]) -> list[dict[Node, Node]]:
    """For each coordinate x_j, ∂node/∂x_j of the places and rotations that the outputs are made of."""
    lift = placement.tape.lift
    found: list[dict[Node, Node]] = [{} for _ in placement.movers]
    for node, mark in _marked(placement.places, outputs):
        for j in mark.of.carrier.path:
            found[j][node] = lift(mark.sign * _slope(placement, mark, j))
    return found


def _slope(placement: Placement, mark: Mark, j: int) -> Scalar:
    mover = placement.movers[j]
    assert mover.edge is not None
    column = placement.columns(mover)[j - mover.edge.first]
    if isinstance(mark.of, Axes):
        return cross(column.angular, _column(mark.of, mark.column))[mark.axis]
    return total(column.linear, cross(column.angular, _arm(placement, mark.of, mover)))[mark.axis]


def _arm(placement: Placement, point: Point, mover: Moving) -> Triple:
    """p − o_j, without the way to the origin and back where both are on one body."""
    if point.carrier is mover:
        return rotate(placement.axes(mover).rotation, difference(point.place, mover.shift))
    return difference(point.position, placement.joint(mover).position)


def _column(axes: Axes, k: int) -> Triple:
    R = axes.rotation
    return (R[0][k], R[1][k], R[2][k])


def rates(placement: Placement, outputs: Sequence[Node]) -> dict[Node, Node]:
    """d node/dt of the places and rotations that the outputs are made of."""
    found: dict[Node, Node] = {}
    for node, mark in _marked(placement.places, outputs):
        if isinstance(mark.of, Axes):
            change = cross(placement.angular_velocity(mark.of.carrier), _column(mark.of, mark.column))
        else:
            change = placement.velocity(mark.of)
        found[node] = placement.tape.lift(mark.sign * change[mark.axis])
    return found


def _marked(marks: dict[int, Mark], outputs: Sequence[Node]) -> list[tuple[Node, Mark]]:
    """The nodes inside the outputs that are known, and what they are; nothing behind them."""
    return [(node, marks[node.index]) for node in live(outputs, marks) if node.index in marks]


@dataclass(frozen=True, eq=False)
class Pull:
    """A force at a place of a body [N], and a torque on it [N m], in body axes."""

    carrier: Moving
    place: Triple = ZERO
    force: Triple = ZERO
    torque: Triple = ZERO


def pulls(
    placement: Placement, values: Sequence[Scalar], multipliers: Sequence[Scalar], inputs: Sequence[Node], motion: bool
) -> tuple[list[Pull], list[Node]]:
    """Forces on bodies, and the part that acts on the `inputs` themselves.

    Their virtual work is ``Σ multiplier · δvalue``. The values are functions of the configuration, or, if `motion`, of
    velocities, with the multipliers and the configuration held fixed.
    """
    outputs = [placement.tape.lift(value) for value in values]
    marked = _marked(placement.motions if motion else placement.places, outputs)
    bars = vjp(outputs, multipliers, [*inputs, *(node for node, _ in marked)])
    shares: dict[Point | Axes, list[list[Scalar]]] = {}
    for (_, mark), bar in zip(marked, bars[len(inputs) :], strict=True):
        share = shares.setdefault(mark.of, [[0.0, 0.0, 0.0] for _ in range(3)])
        share[mark.column][mark.axis] = share[mark.column][mark.axis] + mark.sign * bar
    return [_pull(placement, of, share, motion) for of, share in shares.items()], bars[: len(inputs)]


def _pull(placement: Placement, of: Point | Axes, share: Sequence[Sequence[Scalar]], motion: bool) -> Pull:
    """From derivatives in ground axes to a force or a torque in body axes; ``δR = δθ × R`` gives Σ_k e_k × Rᵀ bar_k."""
    back = transpose(placement.axes(of.carrier).rotation)
    columns = [rotate(back, (bar[0], bar[1], bar[2])) for bar in share]
    if isinstance(of, Point):
        return Pull(of.carrier, of.place, force=columns[0])
    if motion:
        return Pull(of.carrier, torque=columns[0])
    (_, a, b), (c, _, d), (e, f, _) = columns
    return Pull(of.carrier, torque=(d - f, e - b, a - c))


def motion_seeds(placement: Placement, outputs: Sequence[Node], v: Sequence[Node]) -> dict[Node, Node]:
    """The direction of v itself: every velocity inside the outputs changes by its own value."""
    return {**{rate: rate for rate in v}, **{node: node for node, _ in _marked(placement.motions, outputs)}}
