"""Machines with modes simulated without `mbd`: segments of scipy's DOP853, and transitions written out by hand."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Change = dict[str, Any]
"""source, target, name, and a cause: after=seconds, when=f(y, held) with direction, on=mark; state=(mode, number)."""


@dataclass
class Held:
    """State, its beginning and memory of each mode, and the output of the sampled law."""

    state: dict[str, int]
    since: dict[str, float]
    memory: dict[str, Any]
    output: float = 0.0


@dataclass
class HybridMachine:
    """y′ = rates(t, y, held), with modes that change at instants.

    modes : the changes of each mode, in their order
    remembered : what modes store of y as they enter a state
    jumps : (name, guard, direction, new y): a contact ('closed', name), or an event ('event', name) with its reset
    sample : period, delay and u(y) of a sampled law, or None
    """

    rates: Callable[..., Any]
    modes: Mapping[str, Sequence[Change]]
    remembered: Callable[[Any], Any]
    jumps: Sequence[tuple[tuple[str, str], Callable[[Any], float], int, Callable[[Any], Any]]] = ()
    sample: tuple[float, float, Callable[[Any], float]] | None = None
    log: list[tuple[float, str]] = field(default_factory=list)

    def run(self, y: Sequence[float], until: float) -> Any:
        """y at the end; `log` has the changes and jumps."""
        self.t, self.y, self.passed = 0.0, np.array(y, dtype=float), set[Any]()
        self.held = Held(*({name: value for name in self.modes} for value in (0, 0.0, self.remembered(self.y))))
        self.due: list[tuple[float, Any]] = [(0.0, None)] if self.sample else []
        while self.t < until - 1e-13:
            self._advance(until)
        return self.y

    def _guards(self) -> list[tuple[Any, Callable[[Any], float], int]]:
        found: list[tuple[Any, Callable[[Any], float], int]] = []
        for name, changes in self.modes.items():
            for k, change in enumerate(changes):
                if change["source"] == self.held.state[name] and "when" in change:
                    guard = change["when"]
                    found.append(((name, k), lambda y, guard=guard: guard(y, self.held), change.get("direction", 0)))
        return found + [(k, guard, way) for k, (_, guard, way, _) in enumerate(self.jumps)]

    def _slope(self, guard: Callable[[Any], float]) -> float:
        """Sign of the rate of a guard."""
        ahead = self.y + 1e-7 * np.asarray(self.rates(self.t, self.y, self.held))
        return float(np.sign(guard(ahead) - guard(self.y)))

    def _advance(self, until: float) -> None:
        """To the next instant, and everything that happens then."""
        timers = [
            (self.held.since[name] + change["after"], (name, k))
            for name, changes in self.modes.items() for k, change in enumerate(changes)
            if change["source"] == self.held.state[name] and "after" in change and (name, k) not in self.passed
        ]  # fmt: skip
        end, what = min([(until, "end"), *timers, *self.due], key=lambda each: each[0])
        guards = self._guards()
        if end > self.t:
            watched = [self._watched(guard, way) for _, guard, way in guards]
            found = solve_ivp(
                lambda t, y: self.rates(t, y, self.held), (self.t, end), self.y, method="DOP853", rtol=1e-12,
                atol=1e-13, events=watched or None, max_step=0.02,
            )  # fmt: skip
            self.t, self.y = float(found.t[-1]), found.y[:, -1].copy()
            if found.status == 1:
                self._cross(guards, next(k for k, times in enumerate(found.t_events) if len(times)))
                return
        if what is None or isinstance(what, float):
            self._take_sample(what)
        elif what != "end":
            self._change({("own", *what)}, {})

    def _watched(self, guard: Callable[[Any], float], way: int) -> Any:
        start, value = self.t, guard(self.y)
        side = self._slope(guard) if abs(value) < 1e-10 else 0.0

        def event(t: float, y: Any) -> float:
            return side * 1e-6 if side and t < start + 1e-6 else guard(y)

        event.terminal, event.direction = True, way  # type: ignore[attr-defined]
        return event

    def _take_sample(self, waiting: float | None) -> None:
        assert self.sample is not None
        period, delay, law = self.sample
        self.due.pop(next(k for k, each in enumerate(self.due) if each[1] is waiting))
        if waiting is not None:
            self.held.output = waiting
            return
        value = float(law(self.y))
        self.due.append((self.t + period, None))
        if delay:
            self.due.append((self.t + delay, value))
        else:
            self.held.output = value

    def _cross(self, guards: Sequence[Any], fired: int) -> None:
        key = guards[fired][0]
        before = {k: np.sign(guard(self.y)) for k, guard, _ in guards if k != key and abs(guard(self.y)) > 1e-9}
        if isinstance(key, int):
            mark, _, _, jump = self.jumps[key]
            self.y = jump(self.y)
            self.log.append((self.t, mark[1]))
            self._change({mark}, before)
            return
        together = [  # they cross at the same instant, and come one after the other
            other for other, guard, way in guards
            if other == key
            or (not isinstance(other, int) and abs(guard(self.y)) < 1e-9 and way in (0, self._slope(guard)))
        ]  # fmt: skip
        changed = set[str]()
        for each in together:
            if each[0] not in changed:
                changed |= self._change({("own", *each)}, {})

    def _change(self, marks: set[Any], before: Mapping[Any, float]) -> set[str]:
        """Rounds of changes, each caused by the marks of the one before; then guards that have jumped over zero.

        The modes that have changed are returned.
        """
        changed = set[str]()
        while marks:
            taken = []
            for name, changes in self.modes.items():
                for k, change in enumerate(changes):
                    if change["source"] != self.held.state[name]:
                        continue
                    if ("own", name, k) not in marks and change.get("on") not in marks:
                        continue
                    other, number = change.get("state", (name, self.held.state[name]))
                    if self.held.state[other] == number:
                        taken.append((name, change))
                        break
                    self.passed.add((name, k))
            marks = set()
            for name, change in taken:
                self.held.state[name], self.held.since[name] = change["target"], self.t
                self.held.memory[name] = self.remembered(self.y)
                self.log.append((self.t, change["name"]))
                changed.add(name)
                marks |= {("enters", name, change["target"])}
                self.passed = {each for each in self.passed if each[0] != name}
            if not marks and before:
                for key, guard, way in self._guards():
                    side = before.get(key, 0.0)
                    if side and not isinstance(key, int) and key[0] not in changed and np.sign(guard(self.y)) == -side:
                        marks |= {("own", *key)} if way in (0, -side) else set()
                before = {}
        return changed
