"""How fast friction of contacts in space turns the direction in which they slide."""

from __future__ import annotations

from mbd.kernel.contact.cone_directions import mass_of
from mbd.kernel.contact.cones import HELD, speed_of_both
from mbd.kernel.contact.contact_modes import STILL
from mbd.kernel.records import Guards
from mbd.kernel.stepping.restart import evaluate

__all__ = ["STABLE", "estimated_turn_rate"]

STABLE = 2.0
"""Step times the estimated rate at which friction turns directions that explicit schemes take [-].

Beyond 2.785 that of order 4 lets what is across the direction grow from round-off until γ has turned away; at the onset
true rates were found up to 1.24 times those of `estimated_turn_rate`, so that steps stay below 2.48.
"""


def estimated_turn_rate(K: Guards) -> float:
    """Estimated rate [1/s] at which friction turns γ that it does not point along, Σ limit/(m (‖γ‖ + s)).

    It is no bound: m is that of the diagonal of M alone, and pushes follow the direction. It is large where γ is small,
    just after sliding has begun: an explicit scheme must follow it.
    """
    rate = 0.0
    for f in range(K.n_frictions):
        if K.partner[f] > f and K.slip[f] != 0.0 and K.hold[f] != HELD:
            p = K.partner[f]
            gain = K.guards0[K.at_slip + f] * K.guards0[K.at_slip_rate + f]
            gain += K.guards0[K.at_slip + p] * K.guards0[K.at_slip_rate + p]
            speed = speed_of_both(K, f, K.guards0, K.at_slip)
            if gain < 0.0 and speed > STILL:  # it comes to rest: `approached_end` sees to that
                continue
            if rate == 0.0:
                evaluate(K, K.time, K.q, K.y)
            speed += 4.0 * K.hold[f]
            mass = mass_of(K, f)
            if speed > 0.0 and mass > 0.0:
                rate += K.guards0[K.at_limit + f] / (mass * speed)
    return rate
