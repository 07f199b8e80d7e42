"""The derivative of a return map from the exact derivative of one run a return.

With T the tangent vectors (δx, δv, δz, δa) of the section at a state with coordinates c, a being what contacts hold and
machines remember, by c and by parameters p, the derivative of the coordinates is ``C D_k … D_1 T``: D_i is that of the
end of the i-th return by its start and by p (`mbd.sensitivity`), sides exchanged and instants counted from there, and
C = ∂(coordinates)/∂(δx, …) that of the chart where the last one arrives. T keeps the rows of the section,

    δx = D(m) (Z_q c_q + N_q μ),   G δx + h_z c_z + h_a c_a + h_p δp = 0,
    δv = Z_v c_v + N_v ν,          B δv + ḣ_x δx + ḣ_z c_z + ḣ_a c_a + ḣ_p δp = 0

with m = q ⊖ q₀, and what is stored as the section is reached follows. Tangents of orientations are small rotations in
axes of the child: D and its inverse lead from them to the increments of a chart and back (`mbd.configuration`).
Instants of touchdowns follow from the events of a run, lengths of steps from where the feet are at its ends.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.configuration import Configuration
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError
from mbd.gait.return_map import Arrival, ReturnMap, Values
from mbd.gait.section import Chart
from mbd.sensitivity.asked import EndState
from mbd.sensitivity.motion import Mode, Motion, Tangent
from mbd.sensitivity.passed import Passed
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.starts import Direction, captured, programs_of
from mbd.sensitivity.tangent_run import DIRECTIONS
from mbd.simulation.interrupted import stopped
from mbd.simulation.simulate import simulate
from mbd.state import State


@dataclass(frozen=True)
class _Return:
    """One return with derivatives by (coordinates, parameters): period (D,), travel (fixed, D), steps (2 n, D)."""

    period: Vector
    travel: Matrix
    steps: Matrix
    along: Matrix
    state: State


def exact_derivative(
    map_: ReturnMap, chart: Chart, c: Vector, values: Values, names: Sequence[str] = ()
) -> Matrix | None:  # fmt: skip
    """∂(numbers of the map)/∂(c, parameters) at c, of the numbers of `Measured`.

    None where a return does not arrive or no pass knows its derivative.
    """
    of_names = [map_.rates_of(name, values) for name in names]
    if any(rates is None for rates in of_names) or not chart.size + len(names):
        return None
    state, parameters = chart.at(c, map_.vector(values)), map_.vector(values)
    every = [each.name for each in map_.mechanism.equations.parameters]
    rates: list[Mapping[str, float]] = [{}] * chart.size + [each for each in of_names if each is not None]
    if len(every) <= DIRECTIONS:  # one program for all of them takes as long to compile as for one
        rates = [dict.fromkeys(every, 0.0) | dict(each) for each in rates]
    wanted = [Direction(f"direction {k}", parameters=each) for k, each in enumerate(rates)]
    programs = programs_of(map_.mechanism, wanted, parameters)
    chosen = [every[place] for place in programs.places]
    p = np.array([[each.get(name, 0.0) for each in rates] for name in chosen]).reshape(len(chosen), len(rates))
    begun = motion_on_section(chart, state, programs, p)[0].tangent
    along = np.vstack([begun.q, begun.y, begun.anchors])
    period, travel, steps = np.zeros(len(rates)), np.zeros((len(map_.fixed), len(rates))), list[Matrix]()
    for number in range(map_.strides):
        starts = [replace(each, along=along[:, k]) for k, each in enumerate(wanted)]
        found = _returned(map_, state, values, starts, _as_tangent(map_, along, p), programs)
        if found is None:
            return None
        odd = map_.mirror is not None and number % 2 == 1
        steps.append(found.steps)
        steps[-1][::2] += period
        period = period + found.period
        travel = travel + (map_.turned[:, np.newaxis] * found.travel if odd else found.travel)
        along, state = found.along, found.state
    return np.vstack([_by_tangent(chart, state, along), period, travel, *steps])


def _returned(
    map_: ReturnMap, start: State, values: Values, wanted: Sequence[Direction], tangent: Tangent, programs: Programs
) -> _Return | None:  # fmt: skip
    """One return with derivatives; None where it does not arrive or no pass knows its derivative."""
    asked = EndState(wanted)
    try:
        run = simulate(
            map_.model, replace(start, memory=None), map_.integrator, dt=map_.dt, until=(map_.section, map_.longest),
            contact="events", parameters=map_.plain(values), progress=False, on_failure="return",
            backend=map_.backend, wrt=asked,  # type: ignore[arg-type]
        )  # fmt: skip
    except CapabilityError:
        return None
    if stopped(run):
        raise KeyboardInterrupt
    arrival = map_(start, values, strides=1)
    if not run.success or not arrival.outcome.good:
        return None
    passed: Passed = asked.found
    end, configuration = passed.motion, map_.mechanism.equations.configuration
    move, fixed = configuration.difference(start.q, end.q), list(map_.fixed)
    travel = _increments(configuration, move, end.tangent.q)[fixed] - tangent.q[fixed]
    begin = Motion(0.0, start.q, np.concatenate([start.v, start.z]), start.anchors, tangent)
    steps = _steps(map_, arrival, passed, [_places(map_, programs, each, passed.mode) for each in (begin, end)], travel)
    return _Return(end.tangent.t, travel, steps, _arrived(map_, end.tangent), arrival.state)


def _as_tangent(map_: ReturnMap, along: Matrix, p: Matrix) -> Tangent:
    """That of a start at time 0, from tangents (q, (v, z), anchors) and rates of parameters."""
    layout = map_.mechanism.layout
    q, y, anchors = np.split(along, [layout.n_v, layout.n_v + layout.n])
    return Tangent(np.zeros(p.shape[1]), q, y, anchors, p)


def _arrived(map_: ReturnMap, end: Tangent) -> Matrix:
    """The derivatives at an end, instants counted from there, in the order of the mirror image."""
    n_v, mirror = map_.mechanism.layout.n_v, map_.mirror
    q, v, z, anchors = end.q, end.y[:n_v], end.y[n_v:], end.anchors.copy()
    for machine in map_.mechanism.equations.machines:
        anchors[list(machine.times)] -= end.t
    if mirror is not None:
        q, v, z, anchors = mirror.of_v(q.T).T, mirror.of_v(v.T).T, z[mirror.z], mirror.of_changes(anchors.T).T
    return np.vstack([q, v, z, anchors])


def _places(map_: ReturnMap, programs: Programs, motion: Motion, mode: Mode) -> dict[str, tuple[Vector, Matrix]]:
    """Where the points of all feet are (3,), and the derivatives (3, D), by name."""
    if not map_.feet:
        return {}
    names, columns = [f"{place}.{axis}" for place in map_.feet.values() for axis in "xyz"], programs.columns
    values, slopes = programs.results(names, motion.at(mode, np.zeros(columns.n), np.zeros(columns.rows)))
    by = slopes @ motion.tangent.stacked(columns)
    return {foot: (values[3 * k : 3 * k + 3], by[3 * k : 3 * k + 3]) for k, foot in enumerate(map_.feet)}


def _steps(
    map_: ReturnMap, arrival: Arrival, passed: Passed, places: Sequence[Mapping[str, tuple[Vector, Matrix]]],
    travel: Matrix,
) -> Matrix:  # fmt: skip
    """The derivatives of times and lengths of the steps of one return, as `ReturnMap` tells them; NaN as they are."""
    by = np.full((2 * len(arrival.steps), travel.shape[1]), np.nan)
    instants = [(each.time, each.of_time) for each in passed.instants]
    instants.append((arrival.period, passed.motion.tangent.t))
    for k, (_, time, _) in enumerate(arrival.steps):
        by[2 * k] = min(instants, key=lambda instant: abs(instant[0] - time))[1]
    lengths = [length for _, _, length in arrival.steps]
    if not lengths or not np.isfinite(lengths[-1]):
        return by
    stance = next(name for name in map_.feet if name in arrival.before and name != map_.section)
    was, now = places
    one, other = now[map_.section], (was if len(lengths) == 1 else now)[stance]
    way = map_.ahead(one[0] - other[0])
    by[-1] = way @ (one[1] - other[1]) / lengths[-1]
    if len(lengths) == 2:
        moved = map_.forward * arrival.travel
        by[1] = (map_.forward * moved) @ travel / np.linalg.norm(moved) - by[-1]
    return by


def _by_tangent(chart: Chart, state: State, along: Matrix) -> Matrix:
    """C · (δx, δv, δz, δanchors): the change of the coordinates of a state with tangents (n_v + n + A, k) of it."""
    section, configuration = chart.section, chart.section.mechanism.equations.configuration
    heading, layout = section.heading, section.mechanism.layout
    q, v = chart.facing(state)
    moves, rates, z, anchors = np.split(along, np.cumsum([layout.n_v, layout.n_v, layout.n - layout.n_v]))
    if heading is not None:
        angle = heading.angle(chart.state.q, state.q, chart.turning)
        moves, rates = (
            np.array([heading.turned(state.q, column, angle)[1] for column in part.T]).reshape(part.T.shape).T
            for part in (moves, rates)
        )
    away = _increments(configuration, configuration.difference(chart.state.q, q), moves)
    held = anchors[list(section.held)]
    if len(held):
        held = held - section.carried.T @ away[list(section.fixed)]
    if heading is not None:
        # the turn changes too, so that what is left has no part along the heading
        by_turn = heading.tangent(q)
        turn = _increments(configuration, configuration.difference(chart.state.q, q), by_turn[:, np.newaxis])[:, 0]
        change = -(chart.turning @ away) / float(chart.turning @ turn)
        away = away + np.outer(turn, change)
        rates = rates + np.outer(heading.rate_tangent(q, v), change)
    return np.vstack([chart.places.T @ away, chart.rates.T @ rates, z, held])


def _increments(configuration: Configuration, move: Vector, tangents: Matrix) -> Matrix:
    """D(m)⁻¹ of tangents (n_v, k) at q ⊕ m: increments of the chart around q."""
    if configuration.is_vector:
        return tangents
    return configuration.increment_rates(np.broadcast_to(move, tangents.T.shape), tangents.T).T


def _tangents(configuration: Configuration, move: Vector, increments: Matrix) -> Matrix:
    """D(m) of increments (n_v, k) of the chart around q: tangents at q ⊕ m."""
    if configuration.is_vector:
        return increments
    return configuration.increment_velocities(np.broadcast_to(move, increments.T.shape), increments.T).T


def motion_on_section(chart: Chart, state: State, programs: Programs, p: Matrix) -> tuple[Motion, Mode]:
    """A state of the section with T, by its coordinates and then by parameters of rates p (P, D); what acts there."""
    section, mechanism = chart.section, chart.section.mechanism
    layout, equations = mechanism.layout, mechanism.equations
    columns, y = programs.columns, np.concatenate([state.v, state.z])
    none = np.zeros(columns.n), np.zeros(columns.rows)
    flags, size = section.flags.astype(float), p.shape[1]
    mode = Mode((), flags, flags, np.zeros(len(equations.frictions)))
    parts = np.split(np.eye(chart.size, size), np.cumsum(chart.counts)[:-1])

    def with_rows(free: Matrix, off: Matrix, slopes: Matrix, own: slice, known: Tangent) -> Matrix:
        """Tangents whose part off the free ones keeps the rows, as the other parts of a tangent are known."""
        change = slopes @ known.stacked(columns) + slopes[:, own] @ free
        return np.asarray(free - off @ np.linalg.lstsq(slopes[:, own] @ off, change, rcond=None)[0])

    # what is free: the coordinates z, and what is held
    of_y, of_anchors = np.zeros((layout.n, size)), np.zeros((columns.anchors, size))
    of_y[layout.n_v :], of_anchors[list(section.held)] = parts[2], parts[3]
    tangent = Tangent(np.zeros(size), np.zeros((layout.n_v, size)), of_y, of_anchors, p)
    motion = Motion(0.0, state.q, y, state.anchors, tangent)
    _, _, _, _, of_h, of_rate = programs.steps(motion.at(mode, *none))
    watched = programs.watched(motion.at(mode, *none))[1] if section.gaps or section.speeds else np.zeros((0, 0))
    # positions on their rows, then velocities
    configuration = equations.configuration
    move = configuration.difference(chart.state.q, state.q)
    free, off = (_tangents(configuration, move, part) for part in (chart.places, chart.off_places))
    gaps = [section.watched_line(value) for value, _ in section.gaps]
    G = np.vstack([of_h[list(section.places)], *watched[gaps]])
    motion = motion.with_tangent(q=with_rows(free @ parts[0], off, G, columns.x, tangent))
    own = slice(columns.y.start, columns.y.start + layout.n_v)
    speeds = [section.watched_line(value) for value in section.speeds]
    B = np.vstack([of_rate[list(section.rates)], *watched[speeds]])
    of_y[: layout.n_v] = with_rows(chart.rates @ parts[1], chart.off_rates, B, own, motion.tangent)
    motion = motion.with_tangent(y=of_y)
    # what contacts hold and machines have just stored there
    closed = [k for k, each in enumerate(section.manager.contacts) if flags[k] and each.kind == "unilateral"]
    motion = captured(programs, motion, mode, closed)
    if section.stored:
        stored, found = list(section.stored), motion.tangent.anchors.copy()
        found[stored] = programs.stored(motion.at(mode, *none))[1][stored] @ motion.tangent.stacked(columns)
        motion = motion.with_tangent(anchors=found)
    return motion, mode
