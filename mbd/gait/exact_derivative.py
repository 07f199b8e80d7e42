"""The derivative of a return map from the exact derivative of one run a return.

With T the tangent vectors (δx, δv) of the section at a state with coordinates c, ``δx = Z_q + N_q μ``,
``δv = Z_v + N_v ν``, the derivative in coordinates is ``Zᵀ D_k … D_1 T``, D_i that of the end of the i-th return by its
start (`mbd.sensitivity.derivative`), sides exchanged.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import CapabilityError
from mbd.gait.return_map import ReturnMap, Values
from mbd.gait.section import Chart
from mbd.sensitivity.derivative import final_state_derivative
from mbd.simulation.simulate import simulate
from mbd.state import State

__all__ = ["exact_derivative"]

BESIDE = 1e-3
"""Distance [m, rad] of the states from whose rows of velocities their change along the section follows."""


def exact_derivative(map_: ReturnMap, chart: Chart, c: Vector, values: Values) -> Matrix | None:
    """∂(coordinates)/∂c at c, (size, size); None where a return does not arrive or no pass knows its derivative."""
    section = chart.section
    if (
        chart.counts[2]
        or chart.counts[3]
        or section.heading is not None
        or section.mechanism.equations.configuration.charts
    ):
        return None
    state = chart.at(c, map_.vector(values))
    along = _tangent(chart, state, map_.vector(values))
    for _ in range(map_.strides):
        run = simulate(
            map_.model, state, map_.integrator, dt=map_.dt, until=(map_.section, map_.longest), contact="events",
            parameters=map_.plain(values), progress=False, on_failure="return", backend=map_.backend,
        )  # fmt: skip
        arrival = map_(state, values, strides=1)
        if not run.success or not arrival.outcome.good:
            return None
        try:
            by_start, _ = final_state_derivative(run, [*state.names, *state.velocity_names])
        except CapabilityError:
            return None
        along, state = _mirrored(map_, by_start) @ along, arrival.state
    n_v = len(state.v)
    return np.vstack([chart.places.T @ along[:n_v], chart.rates.T @ along[n_v:]])


def _mirrored(map_: ReturnMap, by_start: Matrix) -> Matrix:
    """The rows of a derivative in the order of the mirror image."""
    if map_.mirror is None:
        return by_start
    n_q = len(map_.mirror.q)
    return np.concatenate([map_.mirror.of_q(by_start[:n_q].T).T, map_.mirror.of_v(by_start[n_q:].T).T])


def _tangent(chart: Chart, state: State, parameters: Vector) -> Matrix:
    """T (n_v + n_v, size) at a state of the section."""
    section, compose = chart.section, chart.section.mechanism.equations.configuration.compose
    _, G = section.positions(state.q, parameters, state.anchors)
    moves = chart.places - chart.off_places @ np.linalg.lstsq(G @ chart.off_places, G @ chart.places, rcond=None)[0]

    def rates(move: Vector) -> Vector:
        return section.velocities(compose(state.q, move), state.v, parameters, state.anchors)[0]

    _, B = section.velocities(state.q, state.v, parameters, state.anchors)

    def slope(move: Vector) -> Vector:
        one, two = ((rates(h * move) - rates(-h * move)) / (2.0 * h) for h in (BESIDE, 2.0 * BESIDE))
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
