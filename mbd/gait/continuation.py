"""Pseudo-arclength continuation of fixed points of a return map in one parameter.

With u = (c, p/σ), σ the width of the range of p, a branch solves ``G(u) = F(c, p) − c = 0``. From a point with tangent
τ, ``[P − 1, σ F_p] τ = 0``, the next one solves G = 0 on the plane ``τᵀ u = ds`` by Newton's method with the matrix of
the last point, made again where that converges slowly (Keller 1977; Allgower & Georg 1990, ch. 6). Coordinates c are
those of the chart around the last point.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import GaitError, SimulationError
from mbd.gait.family import Member, across, floquet
from mbd.gait.floquet import Multipliers
from mbd.gait.map_derivative import EXACT, MapDerivative, Measured, map_derivative, measured, numbers_of
from mbd.gait.newton import MAX_CONTRACTION
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import Arrival, ReturnMap
from mbd.gait.section import Chart, Section
from mbd.state import State

CORRECTIONS, QUICK = 10, 4
"""Newton corrections of a point, and how many count as few."""
NOT_CONVERGED = "does not converge"
"""Outcome of corrections that tells nothing of the place where they were made."""


@dataclass(frozen=True, eq=False)
class BranchPoint:
    """A gait on a branch.

    value : of the parameter; state, period [s], distance [m], steps : see `LimitCycle`
    multipliers : see `mbd.gait.floquet`; tangent (size + 1,): of (c, p/σ) in the chart, of length 1
    matrix (size, size + 1): [P − 1, σ F_p]; events : the sequence of (name, kind) in one application
    how : the derivatives were found (see `mbd.gait.map_derivative`)
    """

    value: float
    state: State
    period: float
    distance: float
    steps: tuple[tuple[str, float, float], ...]
    multipliers: Multipliers
    tangent: Vector
    matrix: Matrix
    chart: Chart
    events: tuple[tuple[str, str], ...]
    how: str = EXACT

    @property
    def speed(self) -> float:
        """distance/period [m/s]."""
        return self.distance / self.period

    @property
    def stable(self) -> bool:
        """Whether the largest modulus is below 1."""
        return self.multipliers.stability == "stable"


@dataclass(frozen=True, eq=False)
class Corrected:
    """A solution near a prediction: the state, the parameter, what the map gave there, corrections that it took.

    left : by how much one more correction would change the parameter; u : as in `Continuation.corrected`
    alone : by how much it would if the state did not follow, as beside a limit
    """

    state: State
    value: float
    found: Measured
    corrections: int
    left: float = 0.0
    u: Vector | None = None
    alone: float = 0.0


@dataclass(frozen=True)
class Forbidden(Outcome):
    """Why a solution has no value of the parameter that the model allows. value : that it would have"""

    value: float = float("nan")


@dataclass(eq=False)
class Continuation:
    """What all points of a branch share.

    width : σ; tol : of the coordinates; friction : of the ground, or None
    member : of a family of gaits (`mbd.gait.family`), which a branch keeps, or follows where its name is `name`
    """

    map: ReturnMap
    section: Section
    name: str
    values: Mapping[str, float]
    width: float
    tol: float
    friction: float | None = None
    member: Member | None = None

    @property
    def follows_member(self) -> bool:
        """Whether the branch follows the energy or the speed of its family."""
        return self.member is not None and self.name == self.member.kind

    def with_value(self, value: float) -> dict[str, float]:
        """The parameters with another value of the one that varies."""
        return dict(self.values) if self.follows_member else {**self.values, self.name: float(value)}

    def member_at(self, value: float) -> Member | None:
        """The member that is asked for at a value of the one that varies."""
        return replace(self.member, value=float(value)) if self.member and self.follows_member else self.member

    def derived(
        self, chart: Chart, c: Vector, values: Mapping[str, float], levels: int, base: Measured | None = None
    ) -> MapDerivative:  # fmt: skip
        """The derivatives of the map by all coordinates, then by the parameter: 0 by what picks a member."""
        if not self.follows_member:
            return map_derivative(self.map, chart, c, values, [self.name], levels, base=base)
        found = map_derivative(self.map, chart, c, values, levels=levels, base=base)
        matrix, error = (np.column_stack([part, np.zeros(len(part))]) for part in (found.matrix, found.error))
        return MapDerivative(matrix, error, found.how, found.missing)

    def member_part(self, chart: Chart, found: Measured, derivative: MapDerivative, value: float) -> Matrix:
        """w [∇g, σ g_p], which picks the member, to be added to [P − 1, σ F_p]; zeros without a member."""
        size = chart.size
        if self.member is None:
            return np.zeros((size, size + 1))
        values = self.with_value(value)
        along = self.member.slope(self.map, chart, found, derivative.matrix[:, :size], values)
        if self.follows_member:
            by = -1.0 / self.member.size
        else:
            by = self.member.by(self.map, chart, found, derivative.matrix[:, size], self.name, values)
        return np.outer(across(self.map, chart, values), np.append(along, self.width * by))

    def member_gap(self, chart: Chart, c: Vector, found: Measured, value: float) -> Vector:
        """w (g − g₀), to be added to F(c) − c; zeros without a member."""
        member = self.member_at(value)
        if member is None or self.member is None:
            return np.zeros(chart.size)
        values = self.with_value(value)
        left = -member.misfit(self.map, chart, c, found, values) * member.size / self.member.size
        return left * across(self.map, chart, values)

    def point(self, corrected: Corrected, before: Vector | None, levels: int = 2) -> BranchPoint:
        """The point of a solution; its tangent goes on in the direction of the one `before`.

        levels : see `map_derivative`

        Raises
        ------
        GaitError
            where derivatives are missing.
        """
        values = self.with_value(corrected.value)
        chart = Chart(self.section, corrected.state, self.map.vector(values))
        zero = np.zeros(chart.size)
        base = numbers_of(chart, corrected.found.arrival)
        derivative = self.derived(chart, zero, values, levels, base)
        if derivative.missing:
            why = next(iter(derivative.missing.values()))
            raise GaitError(f"no derivative at {self.name} = {corrected.value:.9g}: {why}")
        matrix = self._matrix(derivative, chart.size) + self.member_part(chart, base, derivative, corrected.value)
        tangent = np.asarray(np.linalg.svd(matrix)[2][-1], dtype=float)  # along which the matrix vanishes
        if before is not None:
            lifted = self.lifted(before, chart)
            tangent = tangent if float(tangent @ lifted) >= 0.0 else -tangent
        arrival = corrected.found.arrival
        return BranchPoint(
            corrected.value, corrected.state, arrival.period, self.map.way_of(arrival), arrival.steps,
            floquet(self.map, chart, derivative, values), tangent, matrix, chart, arrival.events, derivative.how,
        )  # fmt: skip

    def whole(self, point: BranchPoint) -> Vector:
        """The tangent in the coordinates of the mechanism, for the chart of another point."""
        return np.append(point.chart.basis @ point.tangent[:-1], point.tangent[-1])

    def lifted(self, whole: Vector, chart: Chart) -> Vector:
        """A tangent in the coordinates of the mechanism in those of a chart."""
        return np.append(chart.basis.T @ whole[:-1], whole[-1])

    def _matrix(self, derivative: MapDerivative, size: int) -> Matrix:
        P = derivative.matrix[:size]
        return np.column_stack([P[:, :size] - np.eye(size), self.width * P[:, size]])

    def corrected(
        self, point: BranchPoint, plane: Vector, ds: float, guess: Vector | None = None, goal: float | None = None
    ) -> Corrected | Outcome:
        """The solution with planeᵀ u = ds near `guess`, by default ds plane; why there is none.

        u = (c, (p − p₀)/σ) in the chart of the point; `goal` is p to the bit where the plane is that of a value of p.
        """
        chart, size = point.chart, point.chart.size
        u = ds * plane if guess is None else guess.copy()
        matrix, before = point.matrix, np.inf
        for number in range(CORRECTIONS):
            value = point.value + self.width * float(u[-1]) if goal is None else goal
            values = self.with_value(value)
            if faults := self.map.faults(values):
                return Forbidden("not allowed", "; ".join(faults), value=value)
            try:
                found = measured(self.map, chart, u[:size], values)
            except SimulationError as error:
                return Outcome("not on the section", str(error))
            if isinstance(found, Arrival):
                outcome = self.map.against(self.section, found)
                return self.map.explained(chart.at(u[:size], self.map.vector(values)), outcome, values)
            left = found.c - u[:size] + self.member_gap(chart, u[:size], found, value)
            gap = np.append(left, float(plane @ u) - ds)
            residual = float(np.max(np.abs(gap)))
            step = np.linalg.lstsq(np.vstack([matrix, plane]), gap, rcond=None)[0]
            if residual <= self.tol:
                uncertain = self.width * abs(float(step[-1]))
                alone = self.width * residual / (float(np.linalg.norm(matrix[:, -1])) or 1.0)
                state = chart.at(u[:size], self.map.vector(values))
                return Corrected(state, value, found, number, uncertain, u, alone)
            if residual > MAX_CONTRACTION * before:
                renewed = self.matrix_at(chart, u, value, found)
                if renewed is None or self.leaves_smooth_part(point, renewed[1]):
                    return Outcome("no derivative", "the corrections come to where the map has no derivative")
                if residual > 4.0 * before:
                    break
                matrix = renewed[0]
                step = np.linalg.lstsq(np.vstack([matrix, plane]), gap, rcond=None)[0]
            before = min(residual, before)
            u = u - step
        return Outcome(NOT_CONVERGED, "the corrections do not converge")

    def leaves_smooth_part(self, point: BranchPoint, how: str) -> bool:
        """Whether a pass knows the derivative of the map at a point, and none where one was found in this way."""
        return point.how == EXACT and how != EXACT

    def with_half_steps(self) -> Continuation:
        """The same with half the step of the map: where what it finds differs, that is the error of the steps."""
        return replace(self, map=self.map.with_step(0.5 * self.map.dt))

    def last_allowed(self, allowed: float, forbidden: float) -> float:
        """The last value of the parameter between two that the model allows."""
        for _ in range(1200):  # down to the smallest number
            middle = 0.5 * (allowed + forbidden)
            if middle in (allowed, forbidden):
                break
            if self.map.faults(self.with_value(middle)):
                forbidden = middle
            else:
                allowed = middle
        return allowed + 0.0  # no −0

    def matrix_at(self, chart: Chart, u: Vector, value: float, found: Measured) -> tuple[Matrix, str] | None:
        """[P − 1, σ F_p] beside a point, from where the map gives `found`, and how it was found; None where derivatives
        are missing."""
        try:
            derivative = self.derived(chart, u[:-1], self.with_value(value), 1, found)
        except SimulationError:
            return None
        if derivative.missing:
            return None
        matrix = self._matrix(derivative, chart.size) + self.member_part(chart, found, derivative, value)
        return matrix, derivative.how
