"""Whether dry friction in a pin can lock the motion where a run failed: tested on its equations of motion.

The friction μ r N of a pin follows the force in it, and adds to that force itself. With the friction of one pin that
slides, linearized in the multipliers, ``R(λ) λ``, accelerations follow from

    [M  R(u)] (v̇)     (f)
    [B  0   ] (λ)  = −(γ),

u the direction of the force in the pin. Without friction the determinant has the sign of R = Bᵀ. Where it passes zero
for some direction, friction brakes as much as, or more than, the motion that it follows from: there is no acceleration
or there are several (Painlevé 1895). For a pendulum with the moment of inertia J about its pin and its centre of mass
at a distance c that is ``μ r ≥ J / (m c)``, the lever arm of the load on the pin.
"""

import numpy as np

from mbd.arrays import Vector
from mbd.simulation.diagnostics.circular import SINGULAR_RTOL
from mbd.simulation.run.stepper import Stepper
from mbd.tape.derivatives import live
from mbd.tape.node import Node

DIRECTIONS = 180
"""Directions of the force in a pin that are tried [-]."""


def may_jam(stepper: Stepper) -> str:
    """The beginning of a sentence that names the pins whose friction can lock the motion at the accepted state."""
    if int(stepper.kernel.loaded) != 1:
        return ""
    with np.errstate(all="ignore"):
        names = [
            friction.name for f, friction in enumerate(stepper.manager.frictions)
            if friction.contact < 0 and stepper.kernel.slip[f] != 0.0 and _locks(stepper, f, _loads(friction.limit))
        ]  # fmt: skip
    if not names:
        return ""
    return (
        f"pin friction of {', '.join(map(repr, names))} may jam: μ r reaches the lever arm of the load on the pin, so "
        "that no force, or more than one, balances what friction adds to it; use a smaller mu or radius of "
        "PinFriction, or mbd.Coulomb; "
    )


def _loads(limit: Node) -> list[int]:
    """The rows whose multipliers the limit of a friction follows."""
    return sorted({int(node.data[1]) for node in live([limit]) if node.op == "input" and node.data[0] == "lam"})


def _locks(stepper: Stepper, f: int, loads: list[int]) -> bool:
    """Whether the determinant passes zero for some direction of the force in the rows that friction f follows."""
    if not loads:
        return False
    free = _determinant(stepper, None, loads, np.zeros(len(loads)))
    if not np.isfinite(free[1]) or free[0] == 0.0:
        return False
    slips = np.zeros(stepper.kernel.n_frictions)
    slips[f] = stepper.kernel.slip[f]
    for direction in _directions(len(loads)):
        sign, size = _determinant(stepper, slips, loads, direction)
        if np.isfinite(size) and sign * free[0] * np.exp(min(size - free[1], 50.0)) < SINGULAR_RTOL:
            return True
    return False


def _directions(count: int) -> Vector:
    """Unit vectors all around."""
    if count == 2:
        angles = np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False)
        return np.column_stack([np.cos(angles), np.sin(angles)])
    found = np.random.default_rng(1).normal(size=(2 * DIRECTIONS, count))
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def _determinant(stepper: Stepper, slips: Vector | None, loads: list[int], direction: Vector) -> tuple[float, float]:
    """Sign and log |det| of the matrix, with the friction of the slips given and the force in that direction."""
    v = stepper.kernel
    lam = np.zeros(v.n_rows)
    lam[loads] = direction
    matrix = stepper.terms((), slips, lam).saddle(v.rows[: int(v.n_active)].tolist())
    if not np.isfinite(matrix).all():
        return 0.0, np.inf
    sign, size = np.linalg.slogdet(matrix)
    return float(sign), float(size)
