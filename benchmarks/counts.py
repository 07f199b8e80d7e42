"""Scalar operations of the programs of each walker: the same on every machine."""

from __future__ import annotations

from collections.abc import Callable

import mbd
from benchmarks.compiling import MODES
from benchmarks.figures import Figure
from benchmarks.walkers import compass, kneed_model, seven
from mbd.equations import programs
from mbd.equations.cost import operations as total
from mbd.equations.derivation import derive
from mbd.kernel.contact.active_set import ActiveSetManager

WALKERS: dict[str, tuple[Callable[[], mbd.Model], tuple[str, ...]]] = {
    "compass": (lambda: compass()[0], ()),
    "7 links": (lambda: seven()[0], ()),
    "kneed walker": (kneed_model, MODES[0]),
}
"""Models, and the contacts that are closed."""


def measure() -> list[Figure]:
    """Tangent with residual, residual alone, tangent with factors and correction, in both formulations; of events."""
    figures = []
    for name, (make, closed) in WALKERS.items():
        equations = derive(make())
        manager = ActiveSetManager(equations)
        rows = manager.active_rows(manager.flags(closed))
        outputs = {"accelerations": programs.accelerations(equations), "guards": programs.guards(equations)}
        for form, stabilized in ("index 3", False), ("stabilized", True):
            outputs[f"tangent, {form}"] = programs.newton(equations, programs.ActiveSet(rows, (), stabilized))
            outputs[f"residual, {form}"] = programs.residual(equations, programs.ActiveSet(rows, (), stabilized))
            straight = programs.correction(equations, programs.ActiveSet(rows, (), stabilized))
            outputs[f"correction, {form}"] = straight.outputs if straight else []
            outputs[f"solution, {form}"] = straight.solution if straight else []
        figures += [Figure(f"{name}: {program}", total(nodes), "ops") for program, nodes in outputs.items() if nodes]
    return figures
