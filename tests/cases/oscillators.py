"""The linear oscillator as a three-line `System`, and what one step of a scheme does to it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.integrators.base import Point, Terms
from mbd.integrators.family import Coefficients, NewmarkFamily
from mbd.state import Mode, State

__all__ = ["WBZ", "Oscillator", "Spectrum", "amplification", "spectrum"]


@dataclass(frozen=True)
class Oscillator:
    """``u¨ + 2 ξ ω u˙ + ω² u = 0``."""

    frequency: float
    damping: float = 0.0

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        c, k = 2.0 * self.damping * self.frequency, self.frequency**2
        r = point.rate + c * point.y + k * (point.q + point.x)
        return Terms(r, None if tangent is None else np.array([[1.0 + c * tangent[0] + k * tangent[1]]]))


class WBZ(NewmarkFamily):
    """The scheme of Wood, Bossak & Zienkiewicz (1980): α_f = 0. A member of the family that a user adds."""

    rho_inf: float

    def __init__(self, rho_inf: float) -> None:
        super().__init__("ggl", "consistent", 1e-11, rho_inf=rho_inf)

    @property
    def coefficients(self) -> Coefficients:
        alpha_m = (self.rho_inf - 1.0) / (self.rho_inf + 1.0)
        gamma = 0.5 - alpha_m
        return Coefficients(alpha_m, 0.0, 0.25 * (gamma + 0.5) ** 2, gamma)


def amplification(scheme: NewmarkFamily, turn: float, damping: float = 0.0) -> NDArray[np.float64]:
    """What one step of turn ω dt does to (u, u˙/ω, a/ω²): each column is a step from a unit state.

    The memory's `slope`, from which Newton's first guess is made, belongs to another state and is left out.
    """
    system, mode = Oscillator(turn, damping), Mode()
    sizes = np.array([1.0, turn, turn * turn])
    columns = []
    for u, v, a in np.diag(sizes):
        state = State(0.0, np.array([u]), np.array([v]))
        memory: Any = replace(scheme.start(system, state, mode, 1.0), aux=np.array([a]), slope=np.zeros(1))
        result = scheme.step(system, state, 1.0, mode, memory)
        assert result.report.converged
        columns.append([result.state.q[0], result.state.v[0], result.memory.aux[0]])
    return np.array(columns).T / sizes[:, None]


@dataclass(frozen=True)
class Spectrum:
    """Spectral radius, and of the principal pair of roots z: ξ = −ln|z|/arg z and T/T₀ − 1 = ω dt/arg z − 1."""

    radius: float
    damping: float
    elongation: float


def spectrum(scheme: NewmarkFamily, turn: float, damping: float = 0.0) -> Spectrum:
    """The roots of the amplification matrix; the principal pair is the one nearest to the exact exp(i ω dt)."""
    roots = np.linalg.eigvals(amplification(scheme, turn, damping))
    principal = min(roots, key=lambda z: abs(z - np.exp(1j * turn - damping * turn)))
    angle = abs(math.atan2(principal.imag, principal.real)) or math.nan
    return Spectrum(float(max(abs(roots))), -math.log(abs(principal)) / angle, turn / angle - 1.0)
