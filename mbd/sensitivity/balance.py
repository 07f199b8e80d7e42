"""Linear systems of one state: rows that do not depend on others, and the matrix ``[M R; B 0]``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.sensitivity.motion import Mode, Motion
from mbd.sensitivity.programs import Programs

__all__ = ["independent", "saddle"]


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
