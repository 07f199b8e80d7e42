"""The tangent pass over a run that is there: it is made once more with derivatives, some directions at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equal import INSTANT_RTOL, NOMINAL_RTOL
from mbd.equations.equations import Guard
from mbd.equations.switching_times import instant_slopes
from mbd.errors import CapabilityError
from mbd.integrators.stepping import own_scheme
from mbd.kernel.schemes.contract import NO_SCHEME
from mbd.sensitivity.motion import Motion, Rates, Tangent
from mbd.sensitivity.one_sided import sided_end
from mbd.sensitivity.passed import Passed
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.resets import after_reset
from mbd.sensitivity.run_data import RunRows, refused, sided
from mbd.sensitivity.tangent.margins import refuse_edge, refuse_turning_points
from mbd.sensitivity.tangent_run import DIRECTIONS, TangentRun
from mbd.simulation.arguments import end_of
from mbd.simulation.run.idle import keep_idle
from mbd.simulation.run.memory import without_memory
from mbd.simulation.simulate import BRIEF_TIME_SHARE

OWN = ("contact", "impact", "locate", "store", "rest_speed")
FOLLOWING = ("allowed", "longest", "driven")


class AnotherRun(CapabilityError):
    """The same run with derivatives is not the run."""


def _require_known_steps(rows: RunRows) -> None:
    """Refuse schemes of a user that are written in Python alone."""
    if own_scheme(rows.integrator) is NO_SCHEME:
        raise refused(
            f"steps of {rows.integrator!r} are not differentiated", "take RungeKutta853(), RadauIIA() or HHT()"
        )


class Charted:
    """Derivatives of coordinates number by number, and along velocities."""

    def __init__(self, programs: Programs) -> None:
        self.programs = programs

    def base(self, q: Vector) -> Matrix:
        """∂(q ⊕ x)/∂x (n_q, n_v) at x = 0, which are the rates ``q̇ = N(q) v`` of unit velocities."""
        return self.programs.equations.configuration.rates(q, np.eye(self.programs.columns.n_v)).T

    def along(self, q: Vector, of_q: Matrix) -> Matrix:
        """Derivatives along velocities (n_v, D)."""
        if self.programs.mechanism.vector:
            return of_q
        return np.asarray(np.linalg.lstsq(self.base(q), of_q, rcond=None)[0])


def tangent_run(
    rows: RunRows, programs: Programs, start: Tangent, restitutions: Mapping[str, Vector],
    visit: Callable[[int, Motion, Any, Rates], None] | None = None, made: TangentRun | None = None,
) -> Passed:  # fmt: skip
    """The run from its start, with these derivatives, to its end.

    restitutions : rates (D,) of those of contacts; visit : is called with every row; made : the run itself, where it
    has carried the first of these derivatives

    Raises
    ------
    CapabilityError
        where the run has no derivative.
    AnotherRun
        where round-off makes the same run with derivatives another one.
    """
    _require_known_steps(rows)
    if 0 in rows.events:
        event = rows.events[0][0]
        there = f", with closed={event.name!r}" if event.kind == "closed" else ", with the velocities of the first row"
        raise sided(f"{event.name!r} happens as the run starts", f"start where it has happened{there}")
    charted, layout, count = Charted(programs), rows.mechanism.layout, len(start.t)
    runs, states = list[tuple[TangentRun, int]](), list[dict[str, tuple[Any, Matrix]]]()
    for first in range(0, count, DIRECTIONS):
        some = slice(first, min(first + DIRECTIONS, count))
        run = made if made is not None and not runs else _again(rows)
        if run is not made:
            run.every_row = visit is not None
            run.differentiated_reset = _reset(rows, programs, charted, start.p[:, some], run)
            run.moved_with_jump = partial(_moved_with_jump, rows, programs, start.p[:, some], run)
            run.begin_tangents(programs.directed)
            run.at_start()
            seed(run, charted, rows.record.q[0], start, restitutions, some)
            _require_same(rows, run)
            keep_idle(run.stepper)
        runs.append((run, some.stop - some.start))
        states.append(run.at_state())

    def joined(parts: Sequence[Matrix]) -> Matrix:
        cut = [part[..., :width] for part, (_, width) in zip(parts, runs, strict=True)]
        return cut[0] if len(cut) == 1 else np.concatenate(cut, axis=-1)

    at_end = {name: (number, joined([each[name][1] for each in states])) for name, (number, _) in states[0].items()}
    end = _motion(charted, at_end, start.p)
    last, located = rows.mode(len(rows.record.time) - 1), rows.record.settings.get("contact") != "nonsmooth"
    if not located and visit is None:
        return Passed(end[0], last, end[1])
    sizes = np.cumsum([0, 1, layout.n_q, layout.n, layout.n, layout.n_rows])
    names = "clock", "q", "y", "rate", "lam"

    held = rows.watched_anchors if visit is None else rows.stored.anchors

    @cache
    def at_row(row: int) -> tuple[Motion, Rates]:
        numbers = np.concatenate(
            [[rows.ends[row]], rows.record.q[row], rows.y(row), rows.rate(row), rows.record.lam[row]]
        )
        lanes = joined([run.of_rows[row] for run, _ in runs])
        found = {
            name: (numbers[a:b], lanes[a:b]) for name, a, b in zip(names, sizes[:-1], sizes[1:], strict=True)
        }  # fmt: skip
        found["anchors"] = held[row], start.anchors if row == 0 else np.zeros((layout.n_anchors, count))
        return _motion(charted, found, start.p)

    if visit is not None:
        for row in range(len(rows.record.time)):
            motion, rates = at_row(row)
            visit(row, motion, rows.mode(row), rates)
    if not located:
        return Passed(end[0], last, end[1])

    def time_at(row: int) -> Vector:
        return joined([run.of_rows[row][0] for run, _ in runs])

    instants = refuse_turning_points(rows, programs, at_row, time_at, end)
    for run, _ in runs:
        refuse_edge(rows, *run.edge)
    return Passed(end[0], last, end[1], instants)


def seed(
    run: TangentRun, charted: Charted, q: Vector, start: Tangent, restitutions: Mapping[str, Vector], some: slice
) -> None:
    """Give some of the derivatives of a start to a run whose start is in the kernel's arrays."""
    names, count = [contact.name for contact in charted.programs.equations.contacts], len(start.t)
    of_e = np.array([restitutions.get(name, np.zeros(count)) for name in names]).reshape(len(names), count)
    of_q = charted.base(np.array(q)) @ start.q
    run.seed(start.p[:, some], of_q[:, some], start.y[:, some], start.anchors[:, some], of_e[:, some])


