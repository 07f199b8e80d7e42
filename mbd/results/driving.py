"""What a tolerance holds for where drives prescribe a motion: their forces and torques, beside the coordinates.

Coordinates that rows with explicit time determine are right in steps of any size, so that their errors say nothing of
the accelerations and multipliers, which are what is left to be solved for (inverse dynamics). The error of a drive is
told over the forces of the motion,

``e_k = max |λ_k − λ'_k| / F``,  F the largest |λ| of all drives of its unit in the run,

but no less than `FORCE_RTOL` of ``|B_k| (|M a| + |f| + |R λ|) / B_k²``, the terms that cancel in it, and of
``m_k / T²``, the force that moves its inertia ``m_k = |B_k| |M| |B_k| / (B_k²)²`` by 1 m or 1 rad in the length T of
the run. A drive that needs no force at all is right within that.
"""

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equal import EQUAL_RTOL
from mbd.equations.equations import Equations, Row
from mbd.results.balance import MAX_SAMPLES, Balance
from mbd.results.columns import ModelColumns
from mbd.results.record import Rows
from mbd.results.trajectory import Trajectory
from mbd.tape.derivatives import live, substitute

FORCE_RTOL = 1e-5
"""Force of a drive, over the terms that cancel in it, below which it is measured by these [-]."""


def driving_rows(equations: Equations) -> tuple[int, ...]:
    """Numbers of the rows whose multipliers drive the motion; () where no bilateral row depends on time.

    These are the rows that move by themselves, by the time or at a speed, and joints held at a value beside them.
    """
    known = equations.memory.get("driving rows")
    if known is None:
        with equations.tape.lock:
            timed = [k for k in equations.bilateral if _depends_on_time(equations.rows[k], equations.n_v)]
        held = [k for k in equations.bilateral if equations.rows[k].reaction == "drive"]
        known = equations.memory["driving rows"] = tuple(sorted({*timed, *held})) if timed else ()
    return known


def _depends_on_time(row: Row, n_v: int) -> bool:
    """Whether a row moves by itself: h by the time, ``B v + b`` where b, what is left of it at rest, is not zero."""
    if not row.is_velocity:
        return any(node.op == "input" and node.data[0] == "t" for node in live([row.value]))
    tape = row.rate.tape
    at_rest = substitute([row.rate], {tape.input("v", k): 0.0 for k in range(n_v)})[0]
    return not at_rest.is_zero


def drives_of(run: Trajectory) -> tuple[int, ...]:
    """The driving rows of a run; () where its equations are not there."""
    equations = run.record.equations
    return driving_rows(equations) if equations is not None and Balance.serves(equations) else ()


def share(run: Trajectory, other: Trajectory, times: Vector) -> tuple[float, str]:
    """The largest difference of a drive between two runs at these times, over the forces of the motion; whose it is."""
    drives = list(drives_of(run))
    if not drives or not len(times):
        return 0.0, ""
    columns, others = run._model_columns, other._model_columns
    places = columns.grid.places(times)
    ours, theirs = columns.between(places).lam, others.between(others.grid.places(times)).lam
    apart = np.max(np.abs(ours - theirs)[:, drives], axis=0, initial=0.0)
    return _largest(columns, drives, apart, places.lower)


def own_share(run: Trajectory) -> tuple[float, str]:
    """The same of what rows of a run differ by from the balance at their own positions and velocities.

    That is what multipliers that alternate from step to step err by. The rows are those whose multipliers bend most,
    where no event is near and all multipliers are unique.
    """
    drives = list(drives_of(run))
    if not drives or len(run.time) < 3:
        return 0.0, ""
    columns, lam = run._model_columns, run.record.lam[:, drives]
    step = np.diff(run.time)
    bent = np.max(np.abs(np.diff(lam, 2, axis=0)), axis=1, initial=0.0)
    bent[(step[1:] == 0.0) | (step[:-1] == 0.0)] = 0.0  # rows before and behind an event
    chosen = 1 + np.sort(np.argsort(-bent, kind="stable")[:64])
    rows = columns.rows.part(chosen)
    solved = columns.balance.solve(rows)
    missed = np.where((solved.sound & solved.unique)[:, None], np.abs(rows.lam - solved.lam)[:, drives], 0.0)
    return _largest(columns, drives, np.max(missed, axis=0, initial=0.0), chosen)


