"""Activations of least Σ a³ that give moments, at all frames at once, by an interior-point method."""

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.errors import SimulationError

MAX_ITERATIONS = 200
"""Newton steps; 20 to 40 are usual."""
CENTERING = (0.1, 0.8)
"""Part of the complementarity gap that a step aims at after a long step, and after one that a bound cut short [-]."""
GAP, BALANCE = 1e-13, 1e-10
"""Complementarity a z, and largest residual beside its terms, of a solution [-]."""


def least_activation(
    moment: NDArray[np.float64], wanted: Matrix, reserve: float, time: Vector
) -> tuple[Matrix, Matrix]:
    """a (R, m) and ρ (R, j) of least ``Σ a³ + Σ (ρ/ρ₀)²`` with ``G a + ρ = w`` and 0 ≤ a ≤ 1.

    The conditions of an optimum, with multipliers λ of the moments, z of a ≥ 0 and y of a ≤ 1, are

        ``3 a² − Gᵀλ − z + y = 0``, ``G a + ½ ρ₀² λ = w``, ``a z = μ``, ``(1 − a) y = μ``

    with μ → 0. Newton's method eliminates all but λ, so that a step solves one system of j equations a frame
    (S. J. Wright, Primal-dual interior-point methods, 1997, ch. 1). The problem is convex, so that its optimum is
    unique in G a, ρ and in the activations of all muscles that have an arm.

    Parameters
    ----------
    moment : G (R, j, m), moment of each muscle at full activation [N m]
    wanted : w (R, j)
    reserve : ρ₀ > 0
    time : (R,) for messages

    Raises
    ------
    SimulationError
        where no optimum is found, with the time.
    """
    count, rows, m = moment.shape
    G, half = moment, 0.5 * reserve * reserve
    a, z, y = np.full((count, m), 0.1), np.full((count, m), 0.1), np.full((count, m), 0.1)
    b = 1.0 - a  # of its own, since near full activation the difference would be round-off
    lam = np.zeros((count, rows))
    size = 1.0 + np.abs(wanted).max(axis=1, initial=0.0)
    step = np.ones((count, 1))
    going = np.ones(count, dtype=bool)
    for _ in range(MAX_ITERATIONS):
        # residuals of the four conditions, and the frames that still have some
        slope = 3.0 * a * a - np.einsum("kjm,kj->km", G, lam) - z + y
        short = wanted - np.einsum("kjm,km->kj", G, a) - half * lam
        gap = (a * z + b * y).max(axis=1)
        pull = 1.0 + np.abs(np.einsum("kjm,kj->km", G, lam)).max(axis=1)
        going = ~(
            (np.abs(slope).max(axis=1) < BALANCE * pull)
            & (np.abs(short).max(axis=1) < BALANCE * size)
            & (gap < GAP * pull)
        )
        if not going.any():
            return np.clip(a, 0.0, 1.0), wanted - np.einsum("kjm,km->kj", G, np.clip(a, 0.0, 1.0))
        # Newton's step for a, λ, z and y
        aim = np.where(step < 0.5, CENTERING[1], CENTERING[0])  # a long step aims nearer
        mu = aim * (a * z + b * y).mean(axis=1, keepdims=True) / 2.0
        D = 6.0 * a + z / a + y / b
        right = -slope + (mu / a - z) - (mu / b - y)
        S = np.einsum("kjm,km,kim->kji", G, 1.0 / D, G) + half * np.eye(rows)
        d_lam = np.linalg.solve(S, (short - np.einsum("kjm,km->kj", G, right / D))[..., np.newaxis])[..., 0]
        d_a = (right + np.einsum("kjm,kj->km", G, d_lam)) / D
        d_z, d_y = mu / a - z - z / a * d_a, mu / b - y + y / b * d_a
        # as far as a, 1 − a, z and y stay positive
        far = np.minimum(_reach(a, d_a), _reach(b, -d_a))[:, np.newaxis]
        high = np.minimum(_reach(z, d_z), _reach(y, d_y))[:, np.newaxis]
        step = np.where(going[:, np.newaxis], np.minimum(far, high), 0.0)
        a, b, lam = a + step * d_a, b - step * d_a, lam + step * d_lam
        z, y = z + step * d_z, y + step * d_y
    worst = int(np.argmax(going))
    raise SimulationError(
        f"static optimization at t = {time[worst]:.6g} s found no optimum in {MAX_ITERATIONS} steps; a larger reserve= "
        "may help"
    )


def _reach(values: Matrix, change: Matrix) -> Vector:
    """The largest part of a step, up to 1, that leaves values positive (R,)."""
    room = np.where(change < 0.0, -values / np.where(change < 0.0, change, -1.0), np.inf)
    return np.asarray(np.minimum(1.0, 0.995 * room.min(axis=1)))  # not quite to the nearest bound
