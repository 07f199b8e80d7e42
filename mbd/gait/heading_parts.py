"""What a turn of the whole scene about the vertical does to the joints at the ground.

Joints that only shift, sliders one after another, place what hangs from the last of them at ``p₀ + A q``, one column
of A for each of their coordinates. A turn S about the vertical leads to ``A q' = S (r + A q) − r``, r from the axis of
the turn to p₀, which has a solution for every q where the columns of A span what S makes of them. A joint that turns
follows: of a quaternion the product, of a hinge about the vertical the sum; all that hangs from it is turned with it.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.base import Frame
from mbd.dataclass import dataclass
from mbd.equal import ROUND_OFF_RTOL
from mbd.joints import Cylindrical, Free, Prismatic, Revolute, Spherical, Translation, Universal
from mbd.joints.base import Joint
from mbd.joints.quaternions import quaternion_product
from mbd.joints.reflected import AsWritten
from mbd.topology.plan import plan


@dataclass(frozen=True, eq=False)
class Part:
    """Coordinates that a turn changes together.

    kind : 'place', 'orientation' or 'angle'
    q, v : numbers of the coordinates and of the velocities
    up : the vertical, in axes of the ground for places, else of the joint's parent; for an angle its sign
    along : A (3, k) of places; beside : r (3,)
    """

    kind: str
    q: tuple[int, ...]
    v: tuple[int, ...]
    up: Vector
    along: Matrix | None = None
    beside: Vector | None = None

    def turn(self, q: Vector, v: Vector, angle: float) -> None:
        """Turn coordinates and velocities, in place."""
        own = list(self.q)
        if self.kind == "angle":
            q[own] += angle * self.up[0]
        elif self.kind == "orientation":
            half = np.concatenate([[np.cos(0.5 * angle)], np.sin(0.5 * angle) * self.up])
            q[own] = quaternion_product(tuple(half), tuple(q[own]))
        else:
            assert self.along is not None
            assert self.beside is not None
            S, back = rotation(self.up, angle), _inverse(self.along)
            q[own] = back @ (S @ (self.beside + self.along @ q[own]) - self.beside)
            v[list(self.v)] = back @ (S @ (self.along @ v[list(self.v)]))


@dataclass(frozen=True, eq=False)
class _Chain:
    """Joints that only shift, from the ground on: where they lead at zero, and their directions, axes of the ground."""

    place: Vector
    q: tuple[int, ...] = ()
    v: tuple[int, ...] = ()
    directions: tuple[Vector, ...] = ()

    @property
    def along(self) -> Matrix:
        """A (3, k)."""
        return np.asarray(np.reshape(self.directions, (-1, 3)), dtype=np.float64).T


def parts_of(model: Any, up: Vector) -> list[Part] | None:
    """What a turn about the vertical changes of every joint; None where some joint cannot follow."""
    edges = plan(model).edges
    first = _firsts(edges)
    found: list[_Turned] = []
    for joint in edges:
        if joint.parent.body is model.ground:
            own = _of_root(joint, edges, np.eye(3), _Chain(np.zeros(3)), up, first)
            if own is None:
                return None
            found += own
    axis = next((each.place for each in found if each.held), found[0].place if found else np.zeros(3))
    parts: list[Part] = []
    for each in found:
        beside = (each.place - axis) - ((each.place - axis) @ up) * up
        if float(np.max(np.abs(beside))) <= ROUND_OFF_RTOL:
            beside = np.zeros(3)
        elif each.held:
            return None
        parts += [replace(part, beside=beside) if part.kind == "place" else part for part in each.parts]
    return parts if any(part.kind != "place" for part in parts) else None


@dataclass(frozen=True, eq=False)
class _Turned:
    """Parts that turn about one vertical axis, through a place; held : whether that place cannot move."""

    place: Vector
    held: bool
    parts: list[Part]


_First = dict[str, tuple[int, int]]
"""The first coordinate and the first velocity of each joint."""


def _firsts(edges: Sequence[Joint]) -> _First:
    found, q, v = _First(), 0, 0
    for joint in edges:
        found[joint.name] = q, v
        q, v = q + len(joint.labels), v + len(joint.velocity_labels)
    return found


def _of_root(
    joint: Joint, edges: Sequence[Joint], turn: Matrix, chain: _Chain, up: Vector, first: _First
) -> list[_Turned] | None:
    """What turns of a joint and, where it only shifts, of those beyond it; None where one cannot follow."""
    into, (q, v) = turn @ _axes(joint.parent), first[joint.name]
    place = chain.place + turn @ _offset(joint.parent)
    axis, chain = into.T @ up, replace(chain, place=place)
    if isinstance(joint, Free | Spherical):
        orientation = tuple(q + joint.adding + k for k in range(4))
        spins = tuple(v + joint.adding + k for k in range(3))
        if isinstance(joint, Free):
            chain = _shifted(chain, q, v, into)
        return _closed(chain, up, [Part("orientation", orientation, spins, axis)])
    if isinstance(joint, Revolute | Cylindrical | Universal) and _is_along(joint.axis, axis):
        sign = np.array([float(np.sign(np.array(joint.axis) @ axis))])
        return _closed(chain, up, [Part("angle", (q,), (v,), sign)])
    directions = _directions(joint)
    if directions is None:
        return None
    beyond = into @ _axes(joint.child).T
    moved = _shifted(chain, q, v, into @ directions)
    moved = replace(moved, place=place - beyond @ _offset(joint.child))
    children = [other for other in edges if other.parent.body is joint.child.body]
    found: list[_Turned] = []
    if len(children) != 1:
        own = _closed(moved, up, [])
        if own is None:
            return None
        found, moved = own, _Chain(moved.place)
    for other in children:
        more = _of_root(other, edges, beyond, moved, up, first)
        if more is None:
            return None
        found += more
    return found


def _directions(joint: Joint) -> Matrix | None:
    """Directions (3, k) of a joint that only shifts, in axes of its parent's frame; None for others."""
    if isinstance(joint, Prismatic):
        return np.array([joint.axis], dtype=np.float64).T
    if isinstance(joint, Translation):
        return np.eye(3)[:, ["xyz".index(each) for each in joint.axes]]
    return np.zeros((3, 0)) if not joint.labels else None


