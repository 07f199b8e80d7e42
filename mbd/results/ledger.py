"""The energy of a run, divided by cause."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.errors import UnknownNameError, nearest

__all__ = ["Ledger", "Part"]


@dataclass(frozen=True, eq=False)
class Part:
    """Energy that one cause has given to the mechanism since the start (negative: taken), at every row [J].

    kind : 'loss', 'applied', 'penalty', … of an effect; 'drive' (a prescribed motion, coordinates, a potential or a
    surface that move with time), 'impact', 'reset' (a user's event set values, a controller changed parameters)
    """

    name: str
    kind: str
    energy: Vector


@dataclass(frozen=True, eq=False)
class Ledger:
    """Energy of a run at every stored row.

    time [s], kinetic T [J], potential V [J] (R,); parts : what changed T + V, each summed from the start;
    stride : steps between stored rows, over which works are integrated
    """

    time: Vector
    kinetic: Vector
    potential: Vector
    parts: tuple[Part, ...]
    stride: int = 1

    @property
    def total(self) -> Vector:
        """E = T + V [J]."""
        return self.kinetic + self.potential

    @property
    def change(self) -> float:
        """ΔE from the first row to the last [J]."""
        return _last(self.total) - _last(self.total[:1])

    @property
    def numerical(self) -> Vector:
        """E(t) − E(0) − all parts [J]: what the integrator itself gained or lost."""
        left = self.total - _last(self.total[:1])
        for part in self.parts:
            left = left - part.energy
        return np.asarray(left)

    @property
    def drift(self) -> float:
        """Largest |numerical| over the largest swing of kinetic energy [-]; zero for a mechanism that never moves."""
        scale = float(np.ptp(self.kinetic)) if len(self.kinetic) else 0.0
        scale = scale or float(np.max(np.abs(self.kinetic), initial=0.0))
        worst = float(np.max(np.abs(self.numerical), initial=0.0))
        return worst / scale if scale > 0.0 else 0.0

    @property
    def sums(self) -> dict[str, float]:
        """Each part at the end of the run, and 'numerical'; together they make `change` [J]."""
        found = {part.name: _last(part.energy) for part in self.parts}
        found["numerical"] = _last(self.numerical)
        return found

    @property
    def work(self) -> dict[str, Vector]:
        """Each part over time [J]."""
        return {part.name: part.energy for part in self.parts}

    def __getitem__(self, name: str) -> Vector:
        """'kinetic', 'potential', 'total', 'numerical', or a part by its name [J]."""
        columns = {
            "kinetic": self.kinetic, "potential": self.potential, "total": self.total, "numerical": self.numerical,
        } | self.work  # fmt: skip
        if name not in columns:
            raise UnknownNameError(nearest(name, columns, "part of the energy"))
        return columns[name]

    def __repr__(self) -> str:
        width = max(18, *(len(part.name) + 2 for part in self.parts)) if self.parts else 18
        lines = [f"{'energy':<{width}}{'start':>14}{'end':>14}{'change':>14}   [J]"]
        for name, column in (("kinetic", self.kinetic), ("potential", self.potential), ("total", self.total)):
            begin, end = _last(column[:1]), _last(column)
            lines.append(f"{name:<{width}}{begin:>14.6g}{end:>14.6g}{end - begin:>14.6g}")
        lines.append("of which")
        kinds = {part.name: part.kind for part in self.parts}
        for name, value in self.sums.items():
            kind = kinds.get(name, "the integrator")
            lines.append(f"  {name:<{width - 2}}{'':>28}{value:>14.6g}   {kind}")
        if self.stride > 1 and self.parts:
            lines.append(
                f"works are integrated over rows {self.stride} steps apart, whose error stands under 'numerical'"
            )
        return "\n".join(lines)

    def plot(self, path: Any = None) -> Any:
        """The energies over time, and where they went; returns the matplotlib figure, saved if a path is given."""
        from mbd.view.plots import energy

        return energy(self, path=path)


def _last(column: Vector) -> float:
    """The last value; 0 for a run that failed before its first row."""
    return float(column[-1]) if len(column) else 0.0
