"""Where a ball, or the edge of a disk, touches a height function y = H(x, z, t).

Newton's method for the place of contact is written out on the tape, `NEWTON_STEPS` times: what follows from it has
exact derivatives, and as the gap is a minimum over the places, an error ε of the place is one of ε² in the gap.

A ball touches where its center, a radius r along the normal n from the place s, is over S = (X, Z) of its own center:

``s − r ∇H/√(1 + |∇H|²) = S``,   ``g = (Y − H(s) − √(r² − |s − S|²)) n_y``

which knows no height: g is that of the ball let down along y, as it is to first order the distance. A disk touches with
the point of its edge that is lowest over H, ``min_θ y(θ) − H(x(θ), z(θ))``.

Where there is no single such place, in a valley that is narrower than the ball or the disk, g is no number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from mbd.bodies.algebra import cross, derivatives_at, difference, dot, scaled, total
from mbd.bodies.scope import Scope, Triple
from mbd.constraints.surfaces import Surface
from mbd.equal import NOMINAL_RTOL
from mbd.tape.derivatives import substitute
from mbd.tape.functions import cos, sin, sqrt, where
from mbd.tape.node import Node, Scalar

NO_CONTACT_POINT = (
    "the ground is narrower or steeper there than what is round can touch at one place, or its height is no "
    "number; take a smaller radius, a smoother height function, or points of its surface with mbd.touchdown"
)
"""What a gap that is no number means."""

NEWTON_STEPS = 6
"""Of Newton's method for the place of contact: from 0.4 of the radius of curvature it takes four [-]."""


class Heights:
    """H, ∇H and the second derivatives at any place, from one record of the function."""

    def __init__(self, surface: Surface, scope: Scope) -> None:
        tape = scope.tape
        self.fresh = [tape.input("place of contact", k) for k in range(2)]

        def height(x: Scalar, z: Scalar) -> Scalar:
            return surface.slopes((x, 0.0, z), scope)[0]

        self.value, slopes = derivatives_at(height, self.fresh, tape)
        self.nodes = [self.value, *slopes]
        for slope in slopes:
            bends = derivatives_at(lambda x, z, slope=slope: self._moved(slope, x, z), self.fresh, tape)[1]
            self.nodes += bends

    def _moved(self, node: Node, x: Scalar, z: Scalar) -> Scalar:
        return substitute([node], dict(zip(self.fresh, (x, z), strict=True)))[0]

    def at(self, x: Scalar, z: Scalar) -> Sequence[Scalar]:
        """H, H_x, H_z, H_xx, H_xz, H_zx, H_zz."""
        return substitute(self.nodes, dict(zip(self.fresh, (x, z), strict=True)))


def ball_on(surface: Surface, center: Triple, radius: Scalar, scope: Scope) -> tuple[Scalar, Triple]:
    """g of a ball [m], and the arm from its center to where it touches, or would, in ground axes [m]."""
    heights = Heights(surface, scope)
    x, z = center[0], center[2]
    for _ in range(NEWTON_STEPS):
        missed, bend = _off_center(heights, center, radius, x, z)
        (a, b), (c, d) = bend
        size = a * d - b * c
        x, z = x - (d * missed[0] - b * missed[1]) / size, z - (a * missed[1] - c * missed[0]) / size
    (along, across), ((a, b), (c, d)) = _off_center(heights, center, radius, x, z)
    height, *slopes = heights.at(x, z)[:3]
    steep = 1.0 / sqrt(1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1])
    there = difference((x, 0.0, z), (center[0], 0.0, center[2]))
    lift = height + sqrt(radius * radius - dot(there, there))
    found = _where_found((center[1] - lift) * steep, along * along + across * across, radius, a * d - b * c)
    return found, scaled(-radius * steep, (-slopes[0], 1.0, -slopes[1]))


def _off_center(
    heights: Heights, center: Triple, radius: Scalar, x: Scalar, z: Scalar
) -> tuple[tuple[Scalar, Scalar], tuple[tuple[Scalar, Scalar], tuple[Scalar, Scalar]]]:
    """s − r ∇H/√(1 + |∇H|²) − S, and its derivative by s."""
    _, p, q, xx, xz, zx, zz = heights.at(x, z)
    w = 1.0 / sqrt(1.0 + p * p + q * q)
    off = x - radius * p * w - center[0], z - radius * q * w - center[2]
    r, square = radius * w, w * w
    first = p * xx + q * zx, p * xz + q * zz  # ∇ of half the square of the slope
    return off, (
        (1.0 - r * (xx - square * p * first[0]), -r * (xz - square * p * first[1])),
        (-r * (zx - square * q * first[0]), 1.0 - r * (zz - square * q * first[1])),
    )


def edge_on(surface: Surface, center: Triple, axle: Triple, radius: Scalar, scope: Scope) -> tuple[Scalar, Triple]:
    """g of the edge of a thin disk with this axle (of length 1, in ground axes), and the arm to where it touches."""
    heights, normal = Heights(surface, scope), surface.normal_at(center, scope)
    side = cross(axle, normal)
    forward = scaled(1.0 / sqrt(dot(side, side)), side)
    down = cross(axle, forward)  # of the edge, towards the surface below the center

    def lower(angle: Scalar) -> tuple[Triple, Scalar, Scalar, Scalar, Scalar]:
        """Arm, height over the surface, its derivatives by θ, and 1/√(1 + |∇H|²)."""
        c, s = cos(angle), sin(angle)
        arm = scaled(radius, total(scaled(c, down), scaled(s, forward)))
        turned = scaled(radius, difference(scaled(c, forward), scaled(s, down)))
        place = total(center, arm)
        height, p, q, xx, xz, zx, zz = heights.at(place[0], place[2])
        u, w = turned[0], turned[2]
        first = turned[1] - p * u - q * w
        second = p * arm[0] + q * arm[2] - arm[1] - (xx * u * u + (xz + zx) * u * w + zz * w * w)
        return arm, place[1] - height, first, second, 1.0 / sqrt(1.0 + p * p + q * q)

    angle: Scalar = 0.0
    for _ in range(NEWTON_STEPS):
        _, _, first, second, _ = lower(angle)
        angle = angle - first / second
    arm, height, first, second, steep = lower(angle)
    share = second / (radius * sqrt(dot(side, side)))
    return _where_found(height * steep, first * first, radius, share), arm


def _where_found(gap: Scalar, missed: Scalar, radius: Scalar, share: Scalar) -> Scalar:
    """The gap where Newton's method has come to a place, and to a minimum; else no number."""
    # by at least that share of its curvature a ball or a disk is rounder than the valley
    single: Scalar = where(share > 0.02, gap, math.nan)
    bound = NOMINAL_RTOL * radius
    found: Scalar = where(missed < bound * bound, single, math.nan)
    return found
