"""What rows that depend on others bear of a load while a friction slides: the kernel's shares, for any integrator."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import AccelerationTerms
from mbd.equations.equations import Row
from mbd.kernel.algebra.redundancy import JOINT_SHARE, MIN_LIMIT_SHARE

__all__ = ["shares"]


def shares(rows: Sequence[Row], terms: AccelerationTerms, kept: Sequence[int], dependent: Sequence[int]) -> Matrix:
    """S (d, k) of ``λ_d = S λ_kept``, the multipliers of least norm: ``S = W_d C W_kept⁻¹`` with ``B_d = C B_kept``.

    W is that of `mbd.kernel.algebra.redundancy.share`: of joints far above 1, of contacts 1, or the limit of the
    friction that holds a row over the largest of all.

    Parameters
    ----------
    rows : all rows of the equations
    terms : B and the limits of the frictions at the present multipliers
    kept, dependent : numbers of the rows that are solved with and of those that depend on them
    """
    weights = np.array([_weight(row, terms.limits) for row in rows])
    dependence = np.linalg.lstsq(terms.B[list(kept)].T, terms.B[list(dependent)].T)[0].T
    return np.asarray(weights[list(dependent)][:, None] * dependence / weights[list(kept)])


def _weight(row: Row, limits: Vector) -> float:
    largest = float(np.max(limits, initial=0.0))
    if row.friction < 0 and row.contact < 0:
        return JOINT_SHARE
    if row.friction < 0 or largest == 0.0:
        return 1.0
    return float(max(limits[row.friction] / largest, MIN_LIMIT_SHARE))
