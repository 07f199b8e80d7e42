"""Tangents of planar trees from quantities of whole branches, summed up from the tips to the root.

A coordinate j turns all beyond its joint by w_j = 0, ±1 and moves it by l_j. Seen from axes that turn with them, the
points p of these bodies then have other accelerations by, with ẑ× for a right angle and o_j for the joint,

``δa(p) = ẑ × (w_j h(p) − g_j)``,  ``h = p + 2 c_C v``,  ``g_j = w_j e(o_j) + ẑ × B l_j``,  ``e = h + c_K a``

where ``B = (1 − c_K ω²) + (c_K α + 2 c_C ω) ẑ×`` of the body that carries the joint; B also leads from one point of a
body to another, ``e(p) = e(o) + B (p − o)``. So the entries of S = M + c_C C + c_K K need of the branch beyond a joint

``m``,  ``G = Σ m (p − o)``,  ``E = Σ m (e(p) − e(o))``,
``H = Σ m (p − o)·(e(p) − e(o)) + I − c_K V``,  ``V = Σ (p − o)·F``

V being the virial of all its forces F: it stands for the turned inertia, and for forces that keep their direction
where all else turns; what changes of those is added. Only differences of p, v and a of points enter, so that e may be 0
at the joint of the root. Four or five operations make an entry, and S has one only for i on the path of j or j on that
of i.

Composite bodies: R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, 6.2. Derivatives of the inverse
dynamics by them: A. Jain, G. Rodriguez, AIAA J. 31 (1993) 1460; J. Carpentier, N. Mansard, RSS 2018. The form with
virials, where a plane leaves one number of each, is our own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import field

from mbd.bodies.algebra import difference
from mbd.bodies.mass import MassProperties
from mbd.bodies.scope import Rotation, Triple
from mbd.dataclass import dataclass
from mbd.equations.changes import partials
from mbd.equations.inputs import Inputs
from mbd.equations.kinematic_proxies import Wrench
from mbd.equations.kinematics import Moving
from mbd.equations.placement import Placement
from mbd.tape.derivatives import Sweeps, jvp
from mbd.tape.node import Node, Scalar, Tape

Flat = tuple[Scalar, Scalar]
"""A vector of the plane."""
NOWHERE: Flat = (0.0, 0.0)


def _plus(a: Flat, b: Flat) -> Flat:
    return (a[0] + b[0], a[1] + b[1])


def _minus(a: Flat, b: Flat) -> Flat:
    return (a[0] - b[0], a[1] - b[1])


def _times(factor: Scalar, a: Flat) -> Flat:
    return (factor * a[0], factor * a[1])


def _dot(a: Flat, b: Flat) -> Scalar:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Flat, b: Flat) -> Scalar:
    return a[0] * b[1] - a[1] * b[0]


def _quarter(a: Flat) -> Flat:
    """ẑ × a."""
    return (-a[1], a[0])


def _turned(R: Rotation, a: Triple | Flat) -> Flat:
    """R a."""
    return (R[0][0] * a[0] + R[0][1] * a[1], R[1][0] * a[0] + R[1][1] * a[1])


def turns_by_numbers(bodies: Sequence[Moving], tape: Tape) -> bool:
    """Whether every coordinate turns its body about z only, by the same number wherever it is."""
    turns = [tuple(tape.lift(part) for part in column.angular) for body in bodies for column in body.columns]
    return all(x.is_zero and y.is_zero and z.is_constant for x, y, z in turns)


@dataclass
class _Branch:
    """A body and all beyond it, in ground axes.

    joint : o, from the joint of the root; point : e(o); level, turn : B = level + turn ẑ×
    mass, first, moved, moment : m, G, E and H + c_K V
    """

    joint: Flat
    point: Flat
    level: Scalar
    turn: Scalar
    mass: Scalar = 0.0
    first: Flat = NOWHERE
    moved: Flat = NOWHERE
    moment: Scalar = 0.0

    def led(self, shift: Flat) -> Flat:
        """B shift."""
        return _plus(_times(self.level, shift), _times(self.turn, _quarter(shift)))


@dataclass(frozen=True)
class _Way:
    """What a coordinate does: w, l, and g; push : the part of g by l. As a row it has the arm w o + ẑ × l.

    slopes : ∂l/∂x of its own joint, by the number of the coordinate
    """

    number: int
    body: Moving
    turn: float
    slide: Flat
    given: Flat
    push: Flat
    arm: Flat
    slopes: Mapping[int, Flat] = field(default_factory=dict)


@dataclass
class _Load:
    """All forces on a branch: their sum, in axes of the body, and their virial about its joint."""

    force: Flat = NOWHERE
    virial: Scalar = 0.0


class Branches:
    """The branches of a planar tree."""

    def __init__(
        self, bodies: Sequence[Moving], masses: Mapping[str, MassProperties], placement: Placement, inputs: Inputs
    ) -> None:
        self._bodies = [body for body in bodies if body.parent is not None]
        self._placement, self._inputs, self._masses = placement, inputs, masses
        self._known: dict[Moving, _Branch] = {}
        for body in self._bodies:
            self._known[body] = self._motion(body)
        for body in self._bodies:
            self._weigh(body)
        for body in reversed(self._bodies):
            self._join(body)
        self._ways = [way for body in self._bodies for way in self._ways_of(body)]
        self._above = [set(way.body.path) for way in self._ways]  # numbers of the coordinates that move it
        self._sweeps = Sweeps()

    def _ground(self, body: Moving, vector: Triple | Flat) -> Flat:
        """A vector of a body in ground axes."""
        return _turned(self._placement.axes(body).rotation, vector)

    # from the root to the tips --------------------------------------------------------------------------------------
    def _motion(self, body: Moving) -> _Branch:
        """o, e(o) and B."""
        c_C, c_K = self._inputs.c
        omega, alpha = body.angular_velocity[2], body.angular_acceleration[2]
        level, turn = 1.0 - c_K * (omega * omega), c_K * alpha + 2.0 * c_C * omega
        before = None if body.parent is None else self._known.get(body.parent)
        if before is None:
            return _Branch(NOWHERE, NOWHERE, level, turn)
        way = self._to_joint(body)
        return _Branch(_plus(before.joint, way), _plus(before.point, self._rise(body, way)), level, turn)

    def _to_joint(self, body: Moving) -> Flat:
        """From the joint of the parent to that of the body."""
        assert body.parent is not None
        return self._ground(body.parent, difference(body.arm, body.parent.shift))

    def _rise(self, body: Moving, way: Flat) -> Flat:
        """What e gains on this way: B way, and 2 c_C ṗ + c_K (2 ω ẑ × ṗ + p̈) of a joint that slides."""
        c_C, c_K = self._inputs.c
        parent = body.parent
        assert parent is not None
        speed, rate = self._ground(parent, body.sliding), self._ground(parent, body.sliding_rate)
        again = _plus(_times(2.0 * parent.angular_velocity[2], _quarter(speed)), rate)
        return _plus(self._known[parent].led(way), _plus(_times(2.0 * c_C, speed), _times(c_K, again)))

    # from the tips to the root --------------------------------------------------------------------------------------
    def _weigh(self, body: Moving) -> None:
        """m, G, E, H of the body alone."""
        own, mass = self._known[body], self._masses[body.body.name]
        center = self._ground(body, difference(mass.center, body.shift))
        own.mass = mass.mass
        own.first = _times(mass.mass, center)
        own.moved = own.led(own.first)
        own.moment = mass.inertia[2][2] + _dot(center, own.moved)

    def _join(self, body: Moving) -> None:
        """Add a branch, which is complete, to that of its parent."""
        own = None if body.parent is None else self._known.get(body.parent)
        if own is None:
            return
        other, way = self._known[body], self._to_joint(body)
        rise = self._rise(body, way)
        moved = _plus(other.moved, _times(other.mass, rise))
        own.mass = own.mass + other.mass
        own.first = _plus(own.first, _plus(other.first, _times(other.mass, way)))
        own.moved = _plus(own.moved, moved)
        own.moment = own.moment + (other.moment + (_dot(other.first, rise) + _dot(way, moved)))

    def _loads(self, pulls: Sequence[Wrench]) -> dict[Moving, _Load]:
        """Σ F and V of every branch under all its forces, those of inertia among them."""
        loads = {body: _Load() for body in self._bodies}
        for pull in pulls:
            load, arm = loads[pull.carrier], difference(pull.place, pull.carrier.shift)
            load.force = _plus(load.force, (pull.force[0], pull.force[1]))
            load.virial = load.virial + (arm[0] * pull.force[0] + arm[1] * pull.force[1])
        for body in reversed(self._bodies):
            assert body.parent is not None
            if body.parent not in loads:
                continue
            load, other = loads[body.parent], loads[body]
            way, force = difference(body.arm, body.parent.shift), _turned(body.turn, other.force)
            load.force = _plus(load.force, force)
            load.virial = load.virial + (other.virial + (way[0] * force[0] + way[1] * force[1]))
        return loads

    # coordinates ----------------------------------------------------------------------------------------------------
    def _ways_of(self, body: Moving) -> list[_Way]:
        assert body.edge is not None
        assert body.parent is not None
        own, lift, found = self._known[body], self._placement.tape.lift, []
        slides = any(not lift(part).is_zero for column in body.columns for part in column.linear)
        for place, column in enumerate(body.columns):
            number, turn = body.edge.first + place, float(lift(column.angular[2]).data)
            given, arm = _times(turn, own.point), _times(turn, own.joint)
            if not slides:
                slopes = dict.fromkeys(range(body.edge.first, body.edge.first + len(body.columns)), NOWHERE)
                found.append(_Way(number, body, turn, NOWHERE, given, NOWHERE, arm, slopes))
                continue
            slide = self._ground(body.parent, column.linear)
            push = _quarter(self._pushed(body, place, slide))
            slopes = self._slopes(body, [lift(part) for part in column.linear])
            found.append(_Way(number, body, turn, slide, _plus(given, push), push, _plus(arm, _quarter(slide)), slopes))
        return found

    def _slopes(self, body: Moving, linear: Sequence[Node]) -> dict[int, Flat]:
        """∂l/∂x of the coordinates of the joint."""
        assert body.edge is not None
        assert body.parent is not None
        found = {}
        for number, x in enumerate(body.edge.increments, body.edge.first):
            dx, dy, _ = jvp(linear, {x: 1.0})
            found[number] = self._ground(body.parent, (dx, dy))
        return found

    def _pushed(self, body: Moving, place: int, slide: Flat) -> Flat:
        """B l, and what there is because l changes with the coordinates of its joint."""
        c_C, c_K = self._inputs.c
        edge, parent = body.edge, body.parent
        assert edge is not None
        assert parent is not None
        led = self._known[parent].led(slide) if parent in self._known else slide
        lift, linear = self._placement.tape.lift, body.columns[place].linear
        seeds: dict[Node, Scalar] = {
            edge.increments[place]: c_K, edge.rates[place]: c_C, edge.accelerations[place]: 1.0
        }  # fmt: skip
        speeds = jvp([lift(part) for part in body.sliding], seeds)
        rates = jvp([lift(part) for part in body.sliding_rate], seeds)
        speed = self._ground(parent, (speeds[0] - c_C * linear[0], speeds[1] - c_C * linear[1]))
        rate = self._ground(parent, (rates[0] - linear[0], rates[1] - linear[1]))
        return _plus(led, _plus(_times(2.0 * parent.angular_velocity[2], _quarter(speed)), rate))

    # entries --------------------------------------------------------------------------------------------------------
    def tangent(self, pulls: Sequence[Wrench]) -> list[list[Node]]:
        """The columns of S of bodies under forces that keep their direction in ground axes (n_v × n_v).

        pulls : these forces, and those of inertia
        """
        loads, c_K = self._loads(pulls), self._inputs.c[1]
        S = [[self._placement.tape.zero] * len(self._ways) for _ in self._ways]
        moments = {body: self._known[body].moment - c_K * loads[body].virial for body in self._bodies}
        forces = {body: self._ground(body, loads[body].force) for body in self._bodies}
        beyond = [self._row(row, moments[row.body], forces[row.body]) for row in self._ways]
        for way in self._ways:
            self._column(way, moments[way.body], forces[way.body], beyond, S[way.number])
        return S

    def _row(self, row: _Way, moment: Scalar, force: Flat) -> tuple[Scalar, Flat]:
        """What is the same in all entries of a row whose joint is moved: S_ij = w_j · first − second · g_j."""
        branch, across = self._known[row.body], _quarter(row.slide)
        first = row.turn * (moment + _dot(branch.first, branch.point))
        moved = _plus(branch.moved, _times(branch.mass, branch.point))
        first = first - _dot(across, _minus(moved, _times(self._inputs.c[1], force)))
        return first, _minus(_times(row.turn, branch.first), _times(branch.mass, across))

    def _column(
        self, way: _Way, moment: Scalar, force: Flat, beyond: Sequence[tuple[Scalar, Flat]], column: list[Node]
    ) -> None:
        """S_ij of one j: rows beyond its joint, of its joint, and of joints on the way to the root."""
        own, c_K, lift = self._known[way.body], self._inputs.c[1], self._placement.tape.lift
        below = set(way.body.path)
        change = _minus(_times(way.turn, own.moved), _times(own.mass, way.push))  # of the force on the branch, by −ẑ ×
        moment = way.turn * moment - _dot(own.first, way.push)
        above = moment + c_K * _cross(way.slide, force) + _dot(own.joint, change)
        for row, above_row, (first, second) in zip(self._ways, self._above, beyond, strict=True):
            if row.body is way.body:
                entry = row.turn * moment - _dot(_quarter(row.slide), change)
                entry = entry + c_K * _dot(row.slopes[way.number], force)
            elif way.number in above_row:
                entry = way.turn * first - _dot(second, way.given)
            elif row.number in below:
                entry = row.turn * above - _dot(row.arm, change)
            else:
                continue
            column[row.number] = lift(entry)

    # forces that change ---------------------------------------------------------------------------------------------
    def changes(self, pulls: Sequence[Wrench], others: Sequence[Node]) -> list[list[Node]]:
        """What changes of forces on bodies, in ground axes, add to the columns of S, and those of `others`.

        One list a direction, of coordinates and of states: n_v entries, then one for each of the others.
        """
        lift = self._placement.tape.lift
        parts = [lift(part) for pull in pulls for part in (pull.ground[0], pull.ground[1], pull.torque[2])]
        nodes = [*parts, *others]
        directions = self._inputs.directions(partials(self._placement, nodes))
        places = [
            _plus(
                self._known[pull.carrier].joint, self._ground(pull.carrier, difference(pull.place, pull.carrier.shift))
            )
            for pull in pulls
        ]
        return [
            [*self._generalized(pulls, places, found[: len(parts)]), *found[len(parts) :]]
            for found in self._sweeps(nodes, directions)
        ]

    def _generalized(self, pulls: Sequence[Wrench], places: Sequence[Flat], parts: Sequence[Node]) -> list[Node]:
        """Forces (x, y) and torques on bodies, at the `places` of `pulls`, as generalized forces (n_v).

        Bodies without any are passed over: of many that move apart from each other a direction concerns few.
        """
        sums: dict[Moving, tuple[Flat, Scalar]] = {}
        zero = self._placement.tape.zero
        for k, (pull, place) in enumerate(zip(pulls, places, strict=True)):
            x, y, torque = parts[3 * k : 3 * k + 3]
            if x is zero and y is zero and torque is zero:
                continue
            force, moment = sums.get(pull.carrier, (NOWHERE, 0.0))
            sums[pull.carrier] = _plus(force, (x, y)), moment + (torque + _cross(place, (x, y)))
        result = [zero] * len(self._ways)
        for way in reversed(self._ways) if sums else ():
            if way.body not in sums:
                continue
            force, moment = sums[way.body]
            result[way.number] = self._placement.tape.lift(way.turn * moment + _dot(way.arm, _quarter(force)))
            parent = way.body.parent
            if way.body.edge is not None and way.number == way.body.edge.first and parent in self._known:
                before, known = sums.get(parent, (NOWHERE, 0.0))
                sums[parent] = _plus(before, force), known + moment
        return result
