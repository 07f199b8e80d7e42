"""Steps of the Newmark family by the kernel of derivatives (`mbd.sensitivity.kernel.newmark`)."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.sensitivity.entries import System, stacked, system
from mbd.sensitivity.kernel.build import entry
from mbd.sensitivity.kernel.newmark import newmark_steps
from mbd.sensitivity.kernel.newmark_end import newmark_end
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.newmark import NewmarkSteps
from mbd.sensitivity.run_data import Rows
from mbd.sensitivity.schemes import Memory

__all__ = ["ended", "taken"]


def taken(
    steps: NewmarkSteps, motion: Motion, memory: Memory, mode: Mode, rows: Rows, dh: Vector
) -> tuple[int, Motion, Memory]:
    """As many of the steps between these rows as are steps of the scheme from here; the state and memory after them.

    dh (D,) : derivatives of the size of each. A step whose matrices are singular is left to `NewmarkSteps.step`.
    """
    programs = steps.programs
    known = system(programs, "steps", mode, steps.stabilized)
    time, q, y, rate, lam = (np.ascontiguousarray(each) for each in rows)
    n, n_v, m = programs.columns.n, programs.columns.n_v, len(mode.rows)
    sizes, width = known.of_width(len(dh)), len(dh)
    Z = stacked(motion, known)
    w, twofold = Z.shape[1], bool(steps.stabilized and m)
    size = (2 if twofold else 1) * (n + m)
    block = np.zeros((2, programs.layout.size))
    programs.fill(block, motion.at(mode, rate[0], lam[0]))
    numbers = np.array([steps.alpha_m, steps.alpha_f, steps.beta, steps.gamma, steps.full, 1.0])
    memories, X = _numbers(memory, n_v), _derivatives(memory, twofold, known, n_v, w)
    by_size = np.zeros(w)
    by_size[:width] = dh
    done = entry(newmark_steps)(
        [known.function, *programs.charts.programs()],
        programs.values, sizes, numbers, len(time) - 1, time, q, y, rate, lam * known.held,
        known.rows, known.entries, block[0], block[1], np.empty(known.outputs), np.empty(known.outputs), memories, X, Z,
        Z.copy(), by_size, np.empty(size * size), np.empty(size * w), np.empty((n + m) ** 2), np.empty(n + m),
        np.empty(size, dtype=np.int64), np.empty(4 * n + 2 * m), *programs.charts.room(w),
    )  # fmt: skip
    if done == 0 or done == -1:
        return 0, motion, memory
    if done < 0:
        first: Rows = (rows[0][:-done], rows[1][:-done], rows[2][:-done], rows[3][:-done], rows[4][:-done])
        return taken(steps, motion, memory, mode, first, dh)
    tangent = replace(motion.tangent, t=Z[n_v + 2 * n + m, :width], q=Z[:n_v, :width], y=Z[n_v : n_v + n, :width])
    end = Motion(float(time[done]), q[done].copy(), y[done].copy(), motion.anchors, tangent)
    return done, end, _memory(rate[done].copy(), np.array(rows[4][done]), memories, X[:, :width], known, twofold)


def ended(steps: NewmarkSteps, motion: Motion, memory: Memory, mode: Mode, time: float, guess: Rates) -> Rows | None:
    """Two rows: this one, and the end of a step of any size from it, solved for from rates and multipliers near those.

    None where its equations are singular.
    """
    programs = steps.programs
    known = system(programs, "steps", mode, steps.stabilized)
    n, n_v, m = programs.columns.n, programs.columns.n_v, len(mode.rows)
    rows = (
        np.array([motion.t, time]), np.array([motion.q, motion.q]), np.array([motion.y, motion.y]),
        np.array([memory.rates.rate, guess.rate]), np.array([memory.rates.lam, guess.lam]) * known.held,
    )  # fmt: skip
    block = np.zeros((2, programs.layout.size))
    programs.fill(block, motion.at(mode, guess.rate, guess.lam))
    numbers = np.array([steps.alpha_m, steps.alpha_f, steps.beta, steps.gamma, steps.full, 1.0])
    singular = entry(newmark_end)(
        [known.function, *programs.charts.programs()],
        programs.values, known.sizes, numbers, *rows, known.rows, known.fast, known.entries, block[0],
        block[1], np.empty(known.outputs), _numbers(memory, n_v), np.empty((n + m) ** 2), np.empty((n + m) ** 2),
        np.empty(n + m), np.empty(2 * n_v), np.empty(n + m, dtype=np.int64), np.empty(n + m, dtype=np.int64),
        np.empty(4 * n + 2 * m), *programs.charts.room(4)[:2],
    )  # fmt: skip
    return None if singular else rows


def _numbers(memory: Memory, n_v: int) -> Vector:
    """What the scheme remembers, as `newmark_steps` takes it."""
    n, rows = len(memory.aux), len(memory.rates.lam)
    parts = (memory.slope, n), (memory.lam_slope, rows), (memory.shift, n_v), (memory.shift_change, n_v)
    known = [np.zeros(size) if part is None else part for part, size in parts]
    return np.concatenate([memory.aux, *known, [memory.step]])


def _derivatives(memory: Memory, twofold: bool, known: System, n_v: int, w: int) -> Matrix:
    """Its derivatives, as `newmark_steps` takes them."""
    n, rows = len(memory.aux), known.rows
    of_lam, slope = memory.rates.of_lam, memory.of_lam_slope
    parts: list[tuple[Matrix | None, int]] = [(memory.rates.of_rate, n), (memory.of_aux, n)]
    if twofold:
        parts += [(memory.of_slope, n), (memory.of_shift, n_v), (memory.of_change, n_v)]
    parts.append((of_lam[rows] if len(of_lam) else None, len(rows)))
    if twofold:
        parts.append((None if slope is None else slope[rows], len(rows)))
    out, first = np.zeros((sum(size for _, size in parts), w)), 0
    for part, size in parts:
        if part is not None:
            out[first : first + size, : part.shape[1]] = part
        first += size
    return out


def _memory(rate: Vector, lam: Vector, numbers: Vector, X: Matrix, known: System, twofold: bool) -> Memory:
    """What the scheme remembers, from the arrays of `newmark_steps`."""
    n, n_v, rows = len(rate), int(known.sizes[1]), len(lam)
    at = np.cumsum([0, n, n, rows, n_v, n_v])
    aux, slope, lam_slope, shift, change = (numbers[a:b].copy() for a, b in pairwise(at))

    def spread(first: int) -> Matrix:
        out = np.zeros((rows, X.shape[1]))
        out[known.rows] = X[first : first + len(known.rows)]
        return out

    of_rate, of_aux, step = X[:n], X[n : 2 * n], float(numbers[-1])
    if not twofold:
        return Memory(Rates(rate, lam, of_rate, spread(2 * n)), aux, of_aux, step, slope, lam_slope, shift, change)
    last = 3 * n + 2 * n_v
    return Memory(
        Rates(rate, lam, of_rate, spread(last)), aux, of_aux, step, slope, lam_slope, shift, change, X[2 * n : 3 * n],
        X[3 * n : 3 * n + n_v], X[3 * n + n_v : last], spread(last + len(known.rows)),
    )  # fmt: skip
