"""How names of results are built."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from mbd.equations.equations import Equations
from mbd.equations.outputs import Outputs
from mbd.errors import UnknownNameError

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


def scalars_behind(name: str, known: Callable[[str], bool]) -> tuple[str, ...]:
    """The components of a vector, a quaternion or Euler angles, or the name of a scalar; () where neither is known."""
    for endings in VECTORS:
        parts = tuple(name + ending for ending in endings)
        if all(map(known, parts)):
            return parts
    return (name,) if known(name) else ()


def scalars(equations: Equations, names: Iterable[str]) -> tuple[str, ...]:
    """Names of results, with the components of those that have several in their place.

    Raises
    ------
    UnknownNameError
        for a name that the model does not have.
    """
    offered = equations.output

    def known(name: str) -> bool:
        if isinstance(offered, Outputs):
            return offered.offers(name)
        try:
            offered(name)
        except (UnknownNameError, KeyError):
            return False
        return True

    found: dict[str, None] = {}
    for name in names:
        parts = (name,) if known(name) else scalars_behind(name, known)
        if not parts:
            offered(name)  # which says what there is
        found |= dict.fromkeys(parts)
    return tuple(found)
