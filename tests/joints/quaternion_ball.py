"""A ball joint with more coordinates than velocities: a unit quaternion, and the angular velocity in child axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np

from mbd.bodies.base import Frame
from mbd.joints.base import Joint, JointLoss, Label
from mbd.tape.functions import atan2, cos, sin, sqrt, where

SMALL = 0.25
"""θ² below which functions of it are their series [rad²]."""
BERNOULLI = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600,
             3617 / 10670622842880000)  # fmt: skip
"""(1 − (θ/2) cot(θ/2))/θ² by powers of θ²."""


def product(p: Sequence[Any], q: Sequence[Any]) -> list[Any]:
    """p q of quaternions (w, x, y, z)."""
    (a, x, y, z), (b, u, v, w) = p, q
    return [
        a * b - x * u - y * v - z * w, a * u + x * b + y * w - z * v, a * v - x * w + y * b + z * u,
        a * w + x * v - y * u + z * b,
    ]  # fmt: skip


def rotation(q: Sequence[Any]) -> Any:
    """R of a unit quaternion."""
    w, x, y, z = q
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def cross(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def series(s: Any, weights: Sequence[float], closed: Any) -> Any:
    """Σ weight sⁿ below SMALL, else closed(√s); s away from 0 in the branch that is not taken, for its derivatives."""
    total: Any = weights[-1]
    for weight in reversed(weights[:-1]):
        total = weight + s * total
    return where(s < SMALL, total, closed(sqrt(where(s < SMALL, 1.0, s))))


def taylor(first: int, factor: float = 1.0) -> list[float]:
    """(−1)ⁿ factorⁿ/(first + 2n)!"""
    return [(-factor) ** n / factorial(first + 2 * n) for n in range(10)]


def squared(x: Sequence[Any]) -> Any:
    return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]


@dataclass(frozen=True)
class QuaternionBall(Joint):
    """A ball joint in exponential charts."""

    name: str
    parent: Frame
    child: Frame
    loss: JointLoss = None

    def __post_init__(self) -> None:
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        return tuple(Label(name, "") for name in ("w", "x", "y", "z"))

    @property
    def velocity_labels(self) -> tuple[Label, ...]:
        return tuple(Label(f"spin {axis}", "rad/s") for axis in "xyz")

    @property
    def is_vector(self) -> bool:
        return False

    @property
    def is_planar(self) -> bool:
        return False

    @property
    def defaults(self) -> tuple[float, ...]:
        return (1.0, 0.0, 0.0, 0.0)

    def transform(self, q, scope):
        return rotation(q), (0.0, 0.0, 0.0)

    def subspace(self, q, scope):
        zero = (0.0, 0.0, 0.0)
        return [((1.0, 0.0, 0.0), zero), ((0.0, 1.0, 0.0), zero), ((0.0, 0.0, 1.0), zero)]

    def rows(self, R, p, scope):
        return list(zip("xyz", p, strict=True))

    def recover(self, R, p, scope):
        parts = [1.0 + sign[0] * R[0][0] + sign[1] * R[1][1] + sign[2] * R[2][2]
                 for sign in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]  # fmt: skip
        off = {(0, 1): R[2][1] - R[1][2], (0, 2): R[0][2] - R[2][0], (0, 3): R[1][0] - R[0][1],
               (1, 2): R[1][0] + R[0][1], (1, 3): R[0][2] + R[2][0], (2, 3): R[2][1] + R[1][2]}  # fmt: skip

        def by(k: int) -> list[Any]:
            root = sqrt(where(parts[k] > 0.5, parts[k], 1.0))
            return [0.5 * root if i == k else 0.5 * off[min(i, k), max(i, k)] / root for i in range(4)]

        choice = by(3)
        for k in (2, 1, 0):
            choice = [where(parts[k] > 0.9, a, b) for a, b in zip(by(k), choice, strict=True)]
        return choice

    def compose(self, q, x):
        norm = 1.5 - 0.5 * (q[0] * q[0] + squared(q[1:]))  # of a quaternion that is off 1 by round-off
        return product([norm * each for each in q], self._turn(x))

    def _turn(self, x: Sequence[Any]) -> list[Any]:
        s = squared(x)
        w = series(s, taylor(0, 0.25), lambda a: cos(0.5 * a))
        k = series(s, [0.5 * each for each in taylor(1, 0.25)], lambda a: sin(0.5 * a) / a)
        return [w, k * x[0], k * x[1], k * x[2]]

    def _relative(self, q: Sequence[Any], other: Sequence[Any]) -> list[Any]:
        """q⁻¹ other with w ≥ 0."""
        turn = product([q[0], -q[1], -q[2], -q[3]], other)
        sign = where(turn[0] < 0.0, -1.0, 1.0)
        return [sign * each for each in turn]

    def difference(self, q, other):
        w, *u = self._relative(q, other)
        s = squared(u)
        small = s < 0.01 * w * w
        t = where(small, s / where(small, w * w, 1.0), 0.0)
        total: Any = 0.0
        for n in reversed(range(10)):
            total = (-1.0) ** n / (2 * n + 1) + t * total
        a = sqrt(where(small, 1.0, s))
        k = where(small, 2.0 / where(small, w, 1.0) * total, 2.0 * atan2(a, w) / a)
        return [k * each for each in u]

    def normalise(self, q):
        size = sqrt(q[0] * q[0] + squared(q[1:]))
        return [each / size for each in q]

    def coordinate_rates(self, q, v):
        return [0.5 * each for each in product(q, [0.0, *v])]

    def increment_rates(self, x, v):
        k = series(squared(x), BERNOULLI, lambda a: (1.0 - 0.5 * a * cos(0.5 * a) / sin(0.5 * a)) / (a * a))
        turn = cross(x, v)
        again = cross(x, turn)
        return [v[i] + 0.5 * turn[i] + k * again[i] for i in range(3)]

    def increment_velocities(self, x, rates):
        s = squared(x)
        a = series(s, taylor(2), lambda angle: (1.0 - cos(angle)) / (angle * angle))
        b = series(s, taylor(3), lambda angle: (angle - sin(angle)) / (angle * angle * angle))
        turn = cross(x, rates)
        again = cross(x, turn)
        return [rates[i] - a * turn[i] + b * again[i] for i in range(3)]


@dataclass(frozen=True)
class CayleyBall(QuaternionBall):
    """The same ball joint in Cayley charts, which are rational: ``q ⊗ (1, x/2)/√(1 + |x|²/4)``."""

    def __post_init__(self) -> None:
        self.validate()

    def _turn(self, x):
        size = 1.0 / sqrt(1.0 + 0.25 * squared(x))
        return [size, 0.5 * size * x[0], 0.5 * size * x[1], 0.5 * size * x[2]]

    def difference(self, q, other):
        w, *u = self._relative(q, other)
        return [2.0 * each / w for each in u]

    def increment_rates(self, x, v):
        turn, along = cross(x, v), 0.25 * (x[0] * v[0] + x[1] * v[1] + x[2] * v[2])
        return [v[i] + 0.5 * turn[i] + along * x[i] for i in range(3)]

    def increment_velocities(self, x, rates):
        turn, size = cross(x, rates), 1.0 / (1.0 + 0.25 * squared(x))
        return [size * (rates[i] - 0.5 * turn[i]) for i in range(3)]


def axis_angle(axis: Sequence[float], angle: float) -> list[float]:
    """The quaternion of a rotation."""
    unit = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return [float(np.cos(angle / 2)), *map(float, np.sin(angle / 2) * unit)]
