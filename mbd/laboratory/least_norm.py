"""Forces that balance a motion, at all frames at once; where they are not unique those of least norm."""

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL, RANK_RTOL


@dataclass(frozen=True, eq=False)
class Balanced:
    """Forces of ``E τ − R λ + ρ = g`` at each frame.

    effort : (R, n) τ, zero where nothing drives; lam : (R, m) λ; residual : (R, n) ρ, zero where something drives
    free : number of dimensions of (τ, λ) that the balance leaves open, at most over the frames
    shared : whether τ itself is not unique
    """

    effort: Matrix
    lam: Matrix
    residual: Matrix
    free: int = 0
    shared: bool = False


def balanced(g: Matrix, R: NDArray[np.float64], driven: NDArray[np.bool_]) -> Balanced:
    """τ, λ and ρ with ``E τ − R λ + ρ = g``: ρ as small as it can be, then τ, then λ.

    1. λ₀ of least norm makes ``ρ = g_U + R_U λ`` least, over the coordinates U that nothing drives.
    2. ``λ = λ₀ + P y`` with P the projector on the null space of R_U; y of least norm makes ``τ = g_D + R_D λ`` least.

    Parameters
    ----------
    g : (R, n) ``M v̇ + f`` with all known forces; without rows its memory becomes that of τ
    R : (R, n, m) ∂r/∂λ of the rows that always act
    driven : (n,) coordinates with a force or moment τ
    """
    count, m = len(g), R.shape[2]
    effort, residual = g.copy() if m else g, np.zeros(g.shape)
    residual[:, ~driven] = g[:, ~driven]
    effort[:, ~driven] = 0.0
    if not m or not count:
        return Balanced(effort, np.zeros((count, m)), residual)
    upper, lower = R[:, ~driven, :], R[:, driven, :]
    back = left_inverses(upper)
    if back is not None:  # the usual case: the balance where nothing drives determines λ
        lam = -_applied(back, g[:, ~driven])
        residual[:, ~driven] = g[:, ~driven] + _applied(upper, lam)
        effort[:, driven] = g[:, driven] + _applied(lower, lam)
        return Balanced(effort, lam, residual)
    scale = np.linalg.svd(R, compute_uv=False).max(axis=1, initial=0.0)
    back, held = _inverse(upper, scale)
    lam = -_applied(back, g[:, ~driven])
    P = np.eye(m) - back @ upper
    more, moved = _inverse(lower @ P, scale)
    lam = lam - _applied(P @ more, g[:, driven] + _applied(lower, lam))
    residual[:, ~driven] = g[:, ~driven] + _applied(upper, lam)
    effort[:, driven] = g[:, driven] + _applied(lower, lam)
    return Balanced(effort, lam, residual, int((m - held).max()), bool(np.any(moved > 0)))


def left_inverses(matrices: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """``(AᵀA)⁻¹ Aᵀ`` by A = Q U of each matrix (R, n, m), n ≥ m; None where one of them is near a loss of rank.

    Where all are the same, as those of couplers and of motions that are functions of coordinates are, one is inverted.
    """
    count, n, m = matrices.shape
    if n < m:
        return None
    if count > 1 and np.array_equal(matrices, np.broadcast_to(matrices[:1], matrices.shape)):
        one = left_inverses(matrices[:1])
        return None if one is None else np.broadcast_to(one, (count, m, n))
    Q, U = np.linalg.qr(matrices)
    if not np.all(np.abs(np.diagonal(U, axis1=1, axis2=2)) > 0.0):
        return None
    inverse = np.linalg.inv(U)
    sizes = np.abs(U).max(axis=(1, 2)) * np.abs(inverse).max(axis=(1, 2))
    return np.asarray(inverse @ Q.transpose(0, 2, 1)) if np.all(sizes * HALF_PRECISION_RTOL < 1.0) else None


def _inverse(matrices: NDArray[np.float64], scale: Vector) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Pseudo-inverse and rank of each matrix; what is below `RANK_RTOL` of a scale counts as zero."""
    count, n, m = matrices.shape
    if not matrices.size:
        return np.zeros((count, m, n)), np.zeros(count, dtype=np.intp)
    U, sizes, V = np.linalg.svd(matrices, full_matrices=False)
    kept = sizes > RANK_RTOL * scale[:, np.newaxis]
    inverse = np.where(kept, 1.0 / np.where(kept, sizes, 1.0), 0.0)
    return np.einsum("kji,kj,klj->kil", V, inverse, U), kept.sum(axis=1)


def _applied(matrices: NDArray[np.float64], vectors: Matrix) -> Matrix:
    return np.asarray(np.einsum("kij,kj->ki", matrices, vectors))
