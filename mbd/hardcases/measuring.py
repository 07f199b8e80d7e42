"""What judges share: numbers and references by name, halved steps, the order of an error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.schemes import EVERY

__all__ = [
    "accuracy", "error_curve", "halved", "hard_case", "numbers", "published", "quantity", "second_order", "size",
]  # fmt: skip

ORDER = 0.15
"""How far an observed order may lie from 2."""


def hard_case(id: str, must: str, judge: Callable[[str, Any], Outcome], schemes: Sequence[str] = EVERY) -> HardCase:
    """A case whose judge is told which definition it judges."""
    return HardCase(id, must, partial(judge, id), schemes)


def numbers(id: str) -> dict[str, Any]:
    """The definition and the initial conditions of a case."""
    data = definition(id)
    return {**data["definition"], **data["initial_conditions"]}


def quantity(id: str, beginning: str) -> dict[str, Any]:
    """The one reference quantity of a case whose name begins so: 'name', 'value', 'accuracy', …"""
    found = [each for each in definition(id)["quantities"] if each["name"].startswith(beginning)]
    if len(found) != 1:
        known = ", ".join(repr(each["name"]) for each in definition(id)["quantities"])
        raise LookupError(f"{len(found)} quantities of '{id}' begin with {beginning!r}; one should. It has {known}")
    entry: dict[str, Any] = found[0]
    return entry


def published(id: str, beginning: str) -> Any:
    """The value of a reference quantity, as an array or a number."""
    value = np.asarray(quantity(id, beginning)["value"], dtype=float)
    return value if value.ndim else value.item()


def accuracy(id: str, beginning: str) -> float:
    """How far the value of a reference quantity may be off."""
    return float(quantity(id, beginning)["accuracy"])


def size(values: Any) -> float:
    """The largest absolute value; NaN where one is none, 0 of nothing."""
    found = np.abs(np.asarray(values, dtype=float))
    return float(np.max(found)) if found.size else 0.0


def halved(dt: float, count: int = 3) -> Vector:
    """dt, dt/2, dt/4, …"""
    return np.asarray(dt / 2.0 ** np.arange(count))


def second_order(what: str, errors: Sequence[Any], limit: float, floor: float) -> list[Figure]:
    """An error at dt, dt/2, …: small enough at the last, and of order 2 until round-off.

    Parameters
    ----------
    what : of what, with the unit in brackets
    errors : at each step a number, or several, whose Euclidean norm is taken
    limit : the most the last may be
    floor : of round-off and of the reference's own accuracy
    """
    norms = [float(np.linalg.norm(np.atleast_1d(np.asarray(error, dtype=float)))) for error in errors]
    last = Figure(f"error of {what}, finest step", norms[-1], limit)
    clear = [(a, b) for a, b in pairwise(norms) if not a <= 4.0 * floor]
    if not clear:
        return [last, Figure(f"error of {what}, all steps (round-off)", size(norms), 4.0 * floor)]
    a, b = clear[-1]
    order = np.log2(a / max(b, floor)) if b == b else np.nan
    off = abs(order - 2.0) if b > floor else max(0.0, 2.0 - order)
    return [last, Figure(f"observed order − 2 of {what.partition(' [')[0]} [-]", float(off), ORDER)]


def error_curve(name: str, steps: Any, errors: Sequence[Any], label: str) -> Curve:
    """Errors over steps, both logarithmic."""
    norms = [float(np.linalg.norm(np.atleast_1d(np.asarray(error, dtype=float)))) for error in errors]
    return Curve(name, np.asarray(steps), np.asarray(norms), "step [s]", label, logarithmic=True)
