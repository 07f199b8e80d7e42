"""The force of dry friction while it slides: along one direction, or opposite to a velocity in a plane.

Along one direction ``λ_T = slip · limit``, slip = ±1. In space a contact has two, which slide together:

``λ_T = limit w/‖w‖``, ``w = γ + s (2 − ‖s‖²)²``

with the slips s of both, which say where λ_T points while γ does not, or should not:

s = (0, 0)         nothing slides, and no force acts
s = (1, 1)         w = γ: opposite to the velocity as it changes within a step, with its exact tangent
‖s‖ = 10⁻⁷         along s at the onset, where γ is zero, and along γ as soon as that is no round-off
‖s‖ = 10²⁰         along s, whatever γ: in the step in which sliding ends, and at instants
"""

from __future__ import annotations

from mbd.equations.equations import Equations
from mbd.joints.losses.isotropic import LEAST_SQUARE
from mbd.tape.functions import sqrt
from mbd.tape.node import Node, Scalar

__all__ = ["cosine", "sliding_force"]

NO_SLIP = 1e-100
"""‖s‖² that is none [-]."""


def sliding_force(equations: Equations, k: int, smooth: Scalar = 1.0) -> Node:
    """λ_T of friction k while it slides, in terms of its slip, its velocity and its limit.

    smooth : 0 in impacts, where the limit is that at the slip before them
    """
    tape, friction = equations.tape, equations.frictions[k]
    own, limit = tape.input("slip", k), friction.limit_at_speed(smooth)
    if friction.partner < 0:
        return own * limit
    other = tape.input("slip", friction.partner)
    square = own * own + other * other
    return limit * (square / (square + NO_SLIP)) * cosine(equations, k)


def cosine(equations: Equations, k: int) -> Node:
    """w/‖w‖ along friction k, one of two that slide together."""
    tape, friction = equations.tape, equations.frictions[k]
    own, other = tape.input("slip", k), tape.input("slip", friction.partner)
    square = own * own + other * other
    lean = (2.0 - square) * (2.0 - square)
    along = friction.rate + lean * own
    across = equations.frictions[friction.partner].rate + lean * other
    return along / tape.lift(sqrt(along * along + across * across + LEAST_SQUARE))
