"""Motion of bodies in their own axes, by recursion over the spanning tree.

For a joint that turns the child by R and moves it by p against its parent, with ω_r the relative angular velocity,
everything of the child in child axes, and gravity carried as an acceleration −g of the ground:

``ω = Rᵀ ω_p + ω_r``,  ``α = Rᵀ α_p + (Rᵀ ω_p) × ω_r + ω̇_r``
``v = Rᵀ (v_p + ω_p × d + ṗ)``,  ``a = Rᵀ (a_p + A_p d + 2 ω_p × ṗ + p̈)``,  ``A = [α]ₓ + [ω]ₓ²``

at the joint, whose place is d in the parent; A maps places in a body to their acceleration against its origin.
Absolute positions and rotations do not occur: they are made in `placement` where something asks for them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mbd.bodies.algebra import IDENTITY, ZERO, cross, difference, product, rotate, scaled, total, transpose
from mbd.bodies.base import Body
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.base import Joint
from mbd.tape.derivatives import jvp, live
from mbd.tape.node import Node, Scalar, Tape


@dataclass(frozen=True)
class Column:
    """Motion of the child per unit of one velocity: angular in child axes, linear in the parent's axes."""

    angular: Triple
    linear: Triple


@dataclass(frozen=True)
class Edge:
    """A joint of the spanning tree and its motion.

    first : number of its first velocity in v and x
    values, rates, accelerations : q ⊕ x, v and a of the joint; increments, increment_rates : its x and ẋ
    """

    joint: Joint
    first: int
    values: tuple[Node, ...]
    rates: tuple[Node, ...]
    accelerations: tuple[Node, ...]
    increments: tuple[Node, ...]
    increment_rates: tuple[Node, ...]


@dataclass(frozen=True)
class Twist:
    """Velocity of a body: angular, and of its origin, in body axes."""

    angular: Triple
    linear: Triple


@dataclass(frozen=True, eq=False)
class Moving:
    """A body of the tree.

    turn : R, child axes in parent axes; arm : d, the joint in the parent; shift : the joint in the child
    columns : motion per unit of each velocity
    turning, sliding : ω_r in child axes; ṗ of the joint's child frame against the parent in parent axes
    sliding_rate : p̈ of the same
    angular_velocity, angular_acceleration, acceleration : ω, α, and a − g of the origin, child axes
    spin : A = [α]ₓ + [ω]ₓ²
    path : numbers of the velocities that move it
    """

    body: Body
    parent: Moving | None
    edge: Edge | None
    angular_velocity: Triple
    angular_acceleration: Triple
    acceleration: Triple
    spin: Rotation
    turn: Rotation = IDENTITY
    arm: Triple = ZERO
    shift: Triple = ZERO
    columns: tuple[Column, ...] = ()
    turning: Triple = ZERO
    sliding: Triple = ZERO
    sliding_rate: Triple = ZERO
    path: tuple[int, ...] = ()

    def acceleration_at(self, place: Triple) -> Triple:
        """a − g of a point of the body [m/s²], body axes."""
        return total(self.acceleration, rotate(self.spin, place))


def ground_motion(body: Body, gravity: Triple) -> Moving:
    """The ground: at rest, with the acceleration −g that stands for gravity."""
    still = (ZERO, ZERO, ZERO)
    return Moving(body, None, None, ZERO, ZERO, scaled(-1.0, gravity), still)


def moving_body(body: Body, parent: Moving, edge: Edge, scope: Scope) -> Moving:
    """The next body of the recursion."""
    turn, arm, shift, columns = _geometry(edge, scope)
    motion = joint_motion(edge, columns, scope.tape)
    omega, alpha, acceleration, spin = carried(parent, turn, arm, shift, motion)
    path = (*parent.path, *range(edge.first, edge.first + len(edge.rates)))
    return Moving(
        body, parent, edge, omega, alpha, acceleration, spin, turn, arm, shift, columns, motion[0], *motion[2:], path,
    )  # fmt: skip


def carried(
    parent: Moving, turn: Rotation, arm: Triple, shift: Triple, motion: tuple[Triple, Triple, Triple, Triple]
) -> tuple[Triple, Triple, Triple, Rotation]:
    """ω, α, a − g of the origin and A of a body that a parent carries by a joint, which moves by ω_r, ω̇_r, ṗ, p̈."""
    turning, turning_rate, sliding, sliding_rate = motion
    back = transpose(turn)
    with_parent = rotate(back, parent.angular_velocity)
    omega = total(with_parent, turning)
    alpha = total(total(rotate(back, parent.angular_acceleration), cross(with_parent, turning)), turning_rate)
    coriolis = scaled(2.0, cross(parent.angular_velocity, sliding))
    at_joint = total(total(parent.acceleration_at(arm), coriolis), sliding_rate)
    spin = spin_of(omega, alpha)
    return omega, alpha, difference(rotate(back, at_joint), rotate(spin, shift)), spin


