"""Coefficients of explicit Runge–Kutta formulas, with embedded estimates of their errors."""

from collections.abc import Mapping

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Tableau:
    """An explicit formula of s stages; the slope after the last one is that at the end of the step.

    weights : a (s, s), of slope j in stage i; end : b (s,); nodes : c (s,), where stages lie in the step
    error : weights of all slopes (s + 1,) in the estimated error; second : of another one that it is weighed with, or 0
    """

    weights: Matrix
    end: Vector
    nodes: Vector
    error: Vector
    second: Vector

    @property
    def stages(self) -> int:
        """s, the end of the step not counted."""
        return len(self.nodes)

    def flat(self) -> Vector:
        """What the kernel needs, one after the other: a, b, c, the error, the second one; a² and b a, of positions."""
        twice = np.vstack([self.weights, self.end]) @ self.weights
        return np.concatenate([self.weights.ravel(), self.end, self.nodes, self.error, self.second, twice.ravel()])


def weights_at(stages: int, entries: Mapping[tuple[int, int], float]) -> Matrix:
    """a (s, s) of its entries that are other than zero."""
    found = np.zeros((stages, stages))
    for place, value in entries.items():
        found[place] = value
    return found


FOURTH_ORDER = Tableau(
    weights_at(4, {(1, 0): 0.5, (2, 1): 0.5, (3, 2): 1.0}),
    np.array([1.0, 2.0, 2.0, 1.0]) / 6.0,
    np.array([0.0, 0.5, 0.5, 1.0]),
    np.array([0.0, 0.0, 0.0, 1.0, -1.0]) / 6.0,
    np.zeros(5),
)
"""Four stages, and the slope at the end; see `mbd.kernel.schemes.runge_kutta_4`."""