def _shifted(chain: _Chain, q: int, v: int, directions: Matrix) -> _Chain:
    """The chain with further directions (3, k)."""
    count = directions.shape[1]
    return _Chain(
        chain.place, (*chain.q, *range(q, q + count)), (*chain.v, *range(v, v + count)),
        (*chain.directions, *directions.T),
    )  # fmt: skip


def _closed(chain: _Chain, up: Vector, beyond: list[Part]) -> list[_Turned] | None:
    """The parts of a chain and of the joint at its end; None where the chain cannot follow a turn."""
    along = chain.along
    if not len(chain.q) or np.max(np.abs(along - np.outer(up, up @ along))) <= ROUND_OFF_RTOL:
        return [_Turned(chain.place, True, beyond)] if beyond else []
    if np.linalg.matrix_rank(along, tol=1e-9) < along.shape[1]:
        return None
    turned = rotation(up, 1.0) @ along
    if np.max(np.abs(along @ (_inverse(along) @ turned) - turned)) > 1e-9:
        return None
    return [_Turned(chain.place, False, [Part("place", chain.q, chain.v, up, along, np.zeros(3)), *beyond])]


def _inverse(along: Matrix) -> Matrix:
    """A with ``(inverse) A = 1`` of independent columns; the transpose where these are orthonormal."""
    if np.array_equal(along.T @ along, np.eye(along.shape[1])):
        return along.T
    return np.asarray(np.linalg.pinv(along))


def _is_along(one: Any, other: Vector) -> bool:
    return bool(abs(abs(float(np.array(one, dtype=float) @ other)) - 1.0) <= ROUND_OFF_RTOL)


def _axes(frame: Frame) -> Matrix:
    return np.eye(3) if frame.rotation is None else np.array(frame.rotation, dtype=np.float64)


def _offset(frame: Frame) -> Vector:
    """The place of a frame on its body [m]."""
    return np.array([float(x) for x in frame.placement(AsWritten())[1]])  # type: ignore[arg-type]


def rotation(axis: Vector, angle: float) -> Matrix:
    """exp(angle axis×)."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * skew + (1.0 - np.cos(angle)) * skew @ skew)
