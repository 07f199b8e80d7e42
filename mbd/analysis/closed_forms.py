"""Numerical criteria of the Newmark family in closed form, for the undamped oscillator."""

from __future__ import annotations

import numpy as np

from mbd.dataclass import dataclass
from mbd.integrators.base import Integrator
from mbd.integrators.family import Coefficients, NewmarkFamily

__all__ = ["ClosedForm", "closed_form"]


@dataclass(frozen=True)
class ClosedForm:
    """What `Criteria` measures, from the coefficients; a stability limit of None is not known in closed form."""

    order: int
    rho_inf: float
    stability_limit: float | None
    damping_order: int
    damping_coefficient: float
    elongation_order: int
    elongation_coefficient: float


def closed_form(integrator: Integrator) -> ClosedForm | None:
    """The criteria of a member of the Newmark family; None for other schemes.

    With ``d = γ − ½ + α_m − α_f``, from the series of the characteristic polynomial: for d = 0 the damping ratio is
    ``½ (α_f − α_m)(β + α_f α_m − α_f) (ω dt)³`` and the elongation ``(12β − 1 + 12 α_f (α_m − α_f))/24 (ω dt)²``. Else
    the damping ratio is ``d/2 · ω dt``, and without α the elongation is ``(β/2 + d²/8 − d/4 − 1/24) (ω dt)²``.

    A scheme without α is stable for every step if 2β ≥ γ ≥ ½, and else up to ``ω dt = 1/√(γ/2 − β)`` (Hughes 1987,
    ch. 9); one with d = 0 for every step if α_m ≤ α_f ≤ ½ and ``β ≥ ¼ + ½ (α_f − α_m)`` (Chung & Hulbert 1993).
    """
    if not isinstance(integrator, NewmarkFamily):
        return None
    k = integrator.coefficients
    d = k.gamma - 0.5 + k.alpha_m - k.alpha_f
    second = abs(d) < 1e-12
    cubic = 0.5 * (k.alpha_f - k.alpha_m) * (k.beta + k.alpha_f * k.alpha_m - k.alpha_f) if second else 0.0
    stretch = (12.0 * k.beta - 1.0 + 12.0 * k.alpha_f * (k.alpha_m - k.alpha_f)) / 24.0
    if not second:
        stretch = 0.5 * k.beta + d * d / 8.0 - 0.25 * d - 1.0 / 24.0 if k.alpha_m == k.alpha_f == 0.0 else np.nan
    damped = (1, 0.5 * d) if not second else (3, cubic) if cubic else (0, 0.0)
    return ClosedForm(2 if second else 1, k.rho_inf, _limit(k, second), *damped, 2, float(stretch))


def _limit(k: Coefficients, second: bool) -> float | None:
    """ω dt up to which every root stays within the unit circle."""
    if k.alpha_m == k.alpha_f == 0.0:
        if k.gamma < 0.5:
            return 0.0
        return float("inf") if 2.0 * k.beta >= k.gamma - 1e-14 else float(1.0 / np.sqrt(0.5 * k.gamma - k.beta))
    bound = 0.25 + 0.5 * (k.alpha_f - k.alpha_m)
    return float("inf") if second and k.alpha_m <= k.alpha_f <= 0.5 and k.beta >= bound - 1e-14 else None
