"""Convex soles: their support function and its integral, from points or from a function."""

import math
import zlib
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from mbd.bodies.algebra import derivatives_at
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.errors import ModelError
from mbd.tape.interpolation import Pieces, joined
from mbd.tape.node import Tape
from mbd.tape.tracing import traced_scalar

FINENESS = math.radians(3.0)
"""Largest distance of tangents at which the support function is known [rad]."""


Point = tuple[float, float]
Support = tuple[float, float, float]
"""ψ [rad], h(ψ) and h'(ψ) [m]."""


@dataclass(frozen=True)
class Sole:
    """``∫h dψ`` over −π ≤ ψ ≤ π as a piecewise cubic, so that h is a quadratic with continuous slope.

    circumference : ∫h dψ over a turn, that of the convex hull [m]
    """

    pieces: Pieces
    circumference: float

    @property
    def label(self) -> str:
        """'sole' and a number that tells soles apart."""
        return f"sole {zlib.crc32(repr(self.pieces).encode()):08x}"

    def __repr__(self) -> str:
        return f"<Sole of circumference {self.circumference:.6g} m>"


def sole_of(value: Any, what: str) -> Sole:
    """A sole as users may give it: points from heel to toe, or a support function; checked at the border."""
    if isinstance(value, Sole):
        return value
    if callable(value):
        return _sole(_of_function(value, what))
    return _sole(_of_points(_points(value, what), what))


def _sole(known: Sequence[Support]) -> Sole:
    """∫h dψ of a support function known at some tangents."""
    distinct = [known[0], *(b for a, b in pairwise(known) if b[0] > a[0])]
    return Sole(*joined(distinct))


def _points(value: Any, what: str) -> list[Point]:
    """Two columns of finite numbers, x increasing."""
    wanted = "(n ≥ 3, 2) points (x, y) from heel to toe, or a support function h(ψ)"
    try:
        rows = [(float(x), float(y)) for x, y in value]
    except (TypeError, ValueError):
        raise ModelError(f"{what} is {wanted}; got {value!r}") from None
    if len(rows) < 3:
        raise ModelError(
            f"{what} is {wanted}; got {len(rows)} points: for one use mbd.touchdown, for two a heel and toe"
        )
    for k, point in enumerate(rows):
        if not all(map(math.isfinite, point)):
            raise ModelError(f"{what}: point number {k} is {point}; remove what is missing")
        if k and point[0] <= rows[k - 1][0]:
            raise ModelError(
                f"{what}: x must increase from heel to toe, but point number {k - 1} has {rows[k - 1][0]:g} m and "
                f"number {k} has {point[0]:g} m; sort the points"
            )
    return rows


def _lower_hull(points: Sequence[Point]) -> list[Point]:
    """The points that touch level ground at some tangent, from heel to toe (Andrew's chain)."""
    hull: list[Point] = []
    for x, y in points:
        while len(hull) > 1:
            (xa, ya), (xb, yb) = hull[-2:]
            if (xb - xa) * (y - ya) - (yb - ya) * (x - xa) > 0.0:
                break
            hull.pop()
        hull.append((x, y))
    return hull


def _tangents(hull: Sequence[Point]) -> list[float]:
    """ψ at each point of a hull, of the parabola through it and its neighbours."""
    secants = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in pairwise(hull)]
    widths = [b[0] - a[0] for a, b in pairwise(hull)]
    inner = [
        (widths[k + 1] * secants[k] + widths[k] * secants[k + 1]) / (widths[k] + widths[k + 1])
        for k in range(len(secants) - 1)
    ]
    slopes = [2.0 * secants[0] - inner[0], *inner, 2.0 * secants[-1] - inner[-1]]
    return [math.atan(slope) for slope in slopes]


def _of_points(points: Sequence[Point], what: str) -> list[Support]:
    """The support function at the tangents of the points, and over the corners of heel and toe."""
    hull = _lower_hull(points)
    if len(hull) < 3:
        raise ModelError(
            f"{what} is flat or hollow: only its ends touch level ground; use two mbd.Unilateral contacts, heel and toe"
        )
    known = [_support(psi, point) for psi, point in zip(_tangents(hull), hull, strict=True)]
    heel, toe = hull[0], hull[-1]
    chord = math.atan2(heel[1] - toe[1], heel[0] - toe[0]) % (2.0 * math.pi)  # the edge from toe to heel, upside down
    before = [_support(psi, heel) for psi in _between(chord - 2.0 * math.pi, known[0][0])]
    after = [_support(psi, toe) for psi in _between(known[-1][0], chord)]
    return _of_one_turn([*before, *known, *after])


def _between(low: float, high: float) -> list[float]:
    """Angles inside an interval, at most `FINENESS` apart, a little off its ends."""
    count = max(2, math.ceil((high - low) / FINENESS))
    return [low + (k + 0.5) * (high - low) / count for k in range(count)]


def _support(psi: float, point: Point) -> Support:
    """h = x sin ψ − y cos ψ of a point and its slope."""
    (x, y), c, s = point, math.cos(psi), math.sin(psi)
    return psi, x * s - y * c, x * c + y * s


def _of_one_turn(known: Sequence[Support]) -> list[Support]:
    """The same between −π and π, with equal values at both."""
    turn = 2.0 * math.pi
    around = sorted(((psi + math.pi) % turn - math.pi, h, slope) for psi, h, slope in known)
    (a, ha, sa), (b, hb, sb) = around[-1], (around[0][0] + turn, *around[0][1:])
    width = b - a
    t = (math.pi - a) / width
    rise = hb - ha
    first, last = sa * width - rise, rise - sb * width  # of the cubic through both: h_a + t (rise + (1 − t) …)
    h = ha + t * (rise + (1.0 - t) * ((1.0 - t) * first + t * last))
    slope = (rise + (1.0 - 2.0 * t) * ((1.0 - t) * first + t * last) + t * (1.0 - t) * (last - first)) / width
    return [(-math.pi, h, slope), *around, (math.pi, h, slope)]


def _of_function(function: Callable[[Any], Any], what: str) -> list[Support]:
    """The support function and its slope at equal distances over a turn."""
    count = math.ceil(2.0 * math.pi / FINENESS)
    known: list[Support] = []
    for k in range(count + 1):
        psi = -math.pi + 2.0 * math.pi * k / count
        tape = Tape()
        value, (slope,) = derivatives_at(
            lambda x, tape=tape: traced_scalar(function, [("psi", x)], what, tape), [psi], tape
        )
        h, rise = (float(part.data) if part.is_constant else math.nan for part in (value, slope))
        if not math.isfinite(h + rise):
            raise ModelError(f"{what}: h(ψ) must be a finite number [m], got {value!r} at ψ = {psi:.6g} rad")
        known.append((psi, h, rise))
    size = max(abs(h) for _, h, _ in known) or 1.0
    if abs(known[0][1] - known[-1][1]) > EQUAL_RTOL * size:
        raise ModelError(
            f"{what}: h(−π) = {known[0][1]:.6g} m and h(π) = {known[-1][1]:.6g} m must be equal, a turn apart"
        )
    for (a, ha, sa), (b, hb, sb) in pairwise(known):
        radius = (sb - sa) / (b - a) + 0.5 * (ha + hb)  # h + h'', to second order
        if radius < -1e-3 * size:
            raise ModelError(
                f"{what} is not convex: its radius of curvature h + h'' is {radius:.3g} m at ψ = {a:.3g} rad"
            )
    return known
