"""The integrators that hard cases are judged with, by name."""

from __future__ import annotations

from collections.abc import Callable

from mbd.errors import UnknownNameError, nearest
from mbd.integrators import HHT, GeneralizedAlpha, Integrator, Newmark

__all__ = ["DAMPED", "EVERY", "SCHEMES", "scheme"]

SCHEMES: dict[str, Callable[[], Integrator]] = {
    "HHT": lambda: HHT(alpha=0.05),
    "HHT-index3": lambda: HHT(alpha=0.05, formulation="index3"),
    "generalized-alpha": lambda: GeneralizedAlpha(rho_inf=0.8),
    "generalized-alpha-index3": lambda: GeneralizedAlpha(rho_inf=0.8, formulation="index3"),
    "Newmark": Newmark,
}
"""Newmark with rows in position only is refused: nothing damps its multipliers."""

EVERY = tuple(SCHEMES)
DAMPED = EVERY[:-1]
"""Those whose multipliers forget their round-off."""


def scheme(name: str) -> Integrator:
    """The integrator of that name; capitals do not matter."""
    known = {each.lower(): make for each, make in SCHEMES.items()}
    if name.lower() not in known:
        raise UnknownNameError(nearest(name, SCHEMES, "scheme", "There are"))
    return known[name.lower()]()
