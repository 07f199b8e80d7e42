"""Places, rotations and velocities in ground axes, made where something asks.

Every point, rotation and velocity made here is remembered with the body that carries it; `changes` knows from that how
they change, without differentiating through the chain of rotations.
"""

from collections.abc import Collection, Sequence

from mbd.bodies.algebra import IDENTITY, ZERO, cross, difference, product, rotate, total
from mbd.bodies.scope import Rotation, Triple
from mbd.dataclass import dataclass
from mbd.equations.kinematics import Column, Moving
from mbd.tape.node import Node, Scalar, Tape


@dataclass(frozen=True, eq=False)
class Point:
    """A place carried by a body: in body axes, and in ground axes; `at_joint` if it is where its joint holds it."""

    carrier: Moving
    place: Triple
    position: Triple
    at_joint: bool = False


@dataclass(frozen=True, eq=False)
class Axes:
    """The rotation of a body: its axes as columns, in ground axes."""

    carrier: Moving
    rotation: Rotation


@dataclass(frozen=True, eq=False)
class Heading:
    """The direction of a body of a planar mechanism: the sum of the angles on its path, over any number of turns."""

    carrier: Moving
    angle: Scalar


@dataclass(frozen=True, eq=False)
class Mark:
    """What a node is: component `axis` of a point, or element (axis, column) of a rotation; or the negative of it."""

    of: Point | Axes
    axis: int
    column: int = 0
    sign: float = 1.0


class Placement:
    """Everything in ground axes of the bodies of a tree.

    marks : what nodes are known to be, by their index
    movers : for each coordinate number, the body that it moves against its parent
    """

    def __init__(self, tape: Tape, bodies: Sequence[Moving], coordinates: Collection[Node]) -> None:
        self.tape = tape
        self.movers = [body for body in bodies if body.edge is not None for _ in body.columns]
        self.marks: dict[int, Mark] = {}
        self._coordinates = frozenset(coordinates)
        self._axes: dict[Moving, Axes] = {}
        self._points: dict[tuple[Moving, int, int, int], Point] = {}
        self._columns: dict[Moving, list[Column]] = {}
        self._angular: dict[Moving, Triple] = {}
        self._linear: dict[Point, Triple] = {}

    def axes(self, body: Moving) -> Axes:
        """The rotation of a body."""
        known = self._axes.get(body)
        if known is None:
            R = IDENTITY if body.parent is None else product(self.axes(body.parent).rotation, body.turn)
            known = self._axes[body] = Axes(body, R)
            for i in range(3):
                for k in range(3):
                    self._remember(R[i][k], Mark(known, i, k))
        return known

    def directions(self) -> list[Scalar]:
        """The elements of all rotations made so far."""
        return [element for axes in self._axes.values() for row in axes.rotation for element in row]

    def point(self, body: Moving, place: Triple) -> Point:
        """A place of a body, given in its axes."""
        key = self._key(body, place)
        known = self._points.get(key)
        if known is None and key == self._key(body, body.shift) and body.parent is not None:
            return self.joint(body)
        if known is None:
            position = total(self._origin(body), rotate(self.axes(body).rotation, place))
            known = self._made(key, Point(body, place, position))
        return known

    def joint(self, body: Moving) -> Point:
        """Where the joint that moves a body against its parent holds it."""
        assert body.parent is not None
        key = self._key(body, body.shift)
        known = self._points.get(key)
        if known is None:
            position = total(self._origin(body.parent), rotate(self.axes(body.parent).rotation, body.arm))
            known = self._made(key, Point(body, body.shift, position, at_joint=True))
        return known

    def _key(self, body: Moving, place: Triple) -> tuple[Moving, int, int, int]:
        x, y, z = (self.tape.lift(part).index for part in place)
        return (body, x, y, z)

    def _made(self, key: tuple[Moving, int, int, int], point: Point) -> Point:
        self._points[key] = point
        for axis in range(3):
            self._remember(point.position[axis], Mark(point, axis))
        return point

    def _origin(self, body: Moving) -> Triple:
        if body.parent is None:
            return ZERO
        return difference(self.joint(body).position, rotate(self.axes(body).rotation, body.shift))

    def columns(self, body: Moving) -> list[Column]:
        """Motion of a body per unit rate of each coordinate of its joint."""
        known = self._columns.get(body)
        if known is None:
            assert body.parent is not None
            before, after = self.axes(body.parent).rotation, self.axes(body).rotation
            known = [Column(rotate(after, c.angular), rotate(before, c.linear)) for c in body.columns]
            self._columns[body] = known
        return known

    def angular_velocity(self, body: Moving) -> Triple:
        """ω [rad/s]."""
        known = self._angular.get(body)
        if known is None:
            known = self._angular[body] = rotate(self.axes(body).rotation, body.angular_velocity)
        return known

    def velocity(self, point: Point) -> Triple:
        """ṗ [m/s]."""
        known = self._linear.get(point)
        if known is None:
            body = point.carrier
            if point.at_joint:
                assert body.parent is not None
                sliding = rotate(self.axes(body.parent).rotation, body.sliding)
                known = total(self._carried(body.parent, body.arm), sliding)
            else:
                known = self._carried(body, point.place)
            self._linear[point] = known
        return known

    def _carried(self, body: Moving, place: Triple) -> Triple:
        """Velocity of a place that stands still in the body."""
        if body.parent is None:
            return ZERO
        joint, R, omega = self.velocity(self.joint(body)), self.axes(body).rotation, self.angular_velocity(body)
        from_joint = difference(cross(omega, rotate(R, place)), cross(omega, rotate(R, body.shift)))
        return total(joint, from_joint)

    def _remember(self, value: Scalar, mark: Mark) -> None:
        """Note what a node is; a negative is noted by what it is the negative of, too."""
        if not isinstance(value, Node) or not value.args or value in self._coordinates:
            return
        self.marks.setdefault(value.index, mark)
        inner = value.args[0]
        if value.op == "neg" and inner.args and inner not in self._coordinates:
            self.marks.setdefault(inner.index, Mark(mark.of, mark.axis, mark.column, -1.0))
