"""What words see of places and velocities: inputs of their own, each with the body that carries it.

A word writes its forces and measures in views, so that the virtual work of each is known to be done on a place or a
rotation of a certain body, whatever the tape finds equal afterwards; `KinematicProxies.real` then puts
the motion itself in.
"""

from collections.abc import Collection, Sequence

from mbd.bodies.algebra import ZERO, cross, rotate, transpose
from mbd.bodies.scope import Rotation, Triple
from mbd.dataclass import dataclass
from mbd.equations.kinematics import Moving
from mbd.equations.placement import Axes, Heading, Placement, Point
from mbd.tape.derivatives import live, substitute, vjp
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True, eq=False)
class View:
    """Component `axis` of a point, element (axis, column) of a rotation, a heading; if `motion`, of its velocity."""

    of: Point | Axes | Heading
    axis: int
    column: int
    motion: bool
    node: Node
    real: Node


@dataclass(frozen=True, eq=False)
class Wrench:
    """A force at a place of a body [N], and a torque on it [N m], in body axes; `ground`: the force in ground axes."""

    carrier: Moving
    place: Triple = ZERO
    force: Triple = ZERO
    torque: Triple = ZERO
    ground: Triple = ZERO


class KinematicProxies:
    """Places and velocities of a tree as words see them.

    A component that never changes is a view too where a virtual motion would change it; only what is constant out of
    the plane of a planar mechanism is plainly constant.

    Parameters
    ----------
    coordinates : nodes on which a force acts as a generalized force
    planar : whether all moves in x–y and turns about z
    """

    def __init__(self, placement: Placement, coordinates: Collection[Node], planar: bool) -> None:
        self._placement, self._tape, self._planar = placement, placement.tape, planar
        self._coordinates = frozenset(coordinates)
        self._known: dict[int, View] = {}
        self._nodes: dict[tuple[Point | Axes | Heading, int, int, bool], Scalar] = {}

    def _view(
        self, of: Point | Axes | Heading, real: Scalar, axis: int, column: int = 0, motion: bool = False
    ) -> Scalar:
        key = (of, axis, column, motion)
        if key not in self._nodes:
            node = self._tape.lift(real)
            if not (node.is_constant and self._is_fixed(of, axis, column, motion)):
                view = self._tape.input("view", len(self._known))
                self._known[view.index] = View(of, axis, column, motion, view, node)
                node = view
            self._nodes[key] = node
        return self._nodes[key]

    def _is_fixed(self, of: Point | Axes | Heading, axis: int, column: int, motion: bool) -> bool:
        """Whether no virtual motion changes a component."""
        if of.carrier.parent is None:
            return True
        if isinstance(of, Heading):
            return False
        if isinstance(of, Axes) and motion:
            return self._planar and axis != 2
        return self._planar and (axis == 2 or column == 2)

    def position(self, point: Point) -> Triple:
        """p."""
        x, y, z = (self._view(point, point.position[axis], axis) for axis in range(3))
        return (x, y, z)

    def velocity(self, point: Point) -> Triple:
        """ṗ."""
        real = self._placement.velocity(point)
        x, y, z = (self._view(point, real[axis], axis, motion=True) for axis in range(3))
        return (x, y, z)

    def rotation(self, axes: Axes) -> Rotation:
        """R."""
        R = axes.rotation
        a, b, c = (tuple(self._view(axes, R[i][k], i, k) for k in range(3)) for i in range(3))
        return (a, b, c)  # type: ignore[return-value]

    def heading(self, heading: Heading) -> Scalar:
        """The angle of a body in the plane."""
        return self._view(heading, heading.angle, 2)

    def angular_velocity(self, axes: Axes) -> Triple:
        """ω."""
        real = self._placement.angular_velocity(axes.carrier)
        x, y, z = (self._view(axes, real[axis], axis, motion=True) for axis in range(3))
        return (x, y, z)

    def inside(self, outputs: Sequence[Node]) -> list[View]:
        """The views that some expressions are made of."""
        return [self._known[node.index] for node in live(outputs) if node.index in self._known]

    def real(self, outputs: Sequence[Node]) -> list[Node]:
        """The expressions with the motion itself in place of the views."""
        return substitute(outputs, {view.node: view.real for view in self.inside(outputs)})

    def rates(self, outputs: Sequence[Node]) -> dict[Node, Scalar]:
        """d view/dt, in views, of the places and rotations that some expressions are made of."""
        found: dict[Node, Scalar] = {}
        for view in self.inside(outputs):
            if view.motion:
                continue
            if isinstance(view.of, Point):
                found[view.node] = self.velocity(view.of)[view.axis]
            elif isinstance(view.of, Heading):
                found[view.node] = self.angular_velocity(self._placement.axes(view.of.carrier))[2]
            else:
                R = self.rotation(view.of)
                column = (R[0][view.column], R[1][view.column], R[2][view.column])
                found[view.node] = cross(self.angular_velocity(view.of), column)[view.axis]
        return found

    def pulls(
        self,
        values: Sequence[Node],
        multipliers: Sequence[Scalar],
        inputs: Sequence[Node],
        *,
        motion: bool,
        attributed: bool,
    ) -> tuple[list[Wrench], list[Node]]:
        """Forces on bodies, and the part that acts on the `inputs` themselves.

        Their virtual work is ``Σ multiplier · δvalue``. The values are functions of the configuration, or, if `motion`,
        of velocities, with the multipliers and the configuration held fixed. Unless forces must be `attributed` to
        bodies, one on a place that is a coordinate itself acts on that coordinate.
        """
        if not values:
            return [], [self._tape.zero] * len(inputs)
        if not attributed:
            values = substitute(values, {v.node: v.real for v in self.inside(values) if self._is_coordinate(v.real)})
        views = [view for view in self.inside(values) if view.motion == motion]
        bars = self.real(vjp(values, multipliers, [*inputs, *(view.node for view in views)]))
        shares: dict[Point | Axes | Heading, list[list[Scalar]]] = {}
        for view, bar in zip(views, bars[len(inputs) :], strict=True):
            share = shares.setdefault(view.of, [[0.0, 0.0, 0.0] for _ in range(3)])
            share[view.column][view.axis] = bar
        return [self._pull(of, share, motion) for of, share in shares.items()], bars[: len(inputs)]

    def _is_coordinate(self, node: Node) -> bool:
        return node.op == "input" or node in self._coordinates

    def _pull(self, of: Point | Axes | Heading, share: Sequence[Sequence[Scalar]], motion: bool) -> Wrench:
        """From ground axes to a force or a torque in body axes; ``δR = δθ × R`` gives the torque Σ_k e_k × Rᵀ bar_k."""
        if isinstance(of, Heading):
            return Wrench(of.carrier, torque=(0.0, 0.0, share[0][2]))
        back = transpose(self._placement.axes(of.carrier).rotation)
        columns = [rotate(back, (bar[0], bar[1], bar[2])) for bar in share]
        if isinstance(of, Point):
            return Wrench(of.carrier, of.place, force=columns[0], ground=(share[0][0], share[0][1], share[0][2]))
        if motion:
            return Wrench(of.carrier, torque=columns[0])
        (_, a, b), (c, _, d), (e, f, _) = columns
        return Wrench(of.carrier, torque=(d - f, e - b, a - c))
