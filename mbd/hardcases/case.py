"""What a hard case is: a definition with reference values, what must hold, and a judge that measures it."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cache, partial
from importlib.resources import files
from typing import Any

from mbd.dataclass import dataclass
from mbd.hardcases.schemes import EVERY

ROUND_OFF = 1e-10
"""What round-off and the tolerance of Newton's method may leave [m, rad, m/s, -]."""
CLOSURE_ATOL = 1e-8
"""Gap of a joint [m] and angle between parallel links [rad] that are allowed beside singular poses."""


@dataclass(frozen=True)
class Figure:
    """One measured number and the most it may be; NaN never passes. Without a limit it is shown, not judged.

    what : in plain words, with the unit in brackets: 'error of the first impact time [s]'
    value, limit : measured, allowed
    """

    what: str
    value: float
    limit: float = math.inf

    @property
    def is_judged(self) -> bool:
        return self.limit < math.inf

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
        return any(figure.is_judged for figure in self.figures) and all(figure.passed for figure in self.figures)


@dataclass(frozen=True)
class HardCase:
    """A scene on which multibody systems fail, often silently.

    id : of its definition, 'g1-bouncing-ball'
    must : what must hold, in one sentence
    judge : integrator → `Outcome`; it runs the scene and compares
    schemes : names of the integrators it is judged with, see `mbd.hardcases.schemes`
    slow : left out unless asked for
    label : short name where the beginning of the id is shared with another: 'b2-N1'
    """

    id: str
    must: str
    judge: Callable[[Any], Outcome]
    schemes: Sequence[str] = ("HHT", "generalized-alpha")
    slow: bool = False
    notes: Mapping[str, str] = field(default_factory=dict)
    label: str = ""

    @property
    def title(self) -> str:
        return str(definition(self.id)["title"])


def hard_case(id: str, must: str, judge: Callable[[str, Any], Outcome], schemes: Sequence[str] = EVERY) -> HardCase:
    """A case whose judge is told which definition it judges."""
    return HardCase(id, must, partial(judge, id), schemes)


def definition(id: str) -> dict[str, Any]:
    """The case as data: 'definition', 'initial_conditions', 'quantities' (name, value, accuracy)."""
    return read(id)


@cache
def read(id: str) -> dict[str, Any]:
    """The file of a definition."""
    found: dict[str, Any] = json.loads((files("mbd.hardcases") / "data" / f"{id}.json").read_text("utf-8"))
    return found
