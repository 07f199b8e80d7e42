"""Muscles of ``.osim`` files as `Muscle`s on paths of points."""

import math
from collections.abc import Iterator
from typing import Any

from mbd.bodies.base import Frame
from mbd.errors import ModelError, quoted
from mbd.forces.muscles import Muscle, ViaPoint, WrappingEllipsoid
from mbd.laboratory.models.osim_elements import (
    flag_of,
    number_of,
    numbers_of,
    objects_in,
    plain,
    text_of,
    unlike,
)
from mbd.laboratory.models.osim_file import OsimFile, body_named, body_of_socket, coordinate_named
from mbd.laboratory.models.osim_functions import Linear, function_of, is_left_out
from mbd.laboratory.models.osim_surfaces import surfaces_of
from mbd.laboratory.models.xml import Element
from mbd.tape.functions import clip

CURVES = {
    "DeGrooteFregly2016Muscle": "de groote", "Millard2012EquilibriumMuscle": "millard",
    "Millard2012AccelerationMuscle": "millard", "Thelen2003Muscle": "de groote", "Schutte1993Muscle": "de groote",
    "Schutte1993Muscle_Deprecated": "de groote", "Delp1990Muscle_Deprecated": "de groote",
}  # fmt: skip
"""Curves that stand for those of each kind of muscle."""
SAME = ("DeGrooteFregly2016Muscle", "Millard2012EquilibriumMuscle")
"""Kinds whose curves these are; those of others are taken as De Groote's, and said."""


def is_muscle(element: Element) -> bool:
    """Whether an element of a <ForceSet> is a muscle that is read."""
    return element.tag in CURVES


def muscles_of(file: OsimFile) -> dict[str, Muscle]:
    """Muscles by name; what of them is approximated or left out is in the report."""
    found: dict[str, Muscle] = {}
    others, off, pathless, slow = list[str](), list[str](), list[str](), list[str]()
    surfaces = surfaces_of(file)
    taken = {*file.bodies, *file.joints, *file.carriers, *(each.name for each in file.held), "ground"}
    for element in objects_in(file.source, "ForceSet"):
        if not is_muscle(element):
            continue
        given = plain(element.get("name"))
        if flag_of(element, "isDisabled") or not flag_of(element, "appliesForce", True):
            off.append(given)
            continue
        name = unlike(given or "muscle", taken, " muscle")
        path = element.find("GeometryPath") or (element.find("path") or element).find("GeometryPath")
        if path is None:
            pathless.append(given)
            continue
        if element.tag not in SAME:
            others.append(name)
        try:
            points = list(_points(file, path, name))
            between = [*surfaces.between(path, name, points), []]
            whole = [part for point, over in zip(points, between, strict=True) for part in (point, *over)]
            found[name] = _muscle(file, element, name, whole, slow)
        except ModelError as error:
            if str(error).startswith(file.source.file):
                raise
            raise element.wrong(str(error)) from None
    report = file.report
    for kind, muscles in surfaces.straight.items():
        report.approximated.append(
            f"paths around {kind} go straight, so that their moment arms differ: {quoted(dict.fromkeys(muscles))}"
        )
    round_ones = [name for name in surfaces.used if isinstance(surfaces.known[name], WrappingEllipsoid)]
    if round_ones:
        report.approximated.append(
            f"paths around ellipsoids lie in planes, longer than the shortest ones by less than a thousandth of the "
            f"radii most of the time: {quoted(sorted(round_ones))}"
        )
    if surfaces.used:
        report.approximated.append(
            "a path that begins or ends at a point within a surface goes on from the nearest point on it, not straight "
            "with a jump"
        )
    if others:
        report.approximated.append(f"curves of De Groote and Fregly stand for others: {quoted(others)}")
    if slow:
        report.approximated.append(
            f"velocity of fibers, of which there is none, as {Muscle.max_velocity:g} 1/s: {quoted(slow)}"
        )
    if pathless:
        report.left_out.append(f"muscles without a <GeometryPath>: {quoted(pathless)}")
    if off:
        report.left_out.append(f"muscles that are switched off: {quoted(off)}")
    return found


