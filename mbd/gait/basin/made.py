"""The starts of a study, and what makes their walks: states on the section, parameters, balls round the attractors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError, GaitError, ModelError
from mbd.gait.basin.axes import Study, kinds_of_parameters
from mbd.gait.basin.balls import Ball, ball_of
from mbd.gait.basin.onto_section import OntoSection
from mbd.gait.basin.walks import Decided, Walks
from mbd.gait.cycle import LimitCycle
from mbd.gait.return_map import ReturnMap
from mbd.simulation.batch.changes import Changes
from mbd.simulation.batch.runner import Runner
from mbd.simulation.batch.starts import raise_for_turning
from mbd.simulation.simulate import REST_SPEED
from mbd.state import State

MAX_GAITS = 1000
"""Sets of parameters at most, at each of which the gait is looked for."""


CHUNK = 1 << 16
"""Starts whose parameters are looked at together [-]."""
SAMPLED_STARTS = 257
"""Starts by whose parameters the mechanism is made [-]."""


def _spread(count: int) -> Any:
    """Numbers of some starts from the first to the last."""
    return np.unique(np.linspace(0, count - 1, min(count, SAMPLED_STARTS)).astype(int))


@dataclass(eq=False)
class Made:
    """The starts of a study, and what makes their walks.

    map : with the step of the study; gaits : attractors by name; base : parameters, functions of them among these
    """

    map: ReturnMap
    gaits: Mapping[str, LimitCycle]
    study: Study
    base: Mapping[str, float]
    threads: int

    def __post_init__(self) -> None:
        first = next(iter(self.gaits.values()))
        self.state, self.section = (
            replace(first.state, time=0.0, memory=None, moved={}, parameters={}),
            first.chart.section,
        )
        columns = self.study.columns(_spread(len(self.study.grid)))
        kinds, _ = kinds_of_parameters(self.base, columns[1], SAMPLED_STARTS)
        plain = [self.map.plain(values) for values in kinds]
        self.plain = {name: np.array([values[name] for values in plain]) for name in plain[0]}
        options = {"contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": REST_SPEED,
                   "backend": self.map.backend}  # fmt: skip
        until = (self.map.section, self.map.longest)
        self.runner = Runner(self.map.model, self.state, self.map.integrator, self.map.dt, until, self.plain, options,
                             self.threads)  # fmt: skip
        if self.runner.slow:
            raise CapabilityError(
                f"basins are walked in machine code, but {self.runner.slow}; write the model without it, or make a "
                "sweep of runs"
            )
        self.walks = Walks(self.map, self.runner)
        names = self.map.mechanism.equations.configuration.names
        turning = [names[place] for place in columns[0] if place < len(names)]
        raise_for_turning("axes", turning, self.map.mechanism, "vary angular velocities, or parameters")
        self._onto = OntoSection(self.section, columns[0])
        self.balls: dict[tuple[float, ...], list[tuple[int, Ball]]] = {}
        self._find_balls()

    @property
    def all_balls(self) -> list[list[Ball | None]]:
        """The balls of each set of parameters that was met, by attractor."""
        found = []
        for several in self.balls.values():
            known = dict(several)
            found.append([known.get(number) for number in range(len(self.gaits))])
        return found

    def changes(self, kinds: Sequence[Mapping[str, float]], which: Any) -> Changes:
        """The parameters of some starts as columns, functions evaluated once for each set."""
        plain = [self.map.plain(values) for values in kinds]
        if len(plain) == 1:
            return Changes(self.map.model, self.map.mechanism, {k: np.asarray(v) for k, v in plain[0].items()})
        columns = {name: np.array([values[name] for values in plain])[which] for name in plain[0]}
        return Changes(self.map.model, self.map.mechanism, columns)

    def _find_balls(self) -> None:
        """The balls at every set of parameters of the study, the gait followed from the nearest one that is known.

        Sets are taken by their distance from the parameters of the gaits, so that the order of starts changes nothing.
        """
        first, kinds = next(iter(self.gaits.values())), self._all_kinds()
        for values in kinds:
            self.map.require(values)
        table = np.array([[values[name] for name in values] for values in kinds])
        sizes = np.maximum(np.ptp(table, axis=0), 1e-300)
        own = {**getattr(self.map.model, "parameters", {}), **first.parameters}
        home = np.array([own.get(name, value) for name, value in kinds[0].items()])
        far = np.max(np.abs(table - home) / sizes, axis=1, initial=0.0)
        known: dict[str, list[tuple[Vector, LimitCycle]]] = {name: [(home, each)] for name, each in self.gaits.items()}
        for k in np.argsort(far, kind="stable"):
            values, place, found = kinds[k], table[k], []
            for number, name in enumerate(self.gaits):
                near = min(known[name], key=lambda one: float(np.max(np.abs(one[0] - place) / sizes, initial=0.0)))
                try:
                    here = near[1] if values == near[1].parameters else near[1].at(values)
                    known[name].append((place, here))
                    found.append((number, self._ball(name, here, values)))
                except (ModelError, GaitError):
                    if len(kinds) == 1:
                        raise
            self.balls[tuple(values.values())] = found

    def _ball(self, name: str, gait: LimitCycle, values: Mapping[str, float]) -> Ball:
        changes = self.changes([values], None)

        def walked(states: list[State]) -> Any:
            return self.walks.walked(states, gait.strides, changes)

        return ball_of(repr(name), gait, walked)

    def _all_kinds(self) -> list[dict[str, float]]:
        """The different sets of parameters of the study."""
        found: dict[tuple[float, ...], dict[str, float]] = {}
        total = len(self.study.grid)
        for first in range(0, total, CHUNK):
            runs = np.arange(first, min(first + CHUNK, total))
            _, columns = self.study.columns(runs)
            for values in kinds_of_parameters(self.base, columns, len(runs))[0]:
                found[tuple(values.values())] = values
            if len(found) > MAX_GAITS:
                raise ModelError(
                    f"axes give more than {MAX_GAITS} sets of parameters, at each of which the gait is looked for; "
                    "give fewer values, and study them part by part"
                )
            if not columns:
                break
        return list(found.values())

    def lines(self, runs: Any) -> tuple[Matrix, NDArray[np.bool_], Changes, Any, list[list[tuple[int, Ball]]]]:
        """Starts of these numbers as lines, whether they are on the section, their parameters, sets and balls."""
        state, columns = self.study.columns(runs)
        kinds, which = kinds_of_parameters(self.base, columns, len(runs))
        changes = self.changes(kinds, which)
        lines = np.repeat(self.walks.lines([self.state]), len(runs), axis=0)
        for place, column in state.items():
            lines[:, 1 + place] = column
        good = self._onto(*self.walks.parts(lines), changes.all_vectors(len(runs)))
        return lines, good, changes, which, [self.balls[tuple(values.values())] for values in kinds]

    def decide(self, runs: Any, steps: int, found: Decided) -> None:
        """Note what becomes of the starts with these numbers."""
        lines, good, changes, which, balls = self.lines(runs)
        self.walks.decide(lines, good, changes, which, balls, steps, found)

    def start(self, number: int) -> State:
        """The start of a number."""
        lines, good, changes, _, _ = self.lines(np.array([number]))
        if not good[0]:
            raise ModelError(f"start {number} is not on the section: no state there has the named numbers")
        return replace(self.walks.states(lines, self.state)[0], parameters=changes.at(0))
