"""A tolerance on the whole run: trial runs until the error of one agrees with it."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mbd.dataclass import dataclass
from mbd.errors import MemoryLimitError
from mbd.results.columns import asks_for_forces
from mbd.results.driving import drives_of, forces_told, is_wholly_driven
from mbd.simulation.tolerance.comparison import gap
from mbd.simulation.tolerance.search import CHECK_ERROR_RATIO, LOOSEN_SHARE, MAX_CONDITION, PILOT_ERROR_RATIO, Search
from mbd.simulation.tolerance.trials import Trial, is_rounding, rounding

MANY_ROWS = 500_000
"""Rows that a pilot run is predicted from which looser runs are made first [-]."""
REFINEMENT = 10.0
"""What a run allows over what the next one does [-]."""
MIN_REFINEMENT = 100.0
"""The least that one allows, over what the pilot does: finer ones would take as long [-]."""
SLOWER, FASTER = 0.7, 1.5
"""Observed orders over that of the scheme between which errors have its order [-]."""

FIRST_RUN_SHARE = 0.5
"""Local errors of the first run, summed up, over the tolerance [-]."""
MAX_ERROR_RATIO = 3.0
"""Estimated error over the tolerance above which it counts as missed once repeats are used up [-]."""
MAX_RUNS = 5
"""Runs in all, unless the last one came much nearer."""
HIGH_ORDER_RATIO = 1.5
"""Order of a scheme over that of its estimate from which runs are much better than their estimates say [-]."""
REPORTED_GROWTH = 1e3
"""Growth of errors above which a run says so [-]."""
ADVICE = "ask for less accuracy or a shorter time, or take a scheme of higher order, RungeKutta853 or RadauIIA"


@dataclass(frozen=True, eq=False)
class Outcome:
    """The run that counts, what went wrong and what puts it in doubt ('' if nothing does)."""

    trial: Trial
    problem: str
    doubt: str = ""


def first_allowed(tol: float, length: float, power: float) -> float:
    """Local error per second of a first run: `tol` over its length, less where κ is far above 1 [m/s, rad/s]."""
    return FIRST_RUN_SHARE * (max(tol, tol ** (1.0 / power)) if power > HIGH_ORDER_RATIO else tol) / length


def calibrated(
    run: Callable[..., Trial], tol: float, allowed: float, power: float, order: int, names: tuple[str, ...] = ()
) -> Outcome:
    """Runs until the estimated error of one agrees with the tolerance.

    Parameters
    ----------
    run : makes a run with a local error per second, which it ends where more rows than a second argument are predicted
    tol : [m, rad]; allowed : of the first run [m/s, rad/s]
    power : κ; order : of the scheme
    names : of the results that the tolerance holds for; every coordinate without
    """
    regular = power <= MAX_CONDITION
    ratio = PILOT_ERROR_RATIO if regular else CHECK_ERROR_RATIO ** (1.0 / power)
    search = Search(tol, power, order, regular, ratio, names)
    first = run(PILOT_ERROR_RATIO * allowed, MANY_ROWS) if regular else run(allowed)
    if first.room.is_long:
        loose, refused = _foreseen(run, first, tol, power, order, names)
        if refused or (loose and loose[-1].source.interrupted):
            return _given_up(loose, search, refused)
        first = run(PILOT_ERROR_RATIO * allowed)
    if not first.problem and first.run.stats["steps"] == 0:  # it ended where it began
        return _outcome([first], replace(first, error=0.0), search, "")
    if first.source.interrupted or first.room.problem:
        return _outcome([first], first, search, first.problem)
    trials = [] if first.problem else [first]
    wanted: float | None = first.allowed / (ratio if trials else PILOT_ERROR_RATIO)
    for count in range(1, MAX_RUNS + 4):  # runs beyond these, each while the one before has come nearer
        if wanted is None or (count >= MAX_RUNS and not _coming_nearer(trials, tol)):
            break
        refused = _no_room(trials, wanted, power, order)
        if refused and not search.best(trials).error <= tol:
            return _given_up(trials, search, refused)
        if refused:
            break
        found = run(wanted)
        if found.problem and not found.source.interrupted and any(trial.error <= tol for trial in trials):
            break  # a looser run that fails takes nothing away
        if found.problem:
            return _outcome([*trials, found], found, search, found.problem)
        trials = search.estimated([*trials, found])
        wanted = search.next(trials)
    best = search.best(trials)
    missed = not best.error <= MAX_ERROR_RATIO * tol
    if missed and _drives_alone_miss(best, tol):
        outcome = _outcome(trials, best, search, "")
        return replace(outcome, doubt=_drives_missed(best, tol))
    if missed and _amplifies_round_off(trials, best, tol):
        outcome = _outcome(trials, best, search, "")
        return replace(outcome, doubt=_sensitive(best, tol))
    outcome = _outcome(trials, best, search, _unreached(trials, best, tol) if missed else "")
    return outcome if missed else replace(outcome, doubt=_uncovered(best, names))


def _drives_alone_miss(best: Trial, tol: float) -> bool:
    """Whether coordinates keep the tolerance and only forces of drives do not."""
    if best.gap is None or not best.gap.same or not drives_of(best.run) or not best.gap.size > 0.0:
        return False
    return bool(np.isfinite(best.error) and best.error * best.gap.moved <= MAX_ERROR_RATIO * tol * best.gap.size)


def _drives_missed(best: Trial, tol: float) -> str:
    """What such a run says."""
    name = best.gap.name if best.gap is not None else ""
    precise = best.run.settings["integrator"].startswith(("RadauIIA", "RungeKutta853"))
    cure = "" if precise else "; RadauIIA and RungeKutta853 find it from each position by itself"
    return (
        f"tol = {tol:g} holds for coordinates, but not for drives: the force or torque of {name!r} has an estimated "
        f"error of {best.error:.2g} of the largest{cure}"
    )


def _uncovered(best: Trial, names: tuple[str, ...]) -> str:
    """What results that are named by `tol_of` leave open where the motion is prescribed; '' if nothing."""
    if not names or not drives_of(best.run) or not is_wholly_driven(best.run):
        return ""
    columns = best.run._model_columns
    if asks_for_forces([columns.node(name) for name in names]):
        return ""
    return (
        f"drives prescribe the whole motion, so that {', '.join(map(repr, names))} are right in steps of any size: tol "
        "does not cover forces; leave tol_of out, or name those that matter"
    )


def _amplifies_round_off(trials: Sequence[Trial], best: Trial, tol: float) -> bool:
    """Whether round-off of the states alone, which the motion makes larger, keeps a run from its tolerance.

    Then no run in these numbers is better, and one that has half the digits that were asked for counts, in doubt.
    """
    own = rounding(best) * float(best.run.stats["steps"])
    stuck = any(is_rounding(trial) for trial in trials)
    return bool(stuck and own <= tol and best.error <= tol**0.5)  # what round-off alone keeps from it


def _sensitive(best: Trial, tol: float) -> str:
    """What such a run says."""
    where = f" (of {best.gap.name!r})" if best.gap is not None and best.gap.name else ""
    return (
        f"coordinates have an estimated error of {best.error:.2g}{where}, above tol = {tol:g}: the motion is so "
        "sensitive that round-off alone makes it, whatever the steps; what the motion keeps, such as energy, is as "
        "accurate as steps are (tol_of= asks for results by name)"
    )


def _given_up(trials: Sequence[Trial], search: Search, refused: str) -> Outcome:
    """The best of the runs that show that the next one needs too much, or the last one where a user ended it."""
    if trials[-1].problem:
        return _outcome(trials, trials[-1], search, trials[-1].problem)
    trials = search.estimated(trials)
    best = search.best(trials)
    best.source.cause = MemoryLimitError(refused)
    return _outcome(trials, best, search, f"tol = {search.tol:g} was not reached: {refused}; {ADVICE}")


def _no_room(trials: Sequence[Trial], wanted: float, power: float, order: int) -> str:
    """Why a run that allows so much is not begun: its rows would fill the memory. '' if they do not."""
    if not trials:
        return ""
    near = min(trials, key=lambda trial: trial.allowed)
    longer = (near.allowed / wanted) ** (power / order)
    room = trials[0].room  # which may have looked already
    return room.refused(len(near.run.time) * longer, near.run.stats["wall_seconds"] * longer)


def _coming_nearer(trials: Sequence[Trial], tol: float) -> bool:
    """Whether no run is good yet, but the last and finest one is much better than the others."""
    *others, last = trials
    least = min((trial.error for trial in others), default=np.inf)
    return last.error > tol and last.allowed <= min(t.allowed for t in others) and last.error < 0.5 * least


def _outcome(trials: Sequence[Trial], best: Trial, search: Search, problem: str) -> Outcome:
    """The run that counts, with what the trials have shown among its statistics."""
    stats, tol = best.run.record.stats, search.tol
    stats["tolerance"] = {
        "requested": tol, "of": list(search.names), "estimated": float(best.error), "growth": float(best.growth),
        "event_shift": best.gap.shift if best.gap is not None else 0.0,
        "runs": [
            {"allowed": trial.allowed, "estimated": float(trial.error), "steps": trial.run.stats["steps"],
             "rejected": trial.run.stats["rejected"], "seconds": trial.run.stats["wall_seconds"]}
            for trial in trials
        ],
        "comparing_seconds": search.comparing,
    }  # fmt: skip
    sensitive = best.growth > REPORTED_GROWTH and best.error >= LOOSEN_SHARE * tol  # ratios of round-off tell nothing
    if not problem and sensitive and not is_rounding(best) and not search.names:
        stats["notes"].append(
            f"errors grew {best.growth:.2g}-fold: the motion is so sensitive that small differences decide it"
        )
    if not problem and best.error > tol:
        stats["notes"].append(f"the estimated error {best.error:.2g} is above tol = {tol:g}")
    if not problem and not search.names and drives_of(best.run) and is_wholly_driven(best.run):
        stats["notes"].append("drives prescribe the whole motion: tol holds for " + forces_told(best.run))
    if not problem and best.error < LOOSEN_SHARE * tol and stats["steps"] > 0:
        better = search.why_better(trials, best) or f"{len(trials)} runs came no nearer"
        stats["notes"].append(f"the estimated error {best.error:.2g} is far below tol = {tol:g}: {better}")
    if best.gap is not None and not best.gap.same:
        stats["notes"].append("runs at different tolerances have different events; their error is not known")
    return Outcome(best, problem)


def _unreached(trials: Sequence[Trial], best: Trial, tol: float) -> str:
    """Why no run is as accurate as was asked for."""
    name = best.gap.name if best.gap is not None else ""
    where = f" (of {name!r})" if name else ""
    if not np.isfinite(best.error):
        why = (
            "took the same steps, so that their error is not known; give dt=" if best.gap is None else
            "have different events, so that their error is not known; the motion is too sensitive, or give dt="
        )  # fmt: skip
        return f"tol = {tol:g} was not reached: runs at tolerances down to {trials[-1].allowed:.2g} per second {why}"
    stuck = any(is_rounding(trial) for trial in trials)
    why = "smaller steps do not make it smaller, which is the floor of round-off" if stuck else (
        f"{len(trials)} runs did not come nearer"
    )  # fmt: skip
    grew = f"; errors grew {best.growth:.2g}-fold" if best.growth > 1.0 else ""
    return (
        f"tol = {tol:g} was not reached: the best run has an estimated error of {best.error:.2g}{where}; {why}{grew}; "
        "ask for less, or for a shorter time"
    )


# What a tolerance will cost, foreseen from ever finer trial runs before one is made that is long.
#
# With a scheme of order p the error of a run of N steps falls like ``E ∝ N^−p``. Of three runs, each of which allows a
# tenth of the error of the one before, the differences tell E of the finest, and a run within `tol` takes
# ``N (E/tol)^(1/p)`` steps. The first ones are loose enough to take some 10⁴ steps. Where their errors have the size of
# the motion this is too few, and finer ones follow; where errors fall faster, since steps only begin to resolve the
# motion, nothing is foreseen.


def _foreseen(
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
        if steps > 2.0 * last.room.most:  # twice as many as there is room for
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
