"""Robots in the Unified Robot Description Format, ``.urdf`` (wiki.ros.org/urdf/XML)."""

import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.bodies.base import Body, Frame
from mbd.bodies.rigid_body import RigidBody
from mbd.constraints.base import Constraint
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.measures import extension, flexion
from mbd.constraints.unilateral import Unilateral
from mbd.constraints.user_measure import measure
from mbd.errors import quoted
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.joints.losses import Coulomb, Viscous
from mbd.joints.prismatic import Prismatic
from mbd.joints.revolute import Revolute
from mbd.joints.weld import Weld
from mbd.laboratory.models.inertia import note_repairs, possible_inertia
from mbd.laboratory.models.report import ImportedModel, ImportReport
from mbd.laboratory.models.xml import Element, read_xml
from mbd.model import Model
from mbd.notes import doubt
from mbd.topology.doubts import MAX_PLAUSIBLE_ANGLE

SHAPES = ("visual", "collision")
KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating")


def read_urdf(path: Path, base: str, stops: bool, losses: bool, repair: bool) -> ImportedModel:
    """A robot with z of the file turned to y, so that x is forward, y up and z to the right.

    Links are bodies of the same names, joints too; limits of joints become stops, damping and friction losses, mimics
    couplings. See `mbd.read_model`.
    """
    root = read_xml(path)
    if root.tag != "robot":
        raise root.wrong("a file of URDF begins with <robot>")
    if any(tag.startswith("xacro:") for tag in {child.tag for child in root}):
        raise root.wrong("holds macros; expand them first: xacro file.urdf.xacro > file.urdf")
    report = ImportReport()
    model = Model(" ".join(root.attributes.get("name", path.stem).replace(".", "_").split()) or "robot")
    bodies = _bodies(root, report, repair)
    links = root.all("joint")
    children = {_end(joint, "child", bodies) for joint in links}
    roots = [name for name in bodies if name not in children]
    if len(roots) != 1:
        raise root.wrong(
            f"one link without a joint to a parent is expected, got {', '.join(map(repr, roots[:4])) or 'none'}"
        )
    ground = model.ground.origin.turned(-0.5 * math.pi, (1.0, 0.0, 0.0))  # z of the file is up
    origin = bodies[roots[0]].origin
    called, held_by = {_plain(joint.get("name")) for joint in links}, "base"
    while held_by in called:
        held_by += " ground"
    model.connect(Free(held_by, ground, origin) if base == "floating" else Weld(held_by, ground, origin))
    joints, held = dict[str, Joint](), list[Constraint]()
    for each in links:
        name = _plain(each.get("name"))
        if name in joints:
            raise each.wrong("has a name that another joint has")
        joints[name] = _joint(each, name, bodies, losses, report)
        held += _stops(each, joints[name], report) if stops else []
    held += _mimics(links, joints, report)
    model.connect(*joints.values())
    model.constrain(*held)
    _summary(root, links, bodies, stops, losses, report)
    doubt(*_limits_in_degrees(links, root.file))
    return ImportedModel(model, bodies, joints, report)


def _plain(name: str) -> str:
    return " ".join(name.replace(".", "_").split())


# links --------------------------------------------------------------------------------------------------------------
def _bodies(root: Element, report: ImportReport, repair: bool) -> dict[str, Body]:
    found: dict[str, Body] = {}
    broken: list[str] = []
    massless: list[str] = []
    hollow: list[str] = []
    for link in root.all("link"):
        name = _plain(link.get("name"))
        if not name or name in found:
            raise link.wrong("has no name, or that of another link")
        inertial = link.find("inertial")
        mass, center, tensor = 0.0, (0.0, 0.0, 0.0), np.zeros((3, 3))
        if inertial is not None:
            mass, center, tensor = _inertial(inertial)
        if mass == 0.0:
            massless.append(name)
            hollow += [name] if tensor.any() else []
            tensor = np.zeros((3, 3))
        elif mass < 0.0:
            raise link.wrong(f"has the negative mass {mass:g} kg")
        fixed = possible_inertia(tensor)
        if fixed is not tensor:
            broken.append(name)
            tensor = fixed
        elements = (tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2])
        title = f"{name} link" if name == "ground" else name
        found[name] = RigidBody(title, mass, tuple(map(float, elements)), center)
    if not found:
        raise root.wrong("has no links")
    note_repairs(root.file, broken, repair, report)
    if hollow:
        report.approximated.append(f"inertia without a mass taken as none: {', '.join(map(repr, hollow))}")
    if massless:
        report.understood.append(f"links without mass: {', '.join(map(repr, massless))}")
    return found


