"""What is possible but was hardly meant: degrees for radians, millimetres for metres, a hinge twice."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from mbd.equations.equations import Equations
from mbd.topology.doubts import doubts

__all__ = ["WIDE", "degrees", "doubtful"]

WIDE = 10.0
"""Angle above which a whole number may be one in degrees [rad]."""


def doubtful(model: Any, equations: Equations, position: Mapping[str, float]) -> list[str]:
    """Sentences on values of a start and of the model that look like mistakes."""
    return degrees(equations, position) + doubts(model)


def degrees(equations: Equations, position: Mapping[str, float]) -> list[str]:
    """Sentences on angles of a start that may be in degrees."""
    angles = {each.name for each in equations.coordinates if each.unit == "rad"}
    return [
        f"position: {name!r} is {value:g} rad, {value / math.tau:.1f} turns; angles are in radians, and {value:g}° is "
        f"math.radians({value:g}) = {math.radians(value):.4g}"
        for name, value in position.items()
        if name in angles and abs(value) >= WIDE and float(value).is_integer()
    ]
