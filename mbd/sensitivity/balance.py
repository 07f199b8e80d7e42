"""Consistent accelerations, velocities on the rows, impacts: linear systems of one state and their derivatives.

Each is differentiated as the implicit function that it is: ``[M R; B 0] δu = −(∂/∂(t, q, v, anchors, p))``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.sensitivity.entries import stacked, system
from mbd.sensitivity.kernel import balance as kernel
from mbd.sensitivity.kernel.balance import MOST, SETTLED
from mbd.sensitivity.kernel.build import entry
from mbd.sensitivity.motion import Mode, Motion, Rates, solved
from mbd.sensitivity.programs import Programs, paired

__all__ = ["Impact", "consistent_rates", "impact", "independent", "on_rows", "pushed"]


def consistent_rates(programs: Programs, motion: Motion, mode: Mode, guess: Rates) -> Rates:
    """Rates and multipliers with ``r = 0`` and ``ḧ = 0``, and their derivatives.

    guess : near them
    """
    known = system(programs, "consistent", mode, False)
    n, m, size = programs.columns.n, len(mode.rows), programs.layout.size
    block, Z = np.zeros(size), stacked(motion, known)
    programs.fill(block, motion.at(mode, guess.rate, guess.lam))
    B = np.empty((n + m, Z.shape[1]))
    singular = entry(kernel.consistent_rates)(
        [known.function], programs.values, known.of_width(Z.shape[1]), known.rows, known.entries, block,
        np.empty(known.outputs), Z, np.empty((n + m) ** 2), B, np.empty(n + m), np.empty(n + m, dtype=np.int64),
    )  # fmt: skip
    if singular:
        return least_rates(programs, motion, mode, guess)
    lam, of_lam = guess.lam.copy(), np.zeros((programs.columns.rows, len(motion.tangent.t)))
    first, last = programs.layout.lam, programs.layout.a
    lam[known.rows] = block[first + known.rows]
    of_lam[known.rows] = B[n:, : len(motion.tangent.t)]
    return Rates(block[last : last + n], lam, B[:n, : len(motion.tangent.t)], of_lam)


def least_rates(programs: Programs, motion: Motion, mode: Mode, guess: Rates) -> Rates:
    """The same with least solutions where the matrix is singular."""
    c, n, rows = programs.columns, programs.columns.n, list(mode.rows)
    rate, lam = guess.rate.copy(), guess.lam.copy()
    for _ in range(MOST):
        r, change, of_r, of_change = programs.consistent(motion.at(mode, rate, lam))
        A = saddle(of_r, of_change[rows], of_change[rows][:, c.rate], programs, rows)
        step = solved(A, -np.concatenate([r, change[rows]]))
        rate, lam[rows] = rate + step[:n], lam[rows] + step[n:]
        if np.max(np.abs(step), initial=0.0) <= SETTLED * np.max(np.abs([*rate, *lam, 1.0])):
            break
    Z = motion.tangent.stacked(c)
    found = -solved(A, np.vstack([of_r @ Z, of_change[rows] @ Z]))
    of_lam = np.zeros((c.rows, Z.shape[1]))
    of_lam[rows] = found[n:]
    return Rates(rate, lam, found[:n], of_lam)


def pushed(programs: Programs, motion: Motion, mode: Mode, rates: Rates) -> float:
    """The largest rate that the multipliers alone would make."""
    c = programs.columns
    of_r = programs.consistent(motion.at(mode, rates.rate, rates.lam))[2]
    active = motion.at(mode, rates.rate, rates.lam).lam
    return float(np.max(np.abs(solved(of_r[:, c.rate], of_r[:, c.lam] @ active)), initial=0.0))


def saddle(of_r: Matrix, of_row: Matrix, B: Matrix, programs: Programs, rows: Sequence[int]) -> Matrix:
    """``[M R; B 0]``."""
    c, m = programs.columns, len(rows)
    R = of_r[:, c.lam][:, list(rows)]
    return np.block([[of_r[:, c.rate], R], [B, np.zeros((m, m))]])


def independent(programs: Programs, motion: Motion, mode: Mode, rate: Vector, lam: Vector) -> Mode:
    """The mode with only those of its rows that do not depend on earlier ones to be solved for."""
    if not mode.held:
        return mode
    c = programs.columns
    B = programs.consistent(motion.at(mode, rate, lam))[3][:, c.rate]
    kept: list[int] = []
    basis: list[Vector] = []
    for row in mode.held:
        line = B[row] / max(float(np.linalg.norm(B[row])), 1e-300)
        for _ in range(2):
            for known in basis:
                line = line - (known @ line) * known
        left = float(np.linalg.norm(line))
        if left > 1e-9:
            kept.append(row)
            basis.append(line / left)
    return replace(mode, rows=tuple(kept))


def on_rows(programs: Programs, motion: Motion, mode: Mode, y: Vector, of_y: Matrix) -> Motion:
    """The motion with the nearest velocities to y, in the metric of M, that the rows allow.

    ``M (v − y) + R κ = 0``, ``ḣ(v) = 0``; of_y (n, D) are the derivatives of y.
    """
    c, n, rows = programs.columns, programs.columns.n, list(mode.rows)
    if not rows:
        return replace(motion, y=y).with_tangent(y=of_y)
    zero = np.zeros(n), np.zeros(c.rows)
    still = replace(motion, y=y)
    _, _, rate, of_r, _, of_rate = programs.steps(still.at(mode, *zero))
    A = saddle(of_r, of_rate[rows], of_rate[rows][:, c.y], programs, rows)
    found = solved(A, np.concatenate([np.zeros(n), -rate[rows]]))
    jump, kappa = found[:n], np.zeros(c.rows)
    kappa[rows] = found[n:]
    moved = replace(motion, y=y + jump)
    Z = moved.with_tangent(y=np.zeros_like(of_y)).tangent.stacked(c)
    loaded = programs.steps(moved.at(mode, jump, kappa))
    if any(mode.slip[f] != 0.0 for f in paired(programs.equations)):  # R is that of y, whose direction forces have
        here = still.with_tangent(y=of_y).tangent.stacked(c)
        forces = (programs.steps(still.at(mode, jump, kappa))[3] - of_r) @ here - of_r[:, c.rate] @ of_y
    else:
        bare = programs.steps(moved.at(mode, *zero))
        forces = (loaded[3] - bare[3]) @ Z - of_r[:, c.rate] @ of_y
    after = -solved(A, np.vstack([forces, loaded[5][rows] @ Z]))[:n]
    return moved.with_tangent(y=after)


@dataclass(frozen=True)
class Impact:
    """An impact as it happened.

    rows : numbers of the rows with impulses
    restitution : e by the number of each normal row that closes
    slip : signs of the frictions that slide in it; 1 of those in a plane in space, opposite to the velocity after it
    misfit : by how much the velocities after it, and the sum of impulses, are off, relative to their sizes [-]
    """

    rows: tuple[int, ...]
    restitution: Mapping[int, float]
    slip: Vector
    misfit: float = 0.0


def impact(
    programs: Programs, before: Motion, after: Vector, mode: Mode, what: Impact, of_e: Mapping[int, Vector]
) -> tuple[Motion, Impact]:
    """The motion after an impact with the velocities `after` (n,), and how well its law accounts for these.

    of_e : rates (D,) of the restitutions of rows, by their numbers

    ``M (v⁺ − v⁻) + R Λ = 0``, ``ḣ(v⁺) + e ḣ(v⁻) = 0`` of the rows that take part.
    """
    c, n, rows = programs.columns, programs.columns.n, list(what.rows)
    mode = replace(mode, rows=what.rows, held=what.rows, slip=what.slip)
    zero = np.zeros(n), np.zeros(c.rows)
    jump, later = after - before.y, replace(before, y=after)
    _, _, speed0, bare0, _, of_speed0 = programs.steps(before.at(mode, *zero))
    M, R = bare0[:, c.rate], bare0[:, c.lam][:, rows]
    impulse = np.zeros(c.rows)
    sliding = [f for f in paired(programs.equations) if what.slip[f] != 0.0]
    if sliding:  # the direction of their forces is that of the velocity after it
        R = programs.steps(later.at(mode, *zero))[3][:, c.lam][:, rows]
    impulse[rows] = np.linalg.lstsq(R, -M @ jump, rcond=None)[0] if rows else 0.0
    _, _, speed1, loaded, _, of_speed1 = programs.steps(later.at(mode, jump, impulse))
    bare = programs.steps(later.at(mode, *zero))[3]
    e = np.array([what.restitution.get(row, 0.0) for row in rows])
    size = np.max(np.abs(of_speed1[rows][:, c.y]) @ np.abs([*before.y]), initial=1e-300)
    off = np.max(np.abs(speed1[rows] + e * speed0[rows]), initial=0.0) / size
    left = M @ jump + R @ impulse[rows]
    misfit = max(off, float(np.max(np.abs(left)) / max(float(np.max(np.abs(M) @ np.abs(jump))), 1e-300)))
    A = saddle(loaded, of_speed1[rows], of_speed1[rows][:, c.y], programs, rows)
    if sliding:
        A[:n, :n] += (loaded - bare)[:, c.y]
    Z = before.tangent.stacked(c)
    still = before.with_tangent(y=np.zeros_like(before.tangent.y)).tangent.stacked(c)
    forces = (loaded - bare) @ still
    if any(what.slip[f] != 0.0 and each.falls for f, each in enumerate(programs.equations.frictions)):
        forces = (programs.steps(before.at(mode, jump, impulse))[3] - bare0) @ Z  # their size is that of v⁻
    right = [forces - M @ before.tangent.y]
    right.append(of_speed1[rows] @ still + e[:, np.newaxis] * (of_speed0[rows] @ Z))
    for k, row in enumerate(rows):
        if row in of_e and row in what.restitution:
            right[1][k] += of_e[row] * speed0[row]
    found = -solved(A, np.vstack(right))
    return later.with_tangent(y=found[:n]), replace(what, misfit=float(misfit))
