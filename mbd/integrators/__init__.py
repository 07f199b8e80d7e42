"""Integration schemes behind one stepping interface."""

from mbd.integrators.base import Advance, CompiledIntegrator, Integrator, Point, StepReport, StepResult, System, Terms
from mbd.integrators.generalized_alpha import GeneralizedAlpha
from mbd.integrators.hht import HHT
from mbd.integrators.newmark import Newmark
from mbd.integrators.radau import RadauIIA
from mbd.integrators.runge_kutta import RungeKutta853
from mbd.integrators.runge_kutta_4 import RungeKutta4

KINDS: tuple[type[Integrator], ...] = (GeneralizedAlpha, Newmark, HHT, RadauIIA, RungeKutta853, RungeKutta4)
"""The schemes of the library."""

__all__ = [
    "KINDS",
    "Advance",
    "CompiledIntegrator",
    "GeneralizedAlpha",
    "HHT",
    "Integrator",
    "Newmark",
    "Point",
    "RadauIIA",
    "RungeKutta4",
    "RungeKutta853",
    "StepReport",
    "StepResult",
    "System",
    "Terms",
]
