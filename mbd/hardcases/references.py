"""Numbers and references of a case, by name."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.dataclass import dataclass
from mbd.hardcases.case import definition


@dataclass(frozen=True)
class Reference:
    """A reference value with the instants it belongs to (none for a constant) and its absolute accuracy."""

    name: str
    value: NDArray[np.float64]
    times: NDArray[np.float64]
    accuracy: float

    @property
    def size(self) -> float:
        """Largest absolute value."""
        return size(self.value)


def numbers(id: str) -> dict[str, Any]:
    """The definition and the initial conditions of a case."""
    data = definition(id)
    return {**data["definition"], **data["initial_conditions"]}


def quantity(id: str, beginning: str) -> Reference:
    """The one reference quantity of a case whose name begins so."""
    found = [entry for entry in definition(id)["quantities"] if entry["name"].startswith(beginning)]
    if len(found) != 1:
        known = ", ".join(repr(each["name"]) for each in definition(id)["quantities"])
        raise LookupError(f"{len(found)} quantities of '{id}' begin with {beginning!r}; one should. It has {known}")
    (entry,) = found
    value = np.asarray(entry["value"], dtype=float)
    relative = entry.get("accuracy_kind", "abs") == "rel"
    absolute = float(entry["accuracy"]) * (size(value) if relative else 1.0)
    return Reference(entry["name"], value, np.atleast_1d(np.asarray(entry.get("t", []), dtype=float)), absolute)


def published(id: str, beginning: str) -> Any:
    """The value of a reference quantity, as an array or a number."""
    value = quantity(id, beginning).value
    return value if value.ndim else value.item()


def accuracy(id: str, beginning: str) -> float:
    """How far the value of a reference quantity may be off."""
    return quantity(id, beginning).accuracy


def distance_to(found: Any, reference: Reference) -> float:
    """Euclidean distance of all found values, at all instants, from their references; NaN where shapes differ."""
    values = np.asarray(found, dtype=float)
    if values.shape != reference.value.shape:
        return float("nan")
    return float(np.linalg.norm(values - reference.value))


def size(values: Any) -> float:
    """The largest absolute value; NaN where one is none, 0 of nothing."""
    found = np.abs(np.asarray(values, dtype=float))
    return float(np.max(found)) if found.size else 0.0


def limits_of(id: str, table: Mapping[str, tuple[str, float]]) -> tuple[dict[str, float], dict[str, float]]:
    """By what errors are of, the most that each may be and ten times the accuracy of its reference.

    table : the beginning of the name of each reference, and the most that its error may be over the largest value
    """
    limits = {what: limit * quantity(id, name).size for what, (name, limit) in table.items()}
    return limits, {what: 10.0 * accuracy(id, name) for what, (name, _) in table.items()}
