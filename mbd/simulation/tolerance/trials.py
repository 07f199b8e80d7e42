"""One trial run of a calibration, and what it tells by itself."""

import numpy as np

from mbd.dataclass import dataclass
from mbd.results.trajectory import Trajectory
from mbd.simulation.run.data import RunData
from mbd.simulation.run.room import Room
from mbd.simulation.tolerance.comparison import Gap

EPS = float(np.finfo(float).eps)
INSTANT_TOLERANCE = 0.1
"""How far apart instants of two runs may be, over their mean step, where their steps are the same [-]."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A run with a local error of `allowed` [m/s, rad/s]; `error` is the estimate of its global one [m, rad].

    finest : whether no finer run has checked it; widest : whether its steps may be as long as they ever may
    """

    allowed: float
    run: Trajectory
    problem: str
    source: RunData
    room: Room
    error: float = np.inf
    gap: Gap | None = None
    finest: bool = False
    widest: bool = False

    @property
    def spent(self) -> float:
        """Sum of the local errors [m, rad]."""
        return float(self.run.stats["local_errors"])

    @property
    def is_stretched(self) -> bool:
        """Whether half of its time or more passes in steps of the longest size."""
        steps = np.diff(self.run.time)
        long = steps > (1.0 - INSTANT_TOLERANCE) * self.run.settings["longest"]
        return bool(2.0 * np.sum(steps[long]) > 0.99 * np.sum(steps))  # two of a quarter are half the run

    @property
    def growth(self) -> float:
        """Global error of coordinates over the sum of local errors [-]; forces of drives have no part in it."""
        gap = self.gap
        error = self.error * (gap.moved / gap.size if gap is not None and gap.size > gap.moved > 0.0 else 1.0)
        return error / self.spent if self.spent > 0.0 else np.nan


def least_error(trial: Trial, other: Trial, names: tuple[str, ...] = ()) -> float:
    """Error by round-off: of the largest coordinate in each step, grown as local errors did in another run.

    The growth from coordinates to named results, of other units, may be anything; these are rounded themselves too.
    """
    growth = other.growth if np.isfinite(other.growth) else 1.0
    if names:
        return growth * rounding(trial) * float(trial.run.stats["steps"]) + rounding(trial, names)
    return max(growth, 1.0) * rounding(trial) * float(trial.run.stats["steps"])


def rounding(trial: Trial, names: tuple[str, ...] = ()) -> float:
    """Round-off of the largest coordinate [m, rad], or of the largest of the results named."""
    if names:
        return EPS * max(float(np.max(np.abs(trial.run[name]), initial=0.0)) for name in names)
    return EPS * float(np.max(np.abs(trial.run.record.q), initial=0.0))


def is_rounding(trial: Trial) -> bool:
    """Whether the local errors of a run are round-off."""
    return trial.spent <= rounding(trial) * float(trial.run.stats["steps"])


def same_steps(one: Trial, other: Trial) -> bool:
    """Whether two runs took about the same steps, so that they have about the same error."""
    first, second = one.run.time, other.run.time
    if len(first) != len(second):
        return False
    return bool(np.max(np.abs(first - second), initial=0.0) <= INSTANT_TOLERANCE * (first[-1] - first[0]) / len(first))
