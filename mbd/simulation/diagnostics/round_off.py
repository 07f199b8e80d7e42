"""What is left of the balance where a step stops, and what round-off of its inputs makes of it."""

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.simulation.run.stepper import Stepper


@dataclass(frozen=True)
class Remainder:
    """Largest component of the balance over the sum of its terms, as the tolerance of an integrator measures it.

    residual : at Newton's last iterate
    attainable : what neighbouring numbers make of it, each coordinate, rate and multiplier moved to the next number;
        no iteration can ask for less
    """

    residual: float
    attainable: float


def remainder(stepper: Stepper) -> Remainder:
    """The remainder at Newton's last iterate, which is in the block; NaN before the first step."""
    values, layout = stepper.kernel, stepper.mechanism.layout
    block = values.block
    if int(values.mode_id) < 0:
        return Remainder(np.nan, np.nan)
    here = _balance(stepper, block)
    blurred = np.zeros_like(here)
    for place in (*range(layout.q, layout.x), *range(layout.v, layout.anchor)):
        moved = block.copy()
        moved[place] = np.nextafter(block[place], np.inf)
        blurred += np.abs(_balance(stepper, moved) - here)
    scale = np.maximum(values.scale[: len(here)], np.finfo(float).tiny)
    least = float(np.finfo(float).eps)  # the terms themselves are rounded when they are summed
    return Remainder(float(np.max(np.abs(here) / scale)), max(least, float(np.max(blurred / scale))))


def _balance(stepper: Stepper, block: Vector) -> Vector:
    """M v̇ + f + Bᵀλ and ż − s at the inputs in a block."""
    code, n = stepper.code_of(int(stepper.kernel.mode_id)), int(stepper.kernel.n)
    out = np.zeros(n + 2 * len(code.active.rows) + 1)
    with np.errstate(all="ignore"):
        program = getattr(code.residual, "program", code.residual)  # a replay watches that of the step
        program(block, stepper.kernel.params, out)
    return out[:n]
