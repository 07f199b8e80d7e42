"""Accelerations of a tree without rows by articulated bodies: M v̇ = τ without M.

What a force and a torque on the child of a joint meet is an inertia ``(A, H; Hᵀ, M)``: n = A α + H a, f = Hᵀ α + M a,
of the child and of all beyond it whose joints give way (Featherstone 1983, Int. J. Robotics Research 2:13; 2008, Rigid
Body Dynamics Algorithms, 7.3). Each velocity of the joint, whose motion is s, takes away what it gives way to:

``U = I s``,  ``d = s·U``,  ``I ← I − U Uᵀ/d``,  ``u = τ − s·p``,  ``p ← p + U u/d``,  and outwards  ``v̇ = (u − U·a)/d``

The numbers d are the pivots of M, eliminated from the tips of the tree. Angular parts are in the axes of the child and
linear ones in those of its parent, at the joint: there motions of most joints have one component, whose row of I and
number in p are then zero and τ exactly: what remains of a body on a ball joint is three by three. A chain of n bodies
takes operations in proportion to n.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

from mbd.bodies.algebra import ZERO, cross, difference, dot, product, rotate, sum_of, total, transpose
from mbd.bodies.mass import MassProperties
from mbd.bodies.scope import Rotation, Triple
from mbd.dataclass import dataclass
from mbd.equations.composite_mass import Composite
from mbd.equations.kinematics import Moving
from mbd.tape.functions import minimum
from mbd.tape.node import Node, Scalar, Tape


@dataclass(frozen=True)
class ArticulatedBody:
    """What a joint moves, at the joint: its articulated inertia A, H, M and bias force p = (torque, force).

    turning, sliding, spread : what inertias about each axis, the mass, and Σ of the inertias are made from before
        joints give way, but for what these cannot pass on: what round-off is relative to
    """

    A: Rotation
    H: Rotation
    M: Rotation
    torque: Triple = ZERO
    force: Triple = ZERO
    turning: Triple = ZERO
    sliding: Scalar = 0.0
    spread: Scalar = 0.0

    def __add__(self, other: ArticulatedBody) -> ArticulatedBody:
        return ArticulatedBody(
            sum_of(self.A, other.A), sum_of(self.H, other.H), sum_of(self.M, other.M), total(self.torque, other.torque),
            total(self.force, other.force), total(self.turning, other.turning), self.sliding + other.sliding,
            self.spread + other.spread,
        )  # fmt: skip


@dataclass
class Freedom:
    """How one velocity gives way: s, U, 1/d and u."""

    place: int
    motion: tuple[Scalar, ...]
    U: list[Scalar] = field(default_factory=list)
    inverse: Scalar = 0.0
    u: Scalar = 0.0


def articulated_accelerations(
    bodies: Sequence[Moving], masses: Mapping[str, MassProperties], forces: Sequence[Node], tape: Tape
) -> tuple[list[Node], Node] | None:
    """v̇ with M v̇ = forces, and the least part that a pivot has kept; None where a velocity moves nothing.

    bodies : parents before children
    """
    moving = [body for body in bodies if body.parent is not None]
    on = {body.body.name: _alone(body, masses[body.body.name]) for body in moving}
    given: dict[str, list[Freedom]] = {}
    kept = tape.one
    for body in reversed(moving):
        assert body.parent is not None
        name, parent = body.body.name, body.parent
        left, given[name], least = _give_way(body, on[name], forces, tape)
        for part in least:
            if part is None:
                return None
            kept = minimum(kept, part)
        if parent.parent is not None:
            on[parent.body.name] = on[parent.body.name] + _seen_from(parent, body, left, tape)
    rates = [tape.zero] * len(forces)
    motion: dict[str, tuple[Triple, Triple]] = {}
    for body in moving:
        assert body.parent is not None
        angular, linear = motion.get(body.parent.body.name, (ZERO, ZERO))
        linear = total(linear, cross(angular, _place(body.parent, body)))
        moved = [*rotate(transpose(body.turn), angular), *linear]
        for one in reversed(given[body.body.name]):
            rate = (one.u - _dot(one.U, moved)) * one.inverse
            rates[one.place] = tape.lift(rate)
            moved = [a + s * rate for a, s in zip(moved, one.motion, strict=True)]
        motion[body.body.name] = (_triple(moved[:3]), rotate(transpose(body.turn), _triple(moved[3:])))
    return rates, tape.lift(kept)


def _alone(body: Moving, found: MassProperties) -> ArticulatedBody:
    """A body by itself, at its joint, in its own axes."""
    alone = Composite.of(MassProperties(found.mass, difference(found.center, body.shift), found.inertia))
    (x, y, z), A = alone.moment, alone.inertia
    H = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    M = ((found.mass, 0.0, 0.0), (0.0, found.mass, 0.0), (0.0, 0.0, found.mass))
    turning = A[0][0], A[1][1], A[2][2]
    return ArticulatedBody(A, H, M, turning=turning, sliding=found.mass, spread=turning[0] + turning[1] + turning[2])


def _give_way(
    body: Moving, whole: ArticulatedBody, forces: Sequence[Node], tape: Tape
) -> tuple[ArticulatedBody, list[Freedom], list[Scalar | None]]:
    """What the joint of a body passes on, angular parts in the body's axes, linear ones in its parent's."""
    R, mass = body.turn, whole.M[0][0]
    alike = all(whole.M[i][j] is mass if i == j else _is_zero(whole.M[i][j], tape) for i in range(3) for j in range(3))
    M = whole.M if alike else _turned(R, whole.M)
    H = product(whole.H, transpose(R))
    inertia: list[list[Scalar]] = [[*whole.A[i], *H[i]] for i in range(3)]
    inertia += [[H[0][i], H[1][i], H[2][i], *M[i]] for i in range(3)]
    p: list[Scalar] = [*whole.torque, *rotate(R, whole.force)]
    before = [*whole.turning, *([whole.sliding] * 3)]
    given, kept = list[Freedom](), list[Scalar | None]()
    for k in reversed(range(len(body.columns))):
        assert body.edge is not None
        column, tau = body.columns[k], forces[body.edge.first + k]
        one = Freedom(body.edge.first + k, (*column.angular, *column.linear))
        one.U = [_dot(line, one.motion) for line in inertia]
        pivot, size = tape.lift(_dot(one.U, one.motion)), tape.lift(_dot(before, [s * s for s in one.motion]))
        if pivot.is_zero or size.is_zero:
            return whole, [], [None]
        one.inverse, one.u = 1.0 / pivot, tau - _dot(p, one.motion)
        kept.append(pivot / size)
        alone = _only(one.motion, tape)
        shares = [part * one.inverse for part in one.U]
        for i in range(6):
            if i != alone:
                p[i] = p[i] + shares[i] * one.u
            for j in range(i, 6):
                inertia[i][j] = inertia[j][i] = 0.0 if alone in (i, j) else inertia[i][j] - shares[i] * one.U[j]
        if alone is not None:
            p[alone], before[alone] = tau, 0.0 if alone < 3 else before[alone]
        given.append(one)
    A, H, M = (_block(inertia, *corner) for corner in ((0, 0), (0, 3), (3, 3)))
    passes = [not all(_is_zero(part, tape) for part in inertia[i]) for i in range(3)]
    turning = _triple([before[i] if passes[i] else 0.0 for i in range(3)])
    spread = whole.spread if any(passes) else 0.0
    return ArticulatedBody(A, H, M, _triple(p[:3]), _triple(p[3:]), turning, whole.sliding, spread), given, kept


def _seen_from(parent: Moving, body: Moving, left: ArticulatedBody, tape: Tape) -> ArticulatedBody:
    """What a joint passes on to its parent, at the joint and in the axes of the parent."""
    place, R = _place(parent, body), body.turn
    (x, y, z), M = place, left.M
    skew = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    turned = product(R, left.H)
    H = sum_of(turned, product(skew, M))
    before, after = product(turned, skew), product(skew, transpose(H))
    A = _turned(R, left.A)
    upper = [[A[i][j] - before[i][j] + after[i][j] if i <= j else 0.0 for j in range(3)] for i in range(3)]
    alone = [_only(line, tape) for line in R]
    passed = [left.spread if k is None else left.turning[k] for k in alone]
    across = y * y + z * z, x * x + z * z, x * x + y * y
    turning = [own + left.sliding * square for own, square in zip(passed, across, strict=True)]
    spread = left.spread + 2.0 * (left.sliding * (x * x + y * y + z * z))
    return ArticulatedBody(
        _block([[upper[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)], 0, 0), H, M,
        total(rotate(R, left.torque), cross(place, left.force)), left.force, _triple(turning), left.sliding,
        spread,
    )  # fmt: skip


def _place(parent: Moving, body: Moving) -> Triple:
    """From the parent's own joint to that of the body, in the parent's axes."""
    return body.arm if parent.parent is None else difference(body.arm, parent.shift)


def _turned(R: Rotation, S: Rotation) -> Rotation:
    """R S Rᵀ of a symmetric matrix, symmetric to the bit."""
    half = product(R, S)
    upper = [[dot(half[i], R[j]) if i <= j else 0.0 for j in range(3)] for i in range(3)]
    return _block([[upper[min(i, j)][max(i, j)] for j in range(3)] for i in range(3)], 0, 0)


def _only(motion: Sequence[Scalar], tape: Tape) -> int | None:
    """The one component of a motion that has but one, of size 1."""
    moved = [k for k, part in enumerate(motion) if not _is_zero(part, tape)]
    return moved[0] if len(moved) == 1 and tape.lift(motion[moved[0]]) is tape.one else None


def _is_zero(value: Scalar, tape: Tape) -> bool:
    return tape.lift(value).is_zero


def _dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    result: Scalar = 0.0
    for one, other in zip(a, b, strict=True):
        result = result + one * other
    return result


def _triple(values: Sequence[Scalar]) -> Triple:
    return (values[0], values[1], values[2])


def _block(whole: Sequence[Sequence[Scalar]], i: int, j: int) -> Rotation:
    """The three by three entries from (i, j) on."""
    return (_triple(whole[i][j : j + 3]), _triple(whole[i + 1][j : j + 3]), _triple(whole[i + 2][j : j + 3]))
