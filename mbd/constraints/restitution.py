"""What a force law of contact makes of the approach speed: its loss for a restitution, and back.

An impact without other forces, of the effective mass m at the approach speed δ̇₀; w = δ̇/δ̇₀ falls from 1 to −e.

χ laws, ``F = k δⁿ (1 + χ w)``: from ``m δ̈ = −F`` follows ``k δⁿ⁺¹/(n+1) = m δ̇₀² ∫_w¹ s/(1 + χ s) ds``. The impact ends
where the integral from −e to 1 is zero, ``(1 + e) χ = ln((1 + χ)/(1 − e χ))``, whatever k, m and n are.

Kelvin–Voigt, ``F = k δ + c δ̇`` with the damping ratio ``ζ = c/(2 √(k m))``, ends at δ = 0 ('gap') or F = 0 ('pull').
"""

import math
from collections.abc import Callable
from functools import cache

from mbd.arrays import Vector
from mbd.bodies.values import among
from mbd.errors import ModelError, nearest

MIN_RESTITUTION = 0.05
"""Below it a force law is nearly a dashpot: stiffer equations than those of an impact, for the same motion."""
KELVIN_VOIGT = "kelvin-voigt"
CLASSICS: dict[str, Callable[[float], float]] = {
    "hunt-crossley": lambda e: 1.5 * (1.0 - e),
    "lankarani-nikravesh": lambda e: 0.75 * (1.0 - e * e),
    "flores": lambda e: 1.6 * (1.0 - e) / e,
    "gonthier": lambda e: (1.0 - e * e) / e,
}
"""χ(e) as published: Hunt & Crossley 1975, J. Appl. Mech. 42:440; Lankarani & Nikravesh 1990, J. Mech. Des. 112:369;
Flores, Machado, Silva & Martins 2011, Multibody Syst. Dyn. 25:357; Gonthier, McPhee, Lange & Piedbœuf 2004,
Multibody Syst. Dyn. 11:209 (its first approximation). They are approximations: the restitution they give differs."""
SERIES_LIMIT = 0.1
"""Below this χ logarithms cancel, and series of `SERIES_TERMS` terms are used."""
SERIES_TERMS = 18
"""Terms of these series: at `SERIES_LIMIT` what is left out is below round-off."""


def law_of(name: str | None, owner: str) -> str:
    """The name of a law, checked; 'exact' where none is given."""
    if not among(name, (None, KELVIN_VOIGT, "exact", *CLASSICS)):
        raise ModelError(
            f"{owner}: {nearest(str(name), (KELVIN_VOIGT, 'exact', *CLASSICS), 'penalty law', 'The laws are')}"
        )
    return name or "exact"


def wanted(restitution: float, owner: str) -> float:
    """A restitution that a force law can give."""
    if not 0.0 <= restitution <= 1.0:
        raise ModelError(f"{owner}: restitution {restitution:g} is not between 0 and 1")
    if restitution < MIN_RESTITUTION:
        raise ModelError(
            f"{owner}: restitution {restitution:g} is below {MIN_RESTITUTION:g}, nearly a dashpot; use "
            f"mbd.Unilateral(…, restitution={restitution:g}), or {MIN_RESTITUTION:g} and more"
        )
    return restitution


# χ laws -------------------------------------------------------------------------------------------------------------
def chi_for(restitution: float, law: str = "exact") -> float:
    """χ of a law for a wanted restitution e.

    'exact' solves ``(1 + e) χ = ln((1 + χ)/(1 − e χ))`` for ``u = −ln(1 − e χ)``, which is well scaled up to χ = 1/e.

    >>> round(chi_for(0.5), 6), round(chi_for(0.5, "hunt-crossley"), 6)
    (1.432751, 0.75)
    """
    e = restitution
    if law != "exact":
        return CLASSICS[law](e)
    if e == 1.0:
        return 0.0
    from scipy.optimize import brentq

    low = -math.log1p(-0.5 * e * CLASSICS["hunt-crossley"](e))  # which gives a larger restitution
    u = brentq(lambda u: _work(-math.expm1(-u) / e, -e, u), low, (1.0 + e) / e, xtol=1e-300, rtol=1e-14)
    return -math.expm1(-float(u)) / e


