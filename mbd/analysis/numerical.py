"""Numerical criteria of an integrator, measured on it: stability, damping, period, order of consistency.

All follow from the eigenvalues of the amplification matrix of a linear oscillator (see `mbd.analysis.spectrum`) and
from runs with halved steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mbd.analysis.amplification import LinearOscillator, oscillated
from mbd.analysis.spectrum import Spectrum, argument_faults, spectrum
from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL, ROUND_OFF_RTOL
from mbd.errors import CapabilityError, ModelError
from mbd.integrators.averaged import Coefficients
from mbd.integrators.base import Integrator
from mbd.integrators.family import NewmarkFamily
from mbd.later import later

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Criteria", "Spectrum", "criteria", "plot", "spectrum"]

GRID = tuple(float(turn) for turn in np.geomspace(1e-2, 1e3, 101))
"""ω dt at which criteria are measured unless others are asked for [rad]."""
STIFF = (1e3, 1e4, 1e5)
"""ω dt from which the limit at infinity is extrapolated; farther out, round-off grows like ε (ω dt)² [rad]."""
MEASURED_PHASE = 2.0
"""ω t at which the error is measured for the order [rad]."""


@dataclass(frozen=True)
class Criteria:
    """The numerical criteria of one integrator.

    Attributes
    ----------
    integrator : the scheme; damping_ratio : ξ of the oscillator they are measured on [-]
    order : observed order of consistency, as a number; promised : what the scheme says
    rho_inf : ρ as ω dt → ∞, to 1e-5; infinite for explicit schemes; where steps fail, ρ at the largest that do not
    stability_limit : ω dt up to which ρ ≤ 1 and steps succeed; infinite if all up to 1e4 do, 0 if none above 0.01
    damping_order, damping_coefficient : the algorithmic damping ratio is ``coefficient · (ω dt)^order`` as ω dt → 0; 0
        and a coefficient of 0 without damping
    elongation_order, elongation_coefficient : the same for the relative period elongation
    spectra : what was measured, one at each ω dt
    exact : closed forms where they are known
    """

    integrator: Integrator
    damping_ratio: float
    order: float
    promised: int
    rho_inf: float
    stability_limit: float
    damping_order: int
    damping_coefficient: float
    elongation_order: int
    elongation_coefficient: float
    spectra: tuple[Spectrum, ...] = field(repr=False)
    exact: _ClosedForm | None = field(default=None, repr=False)

    @property
    def turns(self) -> Vector:
        """ω dt [rad]."""
        return np.array([each.turn for each in self.spectra])

    @property
    def radius(self) -> Vector:
        """Spectral radius at each of `turns`."""
        return np.array([each.radius for each in self.spectra])

    @property
    def damping(self) -> Vector:
        """Algorithmic damping ratio at each of `turns`; NaN beyond π."""
        return np.array([each.damping for each in self.spectra])

    @property
    def elongation(self) -> Vector:
        """Relative period elongation at each of `turns`; NaN beyond π."""
        return np.array([each.elongation for each in self.spectra])

    def plot(self, *others: Criteria, path: str | Path | None = None) -> Figure:
        """Spectral radius, algorithmic damping and period elongation over ω dt, with those of others; the figure."""
        return plot(self, *others, path=path)

    def __str__(self) -> str:
        from mbd.analysis.tables import criteria_table

        return criteria_table(self)


def criteria(integrator: Integrator, damping: float = 0.0, turns: Sequence[float] = GRID) -> Criteria:
    """Order, stability, numerical damping and period error of an integrator, measured by running its `step`.

    Works for any scheme of the interface, with memory of any kind: multistep schemes and classes of your own.

    Parameters
    ----------
    integrator : the scheme
    damping : ξ of the linear oscillator, 0 ≤ ξ < 1 [-]
    turns : ω dt at which spectra are measured, growing [rad]

    Raises
    ------
    ModelError
        for arguments that are not such numbers.
    CapabilityError
        if a step fails or is not linear on a linear oscillator.

    Examples
    --------
    >>> import mbd
    >>> print(mbd.criteria(mbd.HHT(alpha=0.1), turns=[0.1, 1.0]))
    HHT(alpha=0.1)                                  measured           closed form
      order of consistency                              2.00                     2
      spectral radius at infinity                    0.81818               0.81818
      stable up to ω dt                               always                always
      damping ratio, ω dt → 0                0.01013 (ω dt)³       0.01013 (ω dt)³
      period elongation, ω dt → 0             0.1046 (ω dt)²        0.1046 (ω dt)²
            ω dt  spectral radius  damping ratio  elongation
             0.1      0.999998993      1.008e-05   1.045e-03
               1      0.993847329      6.755e-03   9.450e-02
    """
    faults = argument_faults(integrator, turns, damping)
    if faults:
        raise ModelError(faults)
    spectra = _spectra(integrator, turns, damping)
    fading, coefficient = _leading(integrator, damping, "damping")
    stretching, elongation = _leading(integrator, damping, "elongation")
    promised = integrator.order(LinearOscillator(1.0))
    return Criteria(
        integrator, damping, min(_order(integrator, xi) for xi in (damping, 0.1)), promised,
        _at_infinity(integrator, damping), _stability_limit(integrator, damping), fading, coefficient, stretching,
        elongation, spectra, _closed_form(integrator) if damping == 0.0 else None,
    )  # fmt: skip


def plot(*found: Criteria, path: str | Path | None = None) -> Figure:
    """Spectral radius, algorithmic damping and period elongation of several integrators over ω dt; the figure."""
    figure: Figure = later("Criteria.plot")(found, path)
    return figure


def _spectra(integrator: Integrator, turns: Sequence[float], damping: float) -> tuple[Spectrum, ...]:
    """Spectra, NaN where a step fails; if every one does, its error."""
    found, failure = list[Spectrum](), None
    for turn in turns:
        try:
            found.append(spectrum(integrator, float(turn), damping))
        except CapabilityError as error:
            failure = error
            found.append(Spectrum(float(turn), np.nan, complex(np.nan), np.nan, np.nan, ()))
    if failure is not None and all(np.isnan(each.radius) for each in found):
        raise failure
    return tuple(found)


def _order(integrator: Integrator, damping: float) -> float:
    """log₂ of how the error at ω t = 2 falls from one halving of dt to the next, the finest above round-off."""
    exact = LinearOscillator(MEASURED_PHASE, damping).exact(1.0) @ [1.0, 0.5]
    errors = list[float]()
    for steps in (4, 8, 16, 32, 64, 128, 256):
        state, _ = oscillated(integrator, MEASURED_PHASE / steps, damping, np.array([1.0, 0.5]), steps)[-1]
        error = float(np.hypot(state.q[0] - exact[0], state.v[0] * steps / MEASURED_PHASE - exact[1]))
        if error < ROUND_OFF_RTOL * steps and len(errors) >= 2:
            break
        errors.append(error)
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    return float(2.0 * rates[-1] - rates[-2]) if len(rates) > 1 else float(rates[-1])


def _leading(integrator: Integrator, damping: float, what: str) -> tuple[int, float]:
    """(power, coefficient) of the leading term in ω dt of the damping ratio or of the elongation."""
    turns = 0.4 / 2.0 ** np.arange(6)
    values = np.array([getattr(spectrum(integrator, float(turn), damping), what) for turn in turns])
    usable = np.abs(values) * turns > 10.0 * ROUND_OFF_RTOL
    count = int(np.argmin(usable)) if not usable.all() else len(usable)
    if count < 3 or not np.isfinite(values[:count]).all():
        return 0, 0.0
    turns, values = turns[:count], values[:count]
    power = round(float(np.log2(values[-2] / values[-1]))) if values[-2] / values[-1] > 0.0 else 0
    a, b, c = values[-3:] / turns[-3:] ** power
    once = 1.0 if damping > 0.0 else 2.0  # powers go up in steps of two without damping
    first, second = (2.0**once * b - a) / (2.0**once - 1.0), (2.0**once * c - b) / (2.0**once - 1.0)
    return power, float((2.0 ** (2.0 * once) * second - first) / (2.0 ** (2.0 * once) - 1.0))


def _at_infinity(integrator: Integrator, damping: float) -> float:
    """The limit of ρ by Aitken's extrapolation, for multiple roots come near it slowly; infinity where ρ grows."""
    some, more, *stiff = (each.radius for each in _spectra(integrator, (100.0, 200.0, *STIFF), damping))
    if more > 1.5 * some and more > 2.0:
        return float("inf")
    reached = [radius for radius in stiff if not np.isnan(radius)]
    if len(reached) < len(STIFF):
        return reached[-1] if reached else more
    a, b, c = reached
    if abs(c - b) > 0.5 * abs(b - a):  # round-off: it has converged before
        return b
    return c if abs(c - b) < 1e-6 else c - (c - b) ** 2 / (c - 2.0 * b + a)


