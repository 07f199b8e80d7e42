"""What is possible but was hardly meant: degrees for radians, millimetres for metres, a hinge twice."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

from mbd.equations.equations import Equations

__all__ = ["doubtful"]

LONG = 50.0
"""Distance between points of a body above which it may be given in millimetres [m]."""


WIDE = 10.0
"""Angle above which a whole number may be one in degrees [rad]."""


def doubtful(model: Any, equations: Equations, position: Mapping[str, float]) -> list[str]:
    """Sentences on values of a start and of the model that look like mistakes."""
    return _degrees(equations, position) + _lengths(model) + _twice(model)


def _degrees(equations: Equations, position: Mapping[str, float]) -> list[str]:
    angles = {each.name for each in equations.coordinates if each.unit == "rad"}
    return [
        f"position: {name!r} is {value:g} rad, {value / math.tau:.1f} turns; angles are in radians, and {value:g}° is "
        f"math.radians({value:g}) = {math.radians(value):.4g}"
        for name, value in position.items()
        if name in angles and abs(value) >= WIDE and float(value).is_integer()
    ]


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