def _inertial(inertial: Element) -> tuple[float, Any, Matrix]:
    """Mass, center and inertia about it in axes of the link."""
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    m = mass.numbers("value", 1)[0] if mass is not None else 0.0
    place, R = _origin(inertial)
    tensor = np.zeros((3, 3))
    if inertia is not None:
        values = {key: inertia.numbers(key, 1, (0.0,))[0] for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
        for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
            tensor[i, j] = tensor[j, i] = values[f"i{'xyz'[i]}{'xyz'[j]}"]
    return m, place, R @ tensor @ R.T


def _origin(element: Element) -> tuple[Any, Matrix]:
    """Place and rotation of an <origin>."""
    origin = element.find("origin")
    if origin is None:
        return (0.0, 0.0, 0.0), np.eye(3)
    place, (roll, pitch, yaw) = origin.numbers("xyz", 3, (0.0, 0.0, 0.0)), _turns(origin)
    turns = ((yaw, 2), (pitch, 1), (roll, 0))
    R = np.eye(3)
    for angle, axis in turns:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[j, i], turn[i, j] = math.sin(angle), -math.sin(angle)
        R = R @ turn
    return place, R


# joints -------------------------------------------------------------------------------------------------------------
def _end(joint: Element, which: str, bodies: dict[str, Body]) -> str:
    end = joint.find(which)
    if end is None:
        raise joint.wrong(f"needs a <{which}>")
    name = _plain(end.get("link"))
    if name not in bodies:
        raise end.wrong(f"names the link {name!r}, which the file lacks")
    return name


def _joint(each: Element, name: str, bodies: dict[str, Body], losses: bool, report: ImportReport) -> Joint:
    parent, child = (bodies[_end(each, which, bodies)] for which in ("parent", "child"))
    frame = _placed(each, parent)
    kind = each.get("type")
    if kind not in KINDS:
        raise each.wrong(f"is of the type {kind!r}; there are {', '.join(KINDS)}")
    if kind == "fixed":
        return Weld(name, frame, child.origin)
    if kind == "floating":
        return Free(name, frame, child.origin)
    line = each.find("axis")
    x, y, z = (1.0, 0.0, 0.0) if line is None else line.numbers("xyz", 3, (1.0, 0.0, 0.0))
    if x == y == z == 0.0:
        raise each.wrong("has the axis 0 0 0")
    axis = (x, y, z)
    loss = _loss(each) if losses else None
    if kind == "prismatic":
        return Prismatic(name, frame, child.origin, axis=axis, loss=loss)
    return Revolute(name, frame, child.origin, axis=axis, loss=loss)


def _turns(origin: Element) -> tuple[float, float, float]:
    """Roll, pitch and yaw of an <origin>, or those of its quaternion, which the version 1.2 allows [rad]."""
    if "quat_xyzw" not in origin.attributes:
        roll, pitch, yaw = origin.numbers("rpy", 3, (0.0, 0.0, 0.0))
        return roll, pitch, yaw
    if "rpy" in origin.attributes:
        raise origin.wrong("has both rpy and quat_xyzw; one turn is expected")
    x, y, z, w = origin.numbers("quat_xyzw", 4)
    size = x * x + y * y + z * z + w * w
    if not 0.99 < size < 1.01:
        raise origin.wrong(f"quat_xyzw must have the length 1, got {math.sqrt(size):.4g}")
    x, y, z, w = (part / math.sqrt(size) for part in (x, y, z, w))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, pitch, math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _placed(each: Element, parent: Body) -> Frame:
    """The frame of a joint on its parent."""
    origin = each.find("origin")
    if origin is None:
        return parent.origin
    place, (roll, pitch, yaw) = origin.numbers("xyz", 3, (0.0, 0.0, 0.0)), _turns(origin)
    x, y, z = place
    frame = parent.point(x, y, z) if any(place) else parent.origin
    for angle, axis in ((yaw, (0.0, 0.0, 1.0)), (pitch, (0.0, 1.0, 0.0)), (roll, (1.0, 0.0, 0.0))):
        frame = frame.turned(angle, axis) if angle else frame
    return frame


def _loss(each: Element) -> Any:
    dynamics = each.find("dynamics")
    if dynamics is None:
        return None
    damping, friction = (dynamics.numbers(name, 1, (0.0,))[0] for name in ("damping", "friction"))
    parts = [kind(value) for kind, value in ((Viscous, damping), (Coulomb, friction)) if value > 0.0]
    if not parts:
        return None
    return parts[0] if len(parts) == 1 else parts[0] + parts[1]


def _stops(each: Element, joint: Joint, report: ImportReport) -> list[Constraint]:
    """Limits of an angle or a displacement as stops without restitution."""
    limit = each.find("limit")
    if each.get("type") not in ("revolute", "prismatic") or limit is None:
        return []
    lower, upper = (limit.numbers(name, 1, (0.0,))[0] for name in ("lower", "upper"))
    if not lower < upper:
        report.left_out.append(
            f"limits of {joint.name!r}, whose lower one {lower:g} is not below the upper one {upper:g}"
        )
        return []
    return [
        Unilateral(f"{joint.name} lower stop", extension(joint, offset=lower)),
        Unilateral(f"{joint.name} upper stop", flexion(joint, offset=-upper)),
    ]


def _limits_in_degrees(links: list[Element], file: Any) -> list[str]:
    """A sentence on limits of angles that are whole numbers beyond `MAX_PLAUSIBLE_ANGLE`, as degrees are."""
    limits = [(_plain(each.get("name")), each.find("limit")) for each in links if each.get("type") == "revolute"]
    both = ("lower", "upper")
    ends = {name: [limit.numbers(key, 1, (0.0,))[0] for key in both] for name, limit in limits if limit is not None}
    wide = {
        name: max(pair, key=abs)
        for name, pair in ends.items()
        if MAX_PLAUSIBLE_ANGLE < max(map(abs, pair)) <= 360.0 and all(end.is_integer() for end in pair)
    }
    if not wide:
        return []
    name, angle = next(iter(wide.items()))
    others = f" and of {len(wide) - 1} more" if len(wide) > 1 else ""
    return [
        f"{file}: a limit of {name!r}{others} is {angle:g} rad, {angle / math.tau:.1f} turns; URDF has radians, and "
        f"{angle:g}° is {math.radians(angle):.4g}"
    ]


def _mimics(links: list[Element], joints: dict[str, Joint], report: ImportReport) -> list[Constraint]:
    found: list[Constraint] = []
    for each in links:
        mimic = each.find("mimic")
        if mimic is None:
            continue
        name, other = _plain(each.get("name")), _plain(mimic.get("joint"))
        if other not in joints:
            raise mimic.wrong(f"names the joint {other!r}, which the file lacks")
        pair = joints[name], joints[other]
        if any(len(joint.labels) != 1 for joint in pair):
            report.left_out.append(f"mimic of {name!r} by {other!r}, which have not one coordinate each")
            continue
        factor, offset = mimic.numbers("multiplier", 1, (1.0,))[0], mimic.numbers("offset", 1, (0.0,))[0]
        coordinates = [joint.coordinate_names[0] for joint in pair]
        unit = pair[0].labels[0].unit
        coupled = measure(partial(_apart, factor=factor, offset=offset), *coordinates, unit=unit)
        found.append(Bilateral(f"{name} mimic", coupled))
    if found:
        report.understood.append(f"{len(found)} mimics as couplings: {quoted(each.name for each in found)}")
    return found


def _apart(own: Any, other: Any, factor: float, offset: float) -> Any:
    """q − (k q' + q₀)."""
    return own - factor * other - offset


def _summary(
    root: Element, links: list[Element], bodies: dict[str, Body], stops: bool, losses: bool, report: ImportReport
) -> None:
    kinds = [each.get("type") for each in links]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in KINDS if kind in kinds)
    report.understood.insert(0, f"{len(bodies)} links and {len(links)} joints ({counts or 'none'}), z of the file is y")
    limited = sum(each.find("limit") is not None and each.get("type") in ("revolute", "prismatic") for each in links)
    if limited:
        text = f"limits of {limited} joints"
        (report.understood if stops else report.left_out).append(f"{text} as stops" if stops else text)
    resisting = sum(each.find("dynamics") is not None for each in links)
    if resisting:
        text = f"damping and friction of {resisting} joints"
        (report.understood if losses else report.left_out).append(text)
    efforts = sum(
        each.find("limit") is not None and any(key in each.find("limit").attributes for key in ("effort", "velocity"))  # type: ignore[union-attr]
        for each in links
    )
    if efforts:
        report.left_out.append(f"largest efforts and velocities of {efforts} joints")
    shapes = {tag: sum(len(link.all(tag)) for link in root.all("link")) for tag in SHAPES}
    report.left_out += [f"{count} shapes <{tag}>" for tag, count in shapes.items() if count]
    rest = [child.tag for child in root if child.tag not in ("link", "joint", "material")]
    report.left_out += [f"{rest.count(tag)} <{tag}>" for tag in dict.fromkeys(rest)]
