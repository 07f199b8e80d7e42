"""Independent coordinates of a constrained mechanism: a choice by pivoted QR, and how all others follow from them."""

from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL, NOMINAL_RTOL

ROW_RTOL = 1e-10
"""Size of a row, relative to the largest, below which it acts on nothing [-]."""


@dataclass(frozen=True, eq=False)
class Independent:
    """Coordinates and rates whose small changes determine all others.

    Attributes
    ----------
    places, speeds : numbers of the independent coordinates and rates, ascending
    basis : (2 n_v + n_z, N) changes of (x, v, z) for a unit change of each independent one
    """

    places: tuple[int, ...]
    speeds: tuple[int, ...]
    basis: Matrix


def independent(M: Matrix, B: Matrix, turning: Matrix, velocity: Any, n_z: int = 0) -> Independent:
    """Independent coordinates of ``B_p δx = 0`` and ``B δv + (∂ḣ/∂x) δx = 0``.

    Dependent ones are taken where rows act on least inertia, B over the square root of M_ii, which does not depend on
    the order of the rows or on units; rows that depend on others do no harm.

    Parameters
    ----------
    M : (n_v, n_v) mass matrix; B : (m, n_v) rows; turning : (m, n_v) ∂ḣ/∂x
    velocity : (m,) booleans, rows on velocities, which leave positions free
    n_z : number of first-order states, which are all independent
    """
    n_v = len(M)
    inertia = np.abs(np.diag(M))
    heaviness = np.sqrt(np.maximum(inertia, NOMINAL_RTOL * np.max(inertia, initial=0.0)) + 1e-300)
    # among equals an earlier coordinate is preferred to the next
    weights = heaviness * (1.0 + 1e-6 * np.arange(n_v)[::-1])
    size = row_sizes(B)[:, None]
    B, turning = B / size, turning / size
    negligible = HALF_PRECISION_RTOL * float(np.max(np.abs(B / weights), initial=1e-300))
    by_place = _pivots(B[~velocity] / weights, negligible)
    places = [k for k in range(n_v) if k not in by_place]
    T = np.zeros((n_v, len(places)))
    T[places] = np.eye(len(places))
    T[by_place] = _solved(B[~velocity], by_place, B[~velocity][:, places])
    further = _pivots(B[velocity] @ T / weights[places], negligible)
    by_speed = sorted([*by_place, *(places[k] for k in further)])
    speeds = [k for k in range(n_v) if k not in by_speed]
    a, b = len(places), len(speeds)
    basis = np.zeros((2 * n_v + n_z, a + b + n_z))
    basis[:n_v, :a] = T
    basis[n_v + np.array(speeds, dtype=int), a : a + b] = np.eye(b)
    basis[n_v + np.array(by_speed, dtype=int), : a + b] = _solved(B, by_speed, np.hstack([turning @ T, B[:, speeds]]))
    basis[2 * n_v :, a + b :] = np.eye(n_z)
    return Independent(tuple(places), tuple(speeds), basis)


def row_sizes(B: Matrix) -> Vector:
    """Largest entry of each row, 1 for rows that vanish beside the largest of all."""
    sizes = np.max(np.abs(B), axis=1, initial=0.0)
    return np.where(sizes > ROW_RTOL * np.max(sizes, initial=0.0), sizes, 1.0)


def _pivots(B: Matrix, negligible: float) -> list[int]:
    """The columns that the rows determine best, as many as the rank."""
    from scipy.linalg import qr

    if not B.size:
        return []
    _, triangle, order = qr(B, mode="economic", pivoting=True)
    rank = int(np.count_nonzero(np.abs(np.diag(triangle)) > negligible))
    return sorted(int(k) for k in order[:rank])


def _solved(B: Matrix, dependent: list[int], right: Matrix) -> Matrix:
    """Changes of the dependent ones with ``B_dep d + right = 0``."""
    if not dependent:
        return np.zeros((0, right.shape[1]))
    return np.asarray(np.linalg.lstsq(B[:, dependent], -right, rcond=None)[0])