def _geometry(edge: Edge, scope: Scope) -> tuple[Rotation, Triple, Triple, tuple[Column, ...]]:
    """R, d, the joint in the child, and the columns.

    Where a coordinate adds, the shift per unit rate is ∂p/∂x, which stays constant for joints that slide along axes of
    their parent; else it is the joint's own column, turned into parent axes.
    """
    joint = edge.joint
    R_parent, p_parent = joint.parent.placement(scope)
    R_child, p_child = joint.child.placement(scope)
    R, p = joint.transform(edge.values, scope)
    motions = joint.subspace(edge.values, scope)
    _require_coordinates_alone(joint, (*R, p, *(each for pair in motions for each in pair)))
    columns = []
    for k, ((angular, linear), x) in enumerate(zip(motions, edge.increments, strict=True)):
        slope = _jvp(p, {x: 1.0}, scope.tape) if joint.is_vector or _adds(edge, k) else rotate(R, linear)
        columns.append(Column(rotate(R_child, angular), rotate(R_parent, slope)))
    turn = product(product(R_parent, R), transpose(R_child))
    return turn, total(p_parent, rotate(R_parent, p)), p_child, tuple(columns)


def _require_coordinates_alone(joint: Joint, found: Sequence[Triple]) -> None:
    """Raise a `ModelError` where the placement by a joint of a user's own follows more than its coordinates.

    Velocities and accelerations are those of the coordinates, without what time or other motion would add.
    """
    inner = getattr(joint, "joint", joint)
    if type(inner).__module__.startswith("mbd."):
        return
    parts = [part for triple in found for part in triple if isinstance(part, Node)]
    inputs = [node.data[0] for node in live(parts) if node.op == "input"]
    if any(kind not in ("q", "x", "p") for kind in inputs):
        raise ModelError(
            f"{joint.known_as} ({type(inner).__name__}): its transform or subspace follows "
            f"{'the time' if 't' in inputs else 'other motion'}; they may depend on its coordinates and parameters "
            "only. Let a coordinate take what moves, and prescribe it: mbd.Bilateral('drive', mbd.measure("
            f"'{joint.coordinate_names[0] if joint.labels else joint.name}'), value=lambda t: …)"
        )


def _adds(edge: Edge, k: int) -> bool:
    """Whether a velocity moves one increment alone, and is its rate."""
    rate = edge.rates[k]
    others = [other for j, other in enumerate(edge.increment_rates) if j != k]
    return edge.increment_rates[k] is rate and not any(node is rate for node in live(others))


def joint_motion(edge: Edge, columns: Sequence[Column], tape: Tape) -> tuple[Triple, Triple, Triple, Triple]:
    """ω_r, ω̇_r in child axes and ṗ, p̈ in parent axes."""
    turning, sliding = _combined(columns, edge.rates)
    turning_rate, sliding_rate = _combined(columns, edge.accelerations)
    clock = dict(zip(edge.increments, edge.increment_rates, strict=True))
    for column, rate in zip(columns, edge.rates, strict=True):
        turning_rate = total(turning_rate, scaled(rate, _jvp(column.angular, clock, tape)))
        sliding_rate = total(sliding_rate, scaled(rate, _jvp(column.linear, clock, tape)))
    return turning, turning_rate, sliding, sliding_rate


def _combined(columns: Sequence[Column], rates: Sequence[Scalar]) -> tuple[Triple, Triple]:
    """Σ column · rate."""
    angular: Triple = ZERO
    linear: Triple = ZERO
    for column, rate in zip(columns, rates, strict=True):
        angular, linear = total(angular, scaled(rate, column.angular)), total(linear, scaled(rate, column.linear))
    return angular, linear


def _jvp(vector: Triple, seeds: Mapping[Node, Scalar], tape: Tape) -> Triple:
    """Derivative of a triple along a direction; zero for plain numbers."""
    if all(isinstance(part, float) or part.is_constant for part in vector):
        return ZERO
    x, y, z = jvp([tape.lift(part) for part in vector], seeds)
    return (x, y, z)


def spin_of(omega: Triple, alpha: Triple) -> Rotation:
    """A = [α]ₓ + [ω]ₓ² = [α]ₓ + ω ωᵀ − |ω|² 1."""
    (x, y, z), (ax, ay, az) = omega, alpha
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return (
        (-(yy + zz), xy - az, xz + ay),
        (xy + az, -(xx + zz), yz - ax),
        (xz - ay, yz + ax, -(xx + yy)),
    )


def twists(bodies: Sequence[Moving], extra: Mapping[str, Twist] | None = None) -> dict[str, Twist]:
    """Velocities of all bodies by name, in body axes, linear in v.

    `extra` adds a virtual motion to a body at its joint, in body axes: the derivation of reactions.
    """
    found: dict[str, Twist] = {}
    for moving in bodies:
        if moving.parent is None:
            found[moving.body.name] = Twist(ZERO, ZERO)
            continue
        parent, back = found[moving.parent.body.name], transpose(moving.turn)
        angular = total(rotate(back, parent.angular), moving.turning)
        at_joint = total(total(parent.linear, cross(parent.angular, moving.arm)), moving.sliding)
        linear = rotate(back, at_joint)
        if extra and moving.body.name in extra:
            virtual = extra[moving.body.name]
            angular, linear = total(angular, virtual.angular), total(linear, virtual.linear)
        found[moving.body.name] = Twist(angular, difference(linear, cross(angular, moving.shift)))
    return found