def _largest(columns: ModelColumns, drives: list[int], errors: Vector, chosen: NDArray[np.intp]) -> tuple[float, str]:
    """The largest of the errors over F, and the name of the drive."""
    forces = _forces(columns, drives, columns.rows.part(np.unique(chosen)))
    over = np.divide(errors, forces, out=np.where(errors > 0.0, np.inf, 0.0), where=forces > 0.0)
    worst = int(np.argmax(over))
    return float(over[worst]), columns.equations.rows[drives[worst]].owner


def _forces(columns: ModelColumns, drives: list[int], stored: Rows) -> Vector:
    """F of the module's formula for each drive [N, N m]."""
    record, rows = columns.record, columns.equations.rows
    M, f, R, B, *_ = columns.balance.terms_at(stored)
    M, along = np.abs(M), np.abs(B[:, drives])
    terms = np.einsum("kij,kj->ki", M, np.abs(np.hstack([stored.a, stored.s]))) + np.abs(f)
    terms += np.einsum("kij,kj->ki", np.abs(R), np.abs(stored.lam))
    square = np.maximum(np.einsum("kdi,kdi->kd", along, along), 1e-300)
    cancelled = np.einsum("kdi,ki->kd", along, terms) / square
    inertia = np.einsum("kdi,kij,kdj->kd", along, M, along) / square**2
    length = float(record.time[-1] - record.time[0])
    least = np.max(np.maximum(cancelled, inertia / (length * length or 1.0)), axis=0, initial=0.0)
    largest = np.max(np.abs(record.lam[:, drives]), axis=0, initial=0.0)
    units = np.array([rows[k].unit for k in drives])
    together = np.array([np.max(largest[units == unit]) for unit in units])
    return np.asarray(np.maximum(together, FORCE_RTOL * least))


def forces_told(run: Trajectory) -> str:
    """What a tolerance holds for: the forces and torques of drives, over the largest of each kind."""
    lam, rows = run.record.lam, run._model_columns.equations.rows
    largest = {"m": 0.0, "rad": 0.0}
    for k in drives_of(run):
        largest[rows[k].unit] = max(largest[rows[k].unit], float(np.max(np.abs(lam[:, k]), initial=0.0)))
    kinds = {"m": ("forces of drives over the largest", "N"), "rad": ("torques of drives over the largest", "N m")}
    parts = [f"{kinds[unit][0]} ({size:.3g} {kinds[unit][1]})" for unit, size in largest.items() if size]
    return " and ".join(parts) or "forces of drives, which are zero"


def is_wholly_driven(run: Trajectory) -> bool:
    """Whether bilateral rows leave no coordinate free, so that steps of any size have the motion."""
    equations = run.record.equations
    if equations is None or not drives_of(run):
        return False
    columns, bilateral = run._model_columns, list(equations.bilateral)
    chosen = np.unique(np.linspace(0, len(run.time) - 1, MAX_SAMPLES).astype(np.intp))
    M, _, _, B, *_ = columns.balance.terms_at(columns.rows.part(chosen))
    weight = np.sqrt(np.maximum(np.einsum("kii->ki", M), 0.0))[:, : equations.n_v]
    scaled: Matrix = B[:, bilateral, : equations.n_v] / np.where(weight > 0.0, weight, 1.0)[:, None]
    size = np.linalg.norm(scaled, axis=2, keepdims=True)
    unit = np.divide(scaled, size, out=np.zeros_like(scaled), where=size > 0.0)
    return bool(np.max(np.sum(np.linalg.svd(unit, compute_uv=False) > EQUAL_RTOL, axis=1)) == equations.n_v)
