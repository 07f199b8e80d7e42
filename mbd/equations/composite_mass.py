"""The mass matrix by composite bodies: each coordinate moves all that lies beyond its joint as one rigid body.

With mass m, first moment s and inertia I of the composite about the origin of its first body, and the motion (ω_j, l_j)
of that body per unit rate of coordinate j, the force and torque of a unit acceleration are

``f = m l_j + ω_j × s``,  ``n = I ω_j + s × l_j``,  and  ``M_ij = f · l_i + n · ω_i``

for every coordinate i on the way down to the ground (Walker & Orin 1982, J. Dyn. Syst. Meas. Control 104:205;
Featherstone 2008, Rigid Body Dynamics Algorithms, table 6.2). A chain of n bodies takes a few times n²
operations; the derivatives of its balance, column by column, take three times as many.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from mbd.bodies.algebra import cross, difference, dot, product, rotate, scaled, sum_of, total, transpose
from mbd.bodies.mass import MassProperties
from mbd.bodies.scope import Rotation, Triple
from mbd.dataclass import dataclass
from mbd.equations import sizes
from mbd.equations.kinematics import Moving
from mbd.tape.node import Node, Scalar, Tape


@dataclass(frozen=True)
class Composite:
    """A body and all beyond it as one: mass, first moment and inertia about the body's origin, in its axes."""

    mass: Scalar
    moment: Triple
    inertia: Rotation

    @classmethod
    def of(cls, found: MassProperties) -> Composite:
        """One body."""
        moment = scaled(found.mass, found.center)
        return cls(found.mass, moment, sum_of(found.inertia, _spread(moment, found.center, 0.5)))

    def seen_from(self, turn: Rotation, place: Triple) -> Composite:
        """The same against the parent, in whose axes the origin lies at `place` and the axes are turned."""
        moment = rotate(turn, self.moment)
        turned = product(product(turn, self.inertia), transpose(turn))
        offset = total(moment, scaled(0.5, scaled(self.mass, place)))
        return Composite(
            self.mass, total(moment, scaled(self.mass, place)), sum_of(turned, _spread(offset, place, 1.0))
        )

    def __add__(self, other: Composite) -> Composite:
        return Composite(
            self.mass + other.mass, total(self.moment, other.moment), sum_of(self.inertia, other.inertia)
        )  # fmt: skip


def composite_mass_matrix(
    bodies: Sequence[Moving], masses: Mapping[str, MassProperties], n_v: int, tape: Tape
) -> list[list[Node]]:
    """M of a tree of bodies, line by line, symmetric to the bit.

    bodies : parents before children
    """
    M = [[tape.zero] * n_v for _ in range(n_v)]
    places, motions = _places(bodies), {body.body.name: _motions(body) for body in bodies}
    for body, j, force, torque in _loads(bodies, masses, places, motions):
        below: Moving | None = body
        while below is not None and below.parent is not None:
            for i, turns, moves in motions[below.body.name]:
                if below is not body or i <= j:
                    M[i][j] = M[j][i] = tape.lift(entry(force, torque, turns, moves))
            force, torque = passed_down(below.turn, places[below.body.name], force, torque)
            below = below.parent
    return M


@dataclass(frozen=True)
class MassLoop:
    """M of a tree as a loop over its coordinates and the bodies below each, which takes less code than all entries.

    Attributes
    ----------
    bodies : of each body the number of its parent (−1 of the ground), and its coordinates, from the first to the last
    numbers : of each body R and the place of its origin in the parent (12 numbers, row-major), and then of each
        coordinate force and torque per unit acceleration, ω and l per unit rate (12)
    paths : of each coordinate those on the path from the ground to its body, with which it has entries
    spared : operations that straight-line code would take, about
    """

    bodies: tuple[tuple[int, int, int], ...]
    numbers: tuple[Node, ...]
    paths: tuple[tuple[int, ...], ...]
    spared: int


