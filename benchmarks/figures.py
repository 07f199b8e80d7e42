"""Figures: a measured number with its aim and what it is measured against."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from time import sleep

NOISY = 1.2
"""Median over minimum of the repeats above which a figure is marked as taken on a busy machine."""


@dataclass(frozen=True)
class Figure:
    """One number.

    Parameters
    ----------
    name : what was measured
    value, unit : smaller is better
    aim : what it should not exceed, in the same unit
    yardstick, reference : name and value of something fixed that was measured in the same run, in the same unit, so
        that days and machines compare by ``value / reference``
    aim_ratio : what ``value / reference`` should not exceed
    spread : median over minimum of the repeats
    """

    name: str
    value: float
    unit: str
    aim: float | None = None
    yardstick: str = ""
    reference: float | None = None
    aim_ratio: float | None = None
    spread: float = 1.0

    @property
    def ratio(self) -> float | None:
        """The value in units of the yardstick."""
        return self.value / self.reference if self.reference else None

    @property
    def missed(self) -> bool:
        """Whether the aim, or that of the ratio, is missed."""
        over = self.aim is not None and self.value > self.aim
        return over or (self.aim_ratio is not None and self.ratio is not None and self.ratio > self.aim_ratio)


@dataclass(frozen=True)
class Samples:
    """Repeated measurements of one thing [s]."""

    seconds: tuple[float, ...]

    @property
    def least(self) -> float:
        return min(self.seconds)

    @property
    def spread(self) -> float:
        """Median over minimum: 1 on a quiet machine."""
        return median(self.seconds) / self.least if self.least > 0.0 else 1.0


BURST = 5
"""Rounds between two pauses of `interleaved`."""


def interleaved(tasks: Mapping[str, Callable[[], float]], repeats: int, pause: float = 0.0) -> dict[str, Samples]:
    """Every task once, then every task again …, so that a disturbance hits all alike; after one round to warm up.

    A task returns the seconds that count, which need not be all that it takes. Seconds of `pause` after every `BURST`
    of rounds spread them over longer than others keep a core busy.
    """
    for task in tasks.values():
        task()
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for turn in range(repeats):
        if turn and turn % BURST == 0:
            sleep(pause)
        for name, task in tasks.items():
            seconds[name].append(task())
    return {name: Samples(tuple(values)) for name, values in seconds.items()}


def table(figures: Sequence[Figure]) -> str:
    """The figures as text, one a line."""
    width = max(len(figure.name) for figure in figures)
    lines = [f"{'':<{width}}  {'measured':>16}  {'aim':>8}  {'in yardsticks':<34}  {'aim':>4}"]
    for f in figures:
        aim = f"{f.aim:.4g}" if f.aim is not None else ""
        times = f"{f.ratio:.3g} × {f.yardstick}" if f.ratio is not None else ""
        aim_ratio = f"{f.aim_ratio:.3g}" if f.aim_ratio is not None else ""
        marks = ("  MISSED" if f.missed else "") + (f"  noisy ({f.spread:.2f})" if f.spread > NOISY else "")
        value = f"{f.value:.4g} {f.unit}"
        lines.append(f"{f.name:<{width}}  {value:>16}  {aim:>8}  {times:<34}  {aim_ratio:>4}{marks}".rstrip())
    return "\n".join(lines)
