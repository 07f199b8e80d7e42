"""Stability of a gait: eigenvalues of the derivative of its return map, with those that every gait has told apart."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL

RANK_RTOL = 1e-7
"""Singular value of P relative to its largest, or to `MAX_RANK_SCALE`, below which the map forgets a direction [-]."""
MAX_RANK_SCALE = 100.0
"""Largest singular value beyond which the errors of P alone tell what a map forgets: strongly unstable gaits have
large ones and, with them, small ones that are no zeros [-]."""


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Floquet multipliers of a return map, by falling modulus, and their modes in the coordinates of the section.

    values (k,) complex; modes (size, k) complex, of length 1
    trivial : multipliers that say nothing about stability: 'forgotten' directions (0), 'energy' (1)
    error : estimate of that of the largest
    """

    values: NDArray[np.complex128]
    modes: NDArray[np.complex128]
    trivial: Mapping[str, tuple[float, ...]]
    error: float

    @property
    def largest(self) -> float:
        """The largest modulus; 0 where the map forgets everything."""
        return float(np.max(np.abs(self.values), initial=0.0))

    @property
    def stability(self) -> str:
        """'stable', 'unstable' or 'marginal'."""
        doubt = max(NOMINAL_RTOL, self.error if np.isfinite(self.error) else 0.0)
        if abs(self.largest - 1.0) <= doubt:
            return "marginal"
        return "stable" if self.largest < 1.0 else "unstable"


def multipliers_of(P: Matrix, error: Matrix, energy: Matrix | None = None) -> Multipliers:
    """The multipliers of P (size, size), whose entries have estimated errors.

    Directions that the map forgets, as a reset or an impact does, are multipliers of 0 that are left out: P is
    restricted to its range, with the basis U. What of the range is shorter than errors may be adds
    ``y* P (1 − U Uᵀ) P x/λ`` to an eigenvalue λ with the eigenvectors y* and x, y* x = 1. `energy` is ∇E along the
    section where the cycle loses and gains none; it is then a left eigenvector, of multiplier 1, and is split off.
    """
    size = len(P)
    if not size:
        return Multipliers(np.zeros(0, complex), np.zeros((0, 0), complex), {}, 0.0)
    U, sizes, V = np.linalg.svd(P)
    errors = np.where(np.isfinite(error), error, 0.0)
    doubt, doubts = float(np.max(errors)), np.einsum("ik,ij,kj->k", np.abs(U), errors, np.abs(V))
    rank = int(np.sum(sizes > np.maximum(RANK_RTOL * min(float(sizes[0]), MAX_RANK_SCALE), 10.0 * doubts)))
    basis = U[:, :rank]
    values, vectors = np.linalg.eig(basis.T @ P @ basis)
    modes, shorter = basis @ vectors, U[:, rank:]
    beyond = np.einsum("kr,rk->k", np.linalg.pinv(vectors) @ basis.T @ P @ shorter, shorter.T @ P @ modes)
    beyond = np.where(values.imag == 0.0, beyond.real, beyond)
    values = values + np.divide(beyond, values, out=np.zeros_like(beyond), where=np.abs(beyond) < np.abs(values) ** 2)
    trivial: dict[str, tuple[float, ...]] = {}
    if rank < size:
        trivial["forgotten"] = (0.0,) * (size - rank)
    if energy is not None and np.linalg.norm(energy @ P - energy) <= NOMINAL_RTOL * np.linalg.norm(energy):
        kept = int(np.argmin(np.abs(values - 1.0)))
        trivial["energy"] = (float(values[kept].real),)
        values, modes = np.delete(values, kept), np.delete(modes, kept, axis=1)
    order = np.argsort(-np.abs(values), kind="stable")
    spread = float(np.linalg.cond(vectors)) if rank else 1.0
    return Multipliers(
        np.asarray(values[order], complex), np.asarray(modes[:, order], complex), trivial,
        doubt * min(spread, 1e6) * np.sqrt(size),
    )  # fmt: skip
