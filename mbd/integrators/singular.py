"""How many steps off a singular configuration is: the readable twin of `mbd.kernel.singular.newmark_step`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.kernel.column_weights import LEAST_INERTIA
from mbd.kernel.singular.newmark_step import CONTINUOUS, FORESEEN, NEAREST, VANISHING, WITHIN
from mbd.kernel.singular.step_pairs import WHOLE, is_of_pair

__all__ = ["CONTINUOUS", "WHOLE", "WITHIN", "Distance", "counted_inertia", "distance_to_singularity"]

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Distance:
    """Steps until the constraint Jacobian loses rank, and what round-off makes of velocities there, over the speed."""

    steps: float
    kick: float

    def too_close(self, tolerance: float, near: bool, size: float) -> bool:
        """Whether a step of `size` dt, or whole ones after it, would end where round-off makes more of velocities."""
        if near:
            return self.steps < NEAREST and self.kick > tolerance
        if self.steps < 1.0 or self.steps >= WITHIN + 1.0 or is_of_pair(size):
            return False
        part = self.steps % 1.0
        part = min(part, 1.0 - part)
        foreseen = self.steps >= WITHIN - FORESEEN and abs(size - 1.0) <= WHOLE
        doubt = FORESEEN - NEAREST if foreseen else 0.0
        return part < NEAREST + doubt and self.kick * self.steps > tolerance * max(part - doubt, 1e-3)


def distance_to_singularity(B: Matrix, turning: Matrix, mass: Vector, v: Vector, scale: Vector, dt: float) -> Distance:
    """How far the nearest row is from depending on others, over what a step changes of that.

    B : (m, n_v) rows; turning : (m, n_v) their rates; mass : (n_v,) weights of the coordinates; v : (n_v,)
    scale : (m,) magnitudes of the rows' terms
    """
    weight = 1.0 / np.sqrt(np.where(mass > 0.0, mass, 1.0))
    rows, turns = B * weight, turning * weight
    lengths = np.linalg.norm(rows, axis=1) + dt * np.linalg.norm(turns, axis=1) + 1e-300
    order, here = _pivoted_gram_norms(rows / lengths[:, None], None)
    around = [_pivoted_gram_norms((rows + ahead * turns) / lengths[:, None], order)[1] for ahead in (-dt, dt)]
    change = np.max([np.abs(left - here) for left in around], axis=0)
    steps = here / (change + 1e-300)
    k, near = int(np.argmin(steps)), float(np.min(steps))
    if NEAREST < near < WITHIN + 2.0:  # a row that turns with others changes but does not vanish
        there = [
            _pivoted_gram_norms((rows + ahead * turns) / lengths[:, None], order)[1][k]
            for ahead in (-near * dt, near * dt)
        ]
        if min(there) > VANISHING * here[k]:
            return Distance(1e300, 0.0)
    across = 4.0 * EPS * scale[order[k]] / (here[k] * lengths[order[k]] + 1e-300)
    return Distance(float(steps[k]), float(across / (dt * np.sqrt(mass @ v**2) + 1e-300)))


def counted_inertia(mass: Vector, angles: Any) -> Vector:
    """Inertias (n_v,), each at least a share of the largest of its unit: see `mbd.kernel.column_weights`."""
    turns = np.zeros(len(mass), dtype=bool) if angles is None else np.asarray(angles, dtype=bool)
    least = [LEAST_INERTIA * np.max(mass[unit], initial=0.0) for unit in (~turns, turns)]
    return np.asarray(np.maximum(mass, np.where(turns, least[1], least[0])))


def _pivoted_gram_norms(rows: Matrix, order: list[int] | None) -> tuple[list[int], Vector]:
    """Lengths of rows less their parts along earlier ones; the longest remaining first, or in a given order."""
    rows, taken, left = rows.copy(), list[int](), list[float]()
    for place in range(len(rows)):
        sizes = np.linalg.norm(rows, axis=1)
        sizes[taken] = -1.0
        k = int(np.argmax(sizes)) if order is None else order[place]
        taken.append(k)
        left.append(float(sizes[k]))
        along = rows[k] / (sizes[k] + 1e-300)
        others = [other for other in range(len(rows)) if other not in taken]
        rows[others] -= np.outer(rows[others] @ along, along)
    return taken, np.array(left)
