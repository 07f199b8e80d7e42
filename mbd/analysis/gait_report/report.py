"""A report of one gait or of several beside each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mbd.analysis.gait_report.band import NormativeBand
from mbd.analysis.gait_report.curves import PERCENT, Curve, curves_of
from mbd.analysis.gait_report.measures import NO_SIDE, Measure, Spent, energy_of, measures_of
from mbd.analysis.gait_report.strides import Side, sides_of, words_of
from mbd.bodies.values import among, names_of, number, printable
from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.later import later
from mbd.notebook import table
from mbd.results.archive import named_file, write_whole
from mbd.results.opensim import write_storage
from mbd.results.tables import text_cell
from mbd.results.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

Definition = tuple[str, Callable[[float, float], float]]

DEFINITIONS: dict[str, Definition] = {
    "Robinson": ("%", lambda s, p: 200.0 * abs(s - p) / (abs(s) + abs(p))),
    "ratio": ("-", lambda s, p: p / s),
    "STA": ("-", lambda s, p: (s - p) / (abs(s) + abs(p))),
}
"""Unit and value of each definition, from the values x_s, x_p of the first and the second side.

Robinson: ``2 |x_s − x_p|/(|x_s| + |x_p|) · 100 %``, 0 where they are alike, 200 where one is zero or of the other
sign; of positive numbers the index as published (R. O. Robinson, W. Herzog & B. M. Nigg, Use of
force platform variables to quantify the effects of chiropractic manipulation on gait symmetry, J. Manipulative Physiol.
Ther. 10 (1987) 172); ratio: ``x_p/x_s``, 1 where they are alike; STA: ``(x_s − x_p)/(|x_s| + |x_p|)``, with a sign.
"""


@dataclass(frozen=True, eq=False)
class Walk:
    """What a report has of one run: its name, sides with their strides, numbers, curves, and energies of a stride."""

    name: str
    sides: tuple[Side, ...]
    measures: tuple[Measure, ...]
    curves: tuple[Curve, ...]
    energies: tuple[Spent, ...]

    def __getitem__(self, quantity: str) -> dict[str, float]:
        """The mean of a number by side: ``walk["step length"]["left"]``."""
        known = {measure.quantity: measure.mean for measure in self.measures}
        if quantity not in known:
            raise KeyError(f"no {quantity!r}; there are {', '.join(known)}")
        return known[quantity]

    def spent(self) -> dict[tuple[str, str], float]:
        """Energy of a stride by side and kind of cause [J]."""
        found: dict[tuple[str, str], float] = {}
        for each in self.energies:
            found[each.side, each.kind] = found.get((each.side, each.kind), 0.0) + each.energy
        return found


@dataclass(frozen=True, eq=False)
class GaitReport:
    """Numbers by side, symmetry, curves over the stride and energy by cause of one run or several.

    walks : one for each run; symmetry : name of the definition; mass : by which loads are divided [kg], or None
    band : of normal gait, behind the curves
    """

    walks: tuple[Walk, ...]
    symmetry: str
    mass: float | None
    band: NormativeBand | None = None

    def __getitem__(self, quantity: str) -> dict[str, float]:
        """A number of the first run by side: ``report["step length"]["left"]``."""
        return self.walks[0][quantity]

    def asymmetry(self, walk: Walk, measure: Measure) -> float:
        """The symmetry of a number by the definition chosen; NaN where a side has none, or where its parts cancel."""
        if len(walk.sides) < 2 or measure.cancels([side.name for side in walk.sides[:2]]):
            return float("nan")
        first, second = (measure.mean[side.name] for side in walk.sides[:2])
        with np.errstate(all="ignore"):
            value = symmetry_of(self.symmetry)[1](np.float64(first), np.float64(second))
        return float(value)

    @property
    def heads(self) -> tuple[str, ...]:
        """Titles of the columns of `rows`."""
        unit = symmetry_of(self.symmetry)[0]
        several = len(self.walks) > 1
        own = [(walk.name if several else "", walk) for walk in self.walks]
        found = ["quantity"]
        for name, walk in own:
            lead = f"{name}: " if name else ""
            found += [f"{lead}{side.name}" for side in walk.sides]
            found += [f"{lead}symmetry index ({self.symmetry}) [{unit}]"] * (len(walk.sides) > 1)
        return tuple(found)

    def rows(self) -> list[tuple[str, ...]]:
        """The table of numbers as texts: means by side and the symmetry of each, for every run."""
        found = []
        for first in self.walks[0].measures:
            cells = [f"{first.quantity} [{first.unit}]"]
            for walk in self.walks:
                measure = next(each for each in walk.measures if each.quantity == first.quantity)
                cells += [_text(measure.mean[side.name]) for side in walk.sides]
                cells += [self._asymmetry_text(walk, measure)] * (len(walk.sides) > 1)
            found.append(tuple(cells))
        return found

    def _asymmetry_text(self, walk: Walk, measure: Measure) -> str:
        """To a hundredth of a percent: what is finer is no asymmetry."""
        value, digits = self.asymmetry(walk, measure), 2 if symmetry_of(self.symmetry)[0] == "%" else 4
        return f"{round(value, digits) + 0.0:.{digits}f}" if np.isfinite(value) else "–"

    def energy_rows(self) -> list[tuple[str, ...]]:
        """Energy of a stride by side and kind of cause [J] as texts, one column for each run."""
        keys = dict.fromkeys(key for walk in self.walks for key in walk.spent())
        order = {side.name: k for k, side in enumerate(self.walks[0].sides)}
        ordered = sorted(keys, key=lambda key: (key[1], order.get(key[0], len(order))))
        return [
            (
                kind if side == NO_SIDE else f"{kind}, {side}",
                *(_text(walk.spent().get((side, kind), 0.0) if walk.energies else np.nan) for walk in self.walks),
            )
            for side, kind in ordered
        ]

    # shown --------------------------------------------------------------------------------------------------------
    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        for walk in self.walks:
            counts = ", ".join(f"{len(side.strides)} {side.name}" for side in walk.sides)
            yield f"{walk.name}: strides {counts}"
        yield from _columns([self.heads, *self.rows()])
        yield ""
        if self.band is not None:
            yield f"band of normal gait: {self.band.source}"
        if energies := list(self.energy_rows()):
            yield from _columns([("energy of a stride [J]", *(walk.name for walk in self.walks)), *energies])

    def _repr_html_(self) -> str:
        spent = ("energy of a stride [J]", *(walk.name for walk in self.walks))
        return table("gait", self.heads, self.rows()) + table("energy", spent, self.energy_rows())

    def to_dataframe(self, what: str = "numbers") -> DataFrame:
        """A pandas table.

        Parameters
        ----------
        what : 'numbers' (a row for each run, quantity and side), 'curves' (the percent of the stride as index, a column
            for each run, side, subject and quantity) or 'energy' (a row for each run and cause)
        """
        from mbd.results.tables import library

        pandas = library("pandas", "data", "report.to_dataframe()")
        if what == "numbers":
            return pandas.DataFrame(self._numbers(), columns=("run", "quantity", "unit", "side", "mean", "spread"))
        if what == "curves":
            columns = {
                (walk.name, curve.side, curve.subject, curve.quantity, curve.unit): curve.mean
                for walk in self.walks
                for curve in walk.curves
            }
            return pandas.DataFrame(columns, index=pandas.Index(PERCENT, name="stride [%]"))
        if what == "energy":
            rows = [(walk.name, s.side, s.kind, s.name, s.energy) for walk in self.walks for s in walk.energies]
            return pandas.DataFrame(rows, columns=("run", "side", "kind", "name", "energy [J]"))
        raise ModelError(f"to_dataframe(what=…) takes 'numbers', 'curves' or 'energy', not {what!r}")

    def _numbers(self) -> Iterator[tuple[str, str, str, str, float, float]]:
        unit = symmetry_of(self.symmetry)[0]
        for walk in self.walks:
            for m in walk.measures:
                for side in walk.sides:
                    yield walk.name, m.quantity, m.unit, side.name, m.mean[side.name], m.spread[side.name]
                if len(walk.sides) > 1:
                    yield walk.name, m.quantity, unit, self.symmetry, self.asymmetry(walk, m), float("nan")

    def to_csv(self, path: str | Path) -> Path:
        """Write the numbers; curves and energies go beside them, as ``NAME-curves.csv`` and ``NAME-energy.csv``."""
        target = named_file(path)
        for what in ("numbers", "curves", "energy"):
            place = target if what == "numbers" else target.with_name(f"{target.stem}-{what}{target.suffix}")
            frame = self.to_dataframe(what)
            if what == "curves":
                frame.columns = [": ".join(column[:2]) + f" {column[2]} {column[3]} [{column[4]}]" for column in frame]
            frame.columns = [text_cell(column) for column in frame]
            frame = frame.apply(lambda column: column.map(text_cell))
            write_whole(place, lambda partial, f=frame, w=what: f.to_csv(partial, index=w == "curves"))  # type: ignore[misc]
        return target

    def to_sto(self, path: str | Path) -> Path:
        """Write the curves as a storage file of OpenSim (.sto or .mot), whose time is the percent of the stride."""
        columns = {
            f"{walk.name} {each.side} {each.subject} {each.quantity}": each.mean
            for walk in self.walks
            for each in walk.curves
        }
        degrees = any(each.unit == "°" for walk in self.walks for each in walk.curves)
        return write_storage(path, "gait", PERCENT, columns, degrees, ["time is the percent of the stride"])

    def plot(self, path: str | Path | None = None) -> Figure:
        """Curves of joints and ground over the stride and energies, as gait laboratories draw them."""
        figure: Figure = later("GaitReport.plot")(self, path)
        return figure

    def page(self, path: str | Path) -> Path:
        """Write one self-contained page with tables and pictures."""
        written: Path = later("GaitReport.page")(self, path)
        return written


def gait_report(
    run: Any, *others: Any, names: Sequence[str] | None = None, sides: Sequence[str] | None = None,
    symmetry: str = "Robinson", mass: float | None = None, strides: int | None = None,
    band: NormativeBand | None = None,
) -> GaitReport:  # fmt: skip
    """How a walker walks: numbers by side, symmetry, curves over the stride, energy by side and cause; runs compared.

    A side is a word in names: 'left foot' is the left foot, 'left knee' the left knee. A stride is from a strike of a
    foot to its next, all numbers are means over the strides. On a slope lengths lie along it and forces are normal to
    it.

    *Numbers*: step length and time (of the step that the side's strike ends), stride length and time, speed, cadence,
    stance, swing and double support in percent of the stride, clearance (smallest gap in the middle of swing), normal
    impulse (with that of the strike), peak normal force between impacts. *Curves*: angle, net moment and power of each
    joint of a side (moment: all that acts along the joint's coordinate but gravity and the ground, as inverse dynamics
    finds it), normal and forward force of the ground. *Energy*: what each cause gave in a stride.

    Parameters
    ----------
    run, others : trajectories of `simulate`; gaits with a `walk` or a `run`, such as of `limit_cycle`; what was
        measured, so that it stands beside a simulation: the result of `mbd.inverse_dynamics` with plates, or a
        `Recording` with foot strikes among its events
    names : of the runs in tables, by default those of their models
    sides : words of both sides, the sound one first where one is not, or one word; by default 'left' and 'right'. A
        machine whose feet have neither word, a hopper or a wheel, has one side 'all'; each strike ends a stride of it
    symmetry : 'Robinson' ``2 |x_s − x_p|/(|x_s| + |x_p|) · 100 %``, 'ratio' ``x_p/x_s`` or 'STA' ``(x_s −
        x_p)/(|x_s| + |x_p|)``, s the first side; a dash where braking and driving cancel
    mass : of the body, by which loads, moments and powers are divided [kg]; None: they are as they are
    strides : how many of each side count, the last ones; None: all that are whole
    band : of normal gait, drawn behind the curves with its source, see `mbd.read_band`; moments and powers need `mass`

    Raises
    ------
    TrajectoryError
        for a run without a foot of a side, or without a whole stride; the sentence has its strikes.
    ModelError, UnknownNameError
        for wrong arguments, by name.

    >>> import mbd
    >>> mbd.gait_report(3)
    Traceback (most recent call last):
    mbd.errors.ModelError: gait_report takes runs of mbd.simulate, or gaits that have a run; got 3
    """
    words = None if sides is None else names_of((sides,) if isinstance(sides, str) else sides, "sides of gait_report")
    if words is not None and (len(words) not in (1, 2) or len(set(words)) != len(words)):
        raise ModelError(f"sides of gait_report are two words such as ('left', 'right'), or one, got {sides!r}")
    symmetry_of(symmetry)
    size = None if mass is None else number(mass, "mass of gait_report")
    if size is not None and size <= 0.0:
        raise ModelError(f"mass of gait_report must be positive, got {size:g} kg")
    if strides is not None and (not isinstance(strides, int) or isinstance(strides, bool) or strides < 1):
        raise ModelError(f"strides of gait_report is a number of strides ≥ 1, got {strides!r}")
    if band is not None and not isinstance(band, NormativeBand):
        raise ModelError(f"band of gait_report is an mbd.NormativeBand, as mbd.read_band gives it; got {band!r}")
    walks = [_walked(each) for each in (run, *others)]
    titles = _titles([each.name for each in walks] if names is None else _given(names))
    if len(titles) != len(walks):
        raise ModelError(f"names of gait_report are one for each run; got {len(titles)} names and {len(walks)} runs")
    reports = [_walk(each, title, words, size, strides) for each, title in zip(walks, titles, strict=True)]
    return GaitReport(tuple(reports), symmetry, size, band)


class Measured(Protocol):
    """What was measured of a gait, and reports itself."""

    name: str

    def walk(self, title: str, words: Sequence[str], mass: float | None, strides: int | None) -> Walk:
        """Its strides, numbers and curves."""


def _walked(value: Any) -> Trajectory | Measured:
    """The run of what was given; a gait walks some strides."""
    if isinstance(value, Trajectory):
        return value
    if hasattr(value, "measured_gait"):
        measured: Measured = value.measured_gait()
        return measured
    walk = getattr(value, "walk", None)
    run = walk(6) if callable(walk) else getattr(value, "run", None)
    if not isinstance(run, Trajectory):
        raise ModelError(f"gait_report takes runs of mbd.simulate, or gaits that have a run; got {value!r}")
    return run


def _given(names: Any) -> list[str]:
    """Names of runs that can be shown anywhere."""
    return [printable(name, "names of gait_report:") for name in names_of(names, "names of gait_report")]


def _titles(names: Sequence[str]) -> list[str]:
    """The names, numbered where two are alike."""
    return [name if names.count(name) == 1 else f"{name} ({k})" for k, name in enumerate(names, start=1)]


def _walk(
    run: Trajectory | Measured, title: str, words: Sequence[str] | None, mass: float | None, strides: int | None
) -> Walk:
    if not isinstance(run, Trajectory):
        return run.walk(title, words or ("left", "right"), mass, strides)
    sides = sides_of(run, words or words_of(run), strides)
    return Walk(
        title, tuple(sides), tuple(measures_of(run, sides, mass)), tuple(curves_of(run, sides, mass)),
        tuple(energy_of(run, sides)),
    )  # fmt: skip


def _text(value: float, digits: int = 4) -> str:
    return f"{value:.{digits}g}" if np.isfinite(value) else "–"


def _columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of aligned texts, the first column at the left."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return [
        row[0].ljust(widths[0])
        + "".join(cell.rjust(width + 2) for cell, width in zip(row[1:], widths[1:], strict=True))
        for row in rows
    ]


def symmetry_of(name: str) -> Definition:
    """A definition by its name.

    >>> symmetry_of("Robinson")[1](3.0, 1.0)
    100.0
    """
    if not among(name, DEFINITIONS):
        raise UnknownNameError("symmetry: " + nearest(name, DEFINITIONS, "definition", "There are"))
    return DEFINITIONS[name]
