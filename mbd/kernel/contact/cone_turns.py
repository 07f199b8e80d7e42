"""How fast friction in a plane or in space turns the direction in which it slides."""

from mbd.equal import DIRECT_PIVOT_RTOL, REST_SPEED
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.contact.cone_directions import MAX_GROUP_SIZE, fill_tangents, mass_of
from mbd.kernel.contact.cones import HOLD_DIRECTION, leads_group, product_of, speed_of
from mbd.kernel.records import Balance, ContactForces, Switching
from mbd.kernel.stepping.restart import evaluate, stepping_rows

STABILITY_SHARE = 2.0
"""Step times the estimated rate at which friction turns directions that explicit schemes take [-].

Beyond 2.785 that of order 4 lets what is across the direction grow from round-off until γ has turned away.
"""
MIN_STEPS_TO_REST = 2.0
"""Steps in which γ must not reach zero, nor turn by a radian, for one to be as any other [-]."""
MAX_STEPS_TO_REST = 100.0
"""Steps before it comes to rest from which on a motion that slows down is looked at [-]."""


def estimated_turn_rate(K: Switching) -> float:
    """Estimated rate [1/s] at which friction turns γ that it does not point along, Σ limit λ/(‖γ‖ + s).

    λ is what a force across the direction gains. Of a ball joint it is the largest eigenvalue, with the rows that hold;
    of a contact, whose slide may be unstable, the mean by the diagonal of M: true rates were found up to 1.24 times
    those that follow from it. The rate is large where γ is small, just after sliding has begun and before it ends: an
    explicit scheme must follow it.
    """
    rate = 0.0
    rows = -1
    for f in range(K.n_frictions):
        if leads_group(K, f) and K.slip[f] != 0.0 and K.hold[f] != HOLD_DIRECTION:
            gain = product_of(K, f, K.guards0, K.at_slip, K.at_slip_rate)
            speed = speed_of(K, f, K.guards0, K.at_slip)
            change = speed_of(K, f, K.guards0, K.at_slip_rate)
            still_fast = speed > REST_SPEED and speed > MAX_STEPS_TO_REST * change * max(K.dt, K.step)
            if gain < 0.0 and still_fast:  # it slows down
                continue
            if rows < 0:
                evaluate(K, K.time, K.q, K.y)
                rows = stepping_rows(K)
            speed += 4.0 * K.hold[f]
            if speed > 0.0:
                rate += K.guards0[K.at_limit + f] * ease_across(K, f, rows) / speed
    return rate


def ease_across(K: Balance, f: int, rows: int) -> float:
    """What a force across the direction of the group of f gains, beside so many rows in K.rows."""
    if K.group_size[f] == 2:
        mass = mass_of(K, f)
        return 1.0 / mass if mass > 0.0 else 0.0
    return largest_ease(K, f, rows) if factor_saddle(K, rows, False, DIRECT_PIVOT_RTOL) else 0.0


def largest_ease(K: Balance, f: int, rows: int) -> float:
    """The largest eigenvalue of B K⁻¹ Bᵀ across the direction of the group of f; K is factored, with so many rows."""
    fill_tangents(K, f, 0)
    first = ease_between(K, f, 0, 0, rows)
    second = ease_between(K, f, 1, 1, rows)
    mixed = ease_between(K, f, 0, 1, rows)
    half = 0.5 * (first - second)
    return 0.5 * (first + second) + sqrt(half * half + mixed * mixed)


def ease_between(K: Balance, f: int, i: int, j: int, rows: int) -> float:
    """t_i B K⁻¹ Bᵀ t_j of the tangents i and j of the group of f."""
    for k in range(K.n):
        K.rhs[k] = row_along(K, f, j, k)
    K.rhs[K.n : K.n + rows] = 0.0
    solve_kkt(K, K.n + rows, K.rhs)
    value = 0.0
    for k in range(K.n):
        value += row_along(K, f, i, k) * K.rhs[k]
    return value


def row_along(K: ContactForces, f: int, i: int, column: int) -> float:
    """Entry `column` of t_i B."""
    value = 0.0
    for g in range(K.group_size[f]):
        row = K.friction_row[f + g]
        value += K.cone_across[MAX_GROUP_SIZE * i + g] * K.acc[K.acc_B + row * K.n + column]
    return value
