"""A plain scope for tests: every body floats freely, and numbers come out of the tape."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from mbd.bodies.algebra import axis_rotation, cross, difference, product, rotate, total, transpose
from mbd.bodies.base import Frame
from mbd.bodies.ground import Ground
from mbd.joints.base import Joint
from mbd.scope import FrameMotion, JointMotion, Rotation, Triple
from mbd.tape.derivatives import jvp
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node, Scalar, Table, Tape

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class FreeScope:
    """`mbd.scope.Scope` in which each body has six coordinates: place, then turns about x, y, z.

    Joints are read off their frames; `recorded` holds every parameter asked for, `numbers` the inputs of `value`.
    """

    def __init__(self, joints: Iterable[Joint] = (), tunable: Iterable[str] = ()) -> None:
        self.tape = Tape()
        self.joints = {joint.name: joint for joint in joints}
        self.tunable = set(tunable)
        self.recorded: dict[str, float] = {}
        self.numbers: dict[Node, float] = {self.time: 0.0}
        self._parameters: dict[str, Node] = {}
        self._bodies: dict[str, int] = {}

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

    def table(self, owner: str, breaks: Sequence[float], coefficients: Sequence[Sequence[float]]) -> Table:
        return self.tape.table(owner, breaks, coefficients)

    def state(self, owner: str, field: str, initial: float) -> Node:
        return self.tape.input("z", 0)

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

    def rate(self, node: Node) -> Node:
        """d/dt along the motion."""
        seeds: dict[Node, Scalar] = {self.time: 1.0}
        seeds |= dict(zip(self.all_coordinates, self.all_rates, strict=True))
        return jvp([node], seeds)[0]

    def frame(self, frame: Frame) -> FrameMotion:
        R_frame, place = frame.placement(self)
        if isinstance(frame.body, Ground):
            return FrameMotion(place, R_frame, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
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
        joint = self.joints[name]
        values = [self.tape.lift(v) for v in joint.recover(*self.relative(joint.parent, joint.child), self)]
        return JointMotion(tuple(values), tuple(self.rate(value) for value in values))

    def named(self, name: str) -> Node:
        """'<joint>.<label>', '<joint>.<label>.rate'."""
        owner, label, *rate = name.split(".")
        motion = self.joint(owner)
        place = [label_.name for label_ in self.joints[owner].labels].index(label)
        return self.tape.lift((motion.rates if rate else motion.coordinates)[place])

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


def moment(arm: Triple, force: Triple) -> Triple:
    """arm × force."""
    return cross(arm, force)


# observed order ---------------------------------------------------------------------------------------------------
SECOND_ORDER = (3.6, 4.4)
"""How many times an error of second order may fall as dt is halved; 4 in the limit."""


def halved(error: Callable[[float], Any], dt: float, halvings: int = 3) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Sizes of an error at dt, dt/2, dt/4, …: one line a step, one column a quantity."""
    sizes = [np.abs(np.atleast_1d(error(dt / 2**k))) for k in range(halvings + 1)]
    return np.array(sizes, dtype=float)


def assert_second_order(error: Callable[[float], Any], dt: float, halvings: int = 3) -> None:
    """Every error of `error(dt)`, a number or several, falls 3.6 to 4.4 times with each halving of dt."""
    sizes = halved(error, dt, halvings)
    falls = sizes[:-1] / sizes[1:]
    low, high = SECOND_ORDER
    report = f"errors at dt = {dt:g}, dt/2, …:\n{sizes}\nfall by\n{falls}"
    assert np.all((falls > low) & (falls < high)), report
