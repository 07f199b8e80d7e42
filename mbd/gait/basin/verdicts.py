"""What the end of a return says: it arrives, or what became of the walk; by the rules of `ReturnMap`, for many."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.analysis.ending import FALLEN_HEIGHT_RATIO
from mbd.arrays import Matrix, Vector
from mbd.compile.python import array_function
from mbd.equal import INSTANT_RTOL
from mbd.gait.basin.kinds import NUMBER
from mbd.gait.return_map import ReturnMap
from mbd.kernel import codes
from mbd.results.facts import Facts
from mbd.simulation.batch.changes import Changes
from mbd.simulation.batch.runner import Runner
from mbd.simulation.many_runs import Ends

STILL_WALKING = -1
"""In place of a kind: the walk goes on."""
REST_SPEED_RATIO = 1e-3
"""Largest rate at the end over the largest at the start below which a walker stands [-]."""
Numbers = NDArray[np.int64]


class Verdicts:
    """The rules for one map.

    Parameters
    ----------
    map_ : whose section ends each run
    runner : that makes the runs
    """

    def __init__(self, map_: ReturnMap, runner: Runner) -> None:
        self.map, self.runner = map_, runner
        manager = runner.run.manager
        self.contacts = list(manager.names)
        names = [*manager.names, *(guard.name for guard in manager.guards)]
        self.section = names.index(map_.section)
        self.falls = {k: _side_in(name) for k, name in enumerate(names) if "fall" in name.lower()}
        self.feet = [self.contacts.index(name) for name in map_.feet]
        unilateral = [contact.kind != "penalty" for contact in manager.contacts]
        self._counting = np.array(unilateral, dtype=bool)
        self._points = _Points(map_)

    def kinds(self, lines: Matrix, ends: Ends, changes: Changes) -> Numbers:
        """The kind of each end (N,), STILL_WALKING where the walk is on the section."""
        status, found = ends.status, np.full(len(ends.status), NUMBER["numerical error"])
        found[status == codes.CHATTER] = NUMBER["chatters"]
        found[status == codes.DOUBTFUL_START] = NUMBER["not on the section"]
        found[status == codes.DONE] = NUMBER["misses"]
        event = status == codes.EVENT
        here = event & (ends.stopped_by == self.section)
        found[event & ~here] = NUMBER["other event"]
        found[here] = STILL_WALKING
        at_once = here & (ends.time <= INSTANT_RTOL * self.map.longest)
        found[at_once | (here & self._scuffs(lines, ends, changes))] = NUMBER["scuffs"]
        self._contacts(found, lines, ends)
        self._stands(found, lines, ends)
        self._falls(found, lines, ends, changes)
        finite = np.isfinite(ends.row).all(axis=1)
        found[~finite & (status <= codes.LAST)] = NUMBER["numerical error"]
        return found

    def closed(self, ends: Ends) -> Matrix:
        """Closed contacts (N, contacts) at the ends."""
        v = self.runner.run.kernel
        at = 1 + v.n_q + 2 * v.n + v.n_rows
        return np.asarray(ends.row[:, at : at + v.n_contacts])

    def _contacts(self, found: Numbers, lines: Matrix, ends: Ends) -> None:
        """On the section the contacts are closed that were at its beginning, sides exchanged."""
        v, mirror = self.runner.run.kernel, self.map.mirror
        if not self.contacts:
            return
        begun = lines[:, -2 * v.n_contacts : -v.n_contacts] if v.n_contacts else lines[:, :0]
        now = self.closed(ends)
        if mirror is not None:
            now = now[:, [self.contacts.index(mirror.name(name)) for name in self.contacts]]
        off = (now != begun) & self._counting
        missing = (off & (begun > now)).any(axis=1) & (self.section in self.feet)
        here = found == STILL_WALKING
        found[here & off.any(axis=1)] = NUMBER["wrong contacts"]
        found[here & missing] = NUMBER["scuffs"]

    def _scuffs(self, lines: Matrix, ends: Ends, changes: Changes) -> NDArray[np.bool_]:
        """Whether the foot of the section came down on the side of the stance foot from which it left."""
        found = np.zeros(len(lines), dtype=bool)
        v = self.runner.run.kernel
        if self.section not in self.feet:
            return found
        begun = lines[:, -2 * v.n_contacts : -v.n_contacts]
        for stance in self.feet:
            others = [foot for foot in self.feet if foot not in (stance, self.section)]
            if stance == self.section:
                continue
            alone = (ends.before[:, stance] == 1) & ~(ends.before[:, others] == 1).any(axis=1)
            alone &= begun[:, self.section] == 0
            if not alone.any():
                continue
            names = [self.contacts[self.section], self.contacts[stance]]
            was, now = (
                self._points.between(names, inputs, changes)
                for inputs in (self.runner.inputs(lines), self.runner.inputs(ends.row))
            )
            along = np.sum(was * now, axis=1)
            found |= alone & (along > 0.0) & (np.sum(was * was, axis=1) > 0.0)
        return found

    def _stands(self, found: Numbers, lines: Matrix, ends: Ends) -> None:
        v = self.runner.run.kernel
        rates = (part[:, 1 + v.n_q : 1 + v.n_q + v.n_v] for part in (lines, ends.row))
        before, after = (np.max(np.abs(each), axis=1, initial=0.0) for each in rates)
        found[(found == NUMBER["misses"]) & (after <= REST_SPEED_RATIO * before)] = NUMBER["stands"]

    def _falls(self, found: Numbers, lines: Matrix, ends: Ends, changes: Changes) -> None:
        """Events named a fall, and walkers that are down; the side by where the highest point went first."""
        fallen = np.isin(ends.stopped_by, list(self.falls)) & (found == NUMBER["other event"])
        low = (found == NUMBER["misses"]) | (found == NUMBER["stands"])
        some = np.flatnonzero(fallen | low)
        if not len(some):
            return
        own = changes.part(some) if changes.varies else changes
        at_start, at_end = self.runner.inputs(lines[some]), self.runner.inputs(ends.row[some])
        stance = self._stance(lines[some])
        down, side = self._points.falls(at_start, at_end, stance, own)
        is_fall = fallen[some] | down
        kind = np.where(
            side > 0, NUMBER["falls forward"], np.where(side < 0, NUMBER["falls backward"], NUMBER["falls"])
        )
        for number, named in self.falls.items():
            if named:
                kind[ends.stopped_by[some] == number] = NUMBER[named]
        found[some[is_fall]] = kind[is_fall]

    def _stance(self, lines: Matrix) -> Sequence[str]:
        """The foot that each stands on at first; '' where there is none."""
        v = self.runner.run.kernel
        begun = lines[:, -2 * v.n_contacts : -v.n_contacts] if v.n_contacts else lines[:, :0]
        names = np.full(len(lines), "", dtype=object)
        for foot in reversed(self.feet):
            names[begun[:, foot] == 1] = self.contacts[foot]
        return list(names)


def _side_in(name: str) -> str:
    """The kind of fall that the name of an event tells."""
    side = next((word for word in ("forward", "backward") if word in name.lower()), "")
    return f"falls {side}" if side else ""


class _Points:
    """Places of feet and of the points of bodies in many states."""

    def __init__(self, map_: ReturnMap) -> None:
        self.map, self.equations = map_, map_.mechanism.equations
        facts, known = Facts.of(self.equations), set(self.equations.output_names())
        names = [name for body, frames in facts.segments for frame in frames for name in (f"{body}.{frame}", frame)]
        self.points = [name for name in dict.fromkeys(names) if f"{name}.x" in known]

    def at(self, names: Sequence[str], inputs: dict[str, Matrix], parameters: Vector | Matrix) -> NDArray[np.float64]:
        """Places (N, points, 3) [m]."""
        with self.equations.tape.lock:
            function = array_function([self.equations.output(f"{name}.{axis}") for name in names for axis in "xyz"])
        count = len(inputs["q"])
        inputs = {**inputs, "anchor": np.zeros((count, max(self.equations.n_anchors, 1)))}
        return np.column_stack(function(inputs, parameters)).reshape(count, len(names), 3)

    def between(self, contacts: Sequence[str], inputs: dict[str, Matrix], changes: Changes) -> Matrix:
        """From the place of the second contact to that of the first (N, 3)."""
        names = [self.map.feet[contact] for contact in contacts]
        places = self.at(names, inputs, changes.all_vectors(len(inputs["q"])))
        return np.asarray(places[:, 0] - places[:, 1])

    def falls(
        self, start: dict[str, Matrix], end: dict[str, Matrix], stance: Sequence[str], changes: Changes
    ) -> tuple[NDArray[np.bool_], Numbers]:
        """Whether the walker is less than half as high over its foot as at first, and to which side it leans (±1)."""
        count = len(start["q"])
        up, parameters = _up(self.map, changes, count), changes.all_vectors(count)
        size = np.linalg.norm(up, axis=1)
        if len(self.points) < 2 or not size.all():
            return np.zeros(count, dtype=bool), np.zeros(count, dtype=np.int64)
        up = up / size[:, np.newaxis]
        was, now = (self.at(self.points, inputs, parameters) for inputs in (start, end))
        # time ahead at which it is looked where the highest point goes [s]
        moved = {**start, "q": start["q"] + 1e-4 * self._rates(start)}
        soon = self.at(self.points, moved, parameters)
        heights = np.einsum("npk,nk->np", was, up)
        top, each = np.argmax(heights, axis=1), np.arange(count)
        foot = np.zeros((count, 3))
        for name in set(stance) - {""}:
            here = np.array([other == name for other in stance])
            places = self.at([self.map.feet[name]], {k: column[here] for k, column in start.items()},
                             parameters[here] if parameters.ndim == 2 else parameters)  # fmt: skip
            foot[here] = places[:, 0]
        known = np.array([bool(name) for name in stance])
        over = (np.einsum("nk,nk->n", was[each, top] - foot, up), np.einsum("nk,nk->n", now[each, top] - foot, up))
        ahead, lean = _level(soon[each, top] - was[each, top], up), _level(now[each, top] - foot, up)
        side = np.where(known, np.sign(np.sum(ahead * lean, axis=1)), 0.0).astype(np.int64)
        return known & (over[1] < FALLEN_HEIGHT_RATIO * over[0]), side

    def _rates(self, inputs: dict[str, Matrix]) -> Matrix:
        """q̇."""
        return self.equations.configuration.rates(inputs["q"], inputs["v"])


def _up(map_: ReturnMap, changes: Changes, count: int) -> Matrix:
    """Against gravity (N, 3)."""
    values = getattr(map_.model, "parameters", {})
    found = [changes.columns.get(f"gravity.{axis}", values.get(f"gravity.{axis}", 0.0)) for axis in "xyz"]
    return -np.column_stack([np.broadcast_to(np.asarray(each, dtype=float), count) for each in found])


def _level(vectors: Matrix, up: Matrix) -> Matrix:
    """The part across the vertical."""
    return np.asarray(vectors - np.sum(vectors * up, axis=1)[:, np.newaxis] * up)
