"""Errors that must fall with the square of the step, and the figures that say so."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.hardcases.case import Curve, Figure, definition

__all__ = [
    "DAMPED",
    "EPS",
    "EVERY",
    "Reference",
    "Study",
    "allowance",
    "distance_to",
    "force_floor",
    "quantity",
    "study",
]

EPS = float(np.finfo(float).eps)
EVERY = ("HHT", "HHT-index3", "generalized-alpha", "generalized-alpha-index3", "Newmark")
DAMPED = EVERY[:-1]
"""Names of the schemes that most cases here are judged with; undamped ones hold rows only in the stabilized form."""
ORDER = 2.0
"""What every scheme of the family promises."""
MOST_DEVIATION = 0.15
"""How far an observed order may be from it."""


@dataclass(frozen=True)
class Reference:
    """A reference value with the instants it belongs to (none for a constant) and its accuracy."""

    value: NDArray[np.float64]
    times: NDArray[np.float64]
    accuracy: float

    @property
    def size(self) -> float:
        """Largest absolute value."""
        return float(np.max(np.abs(self.value)))


def quantity(id: str, beginning: str) -> Reference:
    """The one quantity of a definition whose name begins so."""
    found = [entry for entry in definition(id)["quantities"] if entry["name"].startswith(beginning)]
    if len(found) != 1:
        raise LookupError(f"{len(found)} quantities of {id} begin with {beginning!r}")
    (entry,) = found
    value = np.asarray(entry["value"], dtype=float)
    relative = entry.get("accuracy_kind", "abs") == "rel"
    accuracy = entry["accuracy"] * (float(np.max(np.abs(value))) if relative else 1.0)
    return Reference(value, np.atleast_1d(np.asarray(entry.get("t", []), dtype=float)), accuracy)


def distance_to(found: Any, reference: Reference) -> float:
    """Euclidean distance of all found values, at all instants, from their references; NaN where shapes differ."""
    values = np.asarray(found, dtype=float)
    if values.shape != reference.value.shape:
        return float("nan")
    return float(np.linalg.norm(values - reference.value))


@dataclass(frozen=True)
class Study:
    """Errors by what they are of, at steps that get smaller."""

    steps: NDArray[np.float64]
    errors: Mapping[str, NDArray[np.float64]]

    def deviation(self, what: str, floor: Any) -> float:
        """Largest |observed order − 2| of errors above the floor of round-off, one or by step; NaN where there is none.

        Zero where every error is at round-off: then only the limit of the error itself judges.
        """
        errors = self.errors[what]
        if not np.isfinite(errors).all():
            return float("nan")
        clear = errors[1:] > np.broadcast_to(floor, errors.shape)[1:]
        falls, refinements = errors[:-1] / np.maximum(errors[1:], 1e-300), self.steps[:-1] / self.steps[1:]
        orders = np.log(falls[clear]) / np.log(refinements[clear])
        return float(np.max(np.abs(orders - ORDER), initial=0.0))

    def figures(self, limits: Mapping[str, float], floors: Mapping[str, float] | None = None) -> list[Figure]:
        """For each error its order and its size at the finest step.

        limits : the most each error may be at the finest step, by what it is of
        floors : sizes at which an error counts as round-off or as the error of the reference; 1e-11 if not given
        """
        found = []
        for what, limit in limits.items():
            floor = (floors or {}).get(what, 1e-11)
            plain = what.split(" [")[0]
            found.append(Figure(f"|order − 2| of {plain} [-]", self.deviation(what, floor), MOST_DEVIATION))
            found.append(Figure(f"{what} at dt = {self.steps[-1]:g} s", float(self.errors[what][-1]), limit))
        return found

    def curves(self) -> list[Curve]:
        """Errors over steps."""
        return [Curve(what, self.steps, errors, "dt [s]", "error", True) for what, errors in self.errors.items()]


def study(errors: Callable[[float], Mapping[str, float]], dt: float | Sequence[float], halvings: int = 3) -> Study:
    """The errors of runs with dt, dt/2, dt/4, …, or with the steps given, from large to small."""
    steps = [dt / 2**k for k in range(halvings + 1)] if isinstance(dt, float) else list(dt)
    found = [errors(step) for step in steps]
    return Study(np.array(steps), {what: np.array([each[what] for each in found]) for what in found[0]})


def allowance(factor: float, rate: float, dt: float, size: float = 1.0) -> float:
    """``factor (rate dt)² size``: the most an error of order 2 may be.

    rate : at which the motion changes [1/s]; size : of what is in error; factor : about twice what the worst scheme
    of the family needs, as the judges state it
    """
    return factor * (rate * dt) ** 2 * size


def force_floor(integrator: Any, dt: float, count: float, mass: float, length: float, speed: float) -> float:
    """Round-off that multipliers may have after `count` steps [N].

    500 ε m L/dt² with rows on positions only, 50 ε m V/dt with those on velocities too. An undamped scheme does not
    forget: 5 √n ε m V/dt after n steps, where that is more.
    """
    if integrator.formulation == "index3":
        return 500.0 * EPS * mass * length / dt**2
    factor = max(50.0, 5.0 * math.sqrt(count)) if integrator.coefficients.undamped else 50.0
    return factor * EPS * mass * speed / dt
