"""Small balls round attractors: a walk that has come into one stays, and comes to the gait.

With P the derivative of the return map at the gait, μ its largest multiplier and s = √|μ| < 1, the equation
``W = Pᵀ W P/s² + 1`` has a definite solution, and ``|P c|²_W = s² (|c|²_W − |c|²)``: the linear map shrinks the norm
``|c|²_W = cᵀ W c`` by s at least (La Salle 1976, The stability of dynamical systems). The ball ``|c|_W ≤ r`` counts as
verified where runs of the map itself from many places on its surface and inside it all come back on the section, nearer
by at least a tenth of what the linear map promises; r is halved until they do. Samples are no proof, but of a smooth
map in a ball this small they leave little room.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import ModelError, SimulationError
from mbd.gait.cycle import LimitCycle
from mbd.gait.section import Chart
from mbd.state import State

MAX_RADIUS, MIN_RADIUS = 0.1, 1e-6
"""Radii that are tried, in the W-norm of coordinates of the section [m, rad, m/s, rad/s]."""
INSIDE = (1.0, 0.5, 0.1)
"""Radii of the samples over that of the ball [-]."""


@dataclass(frozen=True, eq=False)
class Ball:
    """A verified ball round an attractor.

    chart : coordinates around the gait; W (size, size) its norm; radius : in that norm
    samples : runs that verified it; contraction : the largest ratio of norms after and before among them [-]
    """

    chart: Chart
    W: Matrix
    radius: float
    samples: int
    contraction: float

    def holds(self, q: Matrix, v: Matrix, z: Matrix, anchors: Matrix) -> NDArray[np.bool_]:
        """Which of some states of the section (N, …) lie inside."""
        return np.asarray(self.norm(q, v, z, anchors) <= self.radius)

    def norm(self, q: Matrix, v: Matrix, z: Matrix, anchors: Matrix) -> Vector:
        """|c|_W of states (N,)."""
        chart = self.chart
        if chart.section.heading is not None:
            facing = [chart.facing(replace(chart.state, q=one, v=other)) for one, other in zip(q, v, strict=True)]
            q, v = (np.array([pair[k] for pair in facing]).reshape(len(q), -1) for k in (0, 1))
        parts = [chart.away(q) @ chart.places, (v - chart.state.v) @ chart.rates, z - chart.state.z]
        held = list(chart.section.held)
        if held:
            parts.append((anchors - chart.state.anchors)[:, held])
        c = np.hstack(parts)
        return np.asarray(np.sqrt(np.einsum("ni,ij,nj->n", c, self.W, c)))


Walked = Callable[[list[State]], tuple[list[State], NDArray[np.bool_]]]
"""From states of the section to where the map of the gait leads, and whether each came back."""


def ball_of(name: str, gait: LimitCycle, walked: Walked) -> Ball:
    """The largest ball that runs of the map confirm.

    Raises
    ------
    ModelError
        for a gait that attracts nothing, and one round which no ball of `MIN_RADIUS` holds.
    """
    if not gait.success or gait.map_derivative is None:
        raise ModelError(f"{name} is no gait: {gait.outcome}")
    size = gait.chart.size
    P = np.asarray(gait.map_derivative.matrix[:size, :size], dtype=float)
    spectral = float(np.max(np.abs(np.linalg.eigvals(P)), initial=0.0)) if size else 0.0
    if "energy" in gait.stability_of.trivial:
        raise ModelError(
            f"{name} is one of a family, since nothing takes energy: starts of other energies come to other gaits, and "
            "none attracts them; follow the family by mbd.branch(gait, 'energy', …), or let something take energy"
        )
    if not spectral < 1.0 or gait.stability != "stable":
        raise ModelError(
            f"{name} attracts nothing: its largest multiplier is {max(spectral, gait.largest_multiplier):.6g} "
            f"({gait.stability}); give a stable gait, or other parameters"
        )
    from scipy.linalg import solve_discrete_lyapunov

    shrinks = max(float(np.sqrt(spectral)), 0.3)  # nothing is won by asking for more
    W = np.asarray(solve_discrete_lyapunov(P.T / shrinks, np.eye(size)))
    W = 0.5 * (W + W.T)
    W = W / np.linalg.eigvalsh(W)[0]
    axes = np.linalg.eigh(W)[1]
    wanted = 1.0 - 0.1 * (1.0 - shrinks)
    # places on the surface that are drawn at random beside those on its axes
    random = np.random.default_rng(7).normal(size=(48, size))
    directions = np.vstack([axes.T, -axes.T, random])
    directions /= np.sqrt(np.einsum("ni,ij,nj->n", directions, W, directions))[:, np.newaxis]
    radius, base = MAX_RADIUS, Ball(gait.chart, np.array(W, dtype=np.float64), 0.0, 0, 0.0)
    while radius >= MIN_RADIUS:
        ratio = _worst(base, gait, directions, radius, walked)
        if ratio <= wanted:
            return replace(base, radius=radius, samples=len(directions) * len(INSIDE), contraction=ratio)
        radius *= 0.5
    raise ModelError(
        f"{name}: no ball round it holds walks, down to a radius of {MIN_RADIUS:g}; the step dt may be too coarse for "
        "the gait, which was found with another one: take the dt of the gait"
    )


def _worst(base: Ball, gait: LimitCycle, directions: Matrix, radius: float, walked: Walked) -> float:
    """The largest ratio of norms after and before the map, infinite where a walk does not come back."""
    parameters = gait.map.vector(gait.parameters)
    before = np.concatenate([part * radius * np.ones(len(directions)) for part in INSIDE])
    try:
        starts = [base.chart.at(part * radius * d, parameters) for part in INSIDE for d in directions]
    except SimulationError:
        return float("inf")
    ends, good = walked(starts)
    if not good.all():
        return float("inf")
    columns = (np.array([getattr(end, each) for end in ends]) for each in ("q", "v", "z", "anchors"))
    after = base.norm(*(column.reshape(len(ends), -1) for column in columns))
    return float(np.max(after / before))
