"""A walker in space with disk feet, derived by sympy and stepped by scipy: nothing here is of the library.

Coordinates (x, y, z, roll, left hip, right hip), Lagrange's equations; the stance foot rolls, three rows on velocities;
the other one strikes with all three, plastically, and takes the place of the first.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

EXACT, NEARLY = {"rtol": 1e-12, "atol": 1e-14}, {"rtol": 1e-8, "atol": 1e-10}
AHEAD = 0.1
"""How far the swinging foot is ahead of the other before it may strike [m]."""


def rotation(angle: sp.Expr, axis: int) -> sp.Matrix:
    """About the x (0) or the z axis (2)."""
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]] if axis == 0 else [[c, -s, 0], [s, c, 0], [0, 0, 1]])


def equations(values: Mapping[str, Any]) -> Callable[..., list[Any]]:
    """(q, v) → M, f, J and J̇ v of both feet, their gaps, their places along the way."""
    radius, leg = values["radius"], values["leg_mass"]
    q, v = sp.symbols("x y z phi l r"), sp.symbols("v0:6")
    gravity = values["g"] * sp.Matrix([sp.sin(values["slope"]), -sp.cos(values["slope"]), 0])
    trunk, up = sp.Matrix(q[:3]), sp.Matrix([0, 1, 0])

    def rate(what: sp.Matrix) -> sp.Matrix:
        return what.jacobian(q) * sp.Matrix(v)

    mass = values["trunk_mass"] + values["pelvis_mass"]
    kinetic = (mass * rate(trunk).dot(rate(trunk)) + values["pelvis_inertia"] * v[3] ** 2) / 2
    potential = -mass * gravity.dot(trunk)
    feet = []
    for side, angle, speed in (-0.5, q[4], v[4]), (0.5, q[5], v[5]):
        axes = rotation(q[3], 0) * rotation(angle, 2)
        hip = trunk + rotation(q[3], 0) * sp.Matrix([0, 0, side * values["width"]])
        center, arch = (hip + axes * sp.Matrix([0, -drop, 0]) for drop in (values["center"], 1.0 - radius))
        spin = rotation(angle, 2).T * sp.Matrix([v[3], 0, 0]) + sp.Matrix([0, 0, speed])
        kinetic += (leg * rate(center).dot(rate(center)) + spin.dot(sp.diag(*values["leg_inertia"]) * spin)) / 2
        potential -= leg * gravity.dot(center)
        steep = up - up.dot(axes[:, 2]) * axes[:, 2]
        size = sp.sqrt(steep.dot(steep))
        slip = rate(arch) + (axes * spin).cross(-radius / size * steep)
        feet.append((arch[1] - radius * size, slip.jacobian(v), rate(slip), arch[0]))
    momentum = sp.Matrix([kinetic]).jacobian(v).T
    force = rate(momentum) - sp.Matrix([kinetic - potential]).jacobian(q).T
    rows = [part for _, *parts, _ in feet for part in parts]
    out = [momentum.jacobian(v), force, *rows, *(foot[0] for foot in feet), *(foot[3] for foot in feet)]
    found: Callable[..., list[Any]] = sp.lambdify([*q, *v], out, cse=True)
    return found


def solved(M: Any, J: Any, right: Any) -> Any:
    """The upper part of the solution of [[M, Jᵀ], [J, 0]]."""
    m = len(J)
    return np.linalg.solve(np.block([[M, J.T], [J, np.zeros((m, m))]]), right)[: len(M)]


class Walker:
    """Steps of the walker with these numbers."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.terms = equations(values)

    def gap(self, state: Any, foot: int) -> float:
        """Height of a foot over the slope [m]."""
        return float(self.terms(*state)[6 + foot])

    def rolled(self, state: Any, foot: int, until: float, **how: Any) -> Any:
        """The motion on one foot."""

        def rates(_: float, s: Any) -> Any:
            M, f, *rows = self.terms(*s)
            J, bias = rows[2 * foot], rows[2 * foot + 1]
            return np.concatenate([s[6:], solved(M, J, -np.concatenate([f.ravel(), bias.ravel()]))])

        return solve_ivp(rates, (0.0, until), state, "DOP853", **how)

    def step(self, state: Any, foot: int) -> tuple[float, Any]:
        """Time to the strike of the other foot, and the state just after it."""
        other = 1 - foot

        def lead(s: Any) -> float:
            places = self.terms(*s)[8:]
            return float(places[other] - places[foot]) - AHEAD

        motion = self.rolled(state, foot, 1.2, dense_output=True, **NEARLY).sol
        time = brentq(lambda t: lead(motion(t)), 0.05, 0.6)
        while self.gap(motion(time), other) <= 0.0:
            time += 1e-3
        while self.gap(motion(time), other) > 0.0:
            time += 1e-3
        time = brentq(lambda t: self.gap(motion(t), other), time - 1e-3, time)
        end = self.rolled(state, foot, time, **EXACT).y[:, -1]
        off = -self.gap(end, other) / float((self.terms(*end)[2 + 2 * other] @ end[6:])[1])
        time, end = time + off, self.rolled(end, foot, off, **EXACT).y[:, -1]
        M, _, *rows = self.terms(*end)
        after = solved(M, rows[2 * other], np.concatenate([M @ end[6:], np.zeros(3)]))
        return time, np.concatenate([end[:6], after])

    def standing(self, state: Any, foot: int) -> Any:
        """The state with both feet on the slope and one rolling, from (roll, left hip) and the rates of all angles."""
        q, v = np.array(state[:6]), np.array(state[6:])
        for _ in range(30):  # height and right hip, by differences
            moves = 1e-7 * np.eye(6)[[1, 5]]
            gaps = np.array([self.gap([*q, *v], k) for k in (0, 1)])
            slopes = np.array([[(self.gap([*(q + d), *v], k) - gaps[k]) / 1e-7 for d in moves] for k in (0, 1)])
            q[[1, 5]] -= np.linalg.solve(slopes, gaps)
        J = self.terms(*q, *v)[2 + 2 * foot]
        v[:3] = np.linalg.solve(J[:, :3], -J[:, 3:] @ v[3:])
        return np.concatenate([q, v])


def mirrored(state: Any) -> Any:
    """Left and right exchanged, in the plane x–y, and back to where the walk began."""
    swap, signs = [0, 1, 2, 3, 5, 4], np.array([1.0, 1.0, -1.0, -1.0, 1.0, 1.0])
    return np.concatenate([signs * state[:6][swap], signs * state[6:][swap]])
