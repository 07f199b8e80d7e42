"""Angular velocities and accelerations of orientations that are given as unit quaternions over time."""

import numpy as np

from mbd.arrays import Matrix
from mbd.errors import ModelError

UNIT_LENGTH_ATOL = 1e-3
"""How far from 1 the length of a given quaternion may be before it is refused [-]."""


def make_continuous(quaternions: Matrix, what: str) -> None:
    """Scale quaternions (4, R) in place to length 1 without signs that jump: q and −q are one orientation.

    >>> q = np.array([[0.6, -0.6], [0.8, -0.8], [0.0, 0.0], [0.0, 0.0]])
    >>> make_continuous(q, "trunk.orientation")
    >>> q[:2].tolist()
    [[0.6, 0.6], [0.8, 0.8]]
    """
    sizes = np.sqrt(np.einsum("ij,ij->j", quaternions, quaternions))
    if not abs(sizes.max() - 1.0) <= UNIT_LENGTH_ATOL >= abs(sizes.min() - 1.0):
        wrong = int(np.argmax(np.abs(sizes - 1.0) > UNIT_LENGTH_ATOL))
        raise ModelError(
            f"{what!r} must be unit quaternions (w, x, y, z); that of frame {wrong} has the length {sizes[wrong]:.6g}"
        )
    quaternions /= sizes
    along = np.einsum("ij,ij->j", quaternions[:, 1:], quaternions[:, :-1])
    if along.min(initial=0.0) < 0.0:
        quaternions[:, 1:] *= np.cumprod(np.where(along < 0.0, -1.0, 1.0))


def quaternion_rates(q: Matrix, rate: Matrix, acceleration: Matrix) -> tuple[Matrix, Matrix]:
    """ω and ω̇ in the axes of the child (3, R) from q (4, R) of length 1 and two derivatives of a curve s through it.

    With p = s/|s|, ``ω = 2 vec(q* ⊗ ṡ)`` and ``ω̇ = 2 vec(q* ⊗ s̈) − 2 (q·ṡ) ω``: what of ṡ lies along q changes only
    the length.
    """
    spin = 2.0 * _conjugate_product(q, rate)
    along = np.einsum("ij,ij->j", q, rate)
    return spin, 2.0 * _conjugate_product(q, acceleration) - 2.0 * along * spin


def _conjugate_product(q: Matrix, p: Matrix) -> Matrix:
    """The vector part of q* ⊗ p."""
    (w, x, y, z), (a, b, c, d) = q, p
    return np.array((w * b - a * x - y * d + z * c, w * c - a * y - z * b + x * d, w * d - a * z - x * c + y * b))
