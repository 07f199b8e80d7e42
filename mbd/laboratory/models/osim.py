"""Models of OpenSim, ``.osim``, in the formats 20303 and 30000 (joints within bodies) and 40000."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mbd.arrays import Matrix
from mbd.bodies.marker import Marker
from mbd.bodies.rigid_body import RigidBody
from mbd.errors import quoted
from mbd.joints.free import Free
from mbd.laboratory.models.inertia import note_repairs, possible_inertia
from mbd.laboratory.models.osim_constraints import Coupler, couplers_of, hold, loops_closed
from mbd.laboratory.models.osim_elements import (
    flag_of,
    number_of,
    numbers_of,
    objects_in,
    plain,
    text_of,
    unlike,
)
from mbd.laboratory.models.osim_file import OsimFile, OsimJoint, body_named, body_of_socket
from mbd.laboratory.models.osim_functions import has_corners
from mbd.laboratory.models.osim_joints import connect, joints_of, tree_of
from mbd.laboratory.models.osim_muscles import is_muscle, muscles_of
from mbd.laboratory.models.report import ImportedModel
from mbd.laboratory.models.xml import Element, read_xml
from mbd.model import Model

READ = ("Ground", "BodySet", "JointSet", "ConstraintSet", "MarkerSet")
"""Elements of a model that are read; of others the report counts what is in them."""


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
    units = text_of(source, "length_units", "meters")
    if units not in ("meters", "m"):
        raise source.wrong(f"has lengths in {units!r}; meters are read")
    gravity = numbers_of(source, "gravity", 3, (0.0, -9.80665, 0.0))
    title = plain(source.attributes.get("name", "")) or plain(path.stem) or "model"
    file = OsimFile(source, int(version) < 40000, stops, repair, Model(title, gravity=gravity))
    file.report.approximated += repaired

    bent = sum(1 for each in _within(source) if each.tag == "PiecewiseLinearFunction" and _is_bent(each))
    if bent:
        file.report.approximated.append(f"{bent} <PiecewiseLinearFunction> as splines through their points")

    # bodies, joints from the ground outwards, couplings, markers, muscles, the report
    joints = tree_of(file, joints_of(file, _bodies(file)))
    couplers = couplers_of(file)
    for joint in joints:
        connect(file, joint)
    hold(file, couplers)
    loops_closed(file)
    file.model.connect(*file.joints.values())
    file.model.constrain(*file.held)
    markers = _markers(file)
    muscles = muscles_of(file)
    _summary(file, joints, couplers, markers, len(muscles))
    return ImportedModel(file.model, file.bodies, file.joints, file.report, file.posture, muscles, _driven(file))


def _bodies(file: OsimFile) -> dict[str, Element]:
    """The elements of bodies by name."""
    elements: dict[str, Element] = {}
    broken: list[str] = []
    for element in objects_in(file.source, "BodySet"):
        name = plain(element.get("name"))
        if name == "ground" and file.old:
            continue
        if element.tag != "Body" or not name or name in elements or name == "ground":
            raise element.wrong("is no <Body>, has no name, or that of another body or the ground")
        elements[name] = element
        mass, center = number_of(element, "mass"), numbers_of(element, "mass_center", 3, (0.0, 0.0, 0.0))
        tensor = _inertia(file, element)
        if mass < 0.0:
            raise element.wrong(f"has the negative mass {mass:g} kg")
        if mass == 0.0 and tensor.any():
            file.report.approximated.append(f"inertia of {name!r} without a mass taken as none")
        tensor = tensor if mass > 0.0 else np.zeros((3, 3))
        fixed = possible_inertia(tensor)
        broken += [name] if fixed is not tensor else []
        file.bodies[name] = RigidBody(name, mass, _six(fixed), center)
    if not elements:
        raise file.source.wrong("has no bodies")
    note_repairs(file.source.file, broken, file.repair, file.report)
    return elements


def _inertia(file: OsimFile, element: Element) -> Matrix:
    """The inertia about the center of mass in axes of the body."""
    if file.old:
        parts = [number_of(element, f"inertia_{axes}", 0.0) for axes in ("xx", "yy", "zz", "xy", "xz", "yz")]
    else:
        parts = list(numbers_of(element, "inertia", 6))
    xx, yy, zz, xy, xz, yz = parts
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _markers(file: OsimFile) -> int:
    """Markers as points of their bodies."""
    taken = {*file.bodies, *file.joints, *file.carriers, *(each.name for each in file.held), "ground"}
    count = 0
    for element in objects_in(file.source, "MarkerSet"):
        if element.tag != "Marker":
            file.report.left_out.append(f"<{element.tag}> in <MarkerSet>")
            continue
        name = plain(element.get("name"))
        if file.old:
            body = body_named(file, element, text_of(element, "body"))
        else:
            body = body_of_socket(file, element, text_of(element, "socket_parent_frame"))
        called = unlike(name or "marker", taken, " marker")
        if called != name:
            file.report.approximated.append(f"marker {name!r}, a name that is taken, is called {called!r}")
        Marker(called, file.body(body), numbers_of(element, "location", 3))
        count += 1
    return count


def _summary(file: OsimFile, joints: list[OsimJoint], couplers: list[Coupler], markers: int, muscles: int) -> None:
    report = file.report
    kinds = [joint.element.tag for joint in joints]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
    first = [f"{len(file.bodies)} bodies and {len(joints)} joints ({counts}), {len(file.coordinates)} coordinates"]
    if file.dependents:
        first.append(
            f"motions that are functions of coordinates, as rows: {quoted(m.name for m, _ in file.dependents)}"
        )
    if file.measured:
        first.append(f"coordinates that no motion is by itself, of joints without mass: {quoted(file.measured)}")
    if couplers:
        first.append(f"couplers as rows: {quoted(each.name for each in couplers)}")
    coordinates = file.coordinates.values()
    locked = [each.name for each in coordinates if each.locked]
    clamped = [each.name for each in coordinates if each.is_limited]
    empty = [each.name for each in coordinates if each.clamped and not each.locked and not each.is_limited]
    if locked:
        first.append(f"locked coordinates as rows: {quoted(locked)}")
    if clamped and file.stops:
        first.append(f"clamped coordinates with stops: {quoted(clamped)}")
    if file.loops:
        first.append(f"constraints that close loops, as joints: {quoted(each[0] for each in file.loops)}")
    if muscles:
        first.append(f"{muscles} muscles, which act where they are applied: model.apply(*found.muscles.values())")
    if markers:
        first.append(f"{markers} markers")
    report.understood[:0] = first
    left = report.left_out
    if clamped and not file.stops:
        left.append(f"ranges of clamped coordinates, stops=True makes stops of them: {quoted(clamped)}")
    if empty:
        left.append(f"ranges of clamped coordinates, whose lower end is not below the upper one: {quoted(empty)}")
    prescribed = [each.name for each in coordinates if flag_of(each.element, "prescribed")]
    if prescribed:
        left.append(f"prescribed functions of time: {quoted(prescribed)}")
    moving = [each.name for each in coordinates if number_of(each.element, "default_speed_value", 0.0)]
    if moving:
        left.append(f"default speeds: {quoted(moving)}")
    for child in file.source:
        if child.tag not in READ:
            tags = [each.tag for each in child.find("objects") or () if not is_muscle(each)]
            left += [f"{tags.count(tag)} <{tag}> in <{child.tag}>" for tag in dict.fromkeys(tags)]
            left += (
                [f"{len(child.children)} elements in <{child.tag}>"]
                if child.children and not child.find("objects")
                else []
            )


def _driven(file: OsimFile) -> list[str] | None:
    """Joints whose coordinates no function and no coupler determines; None where these are all."""
    bound = {made.name for made, _ in file.dependents}
    bound |= {each.joint.name for each in file.coordinates.values() if each.joint is not None and not each.free}
    moving = [joint for joint in file.joints.values() if joint.freedoms and joint.name not in bound]
    floating = [joint.name for joint in moving if isinstance(joint, Free) and joint.parent.body.name == "ground"]
    return [joint.name for joint in moving if joint.name not in floating] if bound else None


def _within(element: Element) -> Iterator[Element]:
    """All elements of joints and constraints."""
    for child in element:
        if child.tag not in ("ForceSet", "ControllerSet"):
            yield child
            yield from _within(child)


def _is_bent(function: Element) -> bool:
    x, y = (child.text.split() if (child := function.find(axis)) else [] for axis in "xy")
    return len(x) == len(y) > 2 and has_corners(np.array(x, dtype=float), np.array(y, dtype=float))


def _six(tensor: Matrix) -> tuple[float, ...]:
    """Ixx, Iyy, Izz, Ixy, Ixz, Iyz."""
    return tuple(float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
