"""Angular velocities and accelerations of orientations that are given as unit quaternions over time."""

from __future__ import annotations

import numpy as np

from mbd.arrays import Matrix
from mbd.errors import ModelError

__all__ = ["continuous", "quaternion_rates"]

UNIT_LENGTH_ATOL = 1e-3
"""How far from 1 the length of a given quaternion may be before it is refused [-]."""


def continuous(quaternions: Matrix, what: str) -> Matrix:
    """Quaternions (4, R) of length 1 with signs that do not jump from frame to frame; q and −q are one orientation.

    >>> continuous(np.array([[0.6, -0.6], [0.8, -0.8], [0.0, 0.0], [0.0, 0.0]]), "trunk.orientation")[:2].tolist()
    [[0.6, 0.6], [0.8, 0.8]]
    """
    sizes = np.sqrt(np.einsum("ij,ij->j", quaternions, quaternions))
    wrong = np.flatnonzero(np.abs(sizes - 1.0) > UNIT_LENGTH_ATOL)
    if len(wrong):
        raise ModelError(
            f"{what!r} must be unit quaternions (w, x, y, z); that of frame {wrong[0]} has the length "
            f"{sizes[wrong[0]]:.6g}"
        )
    unit: Matrix = quaternions / sizes
    jumps = np.einsum("ij,ij->j", unit[:, 1:], unit[:, :-1]) < 0.0
    if jumps.any():
        unit[:, 1:] *= np.cumprod(np.where(jumps, -1.0, 1.0))
    return unit


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
