"""How unlike two sides are, by definitions with a name."""

from __future__ import annotations

from collections.abc import Callable

from mbd.bodies.values import among
from mbd.errors import UnknownNameError, nearest

__all__ = ["DEFINITIONS", "symmetry_of"]

Definition = tuple[str, Callable[[float, float], float]]

DEFINITIONS: dict[str, Definition] = {
    "Robinson": ("%", lambda s, p: 200.0 * abs(s - p) / (abs(s) + abs(p))),
    "ratio": ("-", lambda s, p: p / s),
    "STA": ("-", lambda s, p: (s - p) / (abs(s) + abs(p))),
}
"""Unit and value of each definition, from the values x_s, x_p of the first and the second side.

Robinson: ``2 |x_s − x_p|/(|x_s| + |x_p|) · 100 %``, 0 where they are alike, 200 where one is zero or of the other
sign; of positive numbers the index as published (R. O. Robinson, W. Herzog & B. M. Nigg, Use of
force platform variables to quantify the effects of chiropractic manipulation on gait symmetry, J. Manipulative Physiol.
Ther. 10 (1987) 172); ratio: ``x_p/x_s``, 1 where they are alike; STA: ``(x_s − x_p)/(|x_s| + |x_p|)``, with a sign.
"""


def symmetry_of(name: str) -> Definition:
    """A definition by its name.

    >>> symmetry_of("Robinson")[1](3.0, 1.0)
    100.0
    """
    if not among(name, DEFINITIONS):
        raise UnknownNameError("symmetry: " + nearest(name, DEFINITIONS, "definition", "There are"))
    return DEFINITIONS[name]
