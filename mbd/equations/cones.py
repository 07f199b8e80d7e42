"""The force of dry friction while it slides: along one direction, or opposite to a velocity in a plane or in space.

Along one direction ``λ_T = slip · limit``, slip = ±1. In space a contact has two, and a ball joint three, which slide
together:

``λ_T = limit w/‖w‖``, ``w = γ + s (2 − ‖s‖²)²``

with the slips s of all, which say where λ_T points while γ does not, or should not:

s = 0              nothing slides, and no force acts
s = (1, 1), (1, 1, 0)  w = γ: opposite to the velocity as it changes within a step, with its exact tangent
‖s‖ = 10⁻⁷         along s at the onset, where γ is zero, and along γ as soon as that is no round-off
‖s‖ = 10²⁰         along s, whatever γ: in the step in which sliding ends, and at instants
"""

from mbd.equal import MIN_SQUARED_SPEED
from mbd.equations.equations import Equations
from mbd.tape.functions import sqrt
from mbd.tape.node import Node, Scalar

NO_SLIP = 1e-100
"""‖s‖² that is none [-]."""


def sliding_force(equations: Equations, k: int, smooth: Scalar = 1.0) -> Node:
    """λ_T of friction k while it slides, in terms of its slip, its velocity and its limit.

    smooth : 0 in impacts, where the limit is that at the slip before them
    """
    tape, friction = equations.tape, equations.frictions[k]
    own, limit = tape.input("slip", k), friction.limit_at_speed(smooth)
    if not friction.group:
        return own * limit
    square = slip_square(equations, k)
    return limit * (square / (square + NO_SLIP)) * cosine(equations, k)


def slip_square(equations: Equations, k: int) -> Node:
    """‖s‖² of those that slide together with friction k."""
    slips = [equations.tape.input("slip", each) for each in ordered(equations, k)]
    return sum((slip * slip for slip in slips[1:]), slips[0] * slips[0])


def cosine(equations: Equations, k: int) -> Node:
    """w/‖w‖ along friction k, one of several that slide together."""
    tape, square = equations.tape, slip_square(equations, k)
    lean = (2.0 - square) * (2.0 - square)
    w = [equations.frictions[each].rate + lean * tape.input("slip", each) for each in ordered(equations, k)]
    size = sum((each * each for each in w[1:]), w[0] * w[0])
    return w[0] / tape.lift(sqrt(size + MIN_SQUARED_SPEED))


def ordered(equations: Equations, k: int) -> list[int]:
    """Those that slide together with friction k, which comes first."""
    return [k, *(each for each in equations.frictions[k].group if each != k)]
