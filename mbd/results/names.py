"""How names of results are built."""

from __future__ import annotations

__all__ = ["AXES", "VECTORS", "rate_name"]

AXES = (".x", ".y", ".z")
"""Endings of the components of a vector."""

VECTORS = ((".w", *AXES), AXES, (".1", ".2", ".3"))
"""Endings of what is one result in several parts: a quaternion, a vector, three Euler angles."""


def rate_name(name: str) -> str:
    """The name of a quantity's rate of change.

    >>> rate_name("left shank.end.x"), rate_name("left hip.angle")
    ('left shank.end.vx', 'left hip.angle.rate')
    """
    stem, _, last = name.rpartition(".")
    return f"{stem}.v{last}" if f".{last}" in AXES else f"{name}.rate"
