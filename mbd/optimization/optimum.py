"""What an optimization has found: the best trial, what is active there, and why it ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

from mbd.dataclass import dataclass
from mbd.errors import UnknownNameError, nearest
from mbd.notebook import table
from mbd.optimization.problem import Trial

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class Active:
    """A bound or a constraint that holds with equality at the optimum.

    value : of the limit; price : change of the objective as the limit moves by one [objective per its unit]
    """

    name: str
    side: str
    value: float
    price: float

    def __str__(self) -> str:
        return f"{self.name} is at its {self.side} {self.value:.6g} (price {self.price:.3g})"


@dataclass(frozen=True, eq=False)
class Optimum:
    """The best trial of an optimization.

    ``found["knee loss.coefficient"]`` is an unknown, ``found["speed"]`` a number that the objective or a constraint
    takes.

    Attributes
    ----------
    values : the unknowns, by name; guess, bounds : where they began, and between what
    title, objective : what was made smallest or largest, and its value
    numbers : all that is known at the best trial, by name; constraints : (value, low, high) by title
    active : bounds and constraints that hold it there, with their prices
    slope : largest derivative that is left, of the objective less active constraints, by unknowns over their scales,
        over the size of the objective [-]
    violation : of constraints, over their scales [-]
    success, message : whether it converged to a place that violates nothing, and why it ended
    trials : all of them, in order; those that failed have an outcome
    gait, run : of the best trial, as far as there are
    """

    values: Mapping[str, float]
    guess: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]
    title: str
    objective: float
    numbers: Mapping[str, float]
    constraints: Mapping[str, tuple[float, float, float]]
    active: tuple[Active, ...]
    slope: float
    violation: float
    success: bool
    message: str
    method: str
    trials: tuple[Trial, ...] = field(repr=False)
    gait: Any = field(repr=False, default=None)
    run: Any = field(repr=False, default=None)

    @property
    def failed(self) -> tuple[Trial, ...]:
        """Trials without numbers, each with its outcome."""
        return tuple(trial for trial in self.trials if trial.outcome)

    def __getitem__(self, name: str) -> float:
        """An unknown, or a number at the best trial."""
        known = {**self.numbers, **{title: each[0] for title, each in self.constraints.items()}}
        if name not in known:
            raise UnknownNameError(nearest(name, known, "number of the optimum", "It has"))
        return float(known[name])

    def to_dataframe(self) -> DataFrame:
        """A pandas table of all trials: unknowns, objective, violation, outcome."""
        from mbd.results.tables import library

        rows = [
            {**t.values, self.title: t.objective, "violation": t.violation, "outcome": t.outcome} for t in self.trials
        ]
        return library("pandas", "data", "Optimum.to_dataframe()").DataFrame(rows)

    # shown --------------------------------------------------------------------------------------------------------
    HEADS = ("", "guess", "found", "between", "active")

    def _lines(self) -> list[list[str]]:
        active = {each.name: f"{each.side}, price {each.price:.3g}" for each in self.active}
        found = []
        for name, value in self.values.items():
            between = _between(*self.bounds[name])
            found.append([name, f"{self.guess[name]:.6g}", f"{value:.8g}", between, active.get(name, "")])
        for title, (value, low, high) in self.constraints.items():
            found.append([title, "", f"{value:.8g}", _between(low, high), active.get(title, "")])
        return [*found, [self.title, f"{self.trials[0].objective:.6g}", f"{self.objective:.8g}", "", ""]]

    def _notes(self) -> list[str]:
        failures = list(dict.fromkeys(trial.outcome for trial in self.failed))
        notes = [f"{'converged' if self.success else 'not converged'} after {len(self.trials)} trials: {self.message}"]
        if failures:
            more = f", and {len(failures) - 1} other outcomes" if len(failures) > 1 else ""
            notes.append(f"{len(self.failed)} trials failed: {failures[0]}{more}")
        return notes

    def __repr__(self) -> str:
        lines = [list(self.HEADS), *self._lines()]
        widths = [max(len(line[k]) for line in lines) for k in range(len(self.HEADS))]
        text = ["  ".join(f"{cell:>{width}}" for cell, width in zip(line, widths, strict=True)) for line in lines]
        return "\n".join([*(line.rstrip() for line in text), *self._notes()])

    def _repr_html_(self) -> str:
        return table("Optimum", self.HEADS, self._lines(), ". ".join(self._notes()))


def _between(low: float, high: float) -> str:
    if low == high:
        return f"= {low:.6g}"
    ends = abs(low) != float("inf"), abs(high) != float("inf")
    return {
        (True, True): f"{low:.6g} … {high:.6g}", (True, False): f"≥ {low:.6g}", (False, True): f"≤ {high:.6g}",
        (False, False): "",
    }[ends]  # fmt: skip
