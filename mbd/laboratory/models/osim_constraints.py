"""Constraints of ``.osim`` files: couplers between coordinates, locks, stops, and motions that are functions."""

from functools import partial
from typing import Any

import numpy as np

from mbd.constraints.bilateral import Bilateral
from mbd.constraints.measures import extension, flexion
from mbd.constraints.unilateral import Unilateral
from mbd.constraints.user_measure import measure
from mbd.dataclass import dataclass
from mbd.joints.base import Joint
from mbd.joints.spherical import Spherical
from mbd.joints.weld import Weld
from mbd.laboratory.models.osim_elements import flag_of, number_of, numbers_of, objects_in, plain, text_of, unlike
from mbd.laboratory.models.osim_file import (
    OsimCoordinate,
    OsimFile,
    body_named,
    body_of_socket,
    coordinate_named,
    framed,
)
from mbd.laboratory.models.osim_functions import function_of, is_left_out
from mbd.laboratory.models.osim_joints import end_at, turned
from mbd.laboratory.models.xml import Element

CLOSING = {"WeldConstraint": Weld, "PointConstraint": Spherical}
"""Joints that hold what these constraints hold; they close loops."""
ORIGIN = (0.0, 0.0, 0.0)


@dataclass
class Coupler:
    """A coordinate that is a function of others."""

    name: str
    own: OsimCoordinate
    others: list[OsimCoordinate]
    function: Any


def couplers_of(file: OsimFile) -> list[Coupler]:
    """Couplers between coordinates, but for those that are switched off or whose function is not read."""
    found = list[Coupler]()
    for element in objects_in(file.source, "ConstraintSet"):
        name = plain(element.get("name"))
        off = flag_of(element, "isDisabled") or not flag_of(element, "isEnforced", True)
        if element.tag in CLOSING and not off:
            _close(file, element, name)
            continue
        if off or element.tag != "CoordinateCouplerConstraint":
            file.report.left_out.append(f"<{element.tag}> {name!r}{', which is switched off' if off else ''}")
            continue
        names = text_of(element, "independent_coordinate_names").split()
        own, *others = (
            coordinate_named(file, element, each) for each in (text_of(element, "dependent_coordinate_name"), *names)
        )
        inside = element.find("coupled_coordinates_function")
        if inside is None or not others:
            raise element.wrong("needs independent coordinates and a <coupled_coordinates_function>")
        if is_left_out(inside):
            kinds = ", ".join(f"<{child.tag}>" for child in inside)
            file.report.left_out.append(f"coupler {name!r} of {own.name!r}, whose function is {kinds}")
            continue
        function = function_of(inside, len(others), f"coupler {name!r}")
        coupler = Coupler(name, own, others, function.scaled(number_of(element, "scale_factor", 1.0)))
        own.coupled = own.coupled or coupler
        found.append(coupler)
        for coordinate in (own, *others):
            coordinate.alone = True
        own.free = False
    return found


def hold(file: OsimFile, couplers: list[Coupler]) -> None:
    """Rows of motions that depend on coordinates, of couplers and of locks; stops; the posture."""
    taken = {*file.bodies, *file.joints, *file.carriers, *(each[0] for each in file.loops), "ground"}
    for made, motion in file.dependents:
        coordinates, function = _followed(motion.coordinates, motion.function)
        _row(file, f"{made.name} function", made, coordinates, function, taken)
    for coupler in couplers:
        if coupler.own.joint is None and coupler.own.coupled is coupler:
            continue  # its motions are functions of the others
        _row(file, coupler.name or "coupler", coupler.own.made, coupler.others, coupler.function, taken)
    for coordinate in file.coordinates.values():
        if coordinate.joint is None:
            continue
        name, joint = coordinate.name, coordinate.joint
        if coordinate.locked:
            file.held.append(Bilateral(unlike(f"{name} lock", taken), joint, coordinate.value))
        elif coordinate.free:
            file.posture[joint.coordinate_names[0]] = coordinate.value
        if file.stops and coordinate.is_limited:
            file.held += [
                Unilateral(unlike(f"{name} lower stop", taken), extension(joint, offset=coordinate.low)),
                Unilateral(unlike(f"{name} upper stop", taken), flexion(joint, offset=-coordinate.high)),
            ]


def _followed(coordinates: list[OsimCoordinate], function: Any) -> tuple[list[OsimCoordinate], Any]:
    """A function of a coordinate that no joint is, as a function of what its coupler makes it of."""
    for _ in range(10):  # couplers one after another, from a coordinate that no joint is to one that is
        if len(coordinates) != 1 or coordinates[0].joint is not None or coordinates[0].coupled is None:
            break
        coupler = coordinates[0].coupled
        coordinates, function = coupler.others, partial(_composed, outer=function, inner=coupler.function)
    return coordinates, function


def _composed(*q: Any, outer: Any, inner: Any) -> Any:
    return outer(inner(*q))


def _close(file: OsimFile, element: Element, name: str) -> None:
    """A joint that closes a loop: a weld, or two points that stay together."""
    called = unlike(
        name or "loop", {*file.coordinates, *file.bodies, *(each[0] for each in file.loops), "ground"}, " loop"
    )
    if element.tag == "PointConstraint":
        bodies = [_body(file, element, k) for k in (1, 2)]
        ends = [(b, np.array(numbers_of(element, f"location_body_{k}", 3)), np.eye(3)) for k, b in enumerate(bodies, 1)]
    elif file.old:
        ends = [
            (
                _body(file, element, k), np.array(numbers_of(element, f"location_body_{k}", 3, ORIGIN)),
                turned(numbers_of(element, f"orientation_body_{k}", 3, ORIGIN)),
            )
            for k in (1, 2)
        ]  # fmt: skip
    else:
        ends = [end_at(file, element, f"socket_frame{k}") for k in (1, 2)]
    if ends[0][0] == ends[1][0]:
        raise element.wrong("holds a body to itself")
    file.loops.append((called, CLOSING[element.tag], ends[0], ends[1]))


def _body(file: OsimFile, element: Element, k: int) -> str:
    if file.old:
        return body_named(file, element, text_of(element, f"body_{k}"))
    return body_of_socket(file, element, text_of(element, f"socket_body_{k}"))


def loops_closed(file: OsimFile) -> None:
    """Connect the joints that close loops."""
    for called, kind, (first, *a), (second, *b) in file.loops:
        file.joints[called] = kind(called, framed(file.body(first), called, *a), framed(file.body(second), called, *b))


def _row(file: OsimFile, name: str, own: Joint, others: list[OsimCoordinate], function: Any, taken: set[str]) -> None:
    """q − f(q', …) = 0."""
    names = [joint.coordinate_names[0] for joint in (own, *(each.made for each in others))]
    row = measure(partial(_apart, function=function), *names, unit=own.labels[0].unit)
    file.held.append(Bilateral(unlike(name, taken), row))


def _apart(own: Any, *others: Any, function: Any) -> Any:
    """q − f(q', …)."""
    return own - function(*others)