def restitution_of_chi(chi: float) -> float:
    """The restitution that χ gives, the inverse of ``chi_for(e, 'exact')``.

    >>> round(restitution_of_chi(0.75), 3), round(restitution_of_chi(chi_for(0.5)), 12)
    (0.663, 0.5)
    """
    if chi == 0.0:
        return 1.0
    from scipy.optimize import brentq

    top = 1.0 if chi < 1.0 else (1.0 - 1e-15) / chi
    return float(brentq(lambda e: _work(chi, -e), 1e-12 * top, top, xtol=1e-300, rtol=1e-14))


def _work(chi: float, w: float, u: float | None = None) -> float:
    """``∫_w¹ s/(1 + χ s) ds``, the work of the force until then over m δ̇₀²; u is −ln(1 + χ w) where it is known."""
    if chi < SERIES_LIMIT:
        return sum((-chi) ** k * (1.0 - w ** (k + 2)) / (k + 2) for k in range(SERIES_TERMS))
    known = -math.log1p(chi * w) if u is None else u
    return ((1.0 - w) * chi - math.log1p(chi) - known) / chi**2


def stored_work(chi: float) -> float:
    """``∫₀¹ s/(1 + χ s) ds``: the work until the deepest point over m δ̇₀², ½ without loss."""
    return _work(chi, 0.0)


@cache
def _quadrature() -> tuple[Vector, Vector]:
    """Nodes and weights of Gauss and Legendre."""
    import numpy as np

    places, weights = np.polynomial.legendre.leggauss(200)
    return places, weights


def impact_integral(chi: float, exponent: float, end: float) -> float:
    """``∫_end¹ dw/(P(w)^{n/(n+1)} (1 + χ w))`` with ``P(w) = ∫_w¹ s/(1 + χ s) ds``: a duration in its own scale.

    From touch until the deepest point (end = 0), or until it parts (end = −e, where P is zero again);
    ``s = τᵖ/(τᵖ + (1−τ)ᵖ)``, p = n + 1, takes the integrable poles away.
    """
    import numpy as np

    p, power = exponent + 1.0, exponent / (exponent + 1.0)
    places, weights = _quadrature()
    tau = 0.5 * (places + 1.0)
    front, back = tau**p, (1.0 - tau) ** p
    w = end + (1.0 - end) * front / (front + back)
    slope = (1.0 - end) * p * (tau * (1.0 - tau)) ** exponent / (front + back) ** 2
    work = np.array([max(_work(chi, float(each)), 1e-16) for each in w])  # round-off at the ends, where slope is 0
    return float(np.sum(0.5 * weights * slope / (work**power * (1.0 + chi * w))))


# Kelvin–Voigt -------------------------------------------------------------------------------------------------------
def over_angle(ratio: float) -> float:
    """``arccos ζ/√(1 − ζ²)``, 1 at ζ = 1, ``arcosh ζ/√(ζ² − 1)`` above: √(k/m) times half the time until F = 0."""
    z = 1.0 - ratio
    if abs(z) < 1e-4:
        return 1.0 + z / 3.0 + 2.0 * z * z / 15.0
    root = math.sqrt(abs(1.0 - ratio * ratio))
    return math.acos(ratio) / root if ratio < 1.0 else math.acosh(ratio) / root


def restitution_of_ratio(ratio: float, release: str) -> float:
    """e of the damping ratio ζ: ``exp(−2 ζ arccos ζ/√(1−ζ²))`` for 'pull' (with arcosh for ζ > 1), and
    ``exp(−π ζ/√(1−ζ²))`` for 'gap', 0 from ζ = 1.

    Schwager & Pöschel 2007, Granular Matter 9:465 (both).
    """
    if release == "pull":
        return math.exp(-2.0 * ratio * over_angle(ratio))
    return math.exp(-math.pi * ratio / math.sqrt(1.0 - ratio * ratio)) if ratio < 1.0 else 0.0


def damping_ratio_for(restitution: float, release: str) -> float:
    """ζ for a wanted e: ``−ln e/√(π² + ln² e)`` for 'gap', a root of `restitution_of_ratio` for 'pull'.

    >>> round(damping_ratio_for(0.5, "gap"), 4), round(damping_ratio_for(0.5, "pull"), 4)
    (0.2155, 0.2553)
    """
    loss = -math.log(restitution)
    if release == "gap" or loss == 0.0:
        return loss / math.hypot(math.pi, loss)
    from scipy.optimize import brentq

    return float(brentq(lambda ratio: 2.0 * ratio * over_angle(ratio) - loss, 0.0, 1.0 / restitution, rtol=1e-14))
