"""The energy of a run, divided by cause."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from mbd.arrays import Vector, read_only
from mbd.bodies.values import among
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.later import later
from mbd.notebook import table

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

KINDS = (
    "joint loss", "damper", "friction", "penalty", "impact", "motor", "force", "constraint", "reset",
)  # fmt: skip
"""Kinds of causes, in the order in which they are reported; one of a user's own comes behind them."""

SPENT = ("joint loss", "damper", "friction", "penalty", "impact")
"""Kinds that take energy out; the others may give or take."""

TOTALS = ("kinetic", "potential", "total", "numerical")
"""Names of what the ledger is made of, which no part takes from it."""


@dataclass(frozen=True, eq=False)
class Part:
    """Energy that one cause has given to the mechanism since the start (negative: taken), at every row [J].

    name : of the element: 'left knee loss', 'hip motor', 'left foot impact'
    kind : 'joint loss', 'damper', 'friction' (dry), 'penalty', 'impact', 'motor', 'force', 'constraint' (a prescribed
        motion, coordinates, a potential or a surface that move with time) or 'reset' (a user's event set values, a
        controller changed parameters); of stored energy 'gravity' or 'potential', where `energy` is the energy itself
    withheld : why its energy is not told, NaN at every row; '' where it is
    """

    name: str
    kind: str
    energy: Vector
    withheld: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "energy", read_only(self.energy))

    @property
    def passed(self) -> float:
        """Energy that went through it, ``Σ |ΔE|`` over the rows [J]: what a loss took, and twice a spring's swing."""
        return float(np.sum(np.abs(np.diff(self.energy))))


def titled(parts: Iterable[Part], taken: Container[str]) -> dict[str, Vector]:
    """The energy of each part by its name, 'bumper (potential)' with its kind where that name is taken [J]."""
    return {f"{part.name} ({part.kind})" if part.name in taken else part.name: part.energy for part in parts}


