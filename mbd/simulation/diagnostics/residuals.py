"""Residuals of a step by the names of what they belong to."""

from collections.abc import Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.simulation.run.stepper import Stepper


def residuals_of(stepper: Stepper, block: Vector) -> dict[str, float]:
    """The balance by coordinate, and the rows that are closed with their rates, at the inputs in a block."""
    mode = int(stepper.kernel.mode_id)
    if mode < 0:
        return {}
    code, n = stepper.code_of(mode), stepper.kernel.n
    out = np.zeros(n + 2 * len(code.active.rows) + 1)
    with np.errstate(all="ignore"):
        program = getattr(code.residual, "program", code.residual)  # a replay watches that of the step
        program(block, stepper.kernel.params, out)
    return dict(zip(residual_names(stepper, code.active.rows), out.tolist(), strict=False))


def residual_names(stepper: Stepper, rows: Sequence[int]) -> list[str]:
    """Names of the balance and of rows in the order in which a mode's code gives them."""
    equations = stepper.mechanism.equations
    names = [name.removesuffix(".rate") for name in equations.velocity_names]
    names += [state.name for state in equations.states]
    titles = [equations.rows[row].title for row in rows]
    return names + titles + ([f"{title} (rate)" for title in titles] if stepper.stabilized else [])
