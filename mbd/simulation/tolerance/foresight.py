"""What a tolerance will cost, foreseen from ever finer trial runs before one is made that is long.

With a scheme of order p the error of a run of N steps falls like ``E ∝ N^−p``. Of three runs, each of which allows a
tenth of the error of the one before, the differences tell E of the finest, and a run within `tol` takes
``N (E/tol)^(1/p)`` steps. The first ones are loose enough to take some 10⁴ steps. Where their errors have the size of
the motion this is too few, and finer ones follow; where errors fall faster, since steps only begin to resolve the
motion, nothing is foreseen.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mbd.simulation.tolerance.comparison import gap
from mbd.simulation.tolerance.trials import Trial

__all__ = ["MANY_ROWS", "foreseen"]

MANY_ROWS = 500_000
"""Rows that a pilot run is predicted from which looser runs are made first [-]."""
REFINEMENT = 10.0
"""What a run allows over what the next one does [-]."""
MIN_REFINEMENT = 100.0
"""The least that one allows, over what the pilot does: finer ones would take as long [-]."""
SLOWER, FASTER = 0.7, 1.5
"""Observed orders over that of the scheme between which errors have its order [-]."""
MAX_FORESEEN_RATIO = 2.0
"""Steps that are foreseen over those for which there is room from which a run is refused [-]."""


def foreseen(
    run: Callable[[float], Trial], pilot: Trial, tol: float, power: float, order: int, names: tuple[str, ...] = ()
) -> tuple[list[Trial], str]:
    """Loose runs, and why the tolerance is out of reach, in steps, seconds and bytes: '' if it is not, or not foreseen.

    Parameters
    ----------
    pilot : a run that was ended because so many rows were predicted
    power : κ of the errors; order : of the scheme; names : of the results that the tolerance holds for
    """
    looser = (pilot.room.expected / 20_000) ** (order / power)  # steps of the finest of the first three, about
    allowed = pilot.allowed * REFINEMENT**2 * max(looser, MIN_REFINEMENT)
    trials: list[Trial] = []
    while allowed >= MIN_REFINEMENT * pilot.allowed:
        trials.append(run(allowed))
        allowed /= REFINEMENT
        ended = trials[-1].source
        if ended.interrupted or trials[-1].room.problem:
            break
        if trials[-1].problem:  # too loose for this motion
            trials.clear()
        if len(trials) < 3:
            continue
        steps, settled = _steps(trials, tol, power, order, names)
        last = trials[-1]
        if steps > MAX_FORESEEN_RATIO * last.room.most:
            stats = last.run.stats
            return trials, last.room.refused(steps, steps / stats["steps"] * stats["wall_seconds"])
        if settled:
            break
    return trials, ""


def _steps(
    trials: list[Trial], tol: float, power: float, order: int, names: tuple[str, ...] = ()
) -> tuple[float, bool]:
    """Steps that the tolerance takes at least, 0 if unknown, and whether errors fall with the order of the scheme."""
    coarse, middle, fine = trials[-3:]
    first, last = gap(coarse.run, middle.run, tol, names), gap(middle.run, fine.run, tol, names)
    fall = REFINEMENT**-power
    if not (first.same and last.same) or last.size == 0.0 or last.size < first.size * fall**FASTER:
        return 0.0, False
    error = fall / (1.0 - fall) * last.size
    steps = float(fine.run.stats["steps"]) * max(error / tol, 1.0) ** (1.0 / order)
    return steps if np.isfinite(steps) else 0.0, last.size < first.size * fall**SLOWER
