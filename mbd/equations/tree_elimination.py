"""The tangent of a tree eliminated from the tips to the root, without the matrix.

A balance by recursion is linear, joint by joint, in small changes of the motion μ = (ω, α, a) of a body and of the load
W = (torque, force) at its joint. With y the changes of the rates of a joint, and what the branch beyond it adds,

``δμ = T δμ_parent + τ y``,  ``δW = A δμ + β``,  ``b = D y + ρ δW``,  ``δW_parent = X δW + N y + …``

so y is eliminated by ``S = D + ρ A τ``, ``U = ρ A T`` and ``Z = X A τ + N``, and ``X A T − Z S⁻¹ U`` joins the A of the
parent. These S are the pivots of S = M + c_C C + c_K K eliminated from the tips: they are articulated inertias (see
`articulated_bodies`) where c_C = c_K = 0. Operations and code grow in proportion to the number of bodies. Derivatives
are those of the recursion of `kinematics` itself, of one joint with the motion of its parent as inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace

from mbd.bodies.algebra import ZERO, cross, difference, dot, rotate, total
from mbd.bodies.scope import Triple
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL
from mbd.equations.inputs import Inputs
from mbd.equations.kinematic_proxies import Wrench
from mbd.equations.kinematics import Moving, carried, joint_motion, spin_of
from mbd.tape.derivatives import jvps, live, substitute
from mbd.tape.node import Node, Scalar, Tape

Matrix = list[list[Node]]
Inertia = Callable[[Moving], Sequence[Wrench]]
"""The forces of inertia on a body that moves so."""


@dataclass
class Branch:
    """A joint eliminated, with all beyond it.

    parent : place among the branches, −1 of the ground; first : number of its first rate; width : parts of its load
    along, motions : T and τ; loads : ρ; passed : X (nothing passes to the ground)
    upper, beside : U and S, eliminated; inverse : of its pivots; lower : L of S; given : Z by pivots
    """

    parent: int
    first: int
    width: int
    along: Matrix
    motions: Matrix
    loads: Matrix
    passed: Matrix
    upper: Matrix = field(default_factory=list)
    beside: Matrix = field(default_factory=list)
    inverse: list[Node] = field(default_factory=list)
    lower: Matrix = field(default_factory=list)
    given: Matrix = field(default_factory=list)

    def parts(self) -> Iterable[Node]:
        """All that solving needs."""
        for matrix in (self.along, self.motions, self.loads, self.passed, self.upper, self.beside, self.lower):
            for line in matrix:
                yield from line
        for line in self.given:
            yield from line
        yield from self.inverse


@dataclass(frozen=True)
class TreeFactors:
    """An eliminated tangent; see `mbd.tape.elimination.Factors`, whose uses it has.

    branches : parents first; sound : 1.0 where every pivot keeps enough of its terms, else 0.0
    """

    branches: tuple[Branch, ...]
    sound: Node
    weakest: Node

    def solve(self, right: Sequence[Node]) -> list[Node]:
        """y from b."""
        b, tape = list(right), self.sound.tape
        sums = [[tape.zero] * branch.width for branch in self.branches]
        for branch, load in zip(reversed(self.branches), reversed(sums), strict=True):
            size = len(branch.inverse)
            for k in range(size):
                b[branch.first + k] = b[branch.first + k] - _dot(tape, branch.loads[k], load)
            for j in reversed(range(size)):
                for i in range(j):
                    b[branch.first + i] = b[branch.first + i] - branch.lower[i][j] * b[branch.first + j]
            if branch.parent >= 0:
                above = sums[branch.parent]
                for w, line in enumerate(branch.passed):
                    above[w] = above[w] + _dot(tape, line, load)
                    for j in range(size):
                        above[w] = above[w] + branch.given[w][j] * b[branch.first + j]
        y, motion = list(right), list[list[Node]]()
        for branch in self.branches:
            before = motion[branch.parent] if branch.parent >= 0 else []
            first, size = branch.first, len(branch.inverse)
            for j in range(size):
                rest = b[first + j] - _dot(tape, branch.upper[j], before)
                y[first + j] = (rest - _dot(tape, branch.beside[j][:j], y[first : first + j])) * branch.inverse[j]
            rates = y[first : first + size]
            both = zip(branch.along, branch.motions, strict=True)
            motion.append([_dot(tape, T, before) + _dot(tape, tau, rates) for T, tau in both])
        return y

    def kept(self) -> list[Node]:
        """What `solve` needs besides numbers, each once."""
        parts = (node for branch in self.branches for node in branch.parts())
        return list({node.index: node for node in parts if not node.is_constant}.values())

    def read(self, kept: Mapping[int, Node]) -> TreeFactors:
        """The same with inputs, by the index of what they stand for, in the place of `kept`."""

        def lines(matrix: Matrix) -> Matrix:
            return [[kept.get(node.index, node) for node in line] for line in matrix]

        branches = tuple(
            Branch(
                each.parent, each.first, each.width, lines(each.along), lines(each.motions), lines(each.loads),
                lines(each.passed), lines(each.upper), lines(each.beside), lines([each.inverse])[0],
                lines(each.lower), lines(each.given),
            )
            for each in self.branches
        )  # fmt: skip
        return TreeFactors(branches, self.sound, self.weakest)


def tree_factors(
    bodies: Sequence[Moving], inertia: Inertia, direct: Sequence[Node], inputs: Inputs,
    tape: Tape,
) -> TreeFactors | None:  # fmt: skip
    """The tangent of bodies under forces that act on coordinates, eliminated.

    None where such a force follows other joints, a velocity moves nothing, or one belongs to no joint of the tree.

    Parameters
    ----------
    bodies : parents before children
    direct : forces on coordinates (n_v)
    """
    moving = [body for body in bodies if body.parent is not None]
    if sum(len(body.columns) for body in moving) < len(direct) or not _is_local(moving, direct):
        return None
    work = _Elimination(moving, inertia, direct, inputs, tape)
    return work.result() if all(work.eliminate(k) for k in reversed(range(len(moving)))) else None


def _is_local(bodies: Sequence[Moving], direct: Sequence[Node]) -> bool:
    """Whether forces on coordinates follow those of their own joint alone."""
    for body in bodies:
        assert body.edge is not None
        first, last = body.edge.first, body.edge.first + len(body.columns)
        for node in live(direct[first:last]):
            if node.op == "input" and node.data[0] in "xva" and not first <= node.data[1] < last:
                return False
    return True


class _Elimination:
    """The recursion linearized, joint by joint, and eliminated."""

    def __init__(
        self, bodies: Sequence[Moving], inertia: Inertia, direct: Sequence[Node],
        inputs: Inputs, tape: Tape,
    ) -> None:  # fmt: skip
        self.bodies, self.direct, self.inputs, self.tape = bodies, direct, inputs, tape
        self.inertia = inertia
        self.places = {body: k for k, body in enumerate(bodies)}
        self.motions = [_changing(tape, _motion(body)) for body in bodies]
        self.values = self._loads()
        self.loads = [_changing(tape, load) for load in self.values]
        self.A = [self._alone(k) for k in range(len(bodies))]
        self.before = [[list(line) for line in A] for A in self.A]  # what pivots are made of before joints give way
        self.branches: list[Branch | None] = [None] * len(bodies)
        self.sound: Node = tape.one

    def _loads(self) -> list[list[Node]]:
        """Torque and force at each joint, in axes of the body."""
        found = [self._own_load(body) for body in self.bodies]
        for body, load in zip(reversed(self.bodies), reversed(found), strict=True):
            assert body.parent is not None
            if body.parent in self.places:
                above = found[self.places[body.parent]]
                above[:] = [a + b for a, b in zip(above, self._passed(body, load), strict=True)]
        return found

    def _own_load(self, body: Moving) -> list[Node]:
        force: Triple = ZERO
        torque: Triple = ZERO
        for pull in self.inertia(body):
            arm = difference(pull.place, body.shift)
            force, torque = total(force, pull.force), total(torque, total(pull.torque, cross(arm, pull.force)))
        return [self.tape.lift(part) for part in (*torque, *force)]

    def _passed(self, body: Moving, load: Sequence[Scalar]) -> list[Node]:
        """A load at the joint of a body as one at the joint of its parent, in axes of the parent."""
        assert body.parent is not None
        force = rotate(body.turn, _triple(load[3:]))
        torque = total(
            rotate(body.turn, _triple(load[:3])), cross(difference(body.arm, body.parent.shift), force)
        )  # fmt: skip
        return [self.tape.lift(part) for part in (*torque, *force)]

    def _alone(self, k: int) -> Matrix:
        """∂W/∂μ of a body alone."""
        body = self.bodies[k]
        free = self._freed(self.motions[k], "motion", _motion(body))
        moved = _moved(body, free)
        load = self._own_load(moved)
        outputs = [load[w] for w in self.loads[k]]
        return self._derived(outputs, free, self.motions[k], _motion(body), ())

    def _freed(self, places: Sequence[int], kind: str, values: Sequence[Scalar]) -> list[Scalar]:
        """Inputs in the place of values that change."""
        free = list(values)
        for place in places:
            free[place] = self.tape.input(kind, place)
        return free

    def _derived(
        self, outputs: Sequence[Node], free: Sequence[Scalar], places: Sequence[int], values: Sequence[Scalar],
        numbers: Iterable[int],
    ) -> Matrix:  # fmt: skip
        """Derivatives of each output by freed values, and in the directions of some rates."""
        lift, inputs = self.tape.lift, self.inputs
        directions: list[dict[Node, Scalar]] = [{lift(free[place]): 1.0} for place in places]
        for j in numbers:
            directions.append({inputs.a[j]: 1.0, inputs.v[j]: inputs.c[0], inputs.x[j]: inputs.c[1]})
        columns = jvps(outputs, directions)
        back = {lift(free[place]): lift(values[place]) for place in places}
        flat = substitute([entry for column in columns for entry in column], back)
        return [flat[k :: len(outputs)] for k in range(len(outputs))]

    def eliminate(self, k: int) -> bool:
        """Take out the rates of a joint, those beyond it being gone; whether all its velocities move something."""
        body, tape = self.bodies[k], self.tape
        assert body.edge is not None
        assert body.parent is not None
        first, size = body.edge.first, len(body.columns)
        numbers = range(first, first + size)
        above = self.places.get(body.parent, -1)

        # motion: T | τ
        known = self.motions[above] if above >= 0 else []
        before = _motion(body.parent)
        free = self._freed(known, "motion", before)
        parent = _moved(body.parent, free)
        moved = carried(parent, body.turn, body.arm, body.shift, joint_motion(body.edge, body.columns, tape))
        moved_parts = [tape.lift(part) for triple in moved[:3] for part in triple]
        lines = self._derived([moved_parts[c] for c in self.motions[k]], free, known, before, numbers)
        T, tau = [line[: len(known)] for line in lines], [line[len(known) :] for line in lines]

        # load: ρ | D, and X | N
        values = self.values[k]
        free = self._freed(self.loads[k], "load", values)
        outputs = [self._along(body, column, free) for column in range(size)]
        if above >= 0:
            passed = self._passed(body, free)
            outputs += [passed[w] for w in self.loads[above]]
        lines = self._derived(outputs, free, self.loads[k], values, numbers)
        width = len(self.loads[k])
        rho, D = [line[:width] for line in lines[:size]], [line[width:] for line in lines[:size]]
        X, N = [line[:width] for line in lines[size:]], [line[width:] for line in lines[size:]]
        own = self._derived(self.direct[first : first + size], (), (), (), numbers)
        D = _sum(D, own)

        by_rates, by_parent = _product(tape, self.A[k], tau), _product(tape, self.A[k], T)
        S, U = _sum(D, _product(tape, rho, by_rates)), _product(tape, rho, by_parent)
        Z, P = _sum(_product(tape, X, by_rates), N), _product(tape, X, by_parent)
        made = _product(tape, rho, _product(tape, self.before[k], tau))
        if above >= 0:
            self.before[above] = _sum(self.before[above], P)
        branch = Branch(above, first, width, T, tau, rho, X, U, S)
        branch.inverse, branch.lower = [tape.zero] * size, [[tape.zero] * size for _ in range(size)]
        branch.given = [[tape.zero] * size for _ in Z]
        for j in reversed(range(size)):
            pivot = S[j][j]
            if pivot.is_zero:
                return False
            self._judge(pivot, abs(D[j][j]) + abs(made[j][j]))
            inverse = branch.inverse[j] = tape.one / pivot
            for i in range(j):
                factor = branch.lower[i][j] = S[i][j] * inverse
                S[i][:j] = _less(S[i][:j], factor, S[j][:j])
                U[i] = _less(U[i], factor, U[j])
            for w, line in enumerate(Z):
                factor = branch.given[w][j] = line[j] * inverse
                line[:j] = _less(line[:j], factor, S[j][:j])
                P[w] = _less(P[w], factor, U[j])
        if above >= 0:
            self.A[above] = _sum(self.A[above], P)
        self.branches[k] = branch
        return True

    def _along(self, body: Moving, column: int, load: Sequence[Scalar]) -> Node:
        """What a load does along a velocity of the joint."""
        one = body.columns[column]
        force = rotate(body.turn, _triple(load[3:]))
        return self.tape.lift(dot(one.angular, _triple(load[:3])) + dot(one.linear, force))

    def _judge(self, pivot: Node, terms: Node) -> None:
        """A pivot must keep some of its terms, and not have grown out of proportion."""
        size = abs(pivot)
        holds = (HALF_PRECISION_RTOL * terms < size) & (HALF_PRECISION_RTOL * size < terms)
        self.sound = self.tape.binary("and", self.sound, holds)

    def result(self) -> TreeFactors:
        tape = self.tape
        branches = tuple(branch for branch in self.branches if branch is not None)
        return TreeFactors(branches, tape.where(self.sound, tape.one, tape.zero), tape.zero)


def _motion(body: Moving) -> list[Scalar]:
    """ω, α and a of a body."""
    return [*body.angular_velocity, *body.angular_acceleration, *body.acceleration]


def _moved(body: Moving, motion: Sequence[Scalar]) -> Moving:
    """The body with another motion."""
    omega, alpha, acceleration = _triple(motion[:3]), _triple(motion[3:6]), _triple(motion[6:])
    return replace(
        body, angular_velocity=omega, angular_acceleration=alpha, acceleration=acceleration,
        spin=spin_of(omega, alpha),
    )  # fmt: skip


def _changing(tape: Tape, values: Sequence[Scalar]) -> list[int]:
    """The places of what is no number."""
    return [place for place, value in enumerate(values) if not tape.lift(value).is_constant]


def _triple(values: Sequence[Scalar]) -> Triple:
    return (values[0], values[1], values[2])


def _dot(tape: Tape, a: Sequence[Node], b: Sequence[Node]) -> Node:
    result = tape.zero
    for one, other in zip(a, b, strict=True):
        result = tape.add(result, tape.mul(one, other))
    return result


def _product(tape: Tape, A: Matrix, B: Matrix) -> Matrix:
    columns = [*zip(*B, strict=True)]
    return [[_dot(tape, line, column) for column in columns] for line in A]


def _sum(A: Matrix, B: Matrix) -> Matrix:
    return [[a + b for a, b in zip(*lines, strict=True)] for lines in zip(A, B, strict=True)]


def _less(line: Sequence[Node], factor: Node, other: Sequence[Node]) -> list[Node]:
    return [a - factor * b for a, b in zip(line, other, strict=True)]
