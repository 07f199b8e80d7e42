"""How places and rotations change: derivatives by geometry instead of through the chain of rotations.

Along a velocity v_j that turns all bodies beyond its joint at o_j about ω̂_j and moves them by û_j, places and rotations
change by

``û_j + ω̂_j × (p − o_j)``,  ``ω̂_j × R``,  and by ``ṗ`` and ``ω × R`` in time.

Where coordinates add these are ∂p/∂x_j and ∂R/∂x_j; else see `Inputs.by_increments`.
"""

from collections.abc import Sequence

from mbd.bodies.algebra import cross, difference, rotate, total
from mbd.bodies.scope import Triple
from mbd.equations.kinematics import Moving
from mbd.equations.placement import Axes, Mark, Placement, Point
from mbd.tape.derivatives import live
from mbd.tape.node import Node, Scalar


def partials(placement: Placement, outputs: Sequence[Node]) -> list[dict[Node, Node]]:
    """For each velocity v_j, the derivative along it of the places and rotations that the outputs are made of."""
    lift = placement.tape.lift
    found: list[dict[Node, Node]] = [{} for _ in placement.movers]
    for node, mark in _marked(placement, outputs):
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
    for node, mark in _marked(placement, outputs):
        if isinstance(mark.of, Axes):
            change = cross(placement.angular_velocity(mark.of.carrier), _column(mark.of, mark.column))
        else:
            change = placement.velocity(mark.of)
        found[node] = placement.tape.lift(mark.sign * change[mark.axis])
    return found


def _marked(placement: Placement, outputs: Sequence[Node]) -> list[tuple[Node, Mark]]:
    """The nodes inside the outputs that are known, and what they are; nothing behind them."""
    marks = placement.marks
    return [(node, marks[node.index]) for node in live(outputs, marks) if node.index in marks]