@dataclass(frozen=True, eq=False)
class Ledger:
    """Energy of a run at every stored row: ``T + V = (T + V)₀ + Σ parts + numerical``.

    A part that can only take energy never shows that it gave some: where the rows of a run cannot tell its work it is
    withheld, with the reason, and stands under `numerical`.

    time [s], kinetic T [J], potential V [J] (R,)
    parts : what changed T + V, each integrated on its own from the start
    stored : V by element: gravity, springs, potentials
    stride : steps between stored rows, over which works are integrated
    marks : (time [s], name) of the events
    """

    time: Vector
    kinetic: Vector
    potential: Vector
    parts: tuple[Part, ...]
    stride: int = 1
    stored: tuple[Part, ...] = ()
    marks: tuple[tuple[float, str], ...] = ()

    def __post_init__(self) -> None:
        for name in ("time", "kinetic", "potential"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def total(self) -> Vector:
        """E = T + V [J]."""
        return self.kinetic + self.potential

    @property
    def change(self) -> float:
        """ΔE from the first row to the last [J]."""
        return _last(self.total) - _last(self.total[:1])

    @property
    @np.errstate(all="ignore")
    def numerical(self) -> Vector:
        """E(t) − E(0) − all parts [J]: what the integrator itself gained or lost, and parts that are withheld."""
        left = self.total - _last(self.total[:1])
        for part in self.parts:
            left = left if part.withheld else left - part.energy
        return np.asarray(left)

    @property
    @np.errstate(all="ignore")
    def drift(self) -> float:
        """Largest |numerical| over the largest swing of kinetic energy, over the energy where that swings by round-off
        alone [-]; zero for a mechanism that never moves, NaN where energies are too large for numbers.
        """
        scale, largest = np.ptp(self.kinetic) if len(self.kinetic) else 0.0, np.max(np.abs(self.kinetic), initial=0.0)
        scale = float(largest if scale <= EQUAL_RTOL * largest else scale)
        worst = float(np.max(np.abs(self.numerical), initial=0.0))
        return worst / scale if scale != 0.0 else 0.0

    @property
    def sums(self) -> dict[str, float]:
        """Each part at the end of the run, and 'numerical'; together they make `change` [J]."""
        return {title: _last(energy) for title, energy in (*self.work.items(), ("numerical", self.numerical))}

    @property
    def work(self) -> dict[str, Vector]:
        """Each part over time, by `titled` [J]."""
        return titled(self.parts, TOTALS)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of the parts, in the order of `KINDS`."""
        found = dict.fromkeys(part.kind for part in self.parts)
        known = [kind for kind in KINDS if kind in found]
        return (*known, *(kind for kind in found if kind not in KINDS))

    def of(self, kind: str) -> tuple[Part, ...]:
        """The parts of one kind."""
        return tuple(part for part in self.parts if part.kind == kind)

    def by_kind(self) -> dict[str, Vector]:
        """What each kind of cause has given since the start, over time, without withheld parts, and 'numerical' [J]."""
        nothing = np.zeros(len(self.time))
        found = {kind: sum((p.energy for p in self.of(kind) if not p.withheld), nothing) for kind in self.kinds}
        return {**found, "numerical": self.numerical}

    @property
    def _columns(self) -> dict[str, Vector]:
        work = self.work
        return {
            **self.by_kind(), **titled(self.stored, {*TOTALS, *work}),
            "kinetic": self.kinetic, "potential": self.potential, "total": self.total, **work,
        }  # fmt: skip

    def __getitem__(self, name: str) -> Vector:
        """'kinetic', 'potential', 'total', 'numerical', a part, stored energy or kind by its name [J].

        What is stored has its kind behind a name that it shares: 'bumper (potential)' beside the part 'bumper'.
        """
        columns = self._columns
        if not among(name, columns):
            raise UnknownNameError(nearest(name, columns, "part of the energy", "The ledger has"))
        return columns[name]

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        """The names that it has."""
        return iter(self._columns)

    def to_dataframe(self, by: Literal["element", "kind"] = "element") -> DataFrame:
        """A pandas table [J]: `time` as index; kinetic, potential, total; each part, or each kind; numerical."""
        if not among(by, ("element", "kind")):
            raise ModelError(f"to_dataframe(by=…) takes 'element' or 'kind', not {by!r}")
        from mbd.results.tables import library

        pandas = library("pandas", "data", "run.energy.to_dataframe()")
        causes = self.by_kind() if by == "kind" else {**self.work, "numerical": self.numerical}
        columns = {"kinetic": self.kinetic, "potential": self.potential, "total": self.total, **causes}
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        """T, V and E, then what changed them: by kind, those of several elements with their shares of it."""
        width = max([18, *(len(part.name) + 4 for part in self.parts), *(len(kind) + 4 for kind in self.kinds)])
        yield f"{'energy':<{width}}{'start':>14}{'end':>14}{'change':>14}   [J]"
        for name, column in (("kinetic", self.kinetic), ("potential", self.potential), ("total", self.total)):
            begin, end = _last(column[:1]), _last(column)
            yield f"{name:<{width}}{begin:>14.6g}{end:>14.6g}{end - begin:>14.6g}"
        yield "of which"
        for kind in self.kinds:
            parts = self.of(kind)
            totals = [_last(part.energy) for part in parts if not part.withheld]
            alone = len(parts) == 1
            title, note = (parts[0].name, f"   {kind}") if alone else (kind, "")
            yield f"  {title:<{width - 2}}{'':>28}{_number(sum(totals) if totals else None)}{note}"
            for part in () if alone else parts:
                yield f"    {part.name:<{width - 4}}{'':>14}{_number(None if part.withheld else _last(part.energy))}"
        withheld = [part for part in self.parts if part.withheld]
        yield (
            f"  {'numerical':<{width - 2}}{'':>28}{_number(_last(self.numerical))}   the integrator"
            f"{', and what is withheld' if withheld else ''}"
        )
        for part in withheld:
            yield f"{part.name!r} is withheld: {part.withheld}"
        if self.stride > 1 and self.parts:
            yield f"works are integrated over rows {self.stride} steps apart, whose error stands under 'numerical'"

    def _repr_html_(self) -> str:
        columns = {"kinetic": self.kinetic, "potential": self.potential, "total": self.total}
        rows: list[tuple[str, Any, Any, Any, str]] = [
            (name, _last(column[:1]), _last(column), _last(column) - _last(column[:1]), "")
            for name, column in columns.items()
        ]
        for part in self.parts:
            rows.append((part.name, "", "", "withheld" if part.withheld else _last(part.energy), part.kind))
        rows.append(("numerical", "", "", _last(self.numerical), "the integrator"))
        notes = "; ".join(f"{part.name!r} is withheld: {part.withheld}" for part in self.parts if part.withheld)
        return table("energy", ("part", "start [J]", "end [J]", "change [J]", "cause"), rows, notes)

    def plot(self, path: str | Path | None = None) -> Figure:
        """The energies over time, and where they went; returns the matplotlib figure, saved if a path is given."""
        figure: Figure = later("Ledger.plot")(self, path=path)
        return figure


def _number(value: float | None) -> str:
    """An energy of the table; 'withheld' for None."""
    return f"{'withheld':>14}" if value is None else f"{value:>14.6g}"


def _last(column: Vector) -> float:
    """The last value; 0 for a run that failed before its first row."""
    return float(column[-1]) if len(column) else 0.0
