"""The derivation as words see it: parameters, tables, states, motions of frames and joints, and named quantities."""

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from functools import partial

from mbd.bodies.algebra import IDENTITY, difference, product, rotate, transpose
from mbd.bodies.base import Body, Frame
from mbd.bodies.scope import FrameMotion, JointMotion, Rotation, Triple
from mbd.bodies.values import Vector3
from mbd.configuration import Configuration
from mbd.equations import changes
from mbd.equations.dynamics import Dynamics, Work
from mbd.equations.equations import Chart, Coordinate, Turn
from mbd.equations.headings import Headings, direction, spin
from mbd.equations.kinematic_proxies import KinematicProxies
from mbd.equations.kinematics import Edge, Moving, ground_motion, moving_body
from mbd.equations.orientations import offer_orientations
from mbd.equations.outputs import AXES, Outputs
from mbd.equations.parameter_scope import ParameterScope
from mbd.equations.placement import Placement
from mbd.errors import UnknownNameError, nearest
from mbd.forces.rotor import Rotor
from mbd.joints.base import Joint, row_unit
from mbd.tape.derivatives import jvp, live, substitute
from mbd.tape.functions import sin
from mbd.tape.node import Node, Scalar, Tape


def placeholders(tape: Tape) -> tuple[Rotation, Triple]:
    """R, p of a joint as fresh inputs, for asking how its rows depend on them."""
    a, b, c, d, e, f, g, h, i, x, y, z = (tape.input("virtual", k) for k in range(12))
    return ((a, b, c), (d, e, f), (g, h, i)), (x, y, z)


