"""Instants at which the equations jump as time passes, whatever the motion: steps end there.

A switching expression s(t, p) depends on the time and on parameters alone: what a condition compares, the argument of
``abs``, ``sign``, ``min``, ``max`` or ``floor``, or that of a table. Where it passes a target (0, a whole number, a
break of the table) some derivative of the equations jumps. The *level* of a jump is the lowest derivative of the
accelerations that it changes: 0 for a force that jumps, 1 for one with a kink, and so on.

1. Between the instants of other switches inside it, s is smooth. Where it is linear in t there, which its operations
   tell, its targets are passed at instants that a division gives.
2. Elsewhere s is sampled, and each change across a target is bisected; what passes twice between two samples is missed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.equations.equations import Equations
from mbd.tape.derivatives import jvps, live
from mbd.tape.evaluate import Key, evaluate_arrays
from mbd.tape.node import Node
from mbd.tape.operations import CONDITIONS

EPS = sys.float_info.epsilon
ROUND_OFF = 8.0 * EPS
"""How far round-off moves an instant, relative to it and to what is compared [-]."""
MAX_JUMPS = 1_000_000
"""Instants of one switch at most [-]."""
MIN_SAMPLES, MAX_SAMPLES = 4096, 1_048_576
"""Samples in time of an expression that is not linear in it [-]."""
SMOOTH_ORDER = 4
"""Derivatives of a cubic from which none jumps."""

Targets = Callable[[float, float], Vector]
"""Targets between two values of s, in order."""


class Switch(NamedTuple):
    """A switching expression.

    expression : s on the tape
    targets : what it passes
    level : of the jump at each target
    node : the operation that switches
    owner : of the row that it is in; '' elsewhere
    """

    expression: Node
    targets: Targets
    level: Callable[[Vector], Vector]
    node: Node
    owner: str = ""


class Jump(NamedTuple):
    """An instant at which the equations jump.

    left, right : the last time before it and the first one behind it, round-off apart [s]
    level : the lowest derivative of accelerations that jumps; below 0 a velocity or a position
    owner : of a row that jumps, or has a derivative that does
    """

    left: float
    right: float
    level: int
    owner: str = ""


# what switches ------------------------------------------------------------------------------------------------------
def switches_of(equations: Equations) -> tuple[Switch, ...]:
    """The switching expressions of time alone, in the order of the tape."""
    known = equations.memory.get("switches in time")
    if known is None:
        with equations.tape.lock:
            found: dict[tuple[int, int, str], Switch] = {}
            for outputs, offset, owner in _groups(equations):
                for switch in _inside(outputs, offset, owner):
                    found.setdefault((switch.node.index, offset, owner if offset else ""), switch)
        known = equations.memory["switches in time"] = tuple(found[key] for key in sorted(found))
    switches: tuple[Switch, ...] = known
    return switches


def _groups(equations: Equations) -> Iterable[tuple[list[Node], int, str]]:
    """Expressions with the derivatives, less than none, that accelerations ask of them, and their owners."""
    forces = [*equations.balance, *(friction.limit for friction in equations.frictions)]
    for contact in equations.contacts:
        forces += [node for node in (contact.force, contact.only_while) if isinstance(node, Node)]
        forces += [node for _, velocity, force in contact.drags for node in (velocity, force)]
    yield forces, 0, ""
    for row in equations.rows:
        yield ([row.rate], -1, row.owner) if row.is_velocity else ([row.value], -2, row.owner)


def _inside(outputs: Sequence[Node], offset: int, owner: str) -> Iterable[Switch]:
    """The switches that some outputs need; what a table that repeats does with its argument is none."""
    of_time = _of_time(live(outputs))
    seen: set[int] = set()
    stack = list(outputs)
    while stack:
        node = stack.pop()
        if node.index in seen:
            continue
        seen.add(node.index)
        if node.op == "table" and of_time.get(node.args[0].index):
            phase = node.tape.phases.get(node.args[0].index)
            yield _of_table(node, phase, offset, owner)
            stack += node.args if phase is None else [phase[0]]
            continue
        stack += node.args
        if any(of_time.get(arg.index) for arg in node.args) and all(arg.index in of_time for arg in node.args):
            yield from _of_operation(node, offset, owner)


def _of_time(nodes: Iterable[Node]) -> dict[int, bool]:
    """Of what depends on time and parameters alone, by number: whether it depends on time."""
    found: dict[int, bool] = {}
    for node in nodes:
        if node.op == "input":
            kind = node.data[0]
            if kind in ("t", "p"):
                found[node.index] = kind == "t"
        elif all(arg.index in found for arg in node.args):
            found[node.index] = any(found[arg.index] for arg in node.args)
    return found


def _of_operation(node: Node, offset: int, owner: str) -> Iterable[Switch]:
    """The switch of an operation; of rows, whose derivatives are not looked at, any counts as a jump of a force."""
    op = node.op
    level = 1 if op in ("abs", "min", "max") and not offset else 0
    if op in ("abs", "sign"):
        yield Switch(node.args[0], _zero, _constant(level), node, owner)
    elif op == "floor":
        yield Switch(node.args[0], _whole, _constant(level), node, owner)
    elif op in ("lt", "le", "min", "max"):
        yield Switch(node.tape.sub(node.args[0], node.args[1]), _zero, _constant(level), node, owner)


def _of_table(node: Node, phase: tuple[Node, float, float] | None, offset: int, owner: str) -> Switch:
    table, order = node.data
    breaks, jumps = np.array(table.breaks[1:]), np.array(table.jumps)
    counts = jumps < SMOOTH_ORDER
    breaks, levels = breaks[counts], np.maximum(jumps[counts] - order, 0) + offset
    if phase is None:
        return Switch(
            node.args[0],
            lambda low, high: breaks[(breaks >= low) & (breaks <= high)],
            lambda values: levels[np.searchsorted(breaks, values)],
            node,
            owner,
        )
    inner, start, period = phase
    mine = (breaks > start + ROUND_OFF * period) & (breaks <= start + period + ROUND_OFF * period)
    places, of_places = breaks[mine], levels[mine]

    def repeated(low: float, high: float) -> Vector:
        first, last = np.floor((low - start) / period), np.floor((high - start) / period)
        last = min(last, first + MAX_JUMPS / max(1, len(places)))
        each = places[None, :] + period * np.arange(first - 1.0, last + 1.0)[:, None]
        every = each.ravel()
        return np.asarray(every[(every >= low) & (every <= high)])

    def level(values: Vector) -> Vector:
        turns = (values[:, None] - places[None, :]) / period
        return np.asarray(of_places[np.argmin(np.abs(turns - np.round(turns)), axis=1)])

    return Switch(inner, repeated, level, node, owner)


def _zero(low: float, high: float) -> Vector:
    return np.zeros(1 if low <= 0.0 <= high else 0)


def _whole(low: float, high: float) -> Vector:
    first, last = np.ceil(low), np.floor(high)
    return np.arange(first, min(last, first + MAX_JUMPS) + 1.0)


def _constant(level: int) -> Callable[[Vector], Vector]:
    return lambda values: np.full(len(values), level)


def instant_slopes(
    equations: Equations, parameters: Sequence[float] | Vector, time: float, dt: float, places: Sequence[int]
) -> list[Vector]:
    """``dT/dp = −(∂s/∂p)/(∂s/∂t)`` (len(places),) of the jumps of forces at an instant T, each different one once.

    Parameters
    ----------
    parameters, dt : as in `jumps_between`
    time : T [s]
    places : numbers of the parameters to differentiate by
    """
    near = 1e-9 * max(abs(time), dt)
    times = _Times(parameters, time - dt, time + dt, dt)
    found: list[Vector] = []
    for switch in switches_of(equations):
        here = [jump for jump in times.jumps(switch) if jump.level <= 0 and abs(jump.right - time) <= near]
        if here:
            tape = switch.expression.tape
            with tape.lock:
                inputs = [tape.input("t"), *(tape.input("p", place) for place in places)]
                slopes = [line[0] for line in jvps([switch.expression], [{node: 1.0} for node in inputs])]
            by_time, *by = (float(times.at(slope, np.array([here[0].left]))[0]) for slope in slopes)
            slope = -np.array(by) / by_time
            if not any(np.allclose(slope, other, rtol=1e-9, atol=0.0) for other in found):
                found.append(slope)
    return found


# tables in rows -----------------------------------------------------------------------------------------------------
def table_faults(equations: Equations) -> list[str]:
    """What is wrong with tables that rows read: a row on positions needs their second derivative, one on rates a slope.

    Ends of tables count in the runs that reach them.
    """
    faults = []
    for switch in switches_of(equations):
        if not switch.owner or switch.node.op != "table":
            continue
        table, order = switch.node.data
        offset = -1 if any(row.owner == switch.owner and row.is_velocity for row in equations.rows) else -2
        ends = 0 if switch.node.args[0].index in switch.node.tape.phases else 1
        inside = table.jumps[ends : len(table.jumps) - ends]
        lowest = min(inside, default=SMOOTH_ORDER) - order + offset
        if lowest < (0 if offset == -1 else 1):
            faults.append(
                f"{switch.owner!r} reads a table whose {'slope' if offset == -1 else 'second derivative'} does not "
                "exist at its samples, where a constraint asks for accelerations; use mbd.Samples(…, kind='spline'), "
                "or kind='smooth' for noisy data"
            )
    return list(dict.fromkeys(faults))


# when they switch ---------------------------------------------------------------------------------------------------
def jumps_between(
    equations: Equations,
    parameters: Sequence[float] | Vector,
    begin: float,
    end: float,
    dt: float,
    highest: int = SMOOTH_ORDER,
) -> tuple[Jump, ...]:
    """The instants after begin and up to end at which the equations jump, in order.

    Parameters
    ----------
    parameters : their values in the order of the equations; more may follow
    begin, end : of the run [s]
    dt : a step of the run [s], which what is sampled is sampled more finely than
    highest : level above which jumps do not matter
    """
    switches = switches_of(equations)
    if not switches or not begin < end < np.inf:
        return ()
    times = _Times(parameters[: len(equations.parameters)], begin, end, dt)
    return _merged(sorted(jump for switch in switches for jump in times.jumps(switch, highest)))


class _Times:
    """When expressions pass their targets in a run."""

    def __init__(self, parameters: Sequence[float] | Vector, begin: float, end: float, dt: float) -> None:
        self.inputs: dict[Key, Any] = {("p", k): float(value) for k, value in enumerate(parameters)}
        self.begin, self.end, self.dt = begin, end, dt
        self._known: dict[int, tuple[Vector, Vector]] = {}

    def jumps(self, switch: Switch, highest: int = SMOOTH_ORDER) -> list[Jump]:
        """Those of one switch, after begin and up to end."""
        times, values = self.passes(switch)
        node, levels = switch.node, switch.level(values)
        counts = levels <= highest
        times, values, levels = times[counts], values[counts], levels[counts]
        if not len(times):
            return []
        exact = self._compared(node)
        if exact is not None:
            time, at_left = exact
            times = np.full(len(times), time)
            rights = np.nextafter(times, np.inf) if at_left else times
        elif node.op == "table" and node.args[0].op == "input":  # a table of t itself
            times = rights = values
        else:
            margins = np.maximum(ROUND_OFF * np.maximum(np.abs(times), self.dt), self._margins(switch, times))
            rights, times = times + margins, times - margins
        lefts = times if rights is not times and exact is None else times - ROUND_OFF * np.maximum(abs(times), self.dt)
        inside = (rights > self.begin) & (lefts <= self.end)
        found = zip(lefts[inside].tolist(), rights[inside].tolist(), levels[inside].tolist(), strict=True)
        return [Jump(*each, switch.owner) for each in found]

    def _compared(self, node: Node) -> tuple[float, bool] | None:
        """(T, whether T itself is on the left side) of a condition that compares t itself with T; None for others."""
        if node.op not in ("lt", "le"):
            return None
        first = node.args[0].op == "input" and node.args[0].data[0] == "t"
        other = node.args[1 if first else 0]
        if not (first or (node.args[1].op == "input" and node.args[1].data[0] == "t")) or _has_time(other):
            return None
        return float(self.at(other, np.zeros(1))[0]), first == (node.op == "le")

    def _margins(self, switch: Switch, times: Vector) -> Vector:
        """How far round-off of what is compared may move each instant [s]."""
        if not len(times):
            return times
        node, shift = switch.node, 1e-6 * np.maximum(np.abs(times), self.dt)
        parts = node.args if node.op in ("lt", "le", "min", "max") else _terms(switch.expression)
        phase = node.tape.phases.get(node.args[0].index) if node.op == "table" else None
        own = 0.0 if phase is None else abs(phase[1]) + phase[2]
        size = own + sum(np.abs(self.at(part, times)) for part in parts)
        change = np.abs(self.at(switch.expression, times + shift) - self.at(switch.expression, times - shift))
        with np.errstate(all="ignore"):
            margin = ROUND_OFF * size * 2.0 * shift / change
        return np.where(np.isfinite(margin), np.minimum(margin, shift), 0.0)

    def passes(self, switch: Switch) -> tuple[Vector, Vector]:
        """(times, targets) at which the expression of a switch passes a target, in order."""
        if switch.node.index not in self._known:
            self._known[switch.node.index] = self._found(switch)
        return self._known[switch.node.index]

    def _found(self, switch: Switch) -> tuple[Vector, Vector]:
        s = switch.expression
        inner = [self.passes(each)[0] for each in _inside([s], 0, "")]
        edges = np.unique(np.concatenate([[self.begin, self.end], *inner]))
        widths = np.diff(edges)
        kept = widths > 1e3 * EPS * max(abs(self.begin), abs(self.end))
        starts, widths = edges[:-1][kept], widths[kept]
        if not len(starts):
            return np.zeros(0), np.zeros(0)
        if _is_linear(s):
            return self._by_division(switch, starts, widths)
        return self._by_bisection(switch, starts, widths)

    def _by_division(self, switch: Switch, starts: Vector, widths: Vector) -> tuple[Vector, Vector]:
        """Of an expression that is linear in t on every interval."""
        first, second = starts + 0.25 * widths, starts + 0.75 * widths
        low, high = self.at(switch.expression, first), self.at(switch.expression, second)
        times, targets = [], []
        for a, b, s_a, s_b, start, width in zip(first, second, low, high, starts, widths, strict=True):
            slope = (s_b - s_a) / (b - a)
            if slope == 0.0 or not np.isfinite(slope):
                continue
            ends = sorted((s_a - 0.25 * slope * width, s_b + 0.25 * slope * width))
            slack = ROUND_OFF * max(abs(ends[0]), abs(ends[1]))
            values = switch.targets(ends[0] - slack, ends[1] + slack)
            times.append(np.clip(a + (values - s_a) / slope, start, start + width))
            targets.append(values)
        return _together(times, targets)

    def _by_bisection(self, switch: Switch, starts: Vector, widths: Vector) -> tuple[Vector, Vector]:
        """Of any expression, as far as samples tell."""
        count = float(np.clip(4.0 * widths.sum() / self.dt, MIN_SAMPLES, MAX_SAMPLES))  # samples in a step of the run
        before, behind, targets = [], [], []
        for start, width in zip(starts, widths, strict=True):
            part = max(2, int(count * width / widths.sum()))
            grid = start + width * (np.arange(part) + 0.5) / part
            values = self.at(switch.expression, grid)
            for k in _crossings(switch.node, values):
                passed = switch.targets(*sorted((values[k], values[k + 1])))
                passed = passed[passed != values[k + 1]] if k + 2 < part else passed
                before += [grid[k]] * len(passed)
                behind += [grid[k + 1]] * len(passed)
                targets.append(passed)
        if not before:
            return np.zeros(0), np.zeros(0)
        every = np.concatenate(targets)
        return _together([self._bisected(switch.expression, np.array(before), np.array(behind), every)], [every])

    def _bisected(self, s: Node, left: Vector, right: Vector, targets: Vector) -> Vector:
        """Where the expression passes each target between two times."""
        below = self.at(s, left) < targets
        for _ in range(60):  # halvings of the time between two samples
            middle = 0.5 * (left + right)
            same = (self.at(s, middle) < targets) == below
            left, right = np.where(same, middle, left), np.where(same, right, middle)
        return np.asarray(right)

    def at(self, node: Node, times: Vector) -> Vector:
        return evaluate_arrays(node, {**self.inputs, ("t", 0): times})


def _crossings(node: Node, values: Vector) -> NDArray[np.intp]:
    """The samples between which and the next a target may be passed."""
    low, high = values[:-1], values[1:]
    passes = np.isfinite(low) & np.isfinite(high) & (low != high)
    if node.op == "floor":
        passes &= (np.floor(low) != np.floor(high)) | (np.ceil(low) != np.ceil(high))
    elif node.op != "table":
        passes &= np.sign(low) != np.sign(high)
    return np.flatnonzero(passes)


def _together(times: Sequence[Vector], targets: Sequence[Vector]) -> tuple[Vector, Vector]:
    if not times:
        return np.zeros(0), np.zeros(0)
    every = np.concatenate(times)
    order = np.argsort(every, kind="stable")[:MAX_JUMPS]
    return every[order], np.concatenate(targets)[order]


def _has_time(node: Node) -> bool:
    return any(each.op == "input" and each.data[0] == "t" for each in live([node]))


def _terms(node: Node) -> tuple[Node, ...]:
    return node.args if node.op in ("add", "sub") else (node,)


def _is_linear(s: Node) -> bool:
    """Whether an expression is linear in t between the instants of the switches inside it, as its operations tell."""
    linear: Mapping[int, bool] = {}
    found: dict[int, bool] = {}
    timely: dict[int, bool] = {}
    for node in live([s]):
        args = node.args
        timely[node.index] = (node.op == "input" and node.data[0] == "t") or any(timely[arg.index] for arg in args)
        if not timely[node.index]:
            linear_here = True
        elif node.op == "mul":
            linear_here = not all(timely[arg.index] for arg in args)
        elif node.op == "div":
            linear_here = not timely[args[1].index]
        elif node.op == "where":
            args, linear_here = args[1:], True
        else:
            linear_here = node.op in ("input", "add", "sub", "neg", "abs", "min", "max")
        linear_here = linear_here and all(found[arg.index] for arg in args)
        found[node.index] = linear_here or node.op in ("floor", "sign") or node.op in CONDITIONS
    linear = found
    return linear[s.index]


def _merged(jumps: Sequence[Jump]) -> tuple[Jump, ...]:
    """Jumps of one instant as one."""
    found: list[Jump] = []
    for jump in jumps:
        if found and jump.left <= found[-1].right:
            last = found[-1]
            lower = jump if jump.level < last.level else last
            owner = lower.owner or last.owner or jump.owner
            found[-1] = Jump(last.left, max(last.right, jump.right), lower.level, owner)
        else:
            found.append(jump)
    return tuple(found)
