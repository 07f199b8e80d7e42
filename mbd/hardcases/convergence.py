"""Errors that must fall with the square of the step, or faster, until round-off, and the figures that say so.

A scheme of order 2 is judged by |observed order − 2| over every halving. Errors of a higher order are far below what
order 2 allows, and in round-off after a few halvings: they must fall by order 2 at least, and lie below what order 2
allows at every step, not only at the finest.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.hardcases.case import Curve, Figure
from mbd.hardcases.schemes import has_own_forces, holds_positions_only, is_undamped

EPS = float(np.finfo(float).eps)
MIN_ORDER = 2.0
"""What every scheme that is judged promises at least."""
ORDER_ATOL = 0.15
"""How far an observed order may be from it."""


def halved(dt: float, count: int = 3) -> Vector:
    """dt, dt/2, dt/4, …"""
    return np.asarray(dt / 2.0 ** np.arange(count))


def deviation(steps: Any, errors: Any, floor: Any, better: bool = False) -> float:
    """The largest |observed order − 2| above the floor of round-off; NaN where an error is none.

    A fall into the floor must be of order 2 at least. Zero where every error is at round-off.

    Parameters
    ----------
    steps, errors : from large to small steps
    floor : size at which an error counts as round-off or as that of the reference; one, or one for each step
    better : whether orders above 2 are as good: numerical damping is of order 3
    """
    sizes, h = np.asarray(errors, dtype=float), np.asarray(steps, dtype=float)
    if not np.isfinite(sizes).all():
        return float("nan")
    floors = np.broadcast_to(np.asarray(floor, dtype=float), sizes.shape)
    worst = 0.0
    for k in range(1, len(sizes)):
        coarse, fine, least = float(sizes[k - 1]), float(sizes[k]), float(floors[k])
        refinement = float(h[k - 1] / h[k])
        if max(fine, coarse) <= 4.0 * least or (fine <= least and coarse <= refinement**MIN_ORDER * least):
            continue  # at round-off, where it should be
        order = math.log(max(coarse, least, 1e-300) / max(fine, least, 1e-300)) / math.log(refinement)
        short = MIN_ORDER - order
        worst = max(worst, abs(short) if fine > least and not better else short)
    return worst


def second_order(
    what: str, steps: Any, errors: Sequence[Any], limit: float, floor: Any, better: bool = False, order: int = 2,
    erratic: bool = False,
) -> list[Figure]:  # fmt: skip
    """An error small enough at the finest step, and of order 2 until round-off.

    Parameters
    ----------
    what : 'error of the speed [m/s]'
    errors : at each step a number, or several, whose Euclidean norm is taken
    limit : the most it may be at the finest step
    floor, better : see `deviation`
    order : of the scheme: above 2 the error must be of order 2 or better, and small enough at every step
    erratic : whether the error is made in a few steps and depends on where these fall, beside a pose in which rows lose
        rank or behind a switch: with an order above 2 nothing smooth hides that, errors do not fall evenly, and what
        order 2 allows at every step is the whole judgement
    """
    norms, higher = _norms(errors), order > MIN_ORDER
    off = deviation(steps, norms, floor, better or higher)
    judgement = "what is missing to order 2" if better or higher else "|order − 2|"
    figures = [
        Figure(f"{judgement}, {what.partition(' [')[0]} [-]", off, ORDER_ATOL),
        Figure(f"{what} at dt = {float(steps[-1]):.3g} s", float(norms[-1]), limit),
    ]
    if not higher:
        return figures
    return [*figures[erratic:], at_every_step(what, steps, errors, limit)]


def at_every_step(what: str, steps: Any, errors: Sequence[Any], limit: float) -> Figure:
    """Errors over what order 2 allows at each step, ``limit (dt/finest)²``: the largest."""
    h = np.asarray(steps, dtype=float)
    share = float(np.max(_norms(errors) / (limit * (h / h[-1]) ** MIN_ORDER)))
    return Figure(f"{what.partition(' [')[0]} over what order 2 allows, worst of all steps [-]", share, 1.0)


def error_curve(name: str, steps: Any, errors: Sequence[Any], label: str = "error") -> Curve:
    """Errors over steps, both logarithmic."""
    return Curve(name, np.asarray(steps), _norms(errors), "step [s]", label, logarithmic=True)


def _norms(errors: Sequence[Any]) -> NDArray[np.float64]:
    return np.array([float(np.linalg.norm(np.atleast_1d(np.asarray(error, dtype=float)))) for error in errors])


@dataclass(frozen=True)
class Study:
    """Runs of a scheme of that order at steps that get smaller, and their errors, by what they are of.

    errors : at each step a number, or several, whose Euclidean norm is taken; NaN of a run that stops early
    """

    steps: NDArray[np.float64]
    runs: Sequence[Any]
    errors: Mapping[str, Sequence[Any]]
    order: int = 2

    @property
    def finest(self) -> Any:
        """The run with the smallest step."""
        return self.runs[-1]

    @property
    def dt(self) -> float:
        """The smallest step [s]."""
        return float(self.steps[-1])

    @property
    def stopped(self) -> Figure:
        """How many of the runs stop early."""
        return Figure("runs that stop early", sum(not run.success for run in self.runs), 0)

    def figures(
        self, limits: Mapping[str, float], floors: Mapping[str, float] | float = 1e-11, better: bool = False,
        erratic: bool = False,
    ) -> list[Figure]:  # fmt: skip
        """For each error its order and its size at the finest step; see `second_order`.

        limits : the most each error may be at the finest step, by what it is of
        floors : sizes at which an error counts as round-off or as the error of the reference
        """
        found = []
        for what, limit in limits.items():
            floor = floors[what] if isinstance(floors, Mapping) else floors
            errors = self.errors.get(what, [math.nan] * len(self.steps))
            found += second_order(what, self.steps, errors, limit, floor, better, self.order, erratic)
        return found

    def curve(self, what: str) -> Curve:
        """One of the errors over steps, by its name without its unit."""
        name, _, unit = what.partition(" [")
        return error_curve(name, self.steps, self.errors.get(what, []), f"error [{unit}")

    def curves(self) -> list[Curve]:
        """Errors over steps."""
        return [error_curve(what, self.steps, errors) for what, errors in self.errors.items()]


def study(
    run: Callable[[float], Any], errors: Callable[[Any], Mapping[str, Any]], dt: float | Sequence[float],
    integrator: Any, halvings: int = 3,
) -> Study:  # fmt: skip
    """Runs of a scheme with dt, dt/2, dt/4, …, or with the steps given, from large to small, and the errors of each."""
    steps = halved(dt, halvings + 1) if isinstance(dt, float) else np.array(dt)
    runs = [run(float(step)) for step in steps]
    found = [errors(each) if each.success else {} for each in runs]
    names = dict.fromkeys(name for each in found for name in each)
    by_name = {name: [each.get(name, math.nan) for each in found] for name in names}
    return Study(steps, runs, by_name, integrator.order())


def allowance(factor: float, rate: float, dt: float, size: float = 1.0) -> float:
    """``factor (rate dt)² size``: the most an error of order 2 may be.

    rate : at which the motion changes [1/s]; size : of what is in error; factor : about twice what the worst scheme
    of the family needs, as the judges state it
    """
    return factor * (rate * dt) ** 2 * size


def force_floor(integrator: Any, dt: float, count: float, mass: float, length: float, speed: float) -> float:
    """Round-off that multipliers may have after `count` steps [N].

    500 ε m L/dt² with rows on positions only, 50 ε m V/dt with those on velocities too. An undamped scheme does not
    forget: 5 √n ε m V/dt after n steps, where that is more. Multipliers that follow from the state alone have what
    its round-off 10 √n ε makes of m V²/L, whatever dt.
    """
    if has_own_forces(integrator):
        return 10.0 * math.sqrt(count) * EPS * mass * speed**2 / length
    if holds_positions_only(integrator):
        return 500.0 * EPS * mass * length / dt**2
    factor = max(50.0, 5.0 * math.sqrt(count)) if is_undamped(integrator) else 50.0
    return factor * EPS * mass * speed / dt