class DerivationContext(ParameterScope):
    """`mbd.bodies.scope.Scope` over a spanning tree; words see places and velocities as views, which `real` resolves.

    Parameters
    ----------
    tree : the joints that generate coordinates, each after the one that moves its parent
    cuts : the joints that become rows
    gravity : (x, y, z) [m/s²]; run-time parameters 'gravity.x', …
    tunable : names of parameters that stay inputs even at an exact 0 or ±1
    planar : whether all moves in x–y and turns about z
    carried : (joint, number of its angle) of angles of cut joints that are coordinates of their own, behind those of
        the tree, so that they count turns

    Attributes
    ----------
    bodies : by name, the ground first
    placement : everything in ground axes
    quantities : named results that words may ask for
    held_force : a force of a constraint, contact or joint by name, None where there is none
    turns : of the cut joints of a planar mechanism, by joint
    wrapped : of angles of cut joints that only a rotation shows, by joint and number
    """

    def __init__(
        self,
        ground: Body,
        tree: Sequence[Joint],
        cuts: Sequence[Joint],
        gravity: Vector3,
        tunable: Collection[str],
        planar: bool,
        carried: Sequence[tuple[str, int]] = (),
    ) -> None:
        self.tree, self.cuts = tuple(tree), tuple(cuts)
        labels = {joint.name: joint.labels for joint in cuts}
        more = [(f"{name}.{labels[name][k].name}", labels[name][k].unit) for name, k in carried]
        self.configuration = Configuration.of_joints(tree, more)
        n_q, n_v = self.configuration.n_q, self.configuration.n_v
        self.carried = {key: n_v - len(carried) + k for k, key in enumerate(carried)}
        super().__init__(n_q, n_v, tunable)
        self._chart()
        self.gravity = tuple(self.parameters.node(f"gravity.{a}", g) for a, g in zip(AXES, gravity, strict=True))
        self.states: list[tuple[Coordinate, Node]] = []
        self._joints: dict[str, JointMotion] = {}
        self.held_force: Callable[[str], Node | None] = dict[str, Node]().get
        self._dynamics: Dynamics | None = None
        self._rotors: list[Rotor] = []
        self._inertia: tuple[list[list[Node]], list[Node]] | None = None
        self.bodies = self._grown(ground)
        values: list[Scalar] = [node for joint in tree for node in self._tree_motion(joint).coordinates]
        values += [self.own_angle(*key) for key in self.carried]
        self.composed = tuple(self.tape.lift(value) for value in values)
        self.placement = Placement(self.tape, list(self.bodies.values()), self.composed)
        self.views = KinematicProxies(self.placement, self.composed, planar)
        self.quantities = Outputs(self.tape)
        self.turns: dict[str, Turn] = {}
        self.wrapped: dict[tuple[str, int], Turn] = {}
        self._angles: dict[str, tuple[int, Scalar]] = {}
        self._offer_quantities()

    # the tree -------------------------------------------------------------------------------------------------------
    def _grown(self, ground: Body) -> dict[str, Moving]:
        """The recursion over the tree."""
        x, y, z = self.gravity
        bodies = {ground.name: ground_motion(ground, (x, y, z))}
        self._edges: dict[str, Edge] = {}
        place = first = 0
        for joint in self.tree:
            edge = self._edges[joint.name] = self._edge(joint, place, first)
            child = joint.child.body
            bodies[child.name] = moving_body(child, bodies[joint.parent.body.name], edge, self)
            place, first = place + len(joint.labels), first + len(joint.freedoms)
        return bodies

    def _edge(self, joint: Joint, place: int, first: int) -> Edge:
        """place : number of its first coordinate."""
        inputs, places, own = (
            self.inputs,
            slice(place, place + len(joint.labels)),
            slice(first, first + len(joint.freedoms)),
        )
        values = tuple(self.tape.lift(value) for value in joint.compose(inputs.q[places], inputs.x[own]))
        moving = [inputs.clock[x] for x in inputs.x[own]]
        rates = tuple(self.tape.lift(rate) for rate in moving)
        return Edge(joint, first, values, inputs.v[own], inputs.a[own], inputs.x[own], rates)

    def _chart(self) -> None:
        """How increments move, of joints whose coordinates do not add."""
        if self.configuration.is_vector:
            return
        inputs, tape = self.inputs, self.tape
        rates = list(inputs.v)
        n_v = len(rates)
        D = [[tape.one if i == j else tape.zero for j in range(n_v)] for i in range(n_v)]
        for joint, _, first in self.configuration.charts:
            own = slice(first, first + len(joint.freedoms))
            x, v = inputs.x[own], inputs.v[own]
            rates[own] = [tape.lift(rate) for rate in joint.increment_rates(x, v)]
            speeds = [tape.lift(speed) for speed in joint.increment_velocities(x, v)]
            for j, rate in enumerate(v):
                for i, entry in enumerate(jvp(speeds, {rate: 1.0})):
                    D[first + i][first + j] = entry
        self.inputs = replace(inputs, chart=Chart(tuple(rates), tuple(tuple(line) for line in D)))

    def _tree_motion(self, joint: Joint) -> JointMotion:
        edge = self._edges[joint.name]
        return JointMotion(edge.values, edge.rates)

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The entries of q."""
        known = self.configuration
        return tuple(Coordinate(*each) for each in zip(known.names, known.units, known.defaults, strict=True))

    def own_angle(self, joint: str, place: int) -> Node:
        """An angle of a cut joint that is a coordinate of its own."""
        k = self.carried[joint, place]  # behind the coordinates of the tree
        return self.inputs.q[k - len(self.inputs.v)] + self.inputs.x[k]

    def read(self, joint: Joint) -> list[Node]:
        """The coordinates of a cut joint as its frames show them, angles between −π and π."""
        return [self.tape.lift(value) for value in joint.recover(*self.relative(joint), self)]

    # what words ask -------------------------------------------------------------------------------------------------
    def frame(self, frame: Frame) -> FrameMotion:
        """Motion of a frame, in ground axes."""
        body = self._body(frame.body.name)
        R, place = frame.placement(self)
        axes, point, views = self.placement.axes(body), self.placement.point(body, place), self.views
        rotation = views.rotation(axes)
        return FrameMotion(
            views.position(point),
            rotation if R is IDENTITY else product(rotation, R),
            views.velocity(point),
            views.angular_velocity(axes),
        )

    def joint(self, name: str) -> JointMotion:
        """Coordinates and rates of a joint; those of a cut joint are read off its frames."""
        if name in self._edges:
            edge = self._edges[name]
            return JointMotion(edge.values, edge.rates)
        known = self._joints.get(name)
        if known is None:
            joint = next((joint for joint in self.cuts if joint.name == name), None)
            if joint is None:
                raise UnknownNameError(nearest(name, [j.name for j in (*self.tree, *self.cuts)], "joint"))
            values = self.read(joint)
            rates = self.velocities(joint, values)
            place, angle = self._angles.get(name, (-1, 0.0))
            if place >= 0:
                values[place] = self.tape.lift(angle)
            for k in range(len(values)):
                if (name, k) in self.carried:
                    values[k] = self.own_angle(name, k)
            known = self._joints[name] = JointMotion(tuple(values), tuple(rates))
        return known

    def named(self, name: str) -> Node:
        """A named quantity of the configuration or the velocity, or a parameter."""
        value = None if self.quantities.offers(name) else self.parameters.declared(name)
        if value is not None:
            return self.parameter(*_owner_and_field(name), value)
        held = None if self.quantities.offers(name) else self.held_force(name)
        return self.quantities(name) if held is None else held

    def offer_inertia(self, dynamics: Dynamics, rotors: Sequence[Rotor]) -> None:
        """Let laws ask for mass matrices, of bodies and of the rotors on joints of the tree."""
        self._dynamics, self._rotors = dynamics, [each for each in rotors if each.joint.name in self._edges]

    def inertia(self, coordinates: Sequence[str]) -> tuple[list[list[Node]], list[Node]]:
        """M and h of some coordinates of the tree, ``M q̈ + h = τ``, of masses, rotors and weight alone.

        Raises
        ------
        UnknownNameError
            for names of no coordinate of the tree.
        """
        known: dict[str, int] = {}
        for joint in self.tree:
            first = self._edges[joint.name].first
            names = joint.velocity_names if not joint.is_vector else joint.coordinate_names
            known |= {name: first + k for k, name in enumerate(names)}
            known |= {joint.name: first} if len(joint.freedoms) == 1 else {}
        unknown = [name for name in coordinates if name not in known]
        if unknown or self._dynamics is None:
            raise UnknownNameError([nearest(name, known, "coordinate of the tree") for name in unknown])
        places = [known[name] for name in coordinates]
        if self._inertia is None:
            still: dict[Node, float] = dict.fromkeys(self.inputs.a, 0.0)
            M = [list(line) for line in self._dynamics.mass_matrix()]
            for rotor in self._rotors:
                k = self._edges[rotor.joint.name].first
                M[k][k] = M[k][k] + rotor.reflected(self)
            self._inertia = M, substitute(self._dynamics.balance(Work()), still)
        M, h = self._inertia
        return [[M[i][j] for j in places] for i in places], [h[i] for i in places]

    def state(self, owner: str, field: str, initial: float) -> Node:
        """A first-order state; registered on first use."""
        name = f"{owner}.{field}"
        for coordinate, node in self.states:
            if coordinate.name == name:
                return node
        node = self.tape.input("z", len(self.states))
        self.states.append((Coordinate(name, "", initial), node))
        self.quantities.value(name, node)
        return node

    # geometry -------------------------------------------------------------------------------------------------------
    def relative(self, joint: Joint) -> tuple[Rotation, Triple]:
        """R, p of a joint's child frame in its parent frame."""
        parent, child = self.frame(joint.parent), self.frame(joint.child)
        back = transpose(parent.rotation)
        return product(back, child.rotation), rotate(back, difference(child.position, parent.position))

    def cut_rows(self, joint: Joint) -> tuple[list[tuple[str, Node]], bool]:
        """(part, residual) of a cut joint, and whether its places are written in ground axes.

        Where a joint holds its two points together, ``R_Aᵀ (p_B − p_A) = 0`` is ``p_B − p_A = 0``, which is shorter.
        Where it holds a direction in the plane, the angle itself is the row: its sine would be 0 half a turn off too.
        """
        R, p = self.relative(joint)
        level = self._holds_points(joint)
        if level:
            p = difference(self.frame(joint.child).position, self.frame(joint.parent).position)
        rows = [(part, self.tape.lift(value)) for part, value in joint.rows(R, p, self)]
        place, angle = self._angles.get(joint.name, (0, 0.0))
        if place < 0:
            rows = [(part, self.tape.lift(angle) if self._holds_turn(part, value) else value) for part, value in rows]
        own = [k for k in range(len(joint.labels)) if (joint.name, k) in self.carried]
        shown = self.read(joint) if own else []
        rows += [(f"turns of {joint.labels[k].name}", sin(shown[k] - self.own_angle(joint.name, k))) for k in own]
        return rows, level

    def _holds_turn(self, part: str, value: Node) -> bool:
        """Whether a row of a joint that does not turn in the plane is one on its direction."""
        inputs = {node.data[0] for node in live([self.real(value)]) if node.op == "input"}
        return row_unit(part) == "rad" and "x" in inputs

    def count_turns(self, first: int) -> None:
        """Measure the angles of cut joints in the plane by the headings of their bodies, over any number of turns.

        Parameters
        ----------
        first : number of the first anchor that is free to hold whole turns
        """
        headings = Headings(self)
        for joint in self.cuts:
            turns = spin(joint, self)
            bodies = [self.bodies[frame.body.name] for frame in (joint.parent, joint.child)]
            parent, child = (headings.of(body) for body in bodies)
            turning = [] if turns is None else [k for k, slope in enumerate(turns.slopes) if slope != 0.0]
            if turns is None or parent is None or child is None or len(turning) > 1:
                continue
            place = turning[0] if turning else -1
            sign = turns.slopes[place] if turning else 1.0
            if abs(sign) != 1.0:
                continue
            anchor = first + len(self.turns)
            whole = (2.0 * math.pi) * self.tape.input("anchor", anchor)
            offset = direction(joint.child) - direction(joint.parent) - turns.offset
            angle = self.tape.lift(sign * (self.views.heading(child) - self.views.heading(parent) + offset + whole))
            name = joint.coordinate_names[place] if turning else ""
            self._angles[joint.name] = (place, angle)
            self.turns[joint.name] = Turn(name, joint.name, anchor, self.real(angle), sign)

    def count_turns_in_space(self, first: int) -> None:
        """Give results the whole turns of angles that only a rotation shows.

        Parameters
        ----------
        first : number of the first anchor that is free to hold whole turns
        """
        for joint in self.cuts:
            motion = self.joint(joint.name) if joint.labels and joint.is_vector else JointMotion((), ())
            for k, value in enumerate(motion.coordinates):
                node = self.real(value)
                if self.is_wrapped(joint, k, node):
                    anchor = first + len(self.wrapped)
                    angle = node + (2.0 * math.pi) * self.tape.input("anchor", anchor)
                    name, rate = joint.coordinate_names[k], self.real(motion.rates[k])
                    self.wrapped[joint.name, k] = Turn(name, joint.name, anchor, angle, 1.0, rate)

    def is_wrapped(self, joint: Joint, k: int, angle: Node) -> bool:
        """Whether a rotation alone shows an angle of a cut joint, so that it is known up to whole turns.

        That of a thread is not: the shift tells its turns.
        """
        if joint.labels[k].unit != "rad" or not any(each.op == "atan2" for each in live([angle])):
            return False
        R, p = placeholders(self.tape)
        shifts = {self.tape.lift(part).index for part in p}
        shown = self.tape.lift(joint.recover(R, p, self)[k])
        return not any(each.index in shifts for each in live([shown]))

    def _holds_points(self, joint: Joint) -> bool:
        """Whether the rows that depend on p are its three components."""
        R, p = placeholders(self.tape)
        rows = [self.tape.lift(value) for _, value in joint.rows(R, p, self)]
        places = {self.tape.lift(part).index for part in p}
        shifts = [row.index for row in rows if places & {node.index for node in live([row])}]
        return set(shifts) == places

    def real(self, value: Scalar) -> Node:
        """A word's expression with the motion itself in place of the views."""
        return self.views.real([self.tape.lift(value)])[0]

    def rates(self, values: Sequence[Node]) -> list[Node]:
        """d/dt, in views, of words' functions of t and q ⊕ x."""
        seeds: dict[Node, Scalar] = {self.time: 1.0, **self.inputs.clock}
        return jvp(values, seeds | self.views.rates(values))

    def velocities(self, joint: Joint, values: Sequence[Node]) -> list[Node]:
        """The velocities of a joint, with values read off its frames: their rates, or that of ``q ⊖ q₀`` at q = q₀."""
        rates = self.rates(values)
        if joint.is_vector:
            return rates
        fresh = [self.tape.input("virtual", k) for k in range(len(values))]
        moved = [self.tape.lift(x) for x in joint.difference(values, fresh)]
        found = jvp(moved, dict(zip(fresh, rates, strict=True)))
        return substitute(found, dict(zip(fresh, values, strict=True)))

    def rate(self, value: Scalar) -> Node:
        """d/dt of one of them."""
        return self.rates([self.tape.lift(value)])[0]

    def change(self, value: Scalar) -> Node:
        """d/dt of a word's function of t, q ⊕ x, v and z; no view is left in it."""
        values = [self.real(value)]
        inputs = self.inputs
        seeds: dict[Node, Scalar] = {self.time: 1.0, **inputs.clock}
        seeds |= dict(zip(inputs.v, inputs.a, strict=True))
        seeds |= {node: self.tape.input("s", k) for k, (_, node) in enumerate(self.states)}
        return jvp(values, seeds | changes.rates(self.placement, values))[0]

    def offer_frames(self, frames: Iterable[Frame]) -> None:
        """Name the components of frames' places and velocities, and register their parameters."""
        for frame in frames:
            frame.placement(self)
            self.quantities.triple(frame.full_name, partial(self._position, frame))
            self.quantities.triple(frame.full_name, partial(self._velocity, frame), [f"v{axis}" for axis in AXES])

    def _position(self, frame: Frame) -> Triple:
        return self.frame(frame).position

    def _velocity(self, frame: Frame) -> Triple:
        return self.frame(frame).velocity

    def _offer_quantities(self) -> None:
        """Time, coordinates and rates of every joint."""
        self.quantities.value("t", self.time)
        for joint in (*self.tree, *self.cuts):
            if joint.is_vector:
                for k, label in enumerate(joint.labels):
                    self.quantities.add(f"{joint.name}.{label.name}", partial(self._coordinate, joint.name, k))
                    self.quantities.add(f"{joint.name}.{label.name}.rate", partial(self._rate, joint.name, k))
            else:
                for k, name in enumerate(joint.coordinate_names):
                    self.quantities.add(name, partial(self._coordinate, joint.name, k))
                for k, name in enumerate(joint.velocity_names):
                    self.quantities.add(name, partial(self._rate, joint.name, k))
            if len(joint.freedoms) == 1:
                self.quantities.add(f"{joint.name}.rate", partial(self._rate, joint.name, 0))
        offer_orientations(self.quantities, self, (*self.tree, *self.cuts))

    def _coordinate(self, joint: str, place: int) -> Scalar:
        value, turn = self.joint(joint).coordinates[place], self.wrapped.get((joint, place))
        return value if turn is None else value + (2.0 * math.pi) * self.tape.input("anchor", turn.anchor)

    def _rate(self, joint: str, place: int) -> Scalar:
        return self.joint(joint).rates[place]

    def _body(self, name: str) -> Moving:
        if name not in self.bodies:
            raise UnknownNameError(nearest(name, self.bodies, "body"))
        return self.bodies[name]


def _owner_and_field(name: str) -> tuple[str, str]:
    owner, _, field = name.rpartition(".")
    return owner, field
