"""Joints of ``.osim`` files: their frames, coordinates and motions, and the chains of joints that state them."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.algebra import constant_rotation
from mbd.bodies.rigid_body import RigidBody
from mbd.errors import quoted
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.joints.prismatic import Prismatic
from mbd.joints.revolute import Revolute
from mbd.joints.spherical import Spherical
from mbd.joints.weld import Weld
from mbd.laboratory.models.osim_elements import flag_of, number_of, numbers_of, objects_in, plain, text_of
from mbd.laboratory.models.osim_file import (
    Motion,
    OsimCoordinate,
    OsimFile,
    OsimJoint,
    body_named,
    body_of_socket,
    framed,
)
from mbd.laboratory.models.osim_functions import Linear, function_of
from mbd.laboratory.models.xml import Element
from mbd.laboratory.quaternion_rates import UNIT_LENGTH_ATOL

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


def joints_of(file: OsimFile, bodies: dict[str, Element]) -> list[OsimJoint]:
    """The joints as the file has them."""
    found: list[OsimJoint] = []
    names = set[str]()
    for element, child in _joint_elements(file, bodies):
        name = plain(element.get("name"))
        if file.old and name in names:  # OpenSim renames it too
            file.report.approximated.append(f"the second joint {name!r} is called '{name} {child}'")
            name = f"{name} {child}"
        if not name or name in names:
            raise element.wrong("has no name, or that of another joint")
        names.add(name)
        if element.tag != "CustomJoint" and element.tag not in MOTIONS:
            raise element.wrong(
                f"is a joint that cannot be stated exactly; there are CustomJoint, {', '.join(MOTIONS)}"
            )
        if file.old and flag_of(element, "reverse"):
            raise element.wrong("is reversed; exchange its parent and its child")
        ends = _old_ends(file, element, child) if child else _new_ends(file, element, name)
        joint = OsimJoint(name, element, ends[0], ends[1], _joint_coordinates(file, element))
        joint.motions = _custom(file, joint) if element.tag == "CustomJoint" else _plain_motions(file, joint)
        found.append(joint)
    return found


def _joint_elements(file: OsimFile, bodies: dict[str, Element]) -> Iterator[tuple[Element, str]]:
    """Elements of joints, with the child where they lie within it."""
    if not file.old:
        for element in objects_in(file.source, "JointSet"):
            yield element, ""
        return
    for name, body in bodies.items():
        inside = body.find("Joint")
        if inside is None or len(inside.children) != 1:
            raise body.wrong("needs one joint within <Joint>")
        yield inside.children[0], name


def _old_ends(file: OsimFile, element: Element, child: str) -> Any:
    """The frames of a joint within its child."""
    parent = body_named(file, element, text_of(element, "parent_body"))
    places = [
        (np.array(numbers_of(element, place, 3)), turned(numbers_of(element, turn, 3)))
        for place, turn in (("location_in_parent", "orientation_in_parent"), ("location", "orientation"))
    ]
    return (parent, *places[0]), (child, *places[1])


def _new_ends(file: OsimFile, element: Element, joint: str) -> Any:
    """The frames of a joint by its sockets."""
    ends = [end_at(file, element, f"socket_{side}_frame") for side in ("parent", "child")]
    if ends[1][0] == "ground":
        raise element.wrong(f"has the ground as the child of {joint!r}; exchange its parent and its child")
    return ends


def end_at(file: OsimFile, element: Element, socket_tag: str) -> tuple[str, Vector, Matrix]:
    """Body, place and rotation of the frame that a socket names: a frame of the element, or of a body."""
    own = element.find("frames")
    frames = {frame.get("name"): frame for frame in own.all("PhysicalOffsetFrame")} if own else {}
    socket = text_of(element, socket_tag)
    *folder, last = socket.split("/")
    if last in frames and (not folder or folder[-1] in (element.get("name"), ".")):
        frame = frames[last]
        place, turn = numbers_of(frame, "translation", 3), numbers_of(frame, "orientation", 3)
        body = body_of_socket(file, frame, text_of(frame, "socket_parent"))
        return body, np.array(place), turned(turn)
    return body_of_socket(file, element, socket), np.zeros(3), np.eye(3)


def _joint_coordinates(file: OsimFile, element: Element) -> list[OsimCoordinate]:
    if file.old:
        listed = objects_in(element, "CoordinateSet")
    else:
        inside = element.find("coordinates")
        listed = list(inside) if inside else []
    found = []
    for each in listed:
        name = plain(each.get("name"))
        if each.tag != "Coordinate" or not name or name in file.coordinates:
            raise each.wrong("is no <Coordinate>, has no name, or that of another coordinate")
        low, high = numbers_of(each, "range", 2, (-math.inf, math.inf))
        coordinate = OsimCoordinate(
            name,
            each,
            number_of(each, "default_value", 0.0),
            low,
            high,
            flag_of(each, "clamped"),
            flag_of(each, "locked"),
        )
        coordinate.alone = coordinate.locked or (file.stops and coordinate.clamped)
        file.coordinates[name] = coordinate
        found.append(coordinate)
    return found


def _plain_motions(file: OsimFile, joint: OsimJoint) -> list[Motion]:
    kind = MOTIONS[joint.element.tag]
    if len(kind) != len(joint.coordinates):
        raise joint.element.wrong(f"needs {len(kind)} coordinates, got {len(joint.coordinates)}")
    return [
        Motion(label, axis, Linear((1.0,), 0.0), [coordinate])
        for (label, axis), coordinate in zip(kind, joint.coordinates, strict=True)
    ]


def _custom(file: OsimFile, joint: OsimJoint) -> list[Motion]:
    """The six motions of a <SpatialTransform>."""
    own = {coordinate.name: coordinate for coordinate in joint.coordinates}
    transform = joint.element.find("SpatialTransform")
    axes = {axis.get("name"): axis for axis in transform.all("TransformAxis")} if transform else {}
    if sorted(axes) != sorted(ORDER):
        raise joint.element.wrong(f"needs a <SpatialTransform> with {', '.join(ORDER)}")
    motions = []
    for label in ORDER:
        element = axes[label]
        names = [plain(name) for name in text_of(element, "coordinates", "").split()]
        unknown = [name for name in names if name not in own]
        if unknown:
            raise element.wrong(f"of joint {joint.name!r} names the coordinate {unknown[0]!r}, which it lacks")
        what = f"{label} of joint {joint.name!r}"
        motion = Motion(label, X, function_of(element, len(names), what), [own[name] for name in names])
        if motion.constant == 0.0:
            continue
        axis = np.array(numbers_of(element, "axis", 3))
        size = float(np.linalg.norm(axis))
        if size == 0.0:
            raise element.wrong(f"of joint {joint.name!r} needs an axis, got one without a direction")
        if abs(size - 1.0) > UNIT_LENGTH_ATOL:
            file.report.approximated.append(f"axis of {what} has the length {size:.3g}; only its direction is used")
        x, y, z = map(float, axis / size)
        motion.axis = (x, y, z)
        motions.append(motion)
    return motions


def tree_of(file: OsimFile, joints: list[OsimJoint]) -> list[OsimJoint]:
    """The joints from the ground outwards, each body with one joint to its parent."""
    above: dict[str, OsimJoint] = {}
    for joint in joints:
        child = joint.child[0]
        if child in above:
            raise joint.element.wrong(f"is a second joint of body {child!r} to a parent, beside {above[child].name!r}")
        above[child] = joint
    loose = [name for name in file.bodies if name not in above]
    if loose:
        raise file.source.wrong(f"has no joint of the bodies {quoted(loose)} to a parent")
    reached, ordered = {"ground"}, list[OsimJoint]()
    while len(ordered) < len(joints):
        found = [each for each in joints if each.child[0] not in reached and each.parent[0] in reached]
        if not found:
            circle = [each.name for each in joints if each.child[0] not in reached]
            raise file.source.wrong(f"has joints that no way from the ground reaches: {quoted(circle)}")
        ordered += found
        reached |= {each.child[0] for each in found}
    return ordered


def connect(file: OsimFile, joint: OsimJoint) -> None:
    """One joint after another with bodies without mass between them; what does not move is in their frames."""
    if joint.element.tag in ("BallJoint", "FreeJoint") and not any(each.alone for each in joint.coordinates):
        _float(file, joint)
        return
    motions = [motion for label in ORDER for motion in joint.motions if motion.label == label]
    drivers = _drivers(file, joint, motions)
    moving = [k for k, motion in enumerate(motions) if motion.constant is None]
    name, place, R = joint.parent
    base, (child, *end) = file.body(name), joint.child
    for k, motion in enumerate(motions):
        # a motion that does not move shifts or turns the frame of the next one, or that of the child
        if motion.constant is not None:
            place, R = moved(place, R, motion, motion.constant)
            continue
        coordinate, axis = drivers.get(motion.label), motion.axis
        if coordinate is not None:
            place, R = moved(place, R, motion, motion.function.offset)
            axis = (axis[0] * motion.slope, axis[1] * motion.slope, axis[2] * motion.slope)
        called = _joint_name(file, coordinate.name if coordinate else f"{joint.name} {motion.label}", joint)
        start = framed(base, called, place, R)
        place, R = np.zeros(3), np.eye(3)
        # the last motion ends on the child, the others on a body without mass
        if k == moving[-1]:
            for still in motions[k + 1 :]:
                place, R = moved(place, R, still, still.constant or 0.0)
            at, turn = end[0], end[1] @ R.T
            stop = framed(file.bodies[child], called, at - turn @ place, turn)
            _add(file, (Revolute if motion.turns else Prismatic)(called, start, stop, axis=axis), motion, coordinate)
            return
        base = RigidBody(_carrier(file, joint), 0.0, (0.0,) * 6)
        _add(file, (Revolute if motion.turns else Prismatic)(called, start, base.origin, axis=axis), motion, coordinate)
    called = _joint_name(file, joint.name, joint)
    stop = framed(file.bodies[child], called, *end)
    file.joints[called] = Weld(called, framed(base, called, place, R), stop)


def _add(file: OsimFile, made: Joint, motion: Motion, coordinate: OsimCoordinate | None) -> None:
    """A joint of one motion, which is a coordinate or depends on some."""
    file.joints[made.name] = made
    if coordinate is None:
        file.dependents.append((made, motion))
    else:
        coordinate.joint = made


def _float(file: OsimFile, joint: OsimJoint) -> None:
    """A ball or a free joint, whose orientation is a quaternion."""
    called = _joint_name(file, joint.name, joint)
    start = framed(file.body(joint.parent[0]), called, *joint.parent[1:])
    end = framed(file.bodies[joint.child[0]], called, *joint.child[1:])
    values = [coordinate.value for coordinate in joint.coordinates]
    file.joints[called] = Free(called, start, end) if len(values) == 6 else Spherical(called, start, end)
    file.posture |= {f"{called}.{axis}": value for axis, value in zip("xyz", values[3:], strict=False)}
    file.posture[f"{called}.orientation"] = ("xyz", tuple(values[:3]))


def _drivers(file: OsimFile, joint: OsimJoint, motions: list[Motion]) -> dict[str, OsimCoordinate]:
    """By motion, the coordinate that it is; a coordinate that no motion is gets a joint of its own."""
    found: dict[str, OsimCoordinate] = {}
    for coordinate in joint.coordinates:
        driven = [each for each in motions if each.is_driven and each.coordinates == [coordinate]]
        if driven:
            found[driven[0].label] = coordinate
        elif not coordinate.coupled:  # else all motions follow from what determines it, as those of a patella
            _measured(file, joint, coordinate, motions)
    return found


def _measured(file: OsimFile, joint: OsimJoint, coordinate: OsimCoordinate, motions: list[Motion]) -> None:
    """A joint that carries a body without mass, and whose coordinate is one that motions are functions of."""
    own = [each for each in motions if coordinate in each.coordinates and each.constant is None]
    if not own:
        file.report.left_out.append(f"coordinate {coordinate.name!r}, of which no motion is a function")
        return
    called = _joint_name(file, coordinate.name, joint)
    carrier = RigidBody(_carrier(file, joint), 0.0, (0.0,) * 6)
    kind = Revolute if any(each.turns for each in own) else Prismatic
    base = file.body(joint.parent[0])
    file.joints[called] = coordinate.joint = kind(called, base.origin, carrier.origin, axis=own[0].axis)
    file.measured.append(coordinate.name)


def _joint_name(file: OsimFile, wanted: str, joint: OsimJoint) -> str:
    if wanted in file.joints:
        raise joint.element.wrong(f"and another joint would both be called {wanted!r}; rename one")
    return wanted


def _carrier(file: OsimFile, joint: OsimJoint) -> str:
    """The name of a body without mass."""
    number = 1
    while (name := f"{joint.name} carrier {number}") in file.carriers or name in file.bodies:
        number += 1
    file.carriers.add(name)
    return name


def rotation_about(axis: Sequence[float], angle: float) -> Matrix:
    return np.array(constant_rotation((float(axis[0]), float(axis[1]), float(axis[2])), angle))


def turned(angles: tuple[float, ...]) -> Matrix:
    """Turns about x, y and z that move along."""
    x, y, z = angles
    return rotation_about(X, x) @ rotation_about(Y, y) @ rotation_about(Z, z)


def moved(place: Vector, R: Matrix, motion: Motion, value: float) -> tuple[Vector, Matrix]:
    """A frame after a motion by a value."""
    if motion.turns:
        return place, R @ rotation_about(motion.axis, value)
    return place + R @ np.array(motion.axis) * value, R