def _stability_limit(integrator: Integrator, damping: float) -> float:
    """The first ω dt at which ρ exceeds 1 or a step fails, by bisection between the points of a fine grid."""

    def grows(turn: float) -> bool:
        try:
            return spectrum(integrator, turn, damping).radius > 1.0 + EQUAL_RTOL
        except CapabilityError:
            return True

    below = 0.0
    for turn in np.geomspace(1e-2, 1e4, 121):
        if grows(float(turn)):
            break
        below = float(turn)
    else:
        return float("inf")
    if below == 0.0:
        return 0.0
    above = float(turn)
    while above - below > 1e-12 * above:
        middle = 0.5 * (below + above)
        if middle in (below, above):
            break
        below, above = (below, middle) if grows(middle) else (middle, above)
    return below


@dataclass(frozen=True)
class _ClosedForm:
    """What `Criteria` measures, from the coefficients; a stability limit of None is not known in closed form."""

    order: int
    rho_inf: float
    stability_limit: float | None
    damping_order: int
    damping_coefficient: float
    elongation_order: int
    elongation_coefficient: float


def _closed_form(integrator: Integrator) -> _ClosedForm | None:
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
    return _ClosedForm(2 if second else 1, k.rho_inf, _limit(k, second), *damped, 2, float(stretch))


def _limit(k: Coefficients, second: bool) -> float | None:
    """ω dt up to which every root stays within the unit circle."""
    if k.alpha_m == k.alpha_f == 0.0:
        if k.gamma < 0.5:
            return 0.0
        return float("inf") if 2.0 * k.beta >= k.gamma - 1e-14 else float(1.0 / np.sqrt(0.5 * k.gamma - k.beta))
    bound = 0.25 + 0.5 * (k.alpha_f - k.alpha_m)
    return float("inf") if second and k.alpha_m <= k.alpha_f <= 0.5 and k.beta >= bound - 1e-14 else None
