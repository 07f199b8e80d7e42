"""An objective and constraints over numbers, as scaled functions of scaled unknowns, with every trial kept."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL
from mbd.errors import CapabilityError, GaitError, MbdError
from mbd.optimization.formula import Formula
from mbd.optimization.points import Point, Source, failed


@dataclass(frozen=True)
class Limit:
    """A constraint low ≤ formula ≤ high."""

    title: str
    formula: Formula
    low: float
    high: float


@dataclass(frozen=True)
class Trial:
    """One evaluation: unknowns, objective, violation of constraints over their scales; outcome: '' or why it failed."""

    values: Mapping[str, float]
    objective: float
    violation: float
    outcome: str = ""


class FailedTrial(Exception):
    """A trial without numbers: a walk that falls, a run that does not arrive."""

    def __init__(self, u: Vector, outcome: str) -> None:
        super().__init__(outcome)
        self.u, self.outcome = u, outcome


class TrialsSpent(Exception):
    """As many trials as were allowed."""


@dataclass(eq=False)
class Evaluated:
    """Objective parts and constraints at one place; derivatives when they are asked for."""

    u: Vector
    point: Point
    parts: Vector
    limits: Vector
    violation: float
    slopes: tuple[Matrix, Matrix] | None = None


@dataclass(eq=False)
class Problem:
    """The functions that a method of optimization sees; unknowns are guess + scale u.

    parts : of the objective, whose sum of squares is sought where there are several (`squares`)
    sign : −1 to make it largest
    """

    source: Source
    names: tuple[str, ...]
    guess: Vector
    low: Vector
    high: Vector
    parts: Sequence[Formula]
    limits: Sequence[Limit]
    squares: bool
    sign: float
    most: int
    progress: Callable[[int, float], None]
    trials: list[Trial] = field(default_factory=list)
    best: Evaluated | None = None
    last: Evaluated | None = None
    failures: list[FailedTrial] = field(default_factory=list)
    last_error: Exception | None = None

    def __post_init__(self) -> None:
        both = np.isfinite(self.low) & np.isfinite(self.high)
        width = np.where(both, self.high, 0.0) - np.where(both, self.low, 0.0)
        self.scale = np.where(both, width, np.abs(self.guess))
        self.scale = np.where(self.scale > 0.0, self.scale, 1.0)
        self.size, self.limit_scale = 1.0, np.ones(len(self.limits))

    # places -------------------------------------------------------------------------------------------------------
    def values(self, u: Vector) -> dict[str, float]:
        """The unknowns by name."""
        x = np.clip(self.guess + self.scale * u, self.low, self.high)
        return dict(zip(self.names, map(float, x), strict=True))

    @property
    def bounds(self) -> tuple[Vector, Vector]:
        """Of the scaled unknowns."""
        return (self.low - self.guess) / self.scale, (self.high - self.guess) / self.scale

    def begin(self) -> None:
        """The guess, which sets the scales of the objective and of the constraints.

        Raises
        ------
        MbdError
            the error of the guess, if there are no numbers at it.
        """
        try:
            first = self.at(np.zeros(len(self.names)))
            slopes = self.slopes(first)
        except FailedTrial as failure:
            error = self.last_error
            raise error if error is not None else GaitError(f"the guess fails: {failure.outcome}") from None
        steep = float(np.max(np.abs(slopes[0]), initial=0.0))
        least = HALF_PRECISION_RTOL * steep**2 if self.squares else steep
        self.size = max(abs(self.objective(first)), least) or 1.0
        ends = np.array([[limit.low, limit.high] for limit in self.limits]).reshape(-1, 2)
        ends = np.where(np.isfinite(ends), np.abs(ends), 0.0).max(axis=1, initial=0.0)
        steep_limits = np.max(np.abs(slopes[1]), axis=1, initial=0.0)
        self.limit_scale = np.where(ends > 0.0, ends, np.where(steep_limits > 0.0, steep_limits, 1.0))
        first.violation = self._violation(first.limits)
        self.trials[0] = Trial(self.trials[0].values, self.trials[0].objective, first.violation)

    # values -------------------------------------------------------------------------------------------------------
    def at(self, u: Vector) -> Evaluated:
        """What the numbers give at a place.

        Raises
        ------
        FailedTrial
            where there are none, with the outcome.
        """
        if self.last is not None and np.array_equal(u, self.last.u):
            return self.last
        for failure in self.failures:
            if np.array_equal(u, failure.u):
                raise failure
        if len(self.trials) >= self.most:
            raise TrialsSpent
        values = self.values(u)
        wanted = list(dict.fromkeys(name for each in self._formulas for name in each.names if name not in values))
        point = self.source.at(values, wanted)
        if not point.outcome:
            for name in wanted:
                self.source.check(name)
            point.numbers = {**point.numbers, **values}
        if not point.outcome and not all(math.isfinite(point.numbers[name]) for name in wanted):
            missing = next(name for name in wanted if not math.isfinite(point.numbers[name]))
            point.outcome = f"{missing!r} is not finite"
        if point.outcome:
            self._fail(u, values, point.outcome, point.error)
        parts = np.array([each.value(point.numbers) for each in self.parts])
        limits = np.array([limit.formula.value(point.numbers) for limit in self.limits])
        if not np.all(np.isfinite(np.concatenate([parts, limits]))):
            self._fail(u, values, "the objective or a constraint is not finite", None)
        found = Evaluated(u.copy(), point, parts, limits, self._violation(limits))
        self.last = found
        self.trials.append(Trial(values, self.shown(found), found.violation))
        if self.best is None or self.better(found, self.best):
            self.best = found
        self.progress(len(self.trials), self.shown(self.best))
        return found

    @property
    def _formulas(self) -> list[Formula]:
        return [*self.parts, *(limit.formula for limit in self.limits)]

    def _fail(self, u: Vector, values: Mapping[str, float], outcome: str, error: Exception | None) -> None:
        self.trials.append(Trial(values, math.nan, math.nan, outcome))
        self.last_error = error
        self.failures.append(FailedTrial(u.copy(), outcome))
        raise self.failures[-1]

    def slopes(self, at: Evaluated) -> tuple[Matrix, Matrix]:
        """Derivatives of the parts and of the constraints by u; a missing one fails the trial."""
        if at.slopes is None:
            size, own = len(self.names), {name: k for k, name in enumerate(self.names)}

            def slope_of(name: str) -> Vector:
                return np.eye(size)[own[name]] if name in own else at.point.slope_of(name)

            try:
                rows = [each.slope(at.point.numbers, slope_of, size) * self.scale for each in self._formulas]
            except (CapabilityError, GaitError) as error:
                self._without(at, error)
            matrix = np.array(rows).reshape(len(rows), size)
            if not np.all(np.isfinite(matrix)):
                self._without(at, CapabilityError("a derivative is not finite"))
            at.slopes = matrix[: len(self.parts)], matrix[len(self.parts) :]
        return at.slopes

    def _without(self, at: Evaluated, error: MbdError) -> None:
        failed(at.point.values, error)  # goes on where the user ended it
        self.last_error = error
        outcome = f"no derivative: {error}"
        self.trials[-1] = Trial(at.point.values, self.trials[-1].objective, at.violation, outcome)
        self.failures.append(FailedTrial(at.u, outcome))
        self.last = None
        raise self.failures[-1]

    def objective(self, at: Evaluated) -> float:
        """What is made smallest."""
        return float(at.parts @ at.parts) if self.squares else self.sign * float(at.parts[0])

    def shown(self, at: Evaluated) -> float:
        """The objective as the user gave it."""
        return float(at.parts @ at.parts) if self.squares else float(at.parts[0])

    def gradient(self, at: Evaluated) -> Vector:
        """Of `objective` by u."""
        parts, _ = self.slopes(at)
        return 2.0 * at.parts @ parts if self.squares else self.sign * parts[0]

    def _violation(self, limits: Vector) -> float:
        low, high = (np.array([getattr(limit, end) for limit in self.limits]) for end in ("low", "high"))
        over = np.maximum(np.maximum(low - limits, limits - high), 0.0) / self.limit_scale
        return float(np.max(over, initial=0.0))

    def better(self, one: Evaluated, other: Evaluated) -> bool:
        """Whether one place is better: less violated, or as good there and a smaller objective."""
        if max(one.violation, other.violation) > HALF_PRECISION_RTOL:
            return one.violation < other.violation
        return self.objective(one) < self.objective(other)
