"""The integrators that hard cases are judged with, by name, and what judges ask of them."""

from collections.abc import Callable
from functools import cache

from mbd.analysis.spectrum import spectrum
from mbd.errors import UnknownNameError, nearest
from mbd.integrators import HHT, GeneralizedAlpha, Integrator, Newmark, RadauIIA, RungeKutta853
from mbd.integrators.extension import extension_of

SCHEMES: dict[str, Callable[[], Integrator]] = {
    "HHT": lambda: HHT(alpha=0.05),
    "HHT-index3": lambda: HHT(alpha=0.05, formulation="index3"),
    "generalized-alpha": lambda: GeneralizedAlpha(rho_inf=0.8),
    "generalized-alpha-index3": lambda: GeneralizedAlpha(rho_inf=0.8, formulation="index3"),
    "Newmark": Newmark,
    "RadauIIA": RadauIIA,
    "RungeKutta853": RungeKutta853,
}
"""Newmark with rows in position only is refused: nothing damps its multipliers."""

EVERY = tuple(SCHEMES)
STIFF_OMEGA_DT = 1e4
"""ω dt that stands for infinity [rad]."""
DAMPED = tuple(name for name in EVERY if name != "Newmark")
"""Those whose multipliers forget their round-off."""


def scheme(name: str) -> Integrator:
    """The integrator of that name; capitals do not matter."""
    known = {each.lower(): make for each, make in SCHEMES.items()}
    if name.lower() not in known:
        raise UnknownNameError(nearest(name, SCHEMES, "scheme", "There are"))
    return known[name.lower()]()


def holds_positions_only(integrator: Integrator) -> bool:
    """Whether rows are held in position alone, as with formulation='index3'."""
    return getattr(integrator, "formulation", "ggl") == "index3"


def has_own_forces(integrator: Integrator) -> bool:
    """Whether multipliers at the end of a step follow from the state there, and remember nothing of earlier ones."""
    return extension_of(integrator.between).uses_accelerations


@cache
def is_undamped(integrator: Integrator) -> bool:
    """Whether nothing damps an oscillation, however fast: spectral radius 1 as ω dt → ∞."""
    return abs(spectrum(integrator, STIFF_OMEGA_DT).radius - 1.0) < 1e-4


@cache
def is_explicit(integrator: Integrator) -> bool:
    """Whether the stiffest spring bounds the step."""
    return not spectrum(integrator, STIFF_OMEGA_DT).radius < 1.0 + 1e-4
