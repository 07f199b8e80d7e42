"""Whether a law that reads the force of a constraint changes that force by more than it is itself.

Such a law and the force are solved for together. With the law linearized at the multipliers, ``F′(λ) λ``, accelerations
follow from

    [M  Bᵀ + F′] (v̇)     (f)
    [B     0   ] (λ)  = −(γ).

Without the law the determinant has the sign of R = Bᵀ. Where it passes zero no force, or more than one, satisfies both;
beyond that a law that followed the force with the smallest lag would run away from the solution. So the ratio of both
determinants must be positive.
"""

from collections.abc import Iterable

import numpy as np

from mbd.equations.programs import law_forces
from mbd.simulation.run.stepper import Stepper
from mbd.tape.derivatives import live
from mbd.tape.node import Node

SINGULAR_RTOL = 0.01
"""Part of the determinant without the law, or the friction, below which it counts as zero [-]."""
NEARLY_SINGULAR_RTOL = 0.6
"""The same where a run has failed, so that it has come near to zero [-]."""


def circular_laws(stepper: Stepper, least: float = SINGULAR_RTOL) -> str:
    """A sentence that names the laws whose forces act back too strongly on what they read now; '' if none do."""
    equations = stepper.mechanism.equations
    if not equations.held_forces or not law_forces(equations):
        return ""
    v = stepper.kernel
    # the saddle matrix of the rows that act now, without the law and with it
    flags = v.closed[: v.n_contacts]
    rows = stepper.acting(flags)
    terms = stepper.terms(stepper.manager.penalties(flags), None, v.lam[: v.n_rows])
    if not rows or not all(np.isfinite(part).all() for part in (terms.M, terms.R, terms.B)):
        return ""
    free, whole = terms.saddle(rows, terms.B.T), terms.saddle(rows)
    # how the law changes its determinant
    (sign, size), (other, changed) = np.linalg.slogdet(free), np.linalg.slogdet(whole)
    ratio = sign * other * np.exp(min(changed - size, 50.0)) if sign != 0.0 and np.isfinite(size) else 1.0
    if ratio >= least:
        return ""
    names = [effect.name for effect in equations.effects if multipliers_in(effect.generalized())]
    s = "s" * (len(names) == 1)
    end = (
        ", so that no force or several satisfy both"
        if ratio < SINGULAR_RTOL
        else ", and by more as the loop gain comes to 1"
    )
    return (
        f"{', '.join(map(repr, names))} read{s} {', '.join(map(repr, equations.held_forces))} and change{s} it at once "
        f"by {1.0 - ratio:.3g} of what it is (the loop gain){end}; make the law weaker, or let it follow the force "
        "with a lag: a sample (mbd.SampledLaw) or a first-order state (rates of a law or loss)"
    )


def multipliers_in(forces: Iterable[Node]) -> set[int]:
    """Numbers of the rows whose multipliers generalized forces depend on."""
    return {int(node.data[1]) for node in live(list(forces)) if node.op == "input" and node.data[0] == "lam"}