def _motion(charted: Charted, numbers: Mapping[str, tuple[Vector, Matrix]], of_p: Matrix) -> tuple[Motion, Rates]:
    """A motion and its rates from numbers with derivatives."""
    (t, of_t), (q, of_q), (y, of_y), (rate, of_rate), (lam, of_lam), (anchors, of_anchors) = (
        numbers[name] for name in ("clock", "q", "y", "rate", "lam", "anchors")
    )
    tangent = Tangent(of_t[0], charted.along(q, of_q), of_y, of_anchors, of_p)
    return Motion(float(t[0]), q, y, anchors, tangent), Rates(rate, lam, of_rate, of_lam)


def _again(rows: RunRows) -> TangentRun:
    """The run once more, with the settings that it had."""
    settings, start = dict(rows.record.settings), rows.record.start
    own = {name: settings[name] for name in OWN} | {"auto": "nonsmooth_since" in settings}
    if own["auto"]:
        own["contact"] = "events"
    dt, until = settings.get("dt"), settings["until"]
    until = tuple(until) if isinstance(until, list) else until
    if dt is None:
        own |= {name: settings[name] for name in FOLLOWING}
        length = 1.0 if isinstance(until, str | tuple) else (float(until) - float(start.time)) or 1.0
        dt = BRIEF_TIME_SHARE * min(length, 1.0)
    end, stop = end_of(until, rows.manager, dt, start.time)
    known = dict(zip(rows.record.parameter_names, rows.record.parameters, strict=False))
    model = SimpleNamespace(parameters=known)
    if rows.source is not None:
        check, held = rows.source.model.parameter_check, [_repeated(rows, each) for each in rows.controllers]
        model = SimpleNamespace(parameters=known, parameter_check=check, controllers=held)
    return TangentRun(
        model,
        rows.mechanism,
        rows.manager,
        rows.integrator,
        without_memory(start),
        dt,
        end,
        stop,
        known,
        own,
        settings,
    )