def _muscle(file: OsimFile, element: Element, name: str, points: list[Any], slow: list[str]) -> Muscle:
    curves = CURVES[element.tag]
    rigid = flag_of(element, "ignore_tendon_compliance")
    instant = flag_of(element, "ignore_activation_dynamics")
    damping = number_of(element, "fiber_damping", 0.1 if element.tag != SAME[0] else 0.0)
    if curves == "millard" and not rigid and damping < 0.01:
        file.report.approximated.append(f"muscle {name!r} has no damping; it is taken as 0.1")
        damping = 0.1
    velocity = number_of(element, "max_contraction_velocity", number_of(element, "Vmax", Muscle.max_velocity))
    if velocity <= 0.0:
        slow.append(name)
        velocity = Muscle.max_velocity
    return Muscle(
        name, points, number_of(element, "max_isometric_force", 1000.0),
        number_of(element, "optimal_fiber_length", 0.1), number_of(element, "tendon_slack_length", 0.2),
        pennation=number_of(element, "pennation_angle_at_optimal", number_of(element, "pennation_angle", 0.0)),
        excitation=number_of(element, "default_activation", 0.05), tendon="rigid" if rigid else "elastic",
        curves=curves, max_velocity=velocity, damping=damping,
        activation_time=0.0 if instant else number_of(element, "activation_time_constant", 0.015),
        deactivation_time=0.0 if instant else number_of(element, "deactivation_time_constant", 0.05),
        smoothing=number_of(element, "activation_dynamics_smoothing", 10.0),
    )  # fmt: skip


def _points(file: OsimFile, path: Element, muscle: str) -> Iterator[Frame | ViaPoint]:
    """The points of a path, from origin to insertion."""
    for element in objects_in(path, "PathPointSet"):
        if file.old:
            body = file.body(body_named(file, element, text_of(element, "body")))
        else:
            body = file.body(body_of_socket(file, element, text_of(element, "socket_parent_frame")))
        if element.tag == "MovingPathPoint":
            yield _moving(file, element, body.origin, muscle)
            continue
        place = body.point(*numbers_of(element, "location", 3, (0.0, 0.0, 0.0)))
        if element.tag == "ConditionalPathPoint":
            joint, _ = _joint(file, element, text_of(element, "socket_coordinate", text_of(element, "coordinate", "-")))
            low, high = numbers_of(element, "range", 2)
            if low == high:
                file.report.left_out.append(
                    f"point {plain(element.get('name'))!r} of muscle {muscle!r}, which is on the path at one value of "
                    f"{joint.name!r} alone"
                )
                continue
            yield ViaPoint(place, joint, (low, high))
        elif element.tag == "PathPoint":
            yield place
        else:
            raise element.wrong(
                f"of muscle {muscle!r} is no PathPoint, ConditionalPathPoint or MovingPathPoint, which are read"
            )


def _moving(file: OsimFile, element: Element, frame: Frame, muscle: str) -> ViaPoint:
    """A point whose place in its body is a function of coordinates."""
    functions, names = [], []
    for axis in "xyz":
        inside = element.find(f"{axis}_location")
        coordinate = text_of(element, f"socket_{axis}_coordinate", text_of(element, f"{axis}_coordinate", "-"))
        if inside is None or is_left_out(inside):
            raise element.wrong(f"of muscle {muscle!r} needs a function in <{axis}_location> that is read")
        function = function_of(inside, 1, f"{axis} of a point of muscle {muscle!r}")
        if isinstance(function, Linear) and not function.slopes[0]:
            functions.append(_Along(function, None))
            continue
        _, name = _joint(file, element, coordinate)
        names += [name] if name not in names else []
        own = coordinate_named(file, element, coordinate.rpartition("/")[2])
        functions.append(_Along(function, names.index(name), (own.low, own.high)))
    return ViaPoint(frame, place=tuple(functions), arguments=tuple(names) or ("t",))


class _Along:
    """A function of one of several arguments, within its range: OpenSim stops points at the ends of it."""

    def __init__(self, function: Any, place: int | None, reach: tuple[float, float] = (-math.inf, math.inf)) -> None:
        self.function, self.place, self.reach = function, place, reach

    def __call__(self, *q: Any) -> Any:
        if self.place is None:
            return self.function(0.0 * q[0])
        low, high = self.reach
        return self.function(clip(q[self.place], low, high) if low < high < math.inf else q[self.place])


def _joint(file: OsimFile, element: Element, path: str) -> Any:
    """The joint of a coordinate, named by itself or by a path, and its coordinate's name in the model."""
    coordinate = coordinate_named(file, element, path.rpartition("/")[2])
    if coordinate.joint is None:
        raise element.wrong(f"depends on {coordinate.name!r}, which is no joint of its own")
    return coordinate.joint, coordinate.joint.coordinate_names[0]
