"""The four numbers of a scheme of the Newmark family, and what follows from them."""

from __future__ import annotations

import numpy as np

from mbd.dataclass import dataclass

__all__ = ["Coefficients"]


@dataclass(frozen=True)
class Coefficients:
    """α_m, α_f, β, γ."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @property
    def second_order(self) -> bool:
        """γ = ½ + α_f − α_m."""
        return abs(self.gamma - 0.5 - self.alpha_f + self.alpha_m) < 1e-12

    @property
    def undamped(self) -> bool:
        """Spectral radius 1 at infinite frequency (ρ∞ = 1): nothing damps the round-off of the multipliers."""
        return abs(self.rho_inf - 1.0) < 1e-9

    @property
    def rho_inf(self) -> float:
        """Spectral radius of the amplification matrix as ω dt → ∞."""
        beta, gamma = self.beta, self.gamma
        half, product = 0.5 * (0.5 + gamma - 2.0 * beta) / beta, (0.5 - gamma + beta) / beta
        split = half * half - product  # of the roots of z² + 2 half z + product; complex or double where it is not > 0
        pair = float(np.sqrt(product)) if split <= 1e-14 * half * half else abs(half) + float(np.sqrt(split))
        return max(abs(self.alpha_f / (1.0 - self.alpha_f)), pair)
