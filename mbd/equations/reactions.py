"""Reactions in joints: on the child by the parent, at the joint, in ground axes.

For a joint of the tree the child and everything beyond it are moved rigidly by virtual increments at the joint; the
residual of the balance conjugate to them is the force and torque that the joint must give. What acts along the free
directions of the joint (its springs, losses, motors, stops) is not part of the reaction. A cut joint gives
``−(∂h/∂ε)ᵀ λ`` of its own rows.
"""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from mbd.bodies.algebra import cross, difference, dot, rotate, scaled, total, transpose
from mbd.bodies.scope import Triple
from mbd.equations.derivation_context import DerivationContext, placeholders
from mbd.equations.dynamics import Dynamics, Work
from mbd.equations.equations import Row
from mbd.equations.kinematics import Moving
from mbd.joints.base import Joint
from mbd.joints.reversed import Reversed
from mbd.tape.derivatives import substitute, vjp
from mbd.tape.node import Scalar

Direction: TypeAlias = tuple[Triple, Triple]
"""Angular and linear velocity of a joint's child for one unit of a coordinate's rate."""


class Wrench(NamedTuple):
    """A force [N] and a torque [N m]."""

    force: Triple
    torque: Triple


def reaction(joint: Joint, scope: DerivationContext, dynamics: Dynamics, work: Work, rows: Sequence[Row]) -> Wrench:
    """The reaction of a joint; `work` holds every force, with all rows and penalties."""
    if any(cut.name == joint.name for cut in scope.cuts):
        return cut_reaction(joint, scope, rows)
    body = scope.bodies[joint.child.body.name]
    wrench, R = Wrench(*dynamics.joint_wrench(body, work)), scope.placement.axes(body).rotation
    if isinstance(joint, Reversed):
        force, torque = rotate(R, wrench.force), rotate(R, wrench.torque)
        arm = difference(scope.frame(joint.child).position, scope.frame(joint.parent).position)
        back = Wrench(scaled(-1.0, force), scaled(-1.0, total(torque, cross(arm, force))))
        return _without_free(_directions(joint.joint, scope), back)
    force, torque = _without_free(_columns(body), wrench)
    return Wrench(rotate(R, force), rotate(R, torque))


def _columns(body: Moving) -> list[Direction]:
    """The free directions of the joint that leads to a body, in the body's axes."""
    back = transpose(body.turn)
    return [(column.angular, rotate(back, column.linear)) for column in body.columns]


def _directions(joint: Joint, scope: DerivationContext) -> list[Direction]:
    """The free directions of a joint as the user described it, in ground axes."""
    R = scope.frame(joint.child).rotation
    columns = joint.subspace(scope.joint(joint.name).coordinates, scope)
    return [(rotate(R, angular), rotate(R, linear)) for angular, linear in columns]


def _without_free(free: Sequence[Direction], wrench: Wrench) -> Wrench:
    """The part that does no work on the joint's coordinates.

    A multiple of each free direction, torques for the turning ones and forces for the sliding ones, acting at the
    origin of the child's frame, is taken off.
    """
    along = [(angular, None) if _is_turn(angular) else (None, linear) for angular, linear in free]
    gram: list[list[Scalar]] = []
    for angular, linear in free:
        gram.append([dot(angular, turn) if turn is not None else dot(linear, shift) for turn, shift in along])  # type: ignore[arg-type]
    works = [dot(angular, wrench.torque) + dot(linear, wrench.force) for angular, linear in free]
    force, torque = wrench
    for (turn, shift), share in zip(along, _solved(gram, works), strict=True):
        if turn is not None:
            torque = difference(torque, scaled(share, turn))
        elif shift is not None:
            force = difference(force, scaled(share, shift))
    return Wrench(force, torque)


def _is_turn(angular: Triple) -> bool:
    return any(part != 0.0 if isinstance(part, float) else not part.is_zero for part in angular)


def _solved(matrix: list[list[Scalar]], right: list[Scalar]) -> list[Scalar]:
    """Gauss elimination without pivots, for the few free directions of one joint."""
    n = len(right)
    A, b = [list(line) for line in matrix], list(right)
    for k in range(n):
        for i in range(k + 1, n):
            factor = A[i][k] / A[k][k]
            A[i] = [A[i][j] - factor * A[k][j] for j in range(n)]
            b[i] = b[i] - factor * b[k]
    for k in reversed(range(n)):
        for j in range(k + 1, n):
            b[k] = b[k] - A[k][j] * b[j]
        b[k] = b[k] / A[k][k]
    return b


def cut_reaction(joint: Joint, scope: DerivationContext, rows: Sequence[Row]) -> Wrench:
    """From the multipliers of the joint's own rows."""
    tape = scope.tape
    R_free, p_free = placeholders(tape)
    fresh = [tape.lift(part) for part in (*R_free[0], *R_free[1], *R_free[2], *p_free)]
    numbers = {row.part: k for k, row in enumerate(rows) if row.owner == joint.name and row.contact < 0}
    held = [(part, tape.lift(value)) for part, value in joint.rows(R_free, p_free, scope) if part in numbers]
    bars = vjp([value for _, value in held], [tape.input("lam", numbers[part]) for part, _ in held], fresh)
    R, p = scope.relative(joint)
    placed = zip(fresh, [tape.lift(part) for part in (*R[0], *R[1], *R[2], *p)], strict=True)
    *turn, x, y, z = substitute(bars, dict(placed))
    torque: Triple = (0.0, 0.0, 0.0)
    for k in range(3):  # δR = δθ × R, column by column
        torque = total(torque, cross((R[0][k], R[1][k], R[2][k]), (turn[k], turn[3 + k], turn[6 + k])))
    axes = scope.frame(joint.parent).rotation
    force: Triple = (x, y, z)
    if not scope.cut_rows(joint)[1]:
        force = rotate(axes, force)
    return Wrench(scaled(-1.0, force), scaled(-1.0, rotate(axes, torque)))