def mass_loop(bodies: Sequence[Moving], masses: Mapping[str, MassProperties], n_v: int, tape: Tape) -> MassLoop | None:
    """M of a tree of bodies as a loop; None where its entries are few."""
    pairs = sum(len(body.columns) * len(body.path) for body in bodies)
    if pairs < sizes.MIN_LOOP_ENTRIES:
        return None
    moving = [body for body in bodies if body.edge is not None]
    number = {body.body.name: k for k, body in enumerate(moving)}
    places, motions = _places(moving), {body.body.name: _motions(body) for body in moving}
    lines, numbers = list[tuple[int, int, int]](), list[Scalar]()
    for body in moving:
        edge, parent = body.edge, body.parent
        assert edge is not None
        assert parent is not None
        lines.append((number.get(parent.body.name, -1), edge.first, edge.first + len(body.columns)))
        numbers += [part for row in (*body.turn, places[body.body.name]) for part in row]
    known: list[Sequence[Scalar]] = [()] * n_v
    for body, j, force, torque in _loads(moving, masses, places, motions):
        _, turns, moves = motions[body.body.name][j - lines[number[body.body.name]][1]]
        known[j] = (*force, *torque, *turns, *moves)
    numbers += [part for of_one in known for part in of_one]
    paths = tuple(body.path for body in moving for _ in body.columns)
    planar = all(tape.lift(part).is_constant for body in moving for part in body.turn[2])
    spared = int(sizes.OF_PAIR[planar] * pairs)
    return MassLoop(tuple(lines), tuple(map(tape.lift, numbers)), paths, spared)


def entry(force: Triple, torque: Triple, angular: Triple, linear: Triple) -> Scalar:
    """M_ij from the force and the torque of j, and the motion of i."""
    return dot(force, linear) + dot(torque, angular)


def passed_down(turn: Rotation, place: Triple, force: Triple, torque: Triple) -> tuple[Triple, Triple]:
    """Force and torque about the origin of a body, as the same about that of its parent, in the parent's axes."""
    force = rotate(turn, force)
    return force, total(rotate(turn, torque), cross(place, force))


def _places(bodies: Sequence[Moving]) -> dict[str, Triple]:
    """The origin of each body in its parent."""
    return {body.body.name: difference(body.arm, rotate(body.turn, body.shift)) for body in bodies}


def _loads(
    bodies: Sequence[Moving], masses: Mapping[str, MassProperties], places: Mapping[str, Triple],
    motions: Mapping[str, Sequence[tuple[int, Triple, Triple]]],
) -> Iterator[tuple[Moving, int, Triple, Triple]]:  # fmt: skip
    """Force and torque of a unit acceleration of each coordinate on all beyond it, from the tips."""
    composites = {body.body.name: Composite.of(masses[body.body.name]) for body in bodies if body.parent is not None}
    for body in reversed(bodies):
        if body.parent is None:
            continue
        whole, name = composites[body.body.name], body.body.name
        for j, angular, linear in motions[name]:
            force = total(scaled(whole.mass, linear), cross(angular, whole.moment))
            yield body, j, force, total(rotate(whole.inertia, angular), cross(whole.moment, linear))
        if body.parent.parent is not None:
            parent = body.parent.body.name
            composites[parent] = composites[parent] + whole.seen_from(body.turn, places[name])


def _motions(body: Moving) -> list[tuple[int, Triple, Triple]]:
    """Number, angular velocity and velocity of the origin per unit rate of each coordinate, in body axes."""
    if body.edge is None:
        return []
    found = []
    for k, column in enumerate(body.columns):
        linear = difference(rotate(transpose(body.turn), column.linear), cross(column.angular, body.shift))
        found.append((body.edge.first + k, column.angular, linear))
    return found


def _spread(moment: Triple, place: Triple, share: float) -> Rotation:
    """2 share ((s · p) 1 − ½ (s pᵀ + p sᵀ)): what a distance p adds to an inertia."""
    (a, b, c), (x, y, z) = moment, place
    ax, by, cz = a * x, b * y, c * z
    xy, xz, yz = a * y + b * x, a * z + c * x, b * z + c * y
    rows = (
        (2.0 * (by + cz), -xy, -xz),
        (-xy, 2.0 * (ax + cz), -yz),
        (-xz, -yz, 2.0 * (ax + by)),
    )
    return tuple(scaled(share, row) for row in rows)  # type: ignore[return-value]
