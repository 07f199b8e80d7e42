"""Stiffness, loss and step of a penalty contact from what it shall do."""

import math

from mbd.bodies.values import among, number
from mbd.constraints.restitution import (
    KELVIN_VOIGT,
    chi_for,
    damping_ratio_for,
    impact_integral,
    law_of,
    over_angle,
    restitution_of_chi,
    restitution_of_ratio,
    stored_work,
    wanted,
)
from mbd.dataclass import dataclass
from mbd.errors import ModelError

STEPS_OF_APPROACH = 5.0
"""Steps until the deepest point that resolve an impact: its restitution and depth are right to about a hundredth."""


@dataclass(frozen=True)
class PenaltyParameters:
    """A penalty contact of a wanted impact.

    stiffness : k [N/mⁿ, or N m/radⁿ]
    damping : c of Kelvin–Voigt [N s/m, or N m s/rad]; 0 for the χ laws
    chi : χ of the other laws; 0 for Kelvin–Voigt
    restitution : what the law gives, which a published χ only comes near
    duration : of the impact [s]
    largest_dt : a fifth of the time until the deepest point, which is a tenth of `duration` without loss [s]
    """

    stiffness: float
    damping: float
    chi: float
    restitution: float
    duration: float
    largest_dt: float


def penalty_parameters(
    restitution: float,
    penetration: float,
    effective_mass: float,
    approach_speed: float,
    exponent: float = 1.0,
    law: str | None = None,
    release: str = "gap",
) -> PenaltyParameters:
    """Stiffness, loss, duration and largest safe dt of the impact that goes so deep and leaves with so much speed.

    Other forces than that of the contact are neglected, as they are in a short impact. χ laws, with `chi_for(e, law)`:

        k = (n+1) m δ̇₀² Φ/δ_maxⁿ⁺¹,   Φ = (χ − ln(1+χ))/χ²
        T = (m δ̇₀/k) ((n+1) m δ̇₀²/k)^(−n/(n+1)) ∫_{−e}¹ P^(−n/(n+1)) dw/(1+χ w),   P = ∫_w¹ s ds/(1+χ s)

    (from 0 to 1 until the deepest point).

    Kelvin–Voigt, with ζ of `damping_ratio_for(e, release)` and ``φ = arccos ζ/√(1−ζ²)`` (arcosh ζ/√(ζ²−1) above 1):

        k = m (δ̇₀ exp(−ζ φ)/δ_max)²,   c = 2 ζ √(k m),   T = 2 φ √(m/k) ('pull') or π √(m/k)/√(1−ζ²) ('gap')

    (φ √(m/k) until the deepest point).

    Parameters
    ----------
    restitution : e, 0.05 to 1
    penetration : δ_max, how deep the impact may go [m or rad]
    effective_mass : mass that the contact feels, ``1/(J M⁻¹ Jᵀ)`` with J = ∂g/∂q [kg, or kg m²]
    approach_speed : δ̇₀ of the fastest impact [m/s or rad/s]
    exponent : n
    law, release : as for `Penalty`

    >>> found = penalty_parameters(0.5, penetration=1e-3, effective_mass=2.0, approach_speed=1.0)
    >>> f"{found.stiffness:.4g} N/m, chi {found.chi:.4f}, dt up to {found.largest_dt:.2g} s"
    '1.059e+06 N/m, chi 1.4328, dt up to 0.00035 s'
    """
    title = "penalty_parameters"
    law = law_of(law, title)
    e = wanted(number(restitution, f"restitution of {title}"), title)
    given = {"penetration": penetration, "effective_mass": effective_mass, "approach_speed": approach_speed}
    values = {name: number(value, f"{name} of {title}") for name, value in given.items()}
    n = number(exponent, f"exponent of {title}")
    faults = [f"{title}: {name} {value:g} must be positive" for name, value in values.items() if value <= 0.0]
    if n < 1.0:
        faults.append(f"{title}: exponent {n:g} is below 1, endlessly stiff at touch; give n ≥ 1")
    if not among(release, ("gap", "pull")):
        faults.append(f"{title}: release is 'gap' or 'pull', got {release!r}")
    if law == KELVIN_VOIGT and n != 1.0:
        faults.append(f"{title}: law='{KELVIN_VOIGT}' reaches a restitution for exponent 1 only, got exponent {n:g}")
    if faults:
        raise ModelError(faults)
    depth, mass, speed = values.values()
    try:
        if law == KELVIN_VOIGT:
            return _kelvin_voigt(depth, mass, speed, damping_ratio_for(e, release), release)
        return _hysteretic(depth, mass, speed, chi_for(e, law), n)
    except (OverflowError, ZeroDivisionError):
        text = ", ".join(f"{name} {value:g}" for name, value in {**values, "exponent": n}.items())
        raise ModelError(f"{title}: no stiffness that a number can hold belongs to {text}; use m, kg and m/s") from None


def largest_dt(stiffness: float, exponent: float, damping: float, chi: float, mass: float, speed: float) -> float:
    """A fifth of the time until the deepest point of an impact of an effective mass that arrives at a speed [s].

    Of Kelvin–Voigt with n = 1 and of χ laws as `penalty_parameters` gives it; with other n damping is left out.
    """
    if exponent == 1.0 and chi == 0.0:
        angle = over_angle(0.5 * damping / math.sqrt(stiffness * mass))
        return angle * math.sqrt(mass / stiffness) / STEPS_OF_APPROACH
    return _pace(stiffness, mass, speed, exponent) * impact_integral(chi, exponent, 0.0) / STEPS_OF_APPROACH


def _pace(stiffness: float, mass: float, speed: float, n: float) -> float:
    """``(m δ̇₀/k) ((n+1) m δ̇₀²/k)^(−n/(n+1))``, the scale of times of a χ law [s]."""
    energy = (n + 1.0) * mass * speed**2
    return float(mass * speed / stiffness * (energy / stiffness) ** (-n / (n + 1.0)))


def _kelvin_voigt(depth: float, mass: float, speed: float, ratio: float, release: str) -> PenaltyParameters:
    """Of the damped oscillator."""
    angle = over_angle(ratio)
    stiffness = mass * (speed * math.exp(-ratio * angle) / depth) ** 2
    pace = math.sqrt(stiffness / mass)
    duration = 2.0 * angle / pace if release == "pull" else math.pi / (pace * math.sqrt(1.0 - ratio * ratio))
    c = 2.0 * ratio * math.sqrt(stiffness * mass)
    found = restitution_of_ratio(ratio, release)
    return PenaltyParameters(stiffness, c, 0.0, found, duration, angle / pace / STEPS_OF_APPROACH)


def _hysteretic(depth: float, mass: float, speed: float, chi: float, n: float) -> PenaltyParameters:
    """Of a χ law."""
    energy = (n + 1.0) * mass * speed**2
    stiffness = energy * stored_work(chi) / depth ** (n + 1.0)
    pace = _pace(stiffness, mass, speed, n)
    found = restitution_of_chi(chi)
    duration, approach = (pace * impact_integral(chi, n, end) for end in (-found, 0.0))
    return PenaltyParameters(stiffness, 0.0, chi, found, duration, approach / STEPS_OF_APPROACH)
