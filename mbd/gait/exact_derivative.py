"""The derivative of a return map from the exact derivative of one run a return.

With T the tangent vectors (δx, δv) of the section at a state with coordinates c, ``δx = D(m) (Z_q + N_q μ)``,
``δv = Z_v + N_v ν``, m = q ⊖ q₀, the derivative in coordinates is ``C D_k … D_1 T``: D_i is that of the end of the i-th
return by its start (`mbd.sensitivity.derivative`), sides exchanged, and C = ∂(coordinates)/∂(δx, δv) that of the chart
where the last one arrives, ``Zᵀ`` where coordinates add. Tangents of orientations are small rotations in axes of the
child: D and its inverse lead from them to the increments of a chart and back (`mbd.configuration`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.configuration import Configuration
from mbd.errors import CapabilityError
from mbd.gait.return_map import ReturnMap, Values
from mbd.gait.section import Chart
from mbd.sensitivity.asked import EndState
from mbd.sensitivity.tangent_names import place_names
from mbd.simulation.interrupted import stopped
from mbd.simulation.simulate import simulate
from mbd.state import State

__all__ = ["exact_derivative"]

DIFFERENCE_STEP = 1e-3
"""Distance [m, rad] of the states from whose rows of velocities their change along the section follows."""


def exact_derivative(map_: ReturnMap, chart: Chart, c: Vector, values: Values) -> Matrix | None:
    """∂(coordinates)/∂c at c, (size, size); None where a return does not arrive or no pass knows its derivative."""
    equations = chart.section.mechanism.equations
    if chart.counts[2] or chart.counts[3]:
        return None
    state = chart.at(c, map_.vector(values))
    along = _tangent(chart, state, map_.vector(values))
    for _ in range(map_.strides):
        by_start = EndState([*place_names(equations), *state.velocity_names], hold=())
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
        along, state = _mirrored(map_, by_start.found[0]) @ along, arrival.state
    return _by_tangent(chart, state, along)


def _mirrored(map_: ReturnMap, by_start: Matrix) -> Matrix:
    """The rows of a derivative in the order of the mirror image."""
    if map_.mirror is None:
        return by_start
    n_v = len(map_.mirror.v)
    return np.concatenate([map_.mirror.of_v(part.T).T for part in (by_start[:n_v], by_start[n_v:])])


def _by_tangent(chart: Chart, state: State, along: Matrix) -> Matrix:
    """C · (δx, δv): the change of the coordinates of a state with tangents (n_v + n_v, k) of it."""
    configuration, heading = chart.section.mechanism.equations.configuration, chart.section.heading
    n_v = len(state.v)
    q, v = chart.facing(state)
    moves, rates = along[:n_v], along[n_v:]
    if heading is not None:
        angle = heading.angle(chart.state.q, state.q, chart.turning)
        moves, rates = (
            np.array([heading.turned(state.q, column, angle)[1] for column in part.T]).reshape(part.T.shape).T
            for part in (moves, rates)
        )
    away = _increments(configuration, configuration.difference(chart.state.q, q), moves)
    if heading is not None:
        # the turn changes too, so that what is left has no part along the heading
        by_turn = heading.tangent(q)
        turn = _increments(configuration, configuration.difference(chart.state.q, q), by_turn[:, np.newaxis])[:, 0]
        change = -(chart.turning @ away) / float(chart.turning @ turn)
        away = away + np.outer(turn, change)
        rates = rates + np.outer(heading.rate_tangent(q, v), change)
    return np.vstack([chart.places.T @ away, chart.rates.T @ rates])


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
    """T (n_v + n_v, size) at a state of the section."""
    section, configuration = chart.section, chart.section.mechanism.equations.configuration
    compose, away = configuration.compose, configuration.difference(chart.state.q, state.q)
    _, slopes = section.positions(state.q, parameters, state.anchors)
    G = slopes()
    free, off = (_tangents(configuration, away, part) for part in (chart.places, chart.off_places))
    moves = free - off @ np.linalg.lstsq(G @ off, G @ free, rcond=None)[0]

    def rates(move: Vector) -> Vector:
        return section.velocities(compose(state.q, move), state.v, parameters, state.anchors)[0]

    _, B = section.velocities(state.q, state.v, parameters, state.anchors)

    def slope(move: Vector) -> Vector:
        one, two = ((rates(h * move) - rates(-h * move)) / (2.0 * h) for h in (DIFFERENCE_STEP, 2.0 * DIFFERENCE_STEP))
        return np.asarray((4.0 * one - two) / 3.0)

    bends = np.array([slope(move) for move in moves.T]).reshape(moves.shape[1], len(B)).T
    inside = B @ chart.off_rates
    turns = [-chart.off_rates @ np.linalg.lstsq(inside, each, rcond=None)[0] for each in (bends, B @ chart.rates)]
    size, n_v = moves.shape[1], len(state.v)
    found: Any = np.zeros((2 * n_v, chart.size))
    found[:n_v, :size] = moves
    found[n_v:, :size] = turns[0]
    found[n_v:, size:] = chart.rates + turns[1]
    return np.asarray(found)
