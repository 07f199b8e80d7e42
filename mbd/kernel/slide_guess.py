"""Which of several feet slide, and which way: where their cones do not hold all of them at rest.

With pushes as they are the friction of all that may choose is the least of a convex function over discs,

``min ½ λ_Tᵀ G λ_T − γ_0ᵀ λ_T``,  ``‖λ_T‖ ≤ limit``,

γ = γ_0 − G λ_T their velocities (accelerations) under it, G = B K⁻¹ R with what is held (principle of Gauss, friction
being a potential of γ). Limits follow their pushes, by turns. What is found are branches and directions only: the
caller solves their equations again, and judges them.
"""

from __future__ import annotations

from mbd.kernel.branches import find_limits, load, whole
from mbd.kernel.cone_contacts import keep_branches
from mbd.kernel.cones import aim, follows
from mbd.kernel.discs import minimize_within_discs
from mbd.kernel.linear import solve
from mbd.kernel.loads import evaluate_loaded
from mbd.kernel.pivoting import gather_drags, hold
from mbd.kernel.records import Balance, ContactForces
from mbd.kernel.restart import active_rows
from mbd.kernel.saddle import solve_at

__all__ = ["guess_slides"]

MOST_ROUNDS = 30
"""Limits that are followed [-]."""
SETTLED = 1e-12
"""Change of limits, over the largest of them, after which they are known [-]."""
NO_LIMIT = 1e-9
"""Limit over the largest of all below which a friction slides along γ_0 [-]."""


def guess_slides(K: Balance, level: int) -> int:
    """1 if frictions that may choose have been given branches and directions; 0, and all as it was, if they have not.

    There may be too few of them, or one of them that an event has found out.
    """
    drags = gather_drags(K, 0)
    if drags < 3:
        return 0
    for u in range(drags):
        if K.loose[K.lcp_who[u]] == 2:
            return 0
    keep_branches(K, True)
    for u in range(drags):
        K.sticks[K.lcp_who[u]] = 0
        K.slip[K.lcp_who[u]] = 0.0
    evaluate_loaded(K, whole(K, level))
    find_limits(K, level)
    held = hold(K, level, 0, drags)
    if held < 0:
        keep_branches(K, False)
        return 0
    fill_responses(K, held, drags)
    for j in range(drags):
        K.drag[j] = 0.0
    for _ in range(MOST_ROUNDS):
        largest = find_largest(K, drags)
        if largest == 0.0 or share_drags(K, drags, largest) != 0:
            break
        change = follow_pushes(K, level, drags)
        if change < 0.0 or change <= SETTLED * largest:
            break
    take_ways(K, drags)
    return 1


def fill_responses(K: Balance, held: int, drags: int) -> None:
    """G and γ_0 of the frictions that may choose."""
    n = K.n
    for i in range(drags):
        row = K.lcp_rows[i]
        K.free_speed[i] = K.bias[row]
        for j in range(n):
            K.free_speed[i] += K.acc[K.acc_B + row * n + j] * K.jump[j]
    for j in range(drags):
        for i in range(n):
            K.rhs[i] = K.acc[K.acc_R + i * K.n_rows + K.lcp_rows[j]]
        K.rhs[n : n + held] = 0.0
        solve(K.kkt, n + held, K.pivots, K.rhs)
        for i in range(drags):
            value = 0.0
            for k in range(n):
                value += K.acc[K.acc_B + K.lcp_rows[i] * n + k] * K.rhs[k]
            K.response[i * K.n_frictions + j] = value


def find_largest(K: ContactForces, drags: int) -> float:
    """The largest limit of frictions that may choose."""
    largest = 0.0
    for u in range(drags):
        largest = max(largest, K.limit[K.lcp_who[u]])
    return largest


def share_drags(K: ContactForces, drags: int, largest: float) -> int:
    """λ_T of least value at the present limits into K.drag; 1 if there is none."""
    width = K.n_disc_unknowns
    size = 0.0
    speed = 0.0
    for i in range(drags):
        size = max(size, K.response[i * K.n_frictions + i])
        speed = max(speed, abs(K.free_speed[i]))
    if size == 0.0:
        return 1
    scale = max(size * largest, speed)
    discs = 0
    for i in range(drags):
        K.disc_y[i] = 0.0
        K.disc_cost[i] = -K.free_speed[i] / scale
        for j in range(drags):
            coupled = 0.5 * (K.response[i * K.n_frictions + j] + K.response[j * K.n_frictions + i])
            K.disc_quad[i * width + j] = coupled * largest / scale
        f = K.lcp_who[i]
        if follows(K, f):
            continue
        K.disc_at[3 * discs] = K.disc_at[3 * discs + 1] = 0.0
        K.disc_at[3 * discs + 2] = max(K.limit[f] / largest, NO_LIMIT)
        for j in range(drags):
            K.disc_map[3 * discs * width + j] = 1.0 if j == i else 0.0
            K.disc_map[(3 * discs + 1) * width + j] = 1.0 if K.lcp_who[j] == K.partner[f] else 0.0
            K.disc_map[(3 * discs + 2) * width + j] = 0.0
        discs += 1
    status = minimize_within_discs(K, drags, discs)
    for i in range(drags):
        K.drag[i] = largest * K.disc_y[i]
    return int(status)


def follow_pushes(K: Balance, level: int, drags: int) -> float:
    """Limits at the pushes that the drags in K.drag bring about; how much they change, negative if none are found."""
    for u in range(drags):
        K.lcp_limit[u] = K.limit[K.lcp_who[u]]
    load(K, level)
    for u in range(drags):
        for i in range(K.n):
            K.force[i] += K.acc[K.acc_R + i * K.n_rows + K.lcp_rows[u]] * K.drag[u]
    if solve_at(K, active_rows(K, K.active), level) != 0:
        return -1.0
    evaluate_loaded(K, whole(K, level))
    find_limits(K, level)
    change = 0.0
    for u in range(drags):
        change = max(change, abs(K.limit[K.lcp_who[u]] - K.lcp_limit[u]))
    return change


def take_ways(K: ContactForces, drags: int) -> None:
    """Who sticks and who slides, and which way: a multiplier at its limit that the limit pushes back slides."""
    disc = 0
    for u in range(drags):
        f = K.lcp_who[u]
        if follows(K, f):
            continue
        slides = K.disc_force[disc] > K.disc_left[disc]
        disc += 1
        p = K.partner[f]
        K.sticks[f] = 0 if slides else 1
        if p < 0:
            K.slip[f] = (1.0 if K.drag[u] > 0.0 else -1.0) if slides else 0.0
            continue
        K.sticks[p] = K.sticks[f]
        K.slip[f] = K.slip[p] = 0.0
        if slides:
            for j in range(drags):
                if K.lcp_who[j] == p:
                    aim(K, f, K.drag[u], K.drag[j])
