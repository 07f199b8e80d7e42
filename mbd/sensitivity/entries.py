"""What the kernel of derivatives is called with: sizes, entries of programs in a mode, room to work in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.compile.backend import Function
from mbd.sensitivity.kernel.sizes import COLUMNS, PARTS, ROWS, WIDTH
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.programs import Programs

__all__ = ["Integers", "System", "padded", "system"]

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class System:
    """A program in a mode.

    sizes : see `mbd.sensitivity.kernel.sizes`; rows : numbers of the m rows, fast : 1 for those on velocities
    held : 1 for each of all rows that acts
    entries : see there
    """

    function: Function
    sizes: Integers
    rows: Integers
    fast: Integers
    held: Vector
    entries: Integers
    outputs: int

    def of_width(self, width: int) -> Integers:
        """Sizes for so many directions."""
        found = self.sizes.copy()
        found[WIDTH] = padded(width)
        return found


def padded(width: int) -> int:
    """The next multiple of four."""
    return -(-width // 4) * 4


def system(programs: Programs, name: str, mode: Mode, stabilized: bool) -> System:
    """The program `name` ('steps' or 'consistent') in a mode."""
    known, key = programs.sparse(name).systems, (mode.rows, mode.held, stabilized)
    found: System | None = known.get(key)
    if found is None:
        found = known[key] = _made(programs, name, mode, stabilized)
    return found


def _made(programs: Programs, name: str, mode: Mode, stabilized: bool) -> System:
    c, layout, program = programs.columns, programs.layout, programs.sparse(name)
    n, m, R, rows = c.n, len(mode.rows), c.rows, np.array(mode.rows, dtype=np.int64)
    local = np.full(R, -1)
    local[rows] = np.arange(m)
    own = np.concatenate([np.arange(c.n_v + 2 * n), c.n_v + 2 * n + local, c.n_v + 2 * n + m + np.arange(c.count)])
    own[c.lam] = np.where(local >= 0, c.n_v + 2 * n + local, -1)
    own[c.lam.stop : c.count] = c.n_v + 2 * n + m + np.arange(c.count - c.lam.stop)
    lines = np.concatenate([np.arange(n), *_lines(name, n, m, local)])
    equation, column = lines[program.lines], own[program.columns]
    target, near = _targets(programs, name, mode, stabilized)
    kept = np.flatnonzero((equation >= 0) & (column >= 0))
    entries = np.zeros((len(kept), PARTS), dtype=np.int64)
    size = len(lines)
    parts = equation[kept], column[kept], size + kept, target[equation[kept]], near[equation[kept]]
    for k, part in enumerate(parts):
        entries[:, k] = part
    held = np.zeros(R)
    held[list(mode.held)] = 1.0
    charts, bases = programs.charts.groups, c.base.start - R + m
    sizes = np.array([
        n, c.n_v, layout.n_q, R, m, 0, len(kept), c.count - R + m, int(stabilized), layout.q, layout.v, layout.a,
        layout.lam, layout.x if charts else layout.q, bases, len(charts),
        *(number for each in charts for number in (each.first, each.size)),
    ], dtype=np.int64)  # fmt: skip
    return System(
        program.function, sizes, rows, _fast(programs, mode), held, entries.ravel(), size + len(program.lines)
    )


def _lines(name: str, n: int, m: int, local: Integers) -> list[Integers]:
    """Equations of the values of a program behind the balance."""
    first = np.where(local >= 0, n + local, -1)
    return [first] if name == "consistent" else [np.where(local >= 0, n + m + local, -1), first]


def _fast(programs: Programs, mode: Mode) -> Integers:
    return np.array([programs.equations.rows[k].is_velocity for k in mode.rows], dtype=np.int64)


def _targets(programs: Programs, name: str, mode: Mode, stabilized: bool) -> tuple[Integers, Integers]:
    """Where each equation stands in the system of unknowns, and in that of position corrections."""
    n, m = programs.columns.n, len(mode.rows)
    fast = _fast(programs, mode) == 1
    place, none = np.arange(m), np.full(m, -1)
    near = np.full(n + 2 * m, -1)
    if name == "consistent":
        return np.concatenate([np.arange(n), n + place, none]), near
    if not (stabilized and m):
        levels = [np.where(fast, n + place, -1), np.where(fast, -1, n + place)]
        return np.concatenate([np.arange(n), *levels]), near
    near[:n] = n + m + np.arange(n)
    last = 2 * n + m + place
    near[n : n + m] = np.where(fast, last, -1)
    return np.concatenate([np.arange(n), n + place, np.where(fast, -1, last)]), near


def stacked(motion: Motion, system: System) -> Vector:
    """Derivatives of a state by the columns of the system, with zeros up to its width."""
    tangent, sizes = motion.tangent, system.sizes
    n, m, n_v = int(sizes[0]), int(sizes[ROWS]), len(tangent.q)
    first = n_v + 2 * n + m
    last = first + 1 + len(tangent.anchors) + len(tangent.p)
    out = np.zeros((int(sizes[COLUMNS]), padded(len(tangent.t))))
    width = len(tangent.t)
    out[:n_v, :width], out[n_v : n_v + n, :width] = tangent.q, tangent.y
    out[first, :width] = tangent.t
    out[first + 1 : first + 1 + len(tangent.anchors), :width] = tangent.anchors
    out[first + 1 + len(tangent.anchors) : last, :width] = tangent.p
    return out
