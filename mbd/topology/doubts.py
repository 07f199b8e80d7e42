"""What is possible in a description but was hardly meant: millimetres for metres, a hinge twice."""

from __future__ import annotations

from itertools import combinations
from typing import Any

from mbd.joints.base import AWAITED, Joint

__all__ = ["doubts"]

LONG = 50.0
"""Length of a body of less than a ton above which it may be given in millimetres [m]."""
GRIPPING = 10.0
"""Coefficient of friction above which it may be given in percent [-]."""


def doubts(model: Any) -> list[str]:
    """Sentences on what looks like a mistake."""
    return _lengths(model) + _twice(model) + _grips(model) + _awaited(model)


def _lengths(model: Any) -> list[str]:
    """Points of bodies of less than a ton that are far apart."""
    found = []
    for body in getattr(model, "bodies", {}).values():
        parameters = body.parameters()
        length = parameters.get(f"{body.name}.length", 0.0)
        if abs(length) > LONG and 0.0 < parameters.get(f"{body.name}.mass", 0.0) < 1000.0:
            found.append(
                f"'{body.name}' is {length:g} m long; lengths are in metres, and {length:g} mm is {length / 1e3:g}"
            )
    return found


def _grips(model: Any) -> list[str]:
    """Coefficients of friction that no pair of materials has, which were meant in percent or as a force."""
    return [
        f"friction of '{contact.name}' is {contact.friction:g}; a coefficient is a ratio of forces, rubber has about 1"
        for contact in getattr(model, "constraints", ())
        if isinstance(friction := getattr(contact, "friction", None), float | int) and friction > GRIPPING
    ]


def _awaited(model: Any) -> list[str]:
    """Passive moments of a person that were asked for, and of which the model has none."""
    forces = {getattr(force, "name", "") for force in getattr(model, "forces", ())}
    wanted = {vars(joint).get(AWAITED, ()) for joint in getattr(model, "joints", ()) if isinstance(joint, Joint)}
    return [
        f"human(passive=True): the model has none of the passive moments of its joints, such as {names[0]!r}; "
        "model.apply(*person.moments) brings them, passive=False leaves them out"
        for names in sorted(wanted)
        if names and forces.isdisjoint(names)
    ]


def _twice(model: Any) -> list[str]:
    """Joints of one kind and axis between the same points."""
    joints = [joint for joint in getattr(model, "joints", ()) if hasattr(joint, "parent")]
    return [
        f"'{one.name}' and '{other.name}' hold the same points together; leave one out, or their reactions are shared "
        "in no definite way"
        for one, other in combinations(joints, 2)
        if type(one) is type(other)
        and {one.parent.full_name, one.child.full_name} == {other.parent.full_name, other.child.full_name}
        and getattr(one, "axis", None) == getattr(other, "axis", None)
    ]
