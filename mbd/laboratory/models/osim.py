"""Models of OpenSim, ``.osim``, in the formats 20303 and 30000 (joints within bodies) and 40000."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.algebra import constant_rotation
from mbd.bodies.base import Body, Frame
from mbd.bodies.marker import Marker
from mbd.bodies.rigid_body import RigidBody
from mbd.constraints.base import Constraint
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.measures import extension, flexion
from mbd.constraints.unilateral import Unilateral
from mbd.constraints.user_measure import measure
from mbd.errors import ModelError
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.joints.prismatic import Prismatic
from mbd.joints.revolute import Revolute
from mbd.joints.spherical import Spherical
from mbd.joints.weld import Weld
from mbd.laboratory.models.inertia import possible_inertia
from mbd.laboratory.models.osim_functions import Linear, function_of, is_left_out
from mbd.laboratory.models.report import ImportedModel, ImportReport
from mbd.laboratory.models.xml import Element, read_xml
from mbd.model import Model

__all__ = ["read_osim"]

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
MOTIONS: dict[str, tuple[tuple[str, tuple[float, float, float]], ...]] = {
    "WeldJoint": (),
    "PinJoint": (("rotation3", Z),),
    "SliderJoint": (("translation1", X),),
    "UniversalJoint": (("rotation1", X), ("rotation2", Y)),
    "GimbalJoint": (("rotation1", X), ("rotation2", Y), ("rotation3", Z)),
    "BallJoint": (("rotation1", X), ("rotation2", Y), ("rotation3", Z)),
    "PlanarJoint": (("rotation3", Z), ("translation1", X), ("translation2", Y)),
    "FreeJoint": (
        ("rotation1", X), ("rotation2", Y), ("rotation3", Z), ("translation1", X), ("translation2", Y),
        ("translation3", Z),
    ),
}  # fmt: skip
"""What each coordinate of a joint does, in the order of the coordinates."""
ORDER = ("translation1", "translation2", "translation3", "rotation1", "rotation2", "rotation3")
"""Motions one after another: shifts along axes of the parent, then turns about axes that move along."""
UNIT = 1e-3
"""By how much the length of an axis may differ from 1, as printed digits make it [-]."""
READ = ("Ground", "BodySet", "JointSet", "ConstraintSet", "MarkerSet")
"""Elements of a model that are read; of others the report counts what is in them."""


@dataclass
class _Coordinate:
    """A coordinate of a file."""

    name: str
    element: Element
    value: float
    low: float
    high: float
    clamped: bool
    locked: bool
    alone: bool = False
    """Whether a lock, a coupler or a stop needs it by itself."""
    free: bool = True
    """Whether no coupler determines it."""
    joint: Joint | None = None
    """The joint of the model whose one coordinate it is."""

    @property
    def is_limited(self) -> bool:
        """Whether it is clamped to a range, and not locked."""
        return self.clamped and not self.locked and math.isfinite(self.low) and self.low < self.high

    @property
    def made(self) -> Joint:
        """Its joint, which is there."""
        assert self.joint is not None
        return self.joint


@dataclass
class _Coupler:
    """A coordinate that is a function of others."""

    name: str
    own: _Coordinate
    others: list[_Coordinate]
    function: Any


@dataclass
class _Motion:
    """A shift along an axis or a turn about it by a function of coordinates."""

    label: str
    axis: tuple[float, float, float]
    function: Any
    coordinates: list[_Coordinate]

    @property
    def turns(self) -> bool:
        return self.label.startswith("rotation")

    @property
    def constant(self) -> float | None:
        """Its value where it does not move."""
        still = isinstance(self.function, Linear) and not any(self.function.slopes)
        return self.function.offset if still else None

    @property
    def is_driven(self) -> bool:
        """Whether it is ±q + offset of one coordinate."""
        function = self.function
        return isinstance(function, Linear) and len(function.slopes) == 1 and abs(self.slope) == 1.0

    @property
    def slope(self) -> float:
        """Of a function of one coordinate that is linear."""
        slope: float = self.function.slopes[0]
        return slope


@dataclass
class _Joint:
    """A joint of a file: its two frames as (body, place, rotation), its coordinates and motions."""

    name: str
    element: Element
    parent: tuple[str, Vector, Matrix]
    child: tuple[str, Vector, Matrix]
    coordinates: list[_Coordinate]
    motions: list[_Motion] = field(default_factory=list)


def read_osim(path: Path, stops: bool, repair: bool) -> ImportedModel:
    """A model in the axes of the file, x forward, y up, z to the right.

    See `mbd.read_model`.
    """
    repaired = list[str]()
    root = read_xml(path, repaired)
    source = root.find("Model")
    if root.tag != "OpenSimDocument" or source is None:
        raise root.wrong("a file of OpenSim begins with <OpenSimDocument> and has a <Model>")
    version = root.get("Version")
    if version not in ("20303", "30000") and not (version.isdecimal() and 40000 <= int(version) < 50000):
        raise root.wrong(
            f"is of the format {version!r}; 20303, 30000 and 40000 are read: open it with OpenSim 4 and save it"
        )
    reader = _Reader(source, int(version) < 40000, stops, repair)
    reader.report.approximated += repaired
    return reader.read(path)


class _Reader:
    """The steps of reading one file."""

    def __init__(self, source: Element, old: bool, stops: bool, repair: bool) -> None:
        self.source, self.old, self.stops, self.repair = source, old, stops, repair
        self.report = ImportReport()
        self.bodies, self.joints, self.held = dict[str, Body](), dict[str, Joint](), list[Constraint]()
        self.coordinates = dict[str, _Coordinate]()
        self.posture = dict[str, Any]()
        self.dependents = list[tuple[Joint, _Motion]]()
        self.carriers = set[str]()

    def read(self, path: Path) -> ImportedModel:
        """Bodies, joints from the ground outwards, couplings, markers, the report."""
        source, report = self.source, self.report
        units = _text(source, "length_units", "meters")
        if units not in ("meters", "m"):
            raise source.wrong(f"has lengths in {units!r}; meters are read")
        gravity = _numbers(source, "gravity", 3, (0.0, -9.80665, 0.0))
        title = _plain(source.attributes.get("name", "")) or _plain(path.stem) or "model"
        self.model = Model(title, gravity=gravity)
        joints = self._tree(self._joints(self._bodies()))
        couplers = self._couplers()
        for joint in joints:
            self._connect(joint)
        self._hold(couplers)
        self.model.connect(*self.joints.values())
        self.model.constrain(*self.held)
        self._summary(joints, couplers, self._markers())
        return ImportedModel(self.model, self.bodies, self.joints, report, self.posture)

    # bodies -----------------------------------------------------------------------------------------------------------
    def _bodies(self) -> dict[str, Element]:
        """The elements of bodies by name."""
        elements: dict[str, Element] = {}
        broken: list[str] = []
        for element in _objects(self.source, "BodySet"):
            name = _plain(element.get("name"))
            if name == "ground" and self.old:
                continue
            if element.tag != "Body" or not name or name in elements or name == "ground":
                raise element.wrong("is no <Body>, has no name, or that of another body or the ground")
            elements[name] = element
            mass, center = _number(element, "mass"), _numbers(element, "mass_center", 3, (0.0, 0.0, 0.0))
            tensor = self._inertia(element)
            if mass < 0.0:
                raise element.wrong(f"has the negative mass {mass:g} kg")
            if mass == 0.0 and tensor.any():
                self.report.approximated.append(f"inertia of {name!r} without a mass taken as none")
            tensor = tensor if mass > 0.0 else np.zeros((3, 3))
            fixed = possible_inertia(tensor)
            broken += [name] if fixed is not tensor else []
            self.bodies[name] = RigidBody(name, mass, _six(fixed), center)
        if not elements:
            raise self.source.wrong("has no bodies")
        if broken and not self.repair:
            raise ModelError(
                f"{self.source.file}: no body can have the moments of inertia of {_listed(broken)}: one is negative, "
                "or larger than the two others together; repair=True takes the nearest that a body can have"
            )
        if broken:
            self.report.approximated.append(f"moments of inertia made possible: {_listed(broken)}")
        return elements

    def _inertia(self, element: Element) -> Matrix:
        """The inertia about the center of mass in axes of the body."""
        if self.old:
            parts = [_number(element, f"inertia_{axes}", 0.0) for axes in ("xx", "yy", "zz", "xy", "xz", "yz")]
        else:
            parts = list(_numbers(element, "inertia", 6))
        xx, yy, zz, xy, xz, yz = parts
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    # joints -----------------------------------------------------------------------------------------------------------
    def _joints(self, bodies: dict[str, Element]) -> list[_Joint]:
        """The joints as the file has them."""
        found: list[_Joint] = []
        names = set[str]()
        for element, child in self._joint_elements(bodies):
            name = _plain(element.get("name"))
            if self.old and name in names:  # OpenSim renames it too
                self.report.approximated.append(f"the second joint {name!r} is called '{name} {child}'")
                name = f"{name} {child}"
            if not name or name in names:
                raise element.wrong("has no name, or that of another joint")
            names.add(name)
            if element.tag != "CustomJoint" and element.tag not in MOTIONS:
                raise element.wrong(
                    f"is a joint that cannot be stated exactly; there are CustomJoint, {', '.join(MOTIONS)}"
                )
            if self.old and _flag(element, "reverse"):
                raise element.wrong("is reversed; exchange its parent and its child")
            ends = self._old_ends(element, child) if child else self._new_ends(element, name)
            joint = _Joint(name, element, ends[0], ends[1], self._joint_coordinates(element))
            joint.motions = self._custom(joint) if element.tag == "CustomJoint" else self._plain_motions(joint)
            found.append(joint)
        return found

    def _joint_elements(self, bodies: dict[str, Element]) -> Iterator[tuple[Element, str]]:
        """Elements of joints, with the child where they lie within it."""
        if not self.old:
            for element in _objects(self.source, "JointSet"):
                yield element, ""
            return
        for name, body in bodies.items():
            inside = body.find("Joint")
            if inside is None or len(inside.children) != 1:
                raise body.wrong("needs one joint within <Joint>")
            yield inside.children[0], name

    def _body_named(self, element: Element, name: str) -> str:
        name = _plain(name)
        if name != "ground" and name not in self.bodies:
            raise element.wrong(f"names the body {name!r}, which the file lacks")
        return name

    def _old_ends(self, element: Element, child: str) -> Any:
        """The frames of a joint within its child."""
        parent = self._body_named(element, _text(element, "parent_body"))
        places = [
            (np.array(_numbers(element, place, 3)), _turned(_numbers(element, turn, 3)))
            for place, turn in (("location_in_parent", "orientation_in_parent"), ("location", "orientation"))
        ]
        return (parent, *places[0]), (child, *places[1])

    def _new_ends(self, element: Element, joint: str) -> Any:
        """The frames of a joint by its sockets."""
        own = element.find("frames")
        frames = {frame.get("name"): frame for frame in own.all("PhysicalOffsetFrame")} if own else {}
        ends = []
        for side in ("parent", "child"):
            socket = _text(element, f"socket_{side}_frame")
            *folder, last = socket.split("/")
            if last in frames and (not folder or folder[-1] in (element.get("name"), ".")):
                frame = frames[last]
                place, turn = _numbers(frame, "translation", 3), _numbers(frame, "orientation", 3)
                body = self._socket(frame, _text(frame, "socket_parent"))
                ends.append((body, np.array(place), _turned(turn)))
            else:
                ends.append((self._socket(element, socket), np.zeros(3), np.eye(3)))
        if ends[1][0] == "ground":
            raise element.wrong(f"has the ground as the child of {joint!r}; exchange its parent and its child")
        return ends

    def _socket(self, element: Element, path: str) -> str:
        """The body that a path of the format 40000 names: '/bodyset/pelvis', '../../ground', 'ground'."""
        *folder, last = path.split("/")
        plain = not folder or folder[-1] in ("bodyset", "..", ".", "")
        if not plain:
            raise element.wrong(f"names the frame {path!r}; bodies, and frames of the joint on bodies, are read")
        return self._body_named(element, last)

    def _joint_coordinates(self, element: Element) -> list[_Coordinate]:
        if self.old:
            listed = _objects(element, "CoordinateSet")
        else:
            inside = element.find("coordinates")
            listed = list(inside) if inside else []
        found = []
        for each in listed:
            name = _plain(each.get("name"))
            if each.tag != "Coordinate" or not name or name in self.coordinates:
                raise each.wrong("is no <Coordinate>, has no name, or that of another coordinate")
            low, high = _numbers(each, "range", 2, (-math.inf, math.inf))
            coordinate = _Coordinate(
                name,
                each,
                _number(each, "default_value", 0.0),
                low,
                high,
                _flag(each, "clamped"),
                _flag(each, "locked"),
            )
            coordinate.alone = coordinate.locked or (self.stops and coordinate.clamped)
            self.coordinates[name] = coordinate
            found.append(coordinate)
        return found

    def _plain_motions(self, joint: _Joint) -> list[_Motion]:
        kind = MOTIONS[joint.element.tag]
        if len(kind) != len(joint.coordinates):
            raise joint.element.wrong(f"needs {len(kind)} coordinates, got {len(joint.coordinates)}")
        return [
            _Motion(label, axis, Linear((1.0,), 0.0), [coordinate])
            for (label, axis), coordinate in zip(kind, joint.coordinates, strict=True)
        ]

    def _custom(self, joint: _Joint) -> list[_Motion]:
        """The six motions of a <SpatialTransform>."""
        own = {coordinate.name: coordinate for coordinate in joint.coordinates}
        transform = joint.element.find("SpatialTransform")
        axes = {axis.get("name"): axis for axis in transform.all("TransformAxis")} if transform else {}
        if sorted(axes) != sorted(ORDER):
            raise joint.element.wrong(f"needs a <SpatialTransform> with {', '.join(ORDER)}")
        motions = []
        for label in ORDER:
            element = axes[label]
            names = [_plain(name) for name in _text(element, "coordinates", "").split()]
            unknown = [name for name in names if name not in own]
            if unknown:
                raise element.wrong(f"of joint {joint.name!r} names the coordinate {unknown[0]!r}, which it lacks")
            what = f"{label} of joint {joint.name!r}"
            motion = _Motion(label, X, function_of(element, len(names), what), [own[name] for name in names])
            if motion.constant == 0.0:
                continue
            axis = np.array(_numbers(element, "axis", 3))
            size = float(np.linalg.norm(axis))
            if abs(size - 1.0) > UNIT:
                raise element.wrong(f"of joint {joint.name!r} needs an axis of length 1, got {size:.6g}")
            x, y, z = map(float, axis / size)
            motion.axis = (x, y, z)
            motions.append(motion)
        return motions

    def _tree(self, joints: list[_Joint]) -> list[_Joint]:
        """The joints from the ground outwards, each body with one joint to its parent."""
        above: dict[str, _Joint] = {}
        for joint in joints:
            child = joint.child[0]
            if child in above:
                raise joint.element.wrong(
                    f"is a second joint of body {child!r} to a parent, beside {above[child].name!r}"
                )
            above[child] = joint
        loose = [name for name in self.bodies if name not in above]
        if loose:
            raise self.source.wrong(f"has no joint of the bodies {_listed(loose)} to a parent")
        reached, ordered = {"ground"}, list[_Joint]()
        while len(ordered) < len(joints):
            found = [each for each in joints if each.child[0] not in reached and each.parent[0] in reached]
            if not found:
                circle = [each.name for each in joints if each.child[0] not in reached]
                raise self.source.wrong(f"has joints that no way from the ground reaches: {_listed(circle)}")
            ordered += found
            reached |= {each.child[0] for each in found}
        return ordered

    def _body(self, name: str) -> Body:
        return self.model.ground if name == "ground" else self.bodies[name]

    def _connect(self, joint: _Joint) -> None:
        """One joint after another with bodies without mass between them; what does not move is in their frames."""
        if joint.element.tag in ("BallJoint", "FreeJoint") and not any(each.alone for each in joint.coordinates):
            self._float(joint)
            return
        motions = [motion for label in ORDER for motion in joint.motions if motion.label == label]
        drivers = self._drivers(joint, motions)
        moving = [k for k, motion in enumerate(motions) if motion.constant is None]
        name, place, R = joint.parent
        base, (child, *end) = self._body(name), joint.child
        for k, motion in enumerate(motions):
            # a motion that does not move shifts or turns the frame of the next one, or that of the child
            if motion.constant is not None:
                place, R = _moved(place, R, motion, motion.constant)
                continue
            coordinate, axis = drivers.get(motion.label), motion.axis
            if coordinate is not None:
                place, R = _moved(place, R, motion, motion.function.offset)
                axis = (axis[0] * motion.slope, axis[1] * motion.slope, axis[2] * motion.slope)
            called = self._joint_name(coordinate.name if coordinate else f"{joint.name} {motion.label}", joint)
            start = _framed(base, called, place, R)
            place, R = np.zeros(3), np.eye(3)
            # the last motion ends on the child, the others on a body without mass
            if k == moving[-1]:
                for still in motions[k + 1 :]:
                    place, R = _moved(place, R, still, still.constant or 0.0)
                at, turn = end[0], end[1] @ R.T
                stop = _framed(self.bodies[child], called, at - turn @ place, turn)
                self._add((Revolute if motion.turns else Prismatic)(called, start, stop, axis=axis), motion, coordinate)
                return
            base = RigidBody(self._carrier(joint), 0.0, (0.0,) * 6)
            self._add(
                (Revolute if motion.turns else Prismatic)(called, start, base.origin, axis=axis), motion, coordinate
            )
        called = self._joint_name(joint.name, joint)
        stop = _framed(self.bodies[child], called, *end)
        self.joints[called] = Weld(called, _framed(base, called, place, R), stop)

    def _add(self, made: Joint, motion: _Motion, coordinate: _Coordinate | None) -> None:
        """A joint of one motion, which is a coordinate or depends on some."""
        self.joints[made.name] = made
        if coordinate is None:
            self.dependents.append((made, motion))
        else:
            coordinate.joint = made

    def _float(self, joint: _Joint) -> None:
        """A ball or a free joint, whose orientation is a quaternion."""
        called = self._joint_name(joint.name, joint)
        start = _framed(self._body(joint.parent[0]), called, *joint.parent[1:])
        end = _framed(self.bodies[joint.child[0]], called, *joint.child[1:])
        values = [coordinate.value for coordinate in joint.coordinates]
        self.joints[called] = Free(called, start, end) if len(values) == 6 else Spherical(called, start, end)
        self.posture |= {f"{called}.{axis}": value for axis, value in zip("xyz", values[3:], strict=False)}
        self.posture[f"{called}.orientation"] = ("xyz", tuple(values[:3]))

    def _drivers(self, joint: _Joint, motions: list[_Motion]) -> dict[str, _Coordinate]:
        """By motion, the coordinate that it is."""
        found: dict[str, _Coordinate] = {}
        for coordinate in joint.coordinates:
            driven = [each for each in motions if each.is_driven and each.coordinates == [coordinate]]
            if not driven:
                raise joint.element.wrong(
                    f"cannot be stated exactly: none of its motions is the coordinate {coordinate.name!r} itself, by a "
                    "LinearFunction with the slope 1 or -1"
                )
            found[driven[0].label] = coordinate
        return found

    def _joint_name(self, wanted: str, joint: _Joint) -> str:
        if wanted in self.joints:
            raise joint.element.wrong(f"and another joint would both be called {wanted!r}; rename one")
        return wanted

    def _carrier(self, joint: _Joint) -> str:
        """The name of a body without mass."""
        number = 1
        while (name := f"{joint.name} carrier {number}") in self.carriers or name in self.bodies:
            number += 1
        self.carriers.add(name)
        return name

    # constraints ------------------------------------------------------------------------------------------------------
    def _couplers(self) -> list[_Coupler]:
        """Couplers between coordinates, but for those that are switched off or whose function is not read."""
        found = list[_Coupler]()
        for element in _objects(self.source, "ConstraintSet"):
            name = _plain(element.get("name"))
            off = _flag(element, "isDisabled") or not _flag(element, "isEnforced", True)
            if off or element.tag != "CoordinateCouplerConstraint":
                self.report.left_out.append(f"<{element.tag}> {name!r}{', which is switched off' if off else ''}")
                continue
            names = _text(element, "independent_coordinate_names").split()
            own, *others = (
                self._coordinate(element, each) for each in (_text(element, "dependent_coordinate_name"), *names)
            )
            inside = element.find("coupled_coordinates_function")
            if inside is None or not others:
                raise element.wrong("needs independent coordinates and a <coupled_coordinates_function>")
            if is_left_out(inside):
                kinds = ", ".join(f"<{child.tag}>" for child in inside)
                self.report.left_out.append(f"coupler {name!r} of {own.name!r}, whose function is {kinds}")
                continue
            function = function_of(inside, len(others), f"coupler {name!r}")
            found.append(_Coupler(name, own, others, function.scaled(_number(element, "scale_factor", 1.0))))
            for coordinate in (own, *others):
                coordinate.alone = True
            own.free = False
        return found

    def _coordinate(self, element: Element, name: str) -> _Coordinate:
        name = _plain(name)
        if name not in self.coordinates:
            raise element.wrong(f"names the coordinate {name!r}, which the file lacks")
        return self.coordinates[name]

    def _hold(self, couplers: list[_Coupler]) -> None:
        """Rows of motions that depend on coordinates, of couplers and of locks; stops; the posture."""
        taken = set[str]()
        for made, motion in self.dependents:
            self._row(f"{made.name} function", made, motion.coordinates, motion.function, taken)
        for coupler in couplers:
            self._row(coupler.name or "coupler", coupler.own.made, coupler.others, coupler.function, taken)
        for coordinate in self.coordinates.values():
            if coordinate.joint is None:
                continue
            name, joint = coordinate.name, coordinate.joint
            if coordinate.locked:
                self.held.append(Bilateral(_unlike(f"{name} lock", taken), joint, coordinate.value))
            elif coordinate.free:
                self.posture[joint.coordinate_names[0]] = coordinate.value
            if self.stops and coordinate.is_limited:
                self.held += [
                    Unilateral(_unlike(f"{name} lower stop", taken), extension(joint, offset=coordinate.low)),
                    Unilateral(_unlike(f"{name} upper stop", taken), flexion(joint, offset=-coordinate.high)),
                ]

    def _row(self, name: str, own: Joint, others: list[_Coordinate], function: Any, taken: set[str]) -> None:
        """q − f(q', …) = 0."""
        names = [joint.coordinate_names[0] for joint in (own, *(each.made for each in others))]
        row = measure(partial(_apart, function=function), *names, unit=own.labels[0].unit)
        self.held.append(Bilateral(_unlike(name, taken), row))

    # the rest ---------------------------------------------------------------------------------------------------------
    def _markers(self) -> int:
        """Markers as points of their bodies."""
        taken = {*self.bodies, *self.joints, *self.carriers, *(each.name for each in self.held), "ground"}
        count = 0
        for element in _objects(self.source, "MarkerSet"):
            if element.tag != "Marker":
                self.report.left_out.append(f"<{element.tag}> in <MarkerSet>")
                continue
            name = _plain(element.get("name"))
            if self.old:
                body = self._body_named(element, _text(element, "body"))
            else:
                body = self._socket(element, _text(element, "socket_parent_frame"))
            called = _unlike(name or "marker", taken, " marker")
            if called != name:
                self.report.approximated.append(f"marker {name!r}, a name that is taken, is called {called!r}")
            Marker(called, self._body(body), _numbers(element, "location", 3))
            count += 1
        return count

    def _summary(self, joints: list[_Joint], couplers: list[_Coupler], markers: int) -> None:
        report = self.report
        kinds = [joint.element.tag for joint in joints]
        counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
        first = [f"{len(self.bodies)} bodies and {len(joints)} joints ({counts}), {len(self.coordinates)} coordinates"]
        if self.dependents:
            first.append(
                f"motions that are functions of coordinates, as rows: {_listed(m.name for m, _ in self.dependents)}"
            )
        if couplers:
            first.append(f"couplers as rows: {_listed(each.name for each in couplers)}")
        coordinates = self.coordinates.values()
        locked = [each.name for each in coordinates if each.locked]
        clamped = [each.name for each in coordinates if each.is_limited]
        empty = [each.name for each in coordinates if each.clamped and not each.locked and not each.is_limited]
        if locked:
            first.append(f"locked coordinates as rows: {_listed(locked)}")
        if clamped and self.stops:
            first.append(f"clamped coordinates with stops: {_listed(clamped)}")
        if markers:
            first.append(f"{markers} markers")
        report.understood[:0] = first
        left = report.left_out
        if clamped and not self.stops:
            left.append(f"ranges of clamped coordinates, stops=True makes stops of them: {_listed(clamped)}")
        if empty:
            left.append(f"ranges of clamped coordinates, whose lower end is not below the upper one: {_listed(empty)}")
        prescribed = [each.name for each in coordinates if _flag(each.element, "prescribed")]
        if prescribed:
            left.append(f"prescribed functions of time: {_listed(prescribed)}")
        moving = [each.name for each in coordinates if _number(each.element, "default_speed_value", 0.0)]
        if moving:
            left.append(f"default speeds: {_listed(moving)}")
        for child in self.source:
            if child.tag not in READ:
                tags = [each.tag for each in child.find("objects") or ()]
                left += [f"{tags.count(tag)} <{tag}> in <{child.tag}>" for tag in dict.fromkeys(tags)]
                left += (
                    [f"{len(child.children)} elements in <{child.tag}>"]
                    if child.children and not child.find("objects")
                    else []
                )


def _apart(own: Any, *others: Any, function: Any) -> Any:
    """q − f(q', …)."""
    return own - function(*others)


def _six(tensor: Matrix) -> tuple[float, ...]:
    """Ixx, Iyy, Izz, Ixy, Ixz, Iyz."""
    return tuple(float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


# geometry -----------------------------------------------------------------------------------------------------------
def _rotation(axis: Sequence[float], angle: float) -> Matrix:
    return np.array(constant_rotation((float(axis[0]), float(axis[1]), float(axis[2])), angle))


def _turned(angles: tuple[float, ...]) -> Matrix:
    """Turns about x, y and z that move along."""
    x, y, z = angles
    return _rotation(X, x) @ _rotation(Y, y) @ _rotation(Z, z)


def _moved(place: Vector, R: Matrix, motion: _Motion, value: float) -> tuple[Vector, Matrix]:
    """A frame after a motion by a value."""
    if motion.turns:
        return place, R @ _rotation(motion.axis, value)
    return place + R @ np.array(motion.axis) * value, R


def _framed(body: Body, joint: str, place: Vector, R: Matrix) -> Frame:
    """A frame on a body, its own axes and origin where they are those."""
    straight = np.array_equal(R, np.eye(3))
    if straight and not place.any():
        return body.origin
    x, y, z = (tuple(map(float, row)) for row in R)
    offset = tuple(map(float, place))
    return Frame(body, f"{joint} frame", offset, None if straight else (x, y, z))  # type: ignore[arg-type]


# elements -----------------------------------------------------------------------------------------------------------
def _objects(owner: Element, tag: str) -> list[Element]:
    """The elements of a set."""
    inside = owner.find(tag)
    objects = inside.find("objects") if inside else None
    return list(objects) if objects else []


def _plain(name: str) -> str:
    return " ".join(name.replace(".", "_").split())


def _unlike(name: str, taken: set[str], behind: str = " again") -> str:
    """A name that is not taken yet, which then is."""
    while name in taken:
        name += behind
    taken.add(name)
    return name


def _listed(names: Iterable[str]) -> str:
    names = list(names)
    return ", ".join(map(repr, names[:6])) + (f" and {len(names) - 6} more" if names[6:] else "")


def _text(owner: Element, tag: str, otherwise: str | None = None) -> str:
    child = owner.find(tag)
    text = child.text.strip() if child is not None else ""
    if not text and otherwise is None:
        raise owner.wrong(f"needs <{tag}>")
    return text or str(otherwise)


def _numbers(owner: Element, tag: str, count: int, otherwise: tuple[float, ...] | None = None) -> Any:
    child = owner.find(tag)
    if child is None:
        if otherwise is None:
            raise owner.wrong(f"needs <{tag}>")
        return otherwise
    return child.parsed(child.text, count, tag)


def _number(owner: Element, tag: str, otherwise: float | None = None) -> float:
    (value,) = _numbers(owner, tag, 1, None if otherwise is None else (otherwise,))
    return float(value)


def _flag(owner: Element, tag: str, otherwise: bool = False) -> bool:
    child = owner.find(tag)
    if child is None:
        return otherwise
    text = child.text.strip().lower()
    if text not in ("true", "false", "1", "0"):
        raise child.wrong(f"must be true or false, got {child.text.strip()[:60]!r}")
    return text in ("true", "1")
