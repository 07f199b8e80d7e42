"""Walks from many starts side by side: return after return, until each is decided."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.gait.basin.balls import Ball
from mbd.gait.basin.kinds import NUMBER
from mbd.gait.basin.verdicts import Verdicts
from mbd.gait.machines import counted_from
from mbd.gait.return_map import ReturnMap
from mbd.kernel import codes
from mbd.simulation.batch.changes import Changes
from mbd.simulation.batch.runner import Runner
from mbd.simulation.many_runs import Ends, start_line
from mbd.state import State

Numbers = NDArray[np.int64]


@dataclass(eq=False)
class Decided:
    """What became of N starts: number of the kind, of the attractor (−1: none), steps taken, time until then [s]."""

    kind: Numbers
    attractor: Numbers
    steps: Numbers
    time: Vector

    @classmethod
    def of(cls, count: int) -> Decided:
        """Nothing is decided yet."""
        undecided = np.full(count, NUMBER["not decided"])
        return cls(undecided, np.full(count, -1), np.zeros(count, dtype=np.int64), np.zeros(count))

    def part(self, first: int, last: int) -> Decided:
        """That of some starts; what is noted there is noted here."""
        return Decided(*(getattr(self, name)[first:last] for name in ("kind", "attractor", "steps", "time")))

    def take(self, places: Numbers, other: Decided) -> None:
        """Note what became of the starts at these places."""
        for name in ("kind", "attractor", "steps", "time"):
            getattr(self, name)[places] = getattr(other, name)


@dataclass(eq=False)
class Walks:
    """Makes returns of a map for many states at once.

    map : of the walker; runner : makes the runs, each until the section
    """

    map: ReturnMap
    runner: Runner
    verdicts: Verdicts = field(init=False)

    def __post_init__(self) -> None:
        run, v = self.runner.run, self.runner.run.kernel
        self.verdicts = Verdicts(self.map, self.runner)
        names = run.manager.names
        mirror = self.map.mirror
        self._contacts = np.arange(v.n_contacts)
        if mirror is not None:
            self._contacts = np.array([names.index(mirror.name(name)) for name in names], dtype=np.intp)
        n_y = 1 + v.n_q
        self._cuts = np.cumsum([1, v.n_q, v.n_v, v.n - v.n_v, v.n_anchors, v.n_contacts])
        self._at_y = n_y

    # lines of starts ----------------------------------------------------------------------------------------------
    def parts(self, lines: Matrix) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        """q, v, z and anchors of lines of starts, as views."""
        _, q, v, z, anchors, _, _ = np.split(lines, self._cuts, axis=1)
        return q, v, z, anchors

    def lines(self, states: Sequence[State]) -> Matrix:
        """Lines of states."""
        return np.array([start_line(self.runner.run, state) for state in states])

    def states(self, lines: Matrix, base: State) -> list[State]:
        """States of lines on the section of a base."""
        from dataclasses import replace

        parts = zip(*self.parts(lines), strict=True)
        return [replace(base, q=q.copy(), v=v.copy(), z=z.copy(), anchors=a.copy()) for q, v, z, a in parts]

    # returns ------------------------------------------------------------------------------------------------------
    def following(self, ends: Ends) -> Matrix:
        """The lines from which the next returns begin: time 0, sides exchanged where the map does."""
        run, mirror = self.runner.run.kernel, self.map.mirror
        row = ends.row
        q, v = row[:, 1 : self._at_y], row[:, self._at_y : self._at_y + run.n_v]
        z = row[:, self._at_y + run.n_v : self._at_y + run.n]
        at = self._at_y + 2 * run.n + run.n_rows
        closed = row[:, at : at + run.n_contacts]
        anchors = counted_from(self.map.mechanism.equations, ends.anchors, row[:, 0])
        if mirror is not None:
            q, v, z, anchors = mirror.of_q(q), mirror.of_v(v), z[:, mirror.z], mirror.of_anchors(anchors)
        armed = ends.armed[:, self._contacts]
        return np.hstack([np.zeros((len(row), 1)), q, v, z, anchors, closed[:, self._contacts], armed])

    def decide(
        self, lines: Matrix, good: NDArray[np.bool_], changes: Changes, which: Numbers,
        balls: Sequence[Sequence[tuple[int, Ball]]], steps: int, found: Decided,
    ) -> None:  # fmt: skip
        """Note in `found`, return by return, what becomes of starts that are not decided yet.

        Parameters
        ----------
        lines : of starts; good : those that are on the section
        changes : parameters of each; which : number of its set among `balls`, which has (attractor, ball) for each
        steps : returns at most
        """
        found.kind[~good] = NUMBER["not on the section"]
        left = np.flatnonzero(good)
        lines = lines[left]
        left, lines = self._caught(found, left, lines, which, balls)
        for _ in range(steps):
            if not len(left):
                break
            own = changes.part(left) if changes.varies else changes
            ends = self.runner.ends(lines, own)
            judged = self.runner.judged(lines, ends, own) & (ends.status < codes.DOUBTFUL_START)
            kinds = self.verdicts.kinds(lines, ends, own)
            kinds[judged] = NUMBER["numerical error"]
            found.time[left] += np.where(kinds == NUMBER["not on the section"], 0.0, ends.time)
            on = kinds < 0
            found.steps[left[on]] += 1
            found.kind[left[~on]] = kinds[~on]
            following = self.following(ends)
            left, lines = left[on], following[on]
            left, lines = self._caught(found, left, lines, which, balls)

    def _caught(
        self, found: Decided, left: Numbers, lines: Matrix, which: Numbers, balls: Sequence[Sequence[tuple[int, Ball]]]
    ) -> tuple[Numbers, Matrix]:
        """Note the walks that have come into a ball; the others."""
        inside = np.zeros(len(left), dtype=bool)
        for number, several in enumerate(balls):
            here = np.flatnonzero(which[left] == number) if len(balls) > 1 else np.arange(len(left))
            for attractor, ball in several:
                held = here[ball.holds(*self.parts(lines[here]))] if len(here) else here
                fresh = held[~inside[held]]
                found.attractor[left[fresh]] = attractor  # before the kind: Ctrl-C may come between any two lines
                found.kind[left[fresh]] = NUMBER["walks"]
                inside[fresh] = True
        return left[~inside], lines[~inside]

    def walked(
        self, states: list[State], strides: int, changes: Changes
    ) -> tuple[list[State], NDArray[np.bool_]]:  # fmt: skip
        """Where so many returns lead from states of the section, and which of them arrive."""
        lines, good = self.lines(states), np.ones(len(states), dtype=bool)
        for _ in range(strides):
            ends = self.runner.ends(lines, changes)
            good &= self.verdicts.kinds(lines, ends, changes) < 0
            lines = self.following(ends)
        return self.states(lines, states[0]), good
