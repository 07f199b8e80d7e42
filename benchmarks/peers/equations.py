"""Equations of motion of the smooth scenes, derived by hand and independently of `mbd`: ``ẏ = f(y)``.

Every function has the form ``f(y, out, P)``: state, its derivative to be filled in, parameters. It is plain Python that
numba can compile; nothing here is used by `mbd`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.peers.scenes import ANDREWS, CHAINS, ELASTIC, FOUR_BARS, STOP, Andrews, G
from mbd.arrays import Vector


def chain(y: Any, out: Any, P: Any) -> None:
    """Rods hanging from each other, in absolute angles: y = [θ, ω]. P = [length, mass, damping]. O(n).

    From the tip inwards, a rod with all that hangs on it answers the acceleration a of its upper end with the force
    A a + b, A symmetric 2 × 2 (Featherstone 1983, Int. J. Robotics Research 2:13, for absolute coordinates). With
    u = (sin θ, −cos θ), t = ∂u/∂θ, and A, b those of the rods below::

        p = m l/2 t + l A t,   J = I + m l²/4 + l² t·A t
        α = c − p·a/J,         c = (τ + m l/2 t·g + l² ω² t·A u − l t·b)/J
        A ← m 1 + A − p pᵀ/J,  b ← b − m (l/2 ω² u + g) − l ω² A u + p c
    """
    n = y.shape[0] // 2
    length, mass, damping = P[0], P[1], P[2]
    half = 0.5 * length
    px, py, c, inertia = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    A0, A1, A2, bx, by = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        i = n - 1 - k
        w, tx, ty = y[n + i], np.cos(y[i]), np.sin(y[i])
        ux, uy = ty, -tx
        torque = -damping * (w - (y[n + i - 1] if i > 0 else 0.0))
        if i < n - 1:
            torque += damping * (y[n + i + 1] - w)
        atx, aty = A0 * tx + A1 * ty, A1 * tx + A2 * ty
        aux, auy = A0 * ux + A1 * uy, A1 * ux + A2 * uy
        x, z = mass * half * tx + length * atx, mass * half * ty + length * aty
        J = mass * length * length / 3.0 + length * length * (tx * atx + ty * aty)
        spin = length * w * w
        c[i] = (torque - mass * half * G * ty + length * (spin * (tx * aux + ty * auy) - tx * bx - ty * by)) / J
        bx += -mass * half * w * w * ux - spin * aux + x * c[i]
        by += -mass * (half * w * w * uy - G) - spin * auy + z * c[i]
        A0 += mass - x * x / J
        A1 -= x * z / J
        A2 += mass - z * z / J
        px[i], py[i], inertia[i] = x, z, J
    ax, ay = 0.0, 0.0
    for i in range(n):
        w, tx, ty = y[n + i], np.cos(y[i]), np.sin(y[i])
        turn = c[i] - (px[i] * ax + py[i] * ay) / inertia[i]
        out[i], out[n + i] = w, turn
        ax += length * (turn * tx - w * w * ty)
        ay += length * (turn * ty + w * w * tx)


def elastic(y: Any, out: Any, P: Any) -> None:
    """The elastic pendulum, y = [θ, x, θ̇, ẋ], arm R = L + x. P = [L, m, I, k, c]."""
    arm = P[0] + y[1]
    out[0], out[1] = y[2], y[3]
    out[2] = -P[1] * arm * (G * np.sin(y[0]) + 2.0 * y[3] * y[2]) / (P[2] + P[1] * arm * arm)
    out[3] = arm * y[2] ** 2 + G * np.cos(y[0]) - (P[3] * y[1] + P[4] * y[3]) / P[1]


def stop(y: Any, out: Any, P: Any) -> None:
    """The rod and its stop, y = [θ, θ̇]: the tip lies δ = L (θ_s − θ) > 0 inside. P = [L, m, k, c, θ_s]."""
    depth = P[0] * (P[4] - y[0])
    force = P[2] * depth - P[3] * P[0] * y[1] if depth > 0.0 else 0.0
    out[0], out[1] = y[1], (P[0] * force - 0.5 * P[1] * G * P[0] * np.sin(y[0])) / (P[1] * P[0] ** 2 / 3.0)


def four_bar(y: Any, out: Any, P: Any) -> None:
    """N four-bars as the one degree of freedom that they have, y = [θ, θ̇], θ from up. P = [N, L, m]."""
    out[0] = y[1]
    out[1] = (0.5 * (P[0] + 1.0) + P[0]) * G / P[1] * np.sin(y[0]) / ((P[0] + 1.0) / 3.0 + P[0])


# Andrews' mechanism in absolute angles a = β, β+Θ, γ, Φ+δ, δ, Ω+ε, ε and complex numbers: the center of body i is
# z_i = const + c₁ e^{i a_j} + c₂ e^{i a_k}, so that M, the Coriolis terms and the loops are sums over few constants.
FIRST = np.array([0, 0, 2, 4, 4, 6, 6])
SECOND = np.array([0, 1, 2, 3, 4, 5, 6])
LOOPS = np.array([[2, 2], [4, 3], [6, 5]])
"""Angles on which the other end of each loop depends; all of them begin with angles 0 and 1."""


def andrews(y: Any, out: Any, P: Any) -> None:
    """Andrews' mechanism with the loops differentiated twice, y = [a, ȧ]; P = parameters of `_andrews`, complex.

    P[0:7], P[7:14]: c₁, c₂; P[14:21]: masses; P[21:28]: inertias; P[28:30]: common end of the loops; P[30:36]: the
    other ends; P[36]: point of the spring on body 3; P[37]: B − C; P[38:41]: stiffness, rest length, torque.
    """
    K, r = np.zeros((13, 13)), np.zeros(13)
    turn, rate = np.exp(1j * y[:7]), y[7:]
    for i in range(7):
        j, k = FIRST[i], SECOND[i]
        a, b, mass = P[i] * turn[j], P[7 + i] * turn[k], P[14 + i].real
        K[j, j] += mass * (a.real**2 + a.imag**2)
        K[k, k] += mass * (b.real**2 + b.imag**2) + P[21 + i].real
        K[j, k] += mass * (a.real * b.real + a.imag * b.imag)
        K[k, j] += mass * (a.real * b.real + a.imag * b.imag)
        pull = mass * (a * rate[j] ** 2 + b * rate[k] ** 2)  # −m × acceleration at α = 0; δz_i = i a δα
        r[j] += pull.imag * a.real - pull.real * a.imag
        r[k] += pull.imag * b.real - pull.real * b.imag
    arm = P[36] * turn[2]
    reach = P[37] + arm
    force = -P[38].real * (1.0 - P[39].real / abs(reach)) * reach
    r[2] += force.imag * arm.real - force.real * arm.imag
    r[0] += P[40].real
    for loop in range(3):
        row = 7 + 2 * loop
        for end in range(4):
            angle = end if end < 2 else LOOPS[loop, end - 2]
            lever = P[28 + end] * turn[angle] if end < 2 else -P[28 + 2 * loop + end] * turn[angle]
            K[row, angle] -= lever.imag
            K[row + 1, angle] += lever.real
            r[row] += lever.real * rate[angle] ** 2
            r[row + 1] += lever.imag * rate[angle] ** 2
    K[:7, 7:] = K[7:, :7].T
    out[:7] = rate
    out[7:] = np.linalg.solve(K, r)[:7]


def _andrews(p: Andrews) -> Vector:
    """Parameters for `andrews`."""
    first = [0.0, p.rr, 0.0, p.zt, 0.0, -1j * p.u, 0.0]
    second = [
        p.ra, -p.da, p.sb - 1j * p.sa, -1j * (p.e - p.ea), p.ta + 1j * p.tb, p.zf - p.fa, p.ub - 1j * p.ua,
    ]  # fmt: skip
    ends = [p.rr, -p.d, -1j * p.ss, 0.0, p.zt, -1j * p.e, -1j * p.u, p.zf]
    spring = [p.sd - 1j * p.sc, p.B - p.C, p.stiffness, p.rest, p.torque]
    return np.array([*first, *second, *p.masses, *p.inertias, *ends, *spring], dtype=complex)


TO_ABSOLUTE = np.eye(7)
TO_ABSOLUTE[1, 0] = TO_ABSOLUTE[3, 4] = TO_ABSOLUTE[5, 6] = 1.0
FROM_ABSOLUTE = np.linalg.inv(TO_ABSOLUTE)


@dataclass(frozen=True)
class Problem:
    """``ẏ = f(y)`` of a smooth scene, and the rows (compared, n) that map its positions to what is compared."""

    f: Callable[[Any, Any, Any], None]
    start: Vector
    P: Vector
    shown: Any

    def compared(self, Y: Any) -> Any:
        """(times, compared) of states (times, 2n)."""
        return Y[:, : self.shown.shape[1]] @ self.shown.T


def problem(name: str) -> Problem | None:
    """The equations of a scene; None where it has impacts."""
    if name in CHAINS:
        c = CHAINS[name]
        return Problem(chain, np.r_[c.angles, np.zeros(c.n)], np.array([c.length, c.mass, c.damping]), np.eye(c.n))
    if name in FOUR_BARS:
        p = FOUR_BARS[name]
        return Problem(four_bar, np.array([0.0, p.speed / p.length]), np.array([p.n, p.length, p.mass]), np.eye(1))
    if name == "S3b":
        start = np.r_[TO_ABSOLUTE @ ANDREWS.start, np.zeros(7)]
        return Problem(andrews, start, _andrews(ANDREWS), FROM_ABSOLUTE)
    if name == "S5":
        e = ELASTIC
        numbers = np.array([e.length, e.mass, e.inertia, e.stiffness, e.damping])
        return Problem(elastic, np.array([e.angle, 0.0, 0.0, 0.0]), numbers, np.eye(2))
    if name == "S5b":
        s = STOP
        return Problem(
            stop, np.array([s.angle, 0.0]), np.array([s.length, s.mass, s.stiffness, s.damping, s.at]), np.eye(1)
        )
    return None
