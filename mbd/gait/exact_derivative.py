"""The derivative of a return map from the exact derivative of one run a return.

With T the tangent vectors (δx, δv, δz, δa) of the section at a state with coordinates c, a being what contacts hold and
machines remember, the derivative in coordinates is ``C D_k … D_1 T``: D_i is that of the end of the i-th return by its
start (`mbd.sensitivity.derivative`), sides exchanged and instants counted from there, and C = ∂(coordinates)/∂(δx, …)
that of the chart where the last one arrives. T keeps the rows of the section,

    δx = D(m) (Z_q c_q + N_q μ),   G δx + h_z c_z + h_a c_a = 0,
    δv = Z_v c_v + N_v ν,          B δv + ḣ_x δx + ḣ_z c_z + ḣ_a c_a = 0

with m = q ⊖ q₀, and what is stored as the section is reached follows. Tangents of orientations are small rotations in
axes of the child: D and its inverse lead from them to the increments of a chart and back (`mbd.configuration`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.configuration import Configuration
from mbd.errors import CapabilityError
from mbd.gait.return_map import ReturnMap, Values
from mbd.gait.section import Chart, Section
from mbd.sensitivity.asked import EndState
from mbd.sensitivity.motion import Mode, Motion, Tangent
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.strikes import captured
from mbd.simulation.interrupted import stopped
from mbd.simulation.simulate import simulate
from mbd.state import State

__all__ = ["exact_derivative"]


def exact_derivative(map_: ReturnMap, chart: Chart, c: Vector, values: Values) -> Matrix | None:
    """∂(coordinates)/∂c at c, (size, size); None where a return does not arrive or no pass knows its derivative."""
    state = chart.at(c, map_.vector(values))
    along = _tangent(chart, state, map_.vector(values))
    for _ in range(map_.strides):
        by_start = EndState(along)
        try:
            run = simulate(
                map_.model, replace(state, memory=None), map_.integrator, dt=map_.dt,
                until=(map_.section, map_.longest), contact="events", parameters=map_.plain(values), progress=False,
                on_failure="return", backend=map_.backend, wrt=by_start,  # type: ignore[arg-type]
            )  # fmt: skip
        except CapabilityError:
            return None
        if stopped(run):
            raise KeyboardInterrupt
        arrival = map_(state, values, strides=1)
        if not run.success or not arrival.outcome.good:
            return None
        along, state = _arrived(map_, by_start.found), arrival.state
    return _by_tangent(chart, state, along)


def _arrived(map_: ReturnMap, by_start: Matrix) -> Matrix:
    """The derivatives at an end, instants counted from there, in the order of the mirror image."""
    layout, mirror = map_.mechanism.layout, map_.mirror
    q, v, z, anchors = np.split(by_start[:-1], np.cumsum([layout.n_v, layout.n_v, layout.n - layout.n_v]))
    for machine in map_.mechanism.equations.machines:
        anchors[list(machine.times)] -= by_start[-1]
    if mirror is not None:
        q, v, z, anchors = mirror.of_v(q.T).T, mirror.of_v(v.T).T, z[mirror.z], mirror.of_changes(anchors.T).T
    return np.vstack([q, v, z, anchors])


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


def _tangent(chart: Chart, state: State, parameters: Vector) -> Matrix:
    """T (n_v + n + A, size) at a state of the section."""
    section, mechanism = chart.section, chart.section.mechanism
    layout, equations = mechanism.layout, mechanism.equations
    programs = Programs(mechanism, (), parameters)
    columns, y = programs.columns, np.concatenate([state.v, state.z])
    none = np.zeros(columns.n), np.zeros(columns.rows)
    flags, size = section.flags.astype(float), chart.size
    mode = Mode((), (), flags, flags, np.zeros(len(equations.frictions)))
    parts = np.split(np.eye(size), np.cumsum(chart.counts)[:-1])

    def with_rows(free: Matrix, off: Matrix, slopes: Matrix, own: slice, known: Tangent) -> Matrix:
        """Tangents whose part off the free ones keeps the rows, as the other parts of a tangent are known."""
        change = slopes @ known.stacked(columns) + slopes[:, own] @ free
        return np.asarray(free - off @ np.linalg.lstsq(slopes[:, own] @ off, change, rcond=None)[0])

    # what is free: the coordinates z, and what is held
    of_y, of_anchors = np.zeros((layout.n, size)), np.zeros((columns.anchors, size))
    of_y[layout.n_v :], of_anchors[list(section.held)] = parts[2], parts[3]
    tangent = Tangent(np.zeros(size), np.zeros((layout.n_v, size)), of_y, of_anchors, np.zeros((0, size)))
    motion = Motion(0.0, state.q, y, state.anchors, tangent)
    _, _, _, _, of_h, of_rate = programs.steps(motion.at(mode, *none))
    watched = programs.watched(motion.at(mode, *none))[1] if section.gaps or section.speeds else np.zeros((0, 0))
    # positions on their rows, then velocities
    configuration = equations.configuration
    move = configuration.difference(chart.state.q, state.q)
    free, off = (_tangents(configuration, move, part) for part in (chart.places, chart.off_places))
    gaps = [_watched_line(section, value) for value, _ in section.gaps]
    G = np.vstack([of_h[list(section.places)], *watched[gaps]])
    motion = motion.with_tangent(q=with_rows(free @ parts[0], off, G, columns.x, tangent))
    own = slice(columns.y.start, columns.y.start + layout.n_v)
    speeds = [_watched_line(section, value) for value in section.speeds]
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
    return np.vstack([motion.tangent.q, motion.tangent.y, motion.tangent.anchors])


def _watched_line(section: Section, place: int) -> int:
    """Where `Programs.watched` lists the value of a gap or of what an event watches, from its place in `guards`."""
    contacts = len(section.manager.contacts)
    return place if place < contacts else place - 2 * contacts
