"""Unit quaternions (w, x, y, z) of rotations: products, charts by the exponential map, and what is read off them.

``R = 1 + 2 w [u]× + 2 [u]×²`` with u = (x, y, z); −q is the same rotation as q. The chart around q is
``q ⊕ x = q ⊗ exp(x/2)``, with x a rotation vector in the axes that the rotation turns, ω those of its angular velocity:

    ω = T(x) ẋ,   T = 1 − (1−cos θ)/θ² x̂ + (θ−sin θ)/θ³ x̂²,   T⁻¹ = 1 + ½ x̂ + (1 − (θ/2) cot(θ/2))/θ² x̂²,   θ = |x|

each by its series near θ = 0, so that values and derivatives are exact there too. All functions take traced scalars,
floats and arrays. Sources: Müller, Review of the exponential and Cayley map on SE(3) (2021); Shepperd, Quaternion from
rotation matrix (1978).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import factorial
from typing import Any

from mbd.bodies.algebra import cross
from mbd.bodies.scope import Rotation, Triple
from mbd.tape.functions import atan2, cos, sin, sqrt, where
from mbd.tape.node import Scalar

SERIES_LIMIT = 0.25
"""θ² below which functions of it are their series [rad²]."""
SERIES_TERMS = 9
"""Terms of these series: what is left out is below round-off, in their second derivatives too."""
MIN_PIVOT = 0.9
"""4 times the square of a part of a quaternion above which it is a divisor; one of the four is 1 at least."""
BERNOULLI = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600,
             3617 / 10670622842880000)  # fmt: skip
"""(1 − (θ/2) cot(θ/2))/θ² by powers of θ²."""

Four = Sequence[Any]
"""Parts w, x, y, z."""


def quaternion_product(p: Four, q: Four) -> list[Any]:
    """p ⊗ q, the rotation q followed by p."""
    (a, x, y, z), (b, u, v, w) = p, q
    return [
        a * b - x * u - y * v - z * w,
        a * u + x * b + y * w - z * v,
        a * v - x * w + y * b + z * u,
        a * w + x * v - y * u + z * b,
    ]


def rotation_of(q: Four) -> Rotation:
    """R of a unit quaternion."""
    w, x, y, z = q
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def of_rotation(R: Rotation) -> list[Any]:
    """A unit quaternion of R, by the largest of its four parts, which is positive (Shepperd)."""
    signs = ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
    parts = [1.0 + a * R[0][0] + b * R[1][1] + c * R[2][2] for a, b, c in signs]
    beside = {
        (0, 1): R[2][1] - R[1][2], (0, 2): R[0][2] - R[2][0], (0, 3): R[1][0] - R[0][1],
        (1, 2): R[1][0] + R[0][1], (1, 3): R[0][2] + R[2][0], (2, 3): R[2][1] + R[1][2],
    }  # fmt: skip

    def by(k: int) -> list[Any]:
        root = sqrt(where(parts[k] > 0.5 * MIN_PIVOT, parts[k], 1.0))
        return [0.5 * root if i == k else 0.5 * beside[min(i, k), max(i, k)] / root for i in range(4)]

    found = by(3)
    for k in (2, 1, 0):
        found = [where(parts[k] > MIN_PIVOT, a, b) for a, b in zip(by(k), found, strict=True)]
    return found


# the chart --------------------------------------------------------------------------------------------------------
def composed(q: Four, x: Sequence[Any]) -> list[Any]:
    """q ⊗ exp(x/2), of length 1 also where q is off by round-off."""
    size = 1.5 - 0.5 * (q[0] * q[0] + _square(q[1:]))
    s = _square(x)
    w = _by_series(s, _taylor(0, 0.25), lambda angle: cos(0.5 * angle))
    k = _by_series(s, [0.5 * each for each in _taylor(1, 0.25)], lambda angle: sin(0.5 * angle) / angle)
    return quaternion_product([size * each for each in q], [w, k * x[0], k * x[1], k * x[2]])


def increment(q: Four, other: Four) -> list[Any]:
    """The x with q ⊕ x = ± other, half a turn long at most."""
    return rotation_vector(quaternion_product([q[0], -q[1], -q[2], -q[3]], other))


def rotation_vector(q: Four) -> list[Any]:
    """θ n of a rotation by θ about n, 0 ≤ θ ≤ π; its direction is ambiguous at half a turn."""
    sign = where(q[0] < 0.0, -1.0, 1.0)
    w, *u = [sign * each for each in q]
    s = _square(u)
    small = s < 0.01 * w * w
    t = where(small, s / where(small, w * w, 1.0), 0.0)
    total: Any = 0.0
    for n in reversed(range(SERIES_TERMS)):
        total = (-1.0) ** n / (2 * n + 1) + t * total
    a = sqrt(where(small, 1.0, s))
    k = where(small, 2.0 / where(small, w, 1.0) * total, 2.0 * atan2(a, w) / a)
    return [k * each for each in u]


def normalised(q: Four) -> list[Any]:
    """q/|q|."""
    size = sqrt(q[0] * q[0] + _square(q[1:]))
    return [each / size for each in q]


def quaternion_rates(q: Four, omega: Sequence[Any]) -> list[Any]:
    """q̇ = ½ q ⊗ ω."""
    return [0.5 * each for each in quaternion_product(q, [0.0, *omega])]


def increment_rates(x: Sequence[Any], omega: Sequence[Any]) -> list[Any]:
    """ẋ = T⁻¹(x) ω."""
    k = _by_series(_square(x), BERNOULLI, lambda a: (1.0 - 0.5 * a * cos(0.5 * a) / sin(0.5 * a)) / (a * a))
    turn = cross(_triple(x), _triple(omega))
    again = cross(_triple(x), turn)
    return [omega[i] + 0.5 * turn[i] + k * again[i] for i in range(3)]


def increment_velocities(x: Sequence[Any], rates: Sequence[Any]) -> list[Any]:
    """ω = T(x) ẋ."""
    s = _square(x)
    a = _by_series(s, _taylor(2), lambda angle: (1.0 - cos(angle)) / (angle * angle))
    b = _by_series(s, _taylor(3), lambda angle: (angle - sin(angle)) / (angle * angle * angle))
    turn = cross(_triple(x), _triple(rates))
    again = cross(_triple(x), turn)
    return [rates[i] - a * turn[i] + b * again[i] for i in range(3)]


def _triple(x: Sequence[Any]) -> Triple:
    return (x[0], x[1], x[2])


def _square(x: Sequence[Any]) -> Scalar:
    result: Scalar = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
    return result


def _taylor(first: int, factor: float = 1.0) -> list[float]:
    """(−factor)ⁿ/(first + 2n)!"""
    return [(-factor) ** n / factorial(first + 2 * n) for n in range(SERIES_TERMS)]


def _by_series(s: Any, weights: Sequence[float], closed: Callable[[Any], Any]) -> Any:
    """Σ weight sⁿ below SERIES_LIMIT, else closed(√s); s stays away from 0 in a branch that is not taken."""
    total: Any = weights[-1]
    for weight in reversed(weights[:-1]):
        total = weight + s * total
    return where(s < SERIES_LIMIT, total, closed(sqrt(where(s < SERIES_LIMIT, 1.0, s))))
