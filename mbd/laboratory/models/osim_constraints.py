"""Constraints of ``.osim`` files: couplers between coordinates, locks, stops, and motions that are functions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from mbd.constraints.bilateral import Bilateral
from mbd.constraints.measures import extension, flexion
from mbd.constraints.unilateral import Unilateral
from mbd.constraints.user_measure import measure
from mbd.joints.base import Joint
from mbd.laboratory.models.osim_elements import flag_of, number_of, objects_in, plain, text_of, unlike
from mbd.laboratory.models.osim_file import OsimCoordinate, OsimFile, coordinate_named
from mbd.laboratory.models.osim_functions import function_of, is_left_out

__all__ = ["Coupler", "couplers_of", "hold"]


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
        found.append(Coupler(name, own, others, function.scaled(number_of(element, "scale_factor", 1.0))))
        for coordinate in (own, *others):
            coordinate.alone = True
        own.free = False
    return found


def hold(file: OsimFile, couplers: list[Coupler]) -> None:
    """Rows of motions that depend on coordinates, of couplers and of locks; stops; the posture."""
    taken = set[str]()
    for made, motion in file.dependents:
        _row(file, f"{made.name} function", made, motion.coordinates, motion.function, taken)
    for coupler in couplers:
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


def _row(file: OsimFile, name: str, own: Joint, others: list[OsimCoordinate], function: Any, taken: set[str]) -> None:
    """q − f(q', …) = 0."""
    names = [joint.coordinate_names[0] for joint in (own, *(each.made for each in others))]
    row = measure(partial(_apart, function=function), *names, unit=own.labels[0].unit)
    file.held.append(Bilateral(unlike(name, taken), row))


def _apart(own: Any, *others: Any, function: Any) -> Any:
    """q − f(q', …)."""
    return own - function(*others)
