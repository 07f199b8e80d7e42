"""Walkers of rods that hang from one hip, by hand: floating equations and DOP853, nothing shared with mbd.

Coordinates (x, y) of the hip and absolute angles of the rods, 0 hanging down, positive forward: legs 0 and 1 with feet
at their ends, then others. With c the distance of a center from the hip::

    m ẍ + Σ mᵢ cᵢ (cos θᵢ θ̈ᵢ − sin θᵢ θ̇ᵢ²) = m g_x,   m ÿ + Σ mᵢ cᵢ (sin θᵢ θ̈ᵢ + cos θᵢ θ̇ᵢ²) = m g_y
    (Iᵢ + mᵢ cᵢ²) θ̈ᵢ + mᵢ cᵢ (cos θᵢ ẍ + sin θᵢ ÿ) = mᵢ cᵢ (g_x cos θᵢ + g_y sin θᵢ) + τᵢ
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Numbers = NDArray[np.float64]
TIGHT = {"rtol": 1e-12, "atol": 1e-13, "method": "DOP853"}
AHEAD = 0.1
"""How far the swinging foot is ahead of the other before it may strike [m]."""


@dataclass(frozen=True)
class Rods:
    """A walker: hip mass; (mass, center, inertia) of each rod; slope; rows on velocities that hold at all times."""

    hip: float
    rods: Sequence[tuple[float, float, float]]
    slope: float = 0.0
    length: float = 1.0
    g: float = 9.81
    rows: Sequence[Sequence[float]] = ()

    def mass(self, q: Numbers) -> Numbers:
        """M(q)."""
        M = np.zeros((len(q), len(q)))
        M[0, 0] = M[1, 1] = self.hip + sum(m for m, _, _ in self.rods)
        for k, (m, c, inertia) in enumerate(self.rods):
            M[2 + k, 2 + k] = inertia + m * c * c
            M[0, 2 + k] = M[2 + k, 0] = m * c * math.cos(q[2 + k])
            M[1, 2 + k] = M[2 + k, 1] = m * c * math.sin(q[2 + k])
        return M

    def force(self, q: Numbers, v: Numbers) -> Numbers:
        """Weights and centrifugal forces."""
        gx, gy = self.g * math.sin(self.slope), -self.g * math.cos(self.slope)
        f = np.zeros(len(q))
        f[:2] = self.hip * gx, self.hip * gy
        for k, (m, c, _) in enumerate(self.rods):
            sine, cosine = math.sin(q[2 + k]), math.cos(q[2 + k])
            f[0] += m * gx + m * c * sine * v[2 + k] ** 2
            f[1] += m * gy - m * c * cosine * v[2 + k] ** 2
            f[2 + k] += m * c * (gx * cosine + gy * sine)
        return f

    def foot(self, q: Numbers, leg: int) -> Numbers:
        """The place of a foot."""
        return q[:2] + self.length * np.array([math.sin(q[2 + leg]), -math.cos(q[2 + leg])])

    def held(self, q: Numbers, v: Numbers, leg: int) -> tuple[Numbers, Numbers]:
        """Rows that hold a foot, and all others, with their biases."""
        J = np.zeros((2 + len(self.rows), len(q)))
        J[0, 0] = J[1, 1] = 1.0
        sine, cosine = math.sin(q[2 + leg]), math.cos(q[2 + leg])
        J[0, 2 + leg], J[1, 2 + leg] = self.length * cosine, self.length * sine
        bias = np.zeros(len(J))
        bias[:2] = self.length * v[2 + leg] ** 2 * np.array([-sine, cosine])
        J[2:] = np.array(self.rows).reshape(-1, len(q))
        return J, bias

    def swing(
        self, q: Numbers, v: Numbers, leg: int, torques: Callable[..., Any], until: float | None = None,
        begun: float = 0.0,
    ) -> tuple[float, Numbers, Numbers]:  # fmt: skip
        """(t, q, v) at the strike of the other foot, or so long after, from a time at which a leg stands."""
        n = len(q)

        system = np.zeros((n + 2 + len(self.rows),) * 2)
        right = np.zeros(len(system))

        def rates(t: float, s: Numbers) -> Numbers:
            J, bias = self.held(s[:n], s[n:], leg)
            system[:n, :n], system[n:, :n], system[:n, n:] = self.mass(s[:n]), J, J.T
            right[:n], right[n:] = self.force(s[:n], s[n:]), -bias
            right[2:n] += torques(t, s[2:n], s[n + 2 :])
            return np.concatenate([s[n:], np.linalg.solve(system, right)[:n]])

        def strike(_: float, s: Numbers) -> float:
            mine, its = self.foot(s[:n], 1 - leg), self.foot(s[:n], leg)
            return float(mine[1] if mine[0] - its[0] > AHEAD else 1.0 + abs(mine[1]))

        strike.terminal, strike.direction = True, -1.0  # type: ignore[attr-defined]
        if until is not None:
            found = solve_ivp(rates, (begun, until), np.concatenate([q, v]), **TIGHT)
            return until, found.y[:n, -1], found.y[n:, -1]
        found = solve_ivp(rates, (begun, begun + 3.0), np.concatenate([q, v]), events=strike, max_step=0.05, **TIGHT)
        assert found.status == 1
        return float(found.t[-1]), found.y[:n, -1], found.y[n:, -1]

    def struck(self, q: Numbers, v: Numbers, leg: int) -> Numbers:
        """v⁺ of the plastic impact of a foot, with nothing else on the ground."""
        J, _ = self.held(q, v, leg)
        flow = np.linalg.solve(self.mass(q), J.T)
        return v - flow @ np.linalg.solve(J @ flow, J @ v)

    def pushed(self, q: Numbers, v: Numbers, leg: int, size: float) -> Numbers:
        """v after an impulse on the hip along a leg, from its foot up, with nothing on the ground."""
        along = np.zeros(len(q))
        along[:2] = -size * math.sin(q[2 + leg]), size * math.cos(q[2 + leg])
        return v + np.linalg.solve(self.mass(q), along)

    def standing(
        self, angle: float, rates: Sequence[float], others: Sequence[float] = ()
    ) -> tuple[Numbers, Numbers]:  # fmt: skip
        """(q, v) with both feet on the ground; leg 0 stands, at an angle ahead; `others` are angles of other rods."""
        q = np.array([0.0, 0.0, angle, -angle, *others])
        q[:2] -= self.foot(q, 0)
        v = np.array([0.0, 0.0, *rates])
        v[:2] = -self.length * v[2] * np.array([math.cos(angle), math.sin(angle)])
        return q, v


def exchanged(values: Sequence[float]) -> Numbers:
    """Numbers of rods with those of the two legs exchanged."""
    return np.array([values[1], values[0], *values[2:]])


def held_out(
    step: Callable[[Numbers], Numbers], c: Numbers, h: float = 2e-3, levels: int = 3
) -> tuple[Numbers, Numbers]:
    """How far a fixed point of a map by hand is from c, and the eigenvalues of its derivative, by falling modulus.

    Central differences of h, h/2, … with Richardson's extrapolation.
    """
    size = len(c)
    P = np.zeros((size, size))
    for k, unit in enumerate(np.eye(size)):
        table = [(step(c + d * unit) - step(c - d * unit)) / (2.0 * d) for d in h * 0.5 ** np.arange(levels)]
        for order in range(1, levels):
            table = [(4.0**order * fine - coarse) / (4.0**order - 1.0) for coarse, fine in pairwise(table)]
        P[:, k] = table[0]
    values = np.linalg.eigvals(P)
    return np.linalg.lstsq(np.eye(size) - P, step(c) - c, rcond=1e-9)[0], values[np.argsort(-np.abs(values))]
