"""Forward kinematics of a model from its description and the coordinates that a run reports."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

import mbd
from mbd.bodies.base import Body, Frame
from mbd.joints.base import Joint
from tests.fuzz.geometry import (
    Array,
    Moving,
    Signal,
    Twist,
    ball,
    cross,
    fixed,
    inverse,
    matrix_of,
    product,
    shift,
    turn,
    twist,
)
from tests.fuzz.readings import Readings, coordinates

X, Y, Z = np.eye(3)


def joint_motion(joint: Joint, q: list[Signal], told: Readings) -> Moving:
    """The child's frame seen from the parent's.

    q : the coordinates that add; orientations are those of the readings

    Raises
    ------
    NotImplementedError
        for a joint that this judge does not know.
    """
    if isinstance(joint, mbd.Spherical):
        return ball(told.attitude(joint.name))
    if isinstance(joint, mbd.Free):
        place = product(shift(X, q[0]), product(shift(Y, q[1]), shift(Z, q[2])))
        return product(place, ball(told.attitude(joint.name)))
    if isinstance(joint, mbd.Revolute):
        return turn(joint.axis, q[0])
    if isinstance(joint, mbd.Prismatic):
        return shift(joint.axis, q[0])
    if isinstance(joint, mbd.Translation):
        place = fixed(np.eye(4), len(q[0].value))
        for axis, along in zip(joint.axes, q, strict=True):
            place = product(place, shift({"x": X, "y": Y, "z": Z}[axis], along))
        return place
    if isinstance(joint, mbd.Planar):
        return product(product(shift(X, q[0]), shift(Y, q[1])), turn(Z, q[2]))
    if isinstance(joint, mbd.Cylindrical):
        return product(shift(joint.axis, q[1]), turn(joint.axis, q[0]))
    if isinstance(joint, mbd.Universal):
        return product(turn(joint.axis, q[0]), turn(joint.second_axis, q[1]))
    if isinstance(joint, mbd.Screw):
        lead = told.parameters[f"{joint.name}.pitch"] / (2.0 * math.pi)
        return product(shift(joint.axis, Signal(*(lead * part for part in q[0]))), turn(joint.axis, q[0]))
    raise NotImplementedError(f"joints of kind {type(joint).__name__}")


class Mass(NamedTuple):
    """m [kg], center in body axes (3,) [m], inertia about it (3, 3) [kg m²]; planar: only about z is given."""

    mass: float
    center: Array
    inertia: Array
    planar: bool


def mass_of(body: Body, parameters: Mapping[str, Any]) -> Mass:
    """Mass properties from the description of a body, with the parameters of the run."""

    def number(name: str) -> float:
        return float(np.max(parameters[f"{body.name}.{name}"]))

    if isinstance(body, mbd.PointMass):
        return Mass(number("mass"), np.zeros(3), np.zeros((3, 3)), False)
    center = np.zeros(3)
    if isinstance(body, mbd.Link):
        center[1] = -number("center")
    else:
        center[:] = [number(f"center.{axis}") for axis in "xyz"]
    if f"{body.name}.inertia" in parameters:
        return Mass(number("mass"), center, np.diag([0.0, 0.0, number("inertia")]), True)
    inertia = np.zeros((3, 3))
    for (i, j), element in (
        ((0, 0), "xx"),
        ((1, 1), "yy"),
        ((2, 2), "zz"),
        ((0, 1), "xy"),
        ((0, 2), "xz"),
        ((1, 2), "yz"),
    ):
        if f"{body.name}.inertia.{element}" in parameters:
            inertia[i, j] = inertia[j, i] = number(f"inertia.{element}")
    return Mass(number("mass"), center, inertia, False)


@dataclass
class Bodies:
    """Where every body and frame is and how it moves.

    model : the description; told : what the run reports
    placed : placements of the bodies by name
    closing : joints that were not needed to place the bodies, which must fit all the same
    """

    model: mbd.Model
    told: Readings
    placed: dict[str, Moving] = field(default_factory=dict)
    closing: list[Joint] = field(default_factory=list)
    _twists: dict[str, Twist] = field(default_factory=dict)
    _frames: dict[Frame, Moving] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.told)
        self.placed[self.model.ground.name] = fixed(np.eye(4), n)
        left = self._in_order()
        self._float()
        progress = True
        while progress:
            progress = False
            for joint in list(left):
                a, b = joint.parent.body.name, joint.child.body.name
                if (a in self.placed) == (b in self.placed):
                    continue
                self._place(joint, a in self.placed)
                left.remove(joint)
                progress = True
                break
        self.closing = left

    def _in_order(self) -> list[Joint]:
        """Joints of the tree first, then others without coordinates, then those whose coordinates are read off."""

        def rank(joint: Joint) -> int:
            if not joint.labels:
                return 0 if joint.name in self.told.tree else 1
            return 0 if all(name in self.told.tree for name in joint.coordinate_names) else 2

        return sorted(self.model.joints, key=rank)

    def _float(self) -> None:
        """Bodies that the run moves freely, by coordinates of their own."""
        n = len(self.told)
        for body in self.model.bodies:
            names = {label: f"{body} floating.{label}" for label in ("x", "y", "z", "angle", "orientation.w")}
            given = {label: name for label, name in names.items() if name in self.told.tree}
            if not given:
                continue
            level = 0.0 if "orientation.w" in given or "z" in given else self._heights().get(body, 0.0)
            place = fixed(matrix_of(None, np.array([0.0, 0.0, level])), n)
            for label, axis in (("x", X), ("y", Y), ("z", Z)):
                if label in given:
                    place = product(place, shift(axis, self.told.coordinate(given[label])))
            if "angle" in given:
                place = product(place, turn(Z, self.told.coordinate(given["angle"])))
            if "orientation.w" in given:
                place = product(place, ball(self.told.attitude(f"{body} floating")))
            self.placed[body] = place

    def _heights(self) -> dict[str, float]:
        """How high above the plane of the ground joints hold the bodies of a mechanism that moves in a plane."""
        found = {self.model.ground.name: 0.0}
        for _ in self.model.joints:
            for joint in self.model.joints:
                a, b = joint.parent, joint.child
                rise = float(self.constant(a)[2, 3] - self.constant(b)[2, 3])
                if a.body.name in found:
                    found.setdefault(b.body.name, found[a.body.name] + rise)
                elif b.body.name in found:
                    found[a.body.name] = found[b.body.name] - rise
        return found

    def _place(self, joint: Joint, forward: bool) -> None:
        between = self.between(joint)
        outer, inner = (joint.parent, joint.child) if forward else (joint.child, joint.parent)
        step = between if forward else inverse(between)
        H = product(self.frame(outer), step)
        back = np.linalg.inv(self.constant(inner))
        self.placed[inner.body.name] = Moving(H.H @ back, H.first @ back, H.second @ back)

    def between(self, joint: Joint) -> Moving:
        """The child's frame seen from the parent's, by the joint's reported coordinates."""
        if not joint.labels:
            return fixed(np.eye(4), len(self.told))
        q = coordinates(joint, self.told)
        if q is None:
            raise NotImplementedError(f"coordinates of '{joint.name}' are not reported")
        return joint_motion(joint, q, self.told)

    def constant(self, frame: Frame) -> Array:
        """A frame in its body, from the description with the parameters of the run."""
        parameters = self.told.parameters
        place = np.zeros(3)
        if frame.landmark == "end":
            place[1] = -float(np.max(parameters[f"{frame.body.name}.length"]))
        elif frame.landmark == "center" and frame.body is not self.model.ground:
            place = mass_of(frame.body, parameters).center
        elif frame.landmark is None:
            place = np.array([float(np.max(parameters[f"{frame.full_name}.{axis}"])) for axis in "xyz"])
        return matrix_of(frame.rotation, place)

    def frame(self, frame: Frame) -> Moving:
        """A frame in ground axes."""
        if frame not in self._frames:
            H, placed = self.constant(frame), self.placed[frame.body.name]
            self._frames[frame] = Moving(placed.H @ H, placed.first @ H, placed.second @ H)
        return self._frames[frame]

    def place(self, frame: Frame) -> Array:
        """Its origin (n, 3)."""
        return self.frame(frame).H[:, :3, 3]

    def twist(self, body: str) -> Twist:
        """How a body's origin moves."""
        if body not in self._twists:
            self._twists[body] = twist(self.placed[body])
        return self._twists[body]

    def velocity(self, body: str, place: Array) -> Array:
        """Velocity of the point of a body that is at this place of the ground (n, 3)."""
        motion = self.twist(body)
        return motion.linear + cross(motion.angular, place - self.placed[body].H[:, :3, 3])
