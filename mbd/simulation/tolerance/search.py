"""Errors of trial runs from their differences, and which run comes next.

A scheme controls the error of each step; what becomes of it by the end depends on the motion, which may damp errors or
make them grow. With the local error held to `allowed` per second, the error E of a coordinate anywhere in the run goes
like ``E ∝ allowed^κ``, κ the order of the scheme over that of its estimate. Two runs A and B, allowed a > b, differ by
``D = E_A − E_B``: with ``f = (b/a)^κ``, ``E_A = D / (1 − f)``, which hardly depends on κ, and ``E_B = f D / (1 − f)``,
which does.

Schemes of order 2 keep to their order: a cheap pilot comes first, and its difference tells the error of the run that
counts. The errors of few long steps of high order do not: there the run that counts is the coarser one, checked by
another that costs a fifth to two fifths more. Runs that miss the tolerance, by far too much accuracy as well, are
repeated; where three runs tell the order, the more pessimistic one of it and κ counts.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from time import perf_counter

import numpy as np

from mbd.equal import SMALL_SUM_RTOL
from mbd.results.driving import own_share
from mbd.simulation.tolerance.comparison import Gap, gap
from mbd.simulation.tolerance.trials import Trial, is_rounding, least_error, rounding, same_steps

PILOT_ERROR_RATIO = 10.0
"""Allowed error of the pilot run over that of the first run [-]."""
CHECK_ERROR_RATIO = 6.0
"""Error of a run of high order over that of the one that checks it [-]."""
MAX_CONDITION = 1.01
"""κ up to which errors keep to the order of a scheme, so that a pilot tells them [-]."""
MIN_ERROR_RATIO = 2.5
"""Ratio of allowed errors from which the errors of two runs are told apart [-]."""
TARGET_SHARE = 0.4
"""Part of the tolerance that a repeated run aims at [-]."""
LOOSEN_SHARE = 0.15
"""Estimated error over the tolerance below which a looser run is tried [-]."""
SAME_STEPS_REFINEMENT = 1e3
"""How much finer the next run is where two runs took the same steps [-]."""
ERROR_FLOOR = 1e-6
"""Errors over the tolerance below which they do not tell runs apart [-]."""
MAX_STEP_SHARE = 0.25
"""Longest step of a run that is looser than the first ones, over the length of the run [-]."""
LEAST_ORDER, MOST_ORDER = 0.5, 1.5
"""Observed orders that are believed, over the one of the scheme [-]."""


class Search:
    """What is known of the errors of trial runs, and which one comes next."""

    def __init__(
        self, tol: float, power: float, order: int, regular: bool, ratio: float, names: tuple[str, ...] = ()
    ) -> None:  # fmt: skip
        self.tol, self.power, self.order, self.regular, self.ratio = tol, power, order, regular, ratio
        self.names = names
        self.comparing = 0.0  # seconds
        self._gaps: dict[tuple[float, float], Gap] = {}
        self._shown: dict[float, tuple[float, str]] = {}

    # which run counts, and which is next -----------------------------------------------------------------------------
    def best(self, trials: Sequence[Trial]) -> Trial:
        """The run whose error comes nearest the tolerance from below; else the most accurate.

        Of runs whose errors are nothing beside the tolerance, and may be round-off, the one that allows most.
        """
        below = [trial for trial in trials if trial.error <= self.tol]
        if not below:
            return min(trials, key=lambda trial: trial.error)
        return max(below, key=lambda trial: (max(trial.error, ERROR_FLOOR * self.tol), trial.allowed))

    def next(self, trials: Sequence[Trial]) -> float | None:
        """What the next run allows; None: the best is good, or as good as it gets."""
        best = self.best(trials)
        if not np.isfinite(best.error):
            return min(trial.allowed for trial in trials) / (
                SAME_STEPS_REFINEMENT if best.gap is None else PILOT_ERROR_RATIO
            )
        if best.error >= LOOSEN_SHARE * self.tol and best.error <= self.tol:
            return best.allowed / self.ratio if best.finest and not self.regular else None
        if best.error < LOOSEN_SHARE * self.tol and self.why_better(trials, best):
            return None
        return self._aimed(trials)

    def why_better(self, trials: Sequence[Trial], best: Trial) -> str:
        """Why no looser run is worth trying, or ''."""
        rounded = best.error == 0.0 or best.gap is None or best.gap.size <= SMALL_SUM_RTOL
        if rounded and not self.names:  # results that are named may be so because of coordinates that are not
            return "errors are round-off whatever the steps"
        looser = [trial for trial in trials if trial.allowed > best.allowed]
        if (best.widest and best.is_stretched) or any(same_steps(*two) for two in combinations([best, *looser], 2)):
            return f"steps end at events or have their largest size, {100.0 * MAX_STEP_SHARE:.0f} % of the run"
        coarser = [trial.error for trial in looser if np.isfinite(trial.error) and trial.error > self.tol]
        few = best.run.stats["steps"]
        if coarser and min(trial.allowed for trial in looser) < MIN_ERROR_RATIO * best.allowed:
            return f"it takes {few} steps, and slightly longer ones have an error of {min(coarser):.2g}"
        return ""

    def _aimed(self, trials: Sequence[Trial]) -> float:
        """An allowed error for TARGET_SHARE · tol: between two runs linear in logarithms, else by the order."""
        known = sorted((t for t in trials if np.isfinite(t.error) and t.error > 0.0), key=lambda t: t.allowed)
        goal = TARGET_SHARE * self.tol
        under = [trial for trial in known if trial.error <= self.tol]
        above = [
            trial for trial in known if trial.error > self.tol and (not under or trial.allowed > under[-1].allowed)
        ]
        if under and above:
            low, high = under[-1], above[0]
            part = np.log(goal / low.error) / np.log(high.error / low.error)
            return float(low.allowed * (high.allowed / low.allowed) ** min(max(part, 0.1), 0.9))
        base = under[-1] if under else known[0]
        reach = (goal / base.error) ** (1.0 / self.power)
        # no risk in growing: looser runs are judged by a finer one
        return float(base.allowed * min(max(reach, 1.0 / 1e4), 1e10))  # by that much at most

    # errors ----------------------------------------------------------------------------------------------------------
    def estimated(self, trials: Sequence[Trial]) -> list[Trial]:
        """The error of each run by its difference from the finest, of that one by its difference from the next coarser.

        Two runs of the same steps tell nothing of each other: without a third their errors are infinite, without a gap,
        unless the steps are so short, as before an early event, that local errors are round-off.
        """
        finest = min(trials, key=lambda trial: trial.allowed)
        seen = {id(trial): self._against(trial, finest) for trial in trials if not same_steps(trial, finest)}
        coarser = [t for t in trials if id(t) in seen and t.allowed >= MIN_ERROR_RATIO * finest.allowed]
        known = replace(finest, error=np.inf, gap=None, finest=True)
        if coarser:
            near = sorted((seen[id(trial)] for trial in coarser), key=lambda trial: trial.allowed)
            fall = self._fall(near[0], finest, self._observed(near))
            difference = near[0].gap.size if near[0].gap is not None and near[0].gap.same else np.inf
            least = max(least_error(finest, near[0], self.names), self._own(finest))
            error = max(fall / (1.0 - fall) * difference, least)
            known = replace(known, error=error, gap=near[0].gap)
        elif len(trials) > 1 and not seen and is_rounding(finest):
            known = replace(known, error=rounding(finest, self.names) * float(finest.run.stats["steps"]))
        return [
            seen.get(id(trial)) or replace(trial, error=known.error, gap=known.gap, finest=True) for trial in trials
        ]

    def _against(self, trial: Trial, finest: Trial) -> Trial:
        """A run with the error that its difference from a finer one tells."""
        key = (trial.allowed, finest.allowed)
        if key not in self._gaps:
            began = perf_counter()
            self._gaps[key] = gap(trial.run, finest.run, self.tol, self.names)
            self.comparing += perf_counter() - began
        between = self._gaps[key]
        part = 1.0 / (1.0 - self._fall(trial, finest, self.power))
        least = rounding(trial, self.names) * float(trial.run.stats["steps"])
        error = max(part * between.size, least, self._own(trial)) if between.same else np.inf
        return replace(trial, error=error, gap=between, finest=False)

    def _own(self, trial: Trial) -> float:
        """What the drives of a run show of their own error."""
        if self.names:
            return 0.0
        if trial.allowed not in self._shown:
            began = perf_counter()
            self._shown[trial.allowed] = own_share(trial.run)
            self.comparing += perf_counter() - began
        return self._shown[trial.allowed][0]

    def _fall(self, trial: Trial, finer: Trial, power: float) -> float:
        """E of the finer run over that of the other: by what they allow, or, if more, by the number of their steps."""
        steps = max(trial.run.stats["steps"], 1) / max(finer.run.stats["steps"], 1)
        fall = (finer.allowed / trial.allowed) ** min(power, self.power)
        return float(min(max(fall, min(steps, 1.0) ** self.order if self.regular else 0.0), 0.5))

    def _observed(self, near: Sequence[Trial]) -> float:
        """κ from the errors of two runs that a third has told, if they are far enough apart."""
        if (
            len(near) < 2
            or near[1].allowed < MIN_ERROR_RATIO * near[0].allowed
            or not np.isfinite([near[0].error, near[1].error]).all()
        ):
            return self.power
        if min(near[0].error, near[1].error) <= 10.0 * SMALL_SUM_RTOL:
            return self.power
        seen = np.log(near[1].error / near[0].error) / np.log(near[1].allowed / near[0].allowed)
        return float(min(max(seen, LEAST_ORDER * self.power), MOST_ORDER * self.power))
