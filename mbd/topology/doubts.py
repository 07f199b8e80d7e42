"""What is possible in a description but was hardly meant: millimetres for metres, grams for kilograms, twin hinges."""

import math
from itertools import combinations, pairwise
from typing import Any

from mbd.bodies.ground import Ground
from mbd.bodies.link import Link
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.measures import JointMeasure
from mbd.constraints.spring_leg import SpringLeg
from mbd.errors import quoted
from mbd.forces.muscles.wrapping import WrappingCylinder
from mbd.forces.samples import Samples, in_degrees
from mbd.forces.spring import Spring
from mbd.joints.base import AWAITED_ATTRIBUTE, Joint
from mbd.topology.graph import links_of, spanning_tree

MAX_PLAUSIBLE_ANGLE = 10.0
"""Angle above which a whole number may be one in degrees [rad]."""

MAX_LENGTH = 50.0
"""Length of a body of less than a ton above which it may be given in millimetres [m]."""


MAX_SAMPLE_TIME = 2.0
"""Time between samples of a controller above which it may be a frequency [s]."""


def doubts(model: Any) -> list[str]:
    """Sentences on what looks like a mistake."""
    parts = (
        _weights, _lengths, _masses, _angles, _turned, _twice, _grips, _weak_legs, _wrapped, _driven, _periods,
        _awaited,
    )  # fmt: skip
    return [sentence for part in parts for sentence in part(model)]


def in_radians(what: str, value: float) -> list[str]:
    """A sentence on an angle that is a whole number beyond `MAX_PLAUSIBLE_ANGLE`, as degrees are; none on another."""
    if not (abs(value) >= MAX_PLAUSIBLE_ANGLE and float(value).is_integer()):
        return []
    return [
        f"{what} is {value:g} rad, {value / math.tau:.1f} turns; angles are in radians, and {value:g}° is "
        f"math.radians({value:g}) = {math.radians(value):.4g}"
    ]


def _angles(model: Any) -> list[str]:
    """Angles of stops, of springs at rest and of drives that may be in degrees."""
    rest = [each for each in (*getattr(model, "joints", ()), *getattr(model, "forces", ())) if hasattr(each, "rest")]
    angles = [
        (f"rest of '{each.name}'", each.rest)
        for each in rest
        if getattr(each, "joint", each).labels and getattr(each, "joint", each).labels[0].unit == "rad"
    ]
    for word in getattr(model, "constraints", ()):
        measure = getattr(word, "measure", None)
        if isinstance(measure, JointMeasure) and measure.unit == "rad":
            angles.append((f"offset of '{word.name}'", measure.offset))
            angles.append((f"value of '{word.name}'", getattr(word, "value", 0.0)))
    return [sentence for what, angle in angles if isinstance(angle, float) for sentence in in_radians(what, angle)]


def _weights(model: Any) -> list[str]:
    """Gravity straight up, whose sign was forgotten."""
    x, y, z = getattr(model, "gravity", (0.0, 0.0, 0.0))
    if not (x == z == 0.0 and y > 0.0):
        return []
    return [f"gravity (0, {y:g}, 0) pulls upwards; y points up, so that weight is gravity=(0.0, {-y:g}, 0.0)"]


def _lengths(model: Any) -> list[str]:
    """Points of bodies of less than a ton that are far apart."""
    found = []
    for body in getattr(model, "bodies", {}).values():
        parameters = body.parameters()
        length = parameters.get(f"{body.name}.length", 0.0)
        if abs(length) > MAX_LENGTH and 0.0 < parameters.get(f"{body.name}.mass", 0.0) < 1000.0:
            found.append(
                f"'{body.name}' is {length:g} m long; lengths are in metres, and {length:g} mm is {length / 1e3:g}"
            )
    return found + [
        f"'{spring.name}' is {spring.length:g} m long unstretched; lengths are in metres, and {spring.length:g} mm is "
        f"{spring.length / 1e3:g}"
        for spring in getattr(model, "forces", ())
        if isinstance(spring, Spring) and isinstance(spring.length, float) and spring.length > MAX_LENGTH
    ]


def _masses(model: Any) -> list[str]:
    """Masses, centers and inertias that no link of its length has."""
    found = []
    for link in getattr(model, "bodies", {}).values():
        if not isinstance(link, Link) or not link.length > 0.0 or not link.mass > 0.0:
            continue
        name, mass, length, center = link.name, link.mass, link.length, link.center_distance
        if mass > 200.0 and mass > 22_600.0 * length**3:  # heavier than osmium, it may be given in grams
            found.append(
                f"'{name}' has {mass:g} kg in {length:g} m, more than any metal; masses are in kg, and {mass:g} g is "
                f"{mass / 1e3:g} kg"
            )
        if not -0.5 * length <= center <= length:
            found.append(
                f"the center of mass of '{name}' is {center:g} m from its start, outside its length of {length:g} m; "
                f"center is the distance from start to center [m], {0.5 * length:.3g} m for a uniform rod"
            )
        largest = max(link.inertia) if isinstance(link.inertia, tuple) else link.inertia
        if largest > mass * length**2:
            found.append(
                f"the inertia of '{name}' is {largest:g} kg m², more than all its mass at its length has, m L² = "
                f"{mass * length**2:.3g} kg m²; inertia is about the center of mass, m L²/12 = "
                f"{mass * length**2 / 12.0:.3g} kg m² for a uniform rod"
            )
    return found