def _repeated(rows: RunRows, controller: Any) -> Any:
    """A controller that writes what was written in the run, whatever it reads."""
    changes = [(float(rows.record.time[row]), values) for row, values in rows.record.parameter_changes]
    places = {name: k for k, name in enumerate(rows.record.parameter_names) if name in controller.writes}

    def update(time: float, values: Any, state: Any) -> dict[str, float]:
        found = [each for instant, each in changes if abs(instant - time) <= 1e-9 * max(1.0, abs(time))]
        return {name: float(found[-1][k]) for name, k in places.items()} if found else {}

    again = copy(controller)
    for name, value in (("update", update), ("reads", ())):
        object.__setattr__(again, name, value)
    return again


def _require_same(rows: RunRows, run: TangentRun) -> None:
    """Go to the end; raise where the run with derivatives is another than the run, or somebody interrupts it."""
    problem, _ = run.march()
    if run.interrupted:  # a march ends in order then, of which nothing is of use here
        raise run.cause or KeyboardInterrupt
    if problem:
        raise AnotherRun(f"the same run with derivatives failed: {problem}")
    run.collect()
    run.count_turns()
    run.stepper.keep_row()
    run.collect()
    if [(each.kind, each.name) for each in run.events] != [(each.kind, each.name) for each in rows.run.events]:
        _refuse_event_at_end(rows, run)
        raise AnotherRun("the same run with derivatives has other events, by round-off")
    q = rows.record.q[-1]
    off = float(np.max(np.abs(q - run.kernel.q[: len(q)]), initial=0.0))
    if run.stored != len(rows.record.time) or not off <= NOMINAL_RTOL * max(1.0, float(np.max(np.abs(q), initial=0.0))):
        raise AnotherRun("the same run with derivatives ends elsewhere, by round-off")


def _refuse_event_at_end(rows: RunRows, run: TangentRun) -> None:
    """Raise a `OneSidedError` where one of two runs has an event as it ends that the other has not."""
    counts = len(rows.run.events), len(run.events)
    last = (rows.run.events if counts[0] > counts[1] else run.events)[-1]
    end, start = float(rows.record.time[-1]), float(rows.record.time[0])
    if counts[0] != counts[1] and end - last.time <= INSTANT_RTOL * (end - start):
        raise sided_end([last.name], end)


def _moved_with_jump(rows: RunRows, programs: Programs, of_p: Matrix, run: TangentRun) -> Matrix | None:
    """What is added to δy where forces jump at an instant T(p): ``(ẏ⁻ − ẏ⁺) δT``, at a fixed time; None elsewhere."""
    row, time = run.stored - 1, rows.record.time
    if not 0 <= row < len(time) - 1 or time[row + 1] != time[row] or row + 1 in rows.events or not programs.places:
        return None
    now = np.array(run.kernel.params[: len(programs.values)])
    slopes = instant_slopes(programs.equations, now, float(rows.ends[row]), rows.full, programs.places)
    if not len(slopes) or not any(slope.any() for slope in slopes):
        return None
    if len(slopes) > 1:
        raise refused(
            f"forces jump at t = {time[row]:.9g} s for several reasons, whose instants parameters move apart: the run "
            "has a derivative on one side only"
        )
    return np.outer(rows.rate(row) - rows.rate(row + 1), slopes[0] @ of_p)


def _reset(rows: RunRows, programs: Programs, charted: Charted, of_p: Matrix, run: TangentRun) -> Any:
    """What differentiates resets of users' events."""
    numbers = {guard.name: e for e, guard in enumerate(programs.equations.guards)}

    def differentiated(guard: Guard, before: Any, q: Vector, y: Vector) -> tuple[Matrix, Matrix]:
        width = of_p.shape[1]
        motion, rates = _motion(
            charted, {name: (each, lanes[:, :width]) for name, (each, lanes) in before.items()}, of_p
        )
        mode = rows.mode(run.stored - 1)
        after = after_reset(programs, motion, mode, rates, numbers[guard.name], (q, y)).tangent
        return charted.base(q) @ after.q, after.y

    return differentiated
