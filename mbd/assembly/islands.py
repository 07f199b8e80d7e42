"""Islands of equations: unknowns that no entry of a matrix couples to others, each a small problem of its own.

n bodies that do not touch each other are n small problems; those of one shape are solved as one stack of matrices.
"""

import numpy as np

from mbd.arrays import Matrix


def alike_islands(matrix: Matrix, n: int) -> list[np.ndarray]:
    """The connected components of a square matrix, those that are alike together.

    Parameters
    ----------
    matrix : (k, k) its entries other than 0.0 couple two unknowns, in either direction
    n : coordinates, which come before multipliers

    Returns
    -------
    list of (islands, size) numbers of unknowns, ascending; all islands of an array have as many of them below n
    """
    coupled = (matrix != 0.0) | (matrix != 0.0).T
    left = np.ones(len(matrix), dtype=bool)
    found: dict[tuple[int, int], list[np.ndarray]] = {}
    for first in range(len(matrix)):
        if not left[first]:
            continue
        front, inside = np.array([first]), np.zeros(len(matrix), dtype=bool)
        while len(front):
            inside[front] = True
            left[front] = False
            front = np.flatnonzero(coupled[front].any(axis=0) & left)
        members = np.flatnonzero(inside)
        found.setdefault((len(members), int(np.searchsorted(members, n))), []).append(members)
    return [np.array(islands) for islands in found.values()]


def islands_of_rows(M: Matrix, B: Matrix) -> list[tuple[np.ndarray, np.ndarray]]:
    """Coordinates (islands, n) and rows (islands, m) of islands of [M Bᵀ; B 0], those that are alike together."""
    n, m = len(M), len(B)
    found = alike_islands(np.block([[M, B.T], [B, np.zeros((m, m))]]), n)
    held = [int(np.sum(islands[0] >= n)) for islands in found]
    return [
        (each[:, : each.shape[1] - k], each[:, each.shape[1] - k :] - n) for each, k in zip(found, held, strict=True)
    ]