def _turned(model: Any) -> list[str]:
    """Joints that alone hold a body to the ground, and have the ground as their child."""
    found = []
    for joint in getattr(model, "joints", ()):
        child, parent = joint.child.body, joint.parent.body
        if not isinstance(child, Ground) or isinstance(parent, Ground) or not joint.labels:
            continue
        reached = spanning_tree(links_of(model, [joint.name]), model.ground.name)[2]
        if parent.name not in reached:
            found.append(
                f"'{joint.name}' has the ground as its child, so that its coordinates tell how the ground moves seen "
                f"from '{parent.name}', with the opposite sign; the parent comes first: "
                f"mbd.{type(joint).__name__}({joint.name!r}, {_written(joint.child)}, {_written(joint.parent)})"
            )
    return found


def _written(frame: Any) -> str:
    """A frame as it is written: 'model.ground.origin', 'thigh.start'."""
    owner = "model.ground" if isinstance(frame.body, Ground) else frame.body.name.replace(" ", "_")
    return f"{owner}.{frame.name or 'origin'}"


def _grips(model: Any) -> list[str]:
    """Coefficients of friction that no pair of materials has, which were meant in percent or as a force."""
    return [
        f"friction of '{contact.name}' is {contact.friction:g}; a coefficient is a ratio of forces, rubber has about 1"
        for contact in getattr(model, "constraints", ())
        # it may be given in percent
        if isinstance(friction := getattr(contact, "friction", None), float | int) and friction > 10.0
    ]


def _wrapped(model: Any) -> list[str]:
    """Muscles around two cylinders that follow each other without a side."""
    found = []
    for force in getattr(model, "forces", ()):
        points = getattr(getattr(force, "path", None), "points", ())
        free = [isinstance(point, WrappingCylinder) and point.side is None for point in points]
        if any(one and other for one, other in pairwise(free)):
            found.append(force.name)
    if not found:
        return []
    return [
        f"the path of {quoted(found, 4)} goes around two cylinders that follow each other and have no side; the "
        "shorter way around one depends on that around the other, so that either side is possible: give "
        "WrappingCylinder(…, side=)"
    ]


def _weak_legs(model: Any) -> list[str]:
    """Spring legs that cannot carry the model however far they are compressed, whose stiffness may be in kN/m."""
    legs = [contact for contact in getattr(model, "constraints", ()) if isinstance(contact, SpringLeg)]
    if not legs:
        return []
    mass = sum(getattr(body, "mass", 0.0) for body in getattr(model, "bodies", {}).values())
    weight = mass * math.hypot(*getattr(model, "gravity", (0.0, 0.0, 0.0)))
    if sum(leg.stiffness * leg.length for leg in legs) >= weight:
        return []
    return [
        f"'{leg.name}' of {leg.stiffness:g} N/m and {leg.length:g} m pushes with {leg.stiffness * leg.length:.3g} N at "
        f"most, the model weighs {weight:.3g} N; stiffness is in N/m, for people who run about "
        f"20 m g/l = {20.0 * weight / leg.length:.2g} N/m, and {leg.stiffness:g} kN/m is {leg.stiffness * 1e3:g}"
        for leg in legs
    ]


def _driven(model: Any) -> list[str]:
    """Angles that follow samples to and fro through more than a turn, which may be in degrees."""
    found = []
    for drive in getattr(model, "constraints", ()):
        if isinstance(drive, Bilateral) and isinstance(drive.value, Samples) and drive.measure.unit == "rad":
            swing = in_degrees(drive.value.values)
            if swing:
                found.append(
                    f"'{drive.name}' swings an angle to and fro by {swing:.3g} rad, {swing / math.tau:.1f} turns; "
                    "angles are in radians: mbd.Samples(time, numpy.radians(values)) converts degrees"
                )
    return found


def _periods(model: Any) -> list[str]:
    """Controllers that hardly ever sample, whose period was meant as a frequency, or answer late, in milliseconds."""
    words = [*getattr(model, "controllers", ()), *getattr(model, "machines", ())]
    return [
        f"'{word.name}' samples once in {period:g} s; period is the time between samples, and {period:g} Hz is "
        f"period={1.0 / period:.3g}"
        for word in words
        if (period := getattr(word, "period", None)) is not None and period > MAX_SAMPLE_TIME
    ] + [
        f"'{word.name}' puts its outputs out {delay:g} s after each sample; delay is in seconds, and {delay:g} ms is "
        f"{delay / 1e3:g}"
        for word in words
        if (delay := getattr(word, "delay", 0.0)) > MAX_SAMPLE_TIME
    ]


def _awaited(model: Any) -> list[str]:
    """Passive moments of a person that were asked for, and of which the model has none."""
    forces = {getattr(force, "name", "") for force in getattr(model, "forces", ())}
    wanted = {
        vars(joint).get(AWAITED_ATTRIBUTE, ()) for joint in getattr(model, "joints", ()) if isinstance(joint, Joint)
    }
    return [
        f"human(passive=True): the model has none of the passive moments of its joints, such as {names[0]!r}; "
        "model.apply(*person.moments) brings them, passive=False leaves them out"
        for names in sorted(wanted)
        if names and forces.isdisjoint(names)
    ]


def _twice(model: Any) -> list[str]:
    """Joints of one kind and axis between the same points."""
    alike: dict[tuple[type, frozenset[str]], list[Any]] = {}
    for joint in getattr(model, "joints", ()):
        if hasattr(joint, "parent"):
            alike.setdefault((type(joint), frozenset({joint.parent.full_name, joint.child.full_name})), []).append(
                joint
            )
    return [
        f"'{one.name}' and '{other.name}' hold the same points together; leave one out, or their reactions are shared "
        "in no definite way"
        for joints in alike.values()
        for one, other in combinations(joints, 2)
        if getattr(one, "axis", None) == getattr(other, "axis", None)
    ]
