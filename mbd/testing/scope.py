"""A plain scope for tests of words: every body floats freely, and numbers come out of the tape."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from mbd.bodies.algebra import axis_rotation, difference, product, rotate, total, transpose
from mbd.bodies.base import Frame
from mbd.bodies.ground import Ground
from mbd.bodies.scope import FrameMotion, JointMotion, Rotation, Scope, Triple
from mbd.errors import UnknownNameError, nearest
from mbd.joints.base import Joint
from mbd.tape.derivatives import jvp
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node, Scalar, Tape

Numbers = np.ndarray[Any, np.dtype[np.float64]]

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class FreeScope(Scope):
    """`mbd.bodies.scope.Scope` in which each body has six coordinates: place, then turns about x, y, z.

    Joints are read off their frames; `recorded` holds every parameter asked for, `asked` every body,
    `numbers` the inputs of `value`.
    """

    def __init__(self, joints: Iterable[Joint] = (), tunable: Iterable[str] = (), frames: Iterable[Frame] = ()) -> None:
        self.tape = Tape()
        self.frames = {frame.full_name: frame for frame in frames}
        self.joints = {joint.name: joint for joint in joints}
        self.tunable = set(tunable)
        self.recorded: dict[str, float] = {}
        self.numbers: dict[Node, float] = {self.time: 0.0}
        self._parameters: dict[str, Node] = {}
        self._bodies: dict[str, int] = {}
        self.states: dict[str, Node] = {}
        self.asked: set[str] = set()

    @property
    def time(self) -> Node:
        return self.tape.input("t")

    def parameter(self, owner: str, field: str, value: float) -> Node:
        name = f"{owner}.{field}"
        if name not in self._parameters:
            self.recorded[name] = value
            structural = value in (0.0, 1.0, -1.0) and name not in self.tunable
            node = self.tape.constant(value) if structural else self.tape.input("p", len(self._parameters))
            self._parameters[name] = node
            self.numbers[node] = value
        return self._parameters[name]

    def state_names(self, mode: str) -> Sequence[str]:
        """There are no modes."""
        raise UnknownNameError(f"this scope has no mode {mode!r}")

    def inertia(self, coordinates: Sequence[str]) -> tuple[Sequence[Sequence[Node]], Sequence[Node]]:
        """Bodies move freely here."""
        raise UnknownNameError(f"this scope has no coordinates {tuple(coordinates)!r}")

    def state(self, owner: str, field: str, initial: float) -> Node:
        node = self.states.setdefault(f"{owner}.{field}", self.tape.input("z", len(self.states)))
        self.numbers.setdefault(node, initial)
        return node

    # motion -------------------------------------------------------------------------------------------------------
    def coordinates(self, body: str) -> list[Node]:
        first = 6 * self._bodies.setdefault(body, len(self._bodies))
        return [self.tape.input("q", first + k) for k in range(6)]

    def rates(self, body: str) -> list[Node]:
        first = 6 * self._bodies.setdefault(body, len(self._bodies))
        return [self.tape.input("v", first + k) for k in range(6)]

    @property
    def all_coordinates(self) -> list[Node]:
        return [node for body in self._bodies for node in self.coordinates(body)]

    @property
    def all_rates(self) -> list[Node]:
        return [node for body in self._bodies for node in self.rates(body)]

    def move(self, body: str, place: Sequence[float], speed: Sequence[float] = (0.0,) * 6) -> None:
        """Give the six coordinates and six rates of a body their numbers."""
        self.numbers |= dict(zip(self.coordinates(body), place, strict=True))
        self.numbers |= dict(zip(self.rates(body), speed, strict=True))

    def rate(self, value: Scalar) -> Node:
        """d/dt along the motion."""
        seeds: dict[Node, Scalar] = {self.time: 1.0}
        seeds |= dict(zip(self.all_coordinates, self.all_rates, strict=True))
        return jvp([self.tape.lift(value)], seeds)[0]

    def frame(self, frame: Frame) -> FrameMotion:
        R_frame, place = frame.placement(self)
        if isinstance(frame.body, Ground):
            return FrameMotion(place, R_frame, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        self.asked.add(frame.body.name)
        x, y, z, *turns = self.coordinates(frame.body.name)
        R: Any = axis_rotation(AXES[0], turns[0])
        for axis, turn in zip(AXES[1:], turns[1:], strict=True):
            R = product(R, axis_rotation(axis, turn))
        position = total((x, y, z), rotate(R, place))
        rates = [[self.rate(self.tape.lift(part)) for part in row] for row in R]
        spin = product((tuple(rates[0]), tuple(rates[1]), tuple(rates[2])), transpose(R))  # type: ignore[arg-type]
        velocity = tuple(self.rate(self.tape.lift(part)) for part in position)
        return FrameMotion(position, product(R, R_frame), velocity, (spin[2][1], spin[0][2], spin[1][0]))  # type: ignore[arg-type]

    def relative(self, parent: Frame, child: Frame) -> tuple[Rotation, Triple]:
        a, b = self.frame(parent), self.frame(child)
        back = transpose(a.rotation)
        return product(back, b.rotation), rotate(back, difference(b.position, a.position))

    def joint(self, name: str) -> JointMotion:
        if name not in self.joints:
            raise UnknownNameError(nearest(name, self.joints, "joint", "The scope has"))
        joint = self.joints[name]
        values = [self.tape.lift(v) for v in joint.recover(*self.relative(joint.parent, joint.child), self)]
        return JointMotion(tuple(values), tuple(self.rate(value) for value in values))

    def named(self, name: str) -> Node:
        """'t', '<joint>.<label>', '<joint>.<label>.rate', '<joint>.rate', '<body>.<frame>.x', '<body>.<frame>.vx'."""
        owner, _, label = name.rpartition(".")
        if name == "t":
            return self.time
        if owner in self.frames and label.removeprefix("v") in ("x", "y", "z"):
            motion = self.frame(self.frames[owner])
            place = motion.velocity if label.startswith("v") else motion.position
            return self.tape.lift(place["xyz".index(label[-1])])
        known = {f"{joint}.{part.name}": (joint, k) for joint in self.joints
                 for k, part in enumerate(self.joints[joint].labels)}  # fmt: skip
        short = {
            joint: f"{joint}.{each.labels[0].name}" for joint, each in self.joints.items() if len(each.labels) == 1
        }
        coordinate = short.get(owner, owner) if label == "rate" else name
        if coordinate not in known:
            places = [f"{frame}.{axis}" for frame in self.frames for axis in "xyz"]
            raise UnknownNameError(nearest(name, [*known, *places], "quantity", "The scope has"))
        joint, k = known[coordinate]
        moving = self.joint(joint)
        return self.tape.lift((moving.rates if label == "rate" else moving.coordinates)[k])

    # whole scenes -------------------------------------------------------------------------------------------------
    @property
    def bodies(self) -> tuple[str, ...]:
        """The bodies met so far."""
        return tuple(self._bodies)

    def scatter(self, rng: np.random.Generator, spread: float = 1.0) -> None:
        """Random places and rates of every body met so far, and random states."""
        for body in self._bodies:
            self.move(body, list(map(float, rng.uniform(-spread, spread, 6))), list(map(float, rng.uniform(-1, 1, 6))))
        self.numbers |= {node: float(rng.uniform(-1, 1)) for node in self.states.values()}
        self.numbers[self.time] = float(rng.uniform(0, 1))

    def motion_of(self, body: str) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers]:
        """p, R, v, ω of a body's origin, and E with ``ω = E (turn rates)``, as numbers."""
        place = np.array([self.numbers[node] for node in self.coordinates(body)])
        rates = np.array([self.numbers[node] for node in self.rates(body)])
        turns = [
            np.array(axis_rotation(axis, float(turn)), dtype=float) for axis, turn in zip(AXES, place[3:], strict=True)
        ]
        E = np.column_stack([np.eye(3)[0], turns[0][:, 1], (turns[0] @ turns[1])[:, 2]])
        return place[:3], turns[0] @ turns[1] @ turns[2], rates[:3], E @ rates[3:], E

    def turn_scene(self, turn: Numbers, shift: Numbers) -> None:
        """Turn and shift everything with its motion: ``p ← Q p + s``, ``v ← Q v``."""
        for body in self._bodies:
            p, R, v, spin, _ = self.motion_of(body)
            R = turn @ R
            angles = [np.arctan2(-R[1, 2], R[2, 2]), np.arcsin(R[0, 2]), np.arctan2(-R[0, 1], R[0, 0])]
            self.move(body, list(map(float, [*(turn @ p + shift), *angles])))
            E = self.motion_of(body)[4]
            rates = [*(turn @ v), *np.linalg.solve(E, turn @ spin)]
            self.numbers |= dict(zip(self.rates(body), map(float, rates), strict=True))

    def ride(self, velocity: Numbers, spin: Numbers) -> Numbers:
        """The rates of all coordinates of a motion of everything as one rigid body."""
        rates: list[float] = []
        for body in self._bodies:
            p, _, _, _, E = self.motion_of(body)
            rates += [*(velocity + np.cross(spin, p)), *np.linalg.solve(E, spin)]
        return np.array(rates)

    # numbers ------------------------------------------------------------------------------------------------------
    def value(self, *expressions: Scalar, given: Mapping[Any, float] | None = None) -> list[float]:
        """The values of scalars with the numbers known so far."""
        numbers: dict[Any, float] = {**self.numbers, **(given or {})}
        return evaluate([self.tape.lift(e) for e in expressions], numbers)

    def matrix(self, rows: Sequence[Sequence[Scalar]]) -> np.ndarray[Any, np.dtype[np.float64]]:
        """The values of rows of scalars."""
        flat = self.value(*(value for row in rows for value in row))
        return np.array(flat).reshape(len(rows), -1)


def skew(vector: Sequence[Scalar]) -> Rotation:
    """The matrix of the cross product."""
    x, y, z = vector
    return ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
