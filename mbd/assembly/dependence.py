"""Rows of constraints that depend on each other: how many are independent, and which follow from which."""

from collections.abc import Sequence

import numpy as np

from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL

MIN_COEFFICIENT = 1e-7
"""Coefficient below which a row does not take part in a dependence [-]."""


@dataclass(frozen=True)
class Dependence:
    """A row that follows from others: ``B_row = Σ c_k B_k``.

    Attributes
    ----------
    row : its title, "'joint e' (x)"
    on : (title, c) of the rows it depends on, none of which can be left out; empty where the row acts on nothing
    number : its place among the rows that were asked about
    numbers : the places of those it depends on
    """

    row: str
    on: tuple[tuple[str, float], ...]
    number: int
    numbers: tuple[int, ...]

    def __str__(self) -> str:
        if not self.on:
            return f"{self.row} acts on nothing that moves"
        return f"{self.row} depends on " + ", ".join(title for title, _ in self.on)


def normalised(B: Matrix) -> Matrix:
    """Every row over its largest entry; a row that vanishes stays."""
    size = np.max(np.abs(B), axis=1, initial=0.0)
    largest = float(np.max(size, initial=0.0))
    size = np.where(size > 1e-12 * largest, size, np.inf if largest > 0.0 else 1.0)
    return np.asarray(B / size[:, None])


def rank_of(B: Matrix) -> int:
    """The number of independent rows, by the singular values of the row-normalised B.

    Parameters
    ----------
    B : (m, n) Jacobian of the rows
    """
    if not B.size:
        return 0
    sizes = np.linalg.svd(normalised(B), compute_uv=False)
    return int(np.count_nonzero(sizes > HALF_PRECISION_RTOL * max(float(sizes[0]), 1e-300)))


def dependences(B: Matrix, titles: Sequence[str]) -> tuple[Dependence, ...]:
    """Every row that depends on rows before it, with the coefficients.

    The rows are taken in order, as a run does: a row stays if it raises the rank, by what is left of it beside the
    earlier ones. Those that stay are independent, so that the coefficients are unique and the rows with c ≠ 0 are as
    few as can be.

    Parameters
    ----------
    B : (m, n) Jacobian of the rows
    titles : a title for each
    """
    kept, found = list[int](), list[Dependence]()
    if not B.size:
        return ()
    unit = normalised(B)
    basis = np.zeros((0, B.shape[1]))
    for k, row in enumerate(unit):
        left = row - basis.T @ (basis @ row)
        left = left - basis.T @ (basis @ left)
        size = float(np.linalg.norm(left))
        if size > HALF_PRECISION_RTOL * max(float(np.linalg.norm(row)), 1e-300):
            basis = np.vstack([basis, left / size])
            kept.append(k)
            continue
        parts = np.linalg.lstsq(B[kept].T, B[k], rcond=None)[0] if kept else np.zeros(0)
        share = parts * np.linalg.norm(B[kept], axis=1) / (float(np.linalg.norm(B[k])) or 1.0)
        places = [place for place, part in enumerate(share) if abs(part) > MIN_COEFFICIENT and row.any()]
        found.append(
            Dependence(
                titles[k],
                tuple((titles[kept[place]], float(parts[place])) for place in places),
                k,
                tuple(kept[place] for place in places),
            )
        )
    return tuple(found)
