"""The same scenes in non-smooth steps: what holds whatever happens within a step, and errors of the size of a step."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.hardcases.case import Figure
from mbd.hardcases.impacts import deepest, impact_figures
from mbd.hardcases.references import size

TITLE = "non-smooth steps: "
HOW: tuple[tuple[bool, Any], ...] = ((False, "events"), (True, "events"), (False, "nonsmooth"))
"""Runs of a scene: whether contacts are named the other way round, and how they are treated."""


def stepped_figures(model: Any, run: Any) -> list[Figure]:
    """Momentum, energy and held rows at every impact, no penetration, no more work than a step each time.

    Restitution refers to the gap rates before the step, which are no stored row after an impact: that law is not here.
    """
    steps = float(np.ceil((run.time[-1] - run.time[0]) / run.settings["dt"]))
    figures = [each for each in impact_figures(model, run) if "complementarity" not in each.what]
    return [
        *(Figure(TITLE + each.what, each.value, each.limit) for each in figures),
        Figure(f"{TITLE}penetration [m]", deepest(run), 1e-10),
        Figure(f"{TITLE}steps more than t_end/dt [-]", run.stats["steps"] - steps, 0.02 * steps + 4.0),
    ]


def within_steps(what: str, steps: Any, errors: Sequence[Any], most: float) -> list[Figure]:
    """Errors of order one: at each step no more than `most` of it."""
    shares = [size(error) / float(dt) for error, dt in zip(errors, steps, strict=True)]
    return [Figure(f"{TITLE}error of {what}, over dt", size(shares), most)]
