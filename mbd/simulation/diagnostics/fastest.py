"""The fastest motion of a mechanism, and the steps that it needs."""

from collections.abc import Iterable

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.constraints.penalty_parameters import STEPS_OF_APPROACH
from mbd.dataclass import dataclass
from mbd.integrators.base import Point
from mbd.results.record import Record
from mbd.simulation.run.data import RunData

MAX_UNKNOWNS = 40
"""Coordinates and states above which the tangents take too long to derive and compile for a sentence [-]."""


def fastest(run: RunData, record: Record, rows: Iterable[int]) -> float:
    """Largest |s| of the small motions ``exp(s t)`` about some of a run's rows [1/s]; 0 if not to be determined.

    Of ``M δv̇ + C δv + K δq = 0`` along the rows that hold: ``ω = √(k/m)`` of a spring, ``c/m`` of a strong damper.
    """
    top = 0.0
    with np.errstate(all="ignore"):
        for row in sorted(set(rows)):
            top = max(top, _at(run, record, row))
    return top


@dataclass(frozen=True)
class Matrices:
    """M, C, K (n, n): derivatives of the balance by rates, velocities and positions; B (m, n) of the rows that hold."""

    M: Matrix
    C: Matrix
    K: Matrix
    B: Matrix


def matrices(run: RunData, record: Record, row: int) -> Matrices | None:
    """Those at a row of a run; None where they cannot be evaluated, or are too large to derive them for this alone."""
    system = run.stepper.system
    if run.kernel.n > MAX_UNKNOWNS:
        return None
    mode = run.manager.mode(record.closed[row])
    active = list(system.active(mode)[0])
    y, rate = np.concatenate([record.v[row], record.z[row]]), np.concatenate([record.a[row], record.s[row]])
    point = Point(float(record.time[row]), record.q[row], np.zeros(system.n_v), y, rate, record.lam[row][active])
    try:
        once, twice, full = (system.evaluate(point, mode, factors) for factors in ((1.0, 0.0), (2.0, 0.0), (1.0, 1.0)))
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    S1, S2, S3 = (np.asarray(terms.S) for terms in (once, twice, full))
    B: Matrix = np.zeros((0, len(y))) if once.H is None else np.asarray(once.H)
    found = Matrices(2.0 * S1 - S2, S2 - S1, S3 - S1, B)
    return found if all(np.isfinite(each).all() for each in (found.M, found.C, found.K, B)) else None


def free_motions(B: Matrix, n: int) -> Matrix:
    """(n, f) orthonormal velocities that the rows B (m, n) leave free."""
    if not len(B):
        return np.eye(n)
    _, sizes, right = np.linalg.svd(B)
    return np.asarray(right[int(np.sum(sizes > 1e-9 * max(sizes[0], 1e-300))) :].T)


def _at(run: RunData, record: Record, row: int) -> float:
    """Spectral radius of the state matrix of M, C, K on the motions that the rows leave free."""
    found = matrices(run, record, row)
    if found is None:
        return 0.0
    free, n_v = free_motions(found.B, len(found.M)), run.kernel.n_v
    if not free.size:
        return 0.0
    try:
        forces = np.hstack([free.T @ found.K[:, :n_v] @ free[:n_v], free.T @ found.C @ free])
        rates = -np.linalg.solve(free.T @ found.M @ free, forces)
    except np.linalg.LinAlgError:
        return 0.0
    n = len(rates)
    A = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), rates])
    return float(np.max(np.abs(np.linalg.eigvals(A)))) if np.isfinite(A).all() else 0.0


def resolving_dt(rate: float) -> float:
    """A fifth of a quarter period, ``π/(10 ω)`` [s]: what `mbd.penalty_parameters` gives for an impact without loss."""
    return float(np.pi / 2.0 / rate / STEPS_OF_APPROACH)


def sane_rows(run: RunData) -> list[int]:
    """Some rows until speeds have grown absurdly, or the energy is the scheme's own."""
    n_q, n_v = run.kernel.n_q, run.kernel.n_v
    speeds: Vector = np.max(np.abs(run.table[: run.stored, 1 + n_q : 1 + n_q + n_v]), axis=1, initial=0.0)
    early = speeds[: max(2, len(speeds) // 100)]
    # states that grow so much are no longer ones of the mechanism
    wild = np.flatnonzero(~(speeds <= 1e6 * max(1e-3, float(early[0]) if len(early) else 0.0)))
    last = int(wild[0]) if len(wild) else len(speeds)
    last = min(last, run.energy.row) if run.energy.row > 0 else last
    return sorted(set(np.linspace(0, last - 1, 6).astype(int).tolist())) if last > 0 else []


def stability(run: RunData, record: Record) -> str:
    """What bounds dt, where an explicit scheme took steps above its limit of stability; '' elsewhere."""
    if not run.kernel.explicit or run.kernel.adaptive or run.kernel.mode_id < 0:
        return ""
    if run.kernel.n > MAX_UNKNOWNS:
        return "; steps of an explicit scheme may be above its limit of stability: try dt/4, tol=, or mbd.RadauIIA()"
    rate = fastest(run, record, sane_rows(run))
    if rate * run.dt <= run.stepper.own.abilities.stability:
        return ""
    return (
        f"; its fastest motion has {rate:.3g} rad/s, where an explicit scheme is stable for dt below "
        f"{run.stepper.own.abilities.stability / rate:.2g} s only: use less, tol=, or mbd.RadauIIA()"
    )
