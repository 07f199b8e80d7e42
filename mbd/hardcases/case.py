"""What a hard case is: a definition with reference values, what must hold, and a judge that measures it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

__all__ = ["Curve", "Figure", "HardCase", "Outcome", "definition", "reference"]


@dataclass(frozen=True)
class Figure:
    """One measured number and the most it may be; NaN never passes.

    what : in plain words, with the unit in brackets: 'error of the first impact time [s]'
    value, limit : measured, allowed
    """

    what: str
    value: float
    limit: float

    @property
    def passed(self) -> bool:
        return bool(self.value <= self.limit)


@dataclass(frozen=True)
class Curve:
    """Something to look at: values over abscissas; `logarithmic` for errors over steps."""

    name: str
    x: Any
    y: Any
    x_label: str = "time [s]"
    y_label: str = ""
    logarithmic: bool = False


@dataclass(frozen=True)
class Outcome:
    """What a judge measured with one scheme."""

    figures: Sequence[Figure]
    curves: Sequence[Curve] = ()

    @property
    def passed(self) -> bool:
        return bool(self.figures) and all(figure.passed for figure in self.figures)


@dataclass(frozen=True)
class HardCase:
    """A scene on which multibody systems fail, often silently.

    id : of its definition, 'g1-bouncing-ball'
    must : what must hold, in one sentence
    judge : integrator → `Outcome`; it runs the scene and compares
    schemes : names of the integrators it is judged with, see `mbd.hardcases.schemes`
    slow : left out unless asked for
    """

    id: str
    must: str
    judge: Callable[[Any], Outcome]
    schemes: Sequence[str] = ("HHT", "generalized-alpha")
    slow: bool = False
    notes: Mapping[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        return str(definition(self.id)["title"])


@cache
def definition(id: str) -> dict[str, Any]:
    """The case as data: 'definition', 'initial_conditions', 'quantities' (name, value, accuracy)."""
    found: dict[str, Any] = json.loads((files("mbd.hardcases") / "data" / f"{id}.json").read_text("utf-8"))
    return found


def reference(id: str, quantity: str) -> Any:
    """A reference value as an array or a number."""
    values = {entry["name"]: entry["value"] for entry in definition(id)["quantities"]}
    value = np.asarray(values[quantity])
    return value if value.ndim else value.item()
