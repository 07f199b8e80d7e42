"""Consistent accelerations, impact, and the complementarity behind both.

Both solve ``M w + force + R λ = 0`` with ``B w + bias = 0`` on closed rows and
``0 ≤ B w + bias ⟂ −λ ≥ 0`` on contacts that may choose: w the acceleration and λ the
multiplier, or w the jump of velocity and λ the impulse. M may be singular; only the whole
matrix is ever solved with.
"""

from __future__ import annotations

from typing import Any

from mbd.kernel.fields import (
    ACCELERATIONS,
    BLOCKED,
    COMPOSE,
    CONFLICT,
    DEPENDENT,
    ENERGY_GAIN,
    IMPACTS,
    N_DROPPED,
    NO_IMPACT,
    NOT_FINITE,
    NOW,
    SCALES,
)  # fmt: skip
from mbd.kernel.hooks import call
from mbd.kernel.linear import eliminate
from mbd.kernel.redundancy import find_dependent, spread

__all__ = [
    "active_rows", "capture", "complementarity", "compose", "consistent", "evaluate", "fill_block", "impact",
    "raise_scales", "refresh_scales", "solve_rows", "stepping_rows",
]  # fmt: skip


def fill_block(K: Any, t: float, q: Any, y: Any) -> None:
    """The block at a state, with the accepted rates and multipliers; penalties act where closed."""
    block = K.block
    block[0] = t
    block[1] = 0.0
    block[2] = 0.0
    for i in range(K.n_q):
        block[K.o_q + i] = q[i]
    for i in range(K.n_v):
        block[K.o_x + i] = 0.0
    for i in range(K.n):
        block[K.o_v + i] = y[i]
        block[K.o_a + i] = K.rate[i]
    for k in range(K.n_rows):
        block[K.o_lam + k] = K.lam[k]
    for k in range(K.n_anchors):
        block[K.o_anchor + k] = K.anchors[k]
    for c in range(K.n_contacts):
        block[K.o_switch + c] = 1.0 if (K.kind[c] == 1 and K.closed[c] == 1) else 0.0


def compose(K: Any, q1: Any) -> None:
    """q₁ = q ⊕ x with the accepted q and the increment x in the block."""
    if K.vector == 1:
        for i in range(K.n_q):
            q1[i] = K.q[i] + K.block[K.o_x + i]
    else:
        for i in range(K.n_q):
            K.block[K.o_q + i] = K.q[i]
        call(K, COMPOSE, q1)


def refresh_scales(K: Any) -> None:
    """Magnitudes of r, h and ḣ, term by term before cancellation, at the state now in the block."""
    call(K, SCALES, K.scale)
    for i in range(K.n):
        K.scale[i] = max(K.scale[i], 1e-300)
    for unit in range(2):  # forces [N] and torques [N m] are judged as blocks of their own
        big = 0.0
        for i in range(K.n):
            if K.unit[i] == unit:
                big = max(big, K.scale[i])
        for i in range(K.n):
            if K.unit[i] == unit:
                K.scale[i] = big
    for k in range(K.n_rows):  # a row that vanishes term by term still inherits the round-off of its coordinates
        size = 1e-3
        speed = 1e-3
        for i in range(K.n_v):
            if K.unit[i] == K.row_unit[k]:
                speed = max(speed, abs(K.block[K.o_v + i]))
                if i < K.n_q:
                    size = max(size, abs(K.block[K.o_q + i]))
        K.scale[K.n + k] = max(K.scale[K.n + k], size)
        K.scale[K.n + K.n_rows + k] = max(K.scale[K.n + K.n_rows + k], speed)


def raise_scales(K: Any, rows: bool) -> None:
    """Magnitudes at the state now in the block where they exceed those known; where a force passes zero it has none.

    Those of rows, by which gaps are judged too, only on demand: a state far ahead says nothing of the round-off here.
    """
    known = K.n + 2 * K.n_rows
    for i in range(known):
        K.work[i] = K.scale[i]
    refresh_scales(K)
    for i in range(known):
        if i < K.n or rows:
            K.scale[i] = max(K.scale[i], K.work[i])
        else:
            K.scale[i] = K.work[i]


def stepping_rows(K: Any) -> int:
    """The active rows of the closed contacts that do not depend on others, into K.rows; how many."""
    m = 0
    for row in range(K.n_rows):
        contact = K.row_contact[row]
        if K.dropped[row] == 0 and (contact < 0 or K.closed[contact] == 1):
            K.rows[m] = row
            m += 1
    return m


def active_rows(K: Any, flags: Any) -> int:
    """Numbers of the active rows into K.rows, ascending; how many."""
    m = 0
    for row in range(K.n_rows):
        contact = K.row_contact[row]
        if contact < 0 or flags[contact] == 1:
            K.rows[m] = row
            m += 1
    return m


def evaluate(K: Any, t: float, q: Any, y: Any) -> None:
    """M, f, R, B, h, ḣ, bias, captured, kinetic energy at a state, into K.acc."""
    fill_block(K, t, q, y)
    call(K, ACCELERATIONS, K.acc)


def solve_rows(K: Any, m: int, dropping: bool) -> int:
    """w and λ for the m rows in K.rows; w in K.jump, λ of all rows in K.impulse.

    Rows may depend on each other where `dropping` allows it: then K.dropped tells which, and λ has the least norm.
    """
    n = K.n
    size = n + m
    o_R = n * n + n
    o_B = o_R + n * K.n_rows
    A = K.kkt
    for i in range(n):
        for j in range(n):
            A[i * size + j] = K.acc[i * n + j]
        for k in range(m):
            A[i * size + n + k] = K.acc[o_R + i * K.n_rows + K.rows[k]]
        K.rhs[i] = -K.force[i]
    for k in range(m):
        row = K.rows[k]
        for j in range(n):
            A[(n + k) * size + j] = K.acc[o_B + row * n + j]
        for j in range(m):
            A[(n + k) * size + n + j] = 0.0
        K.rhs[n + k] = -K.bias[row]
    finite = 0.0
    for k in range(size * size):
        finite += abs(A[k])
    for k in range(size):
        finite += abs(K.rhs[k])
    if not finite < 1e300:
        return NOT_FINITE
    rank = eliminate(A, size, K.rhs, K.columns, K.work, 1e-12)
    if rank < 0:
        K.state[BLOCKED] = K.columns[-1 - rank]
        return CONFLICT
    for i in range(n):
        K.jump[i] = K.rhs[i]
    for k in range(K.n_rows):
        K.impulse[k] = 0.0
    for k in range(m):
        K.impulse[K.rows[k]] = K.rhs[n + k]
    for k in range(rank, size):
        if K.columns[k] < n or not dropping:
            K.state[BLOCKED] = K.columns[k]
            return DEPENDENT
    if rank < size:
        find_dependent(K, m)
        spread(K, K.impulse)
    return 0


def consistent(K: Any, t: float, q: Any, y: Any) -> int:
    """Rates and multipliers of the closed rows at a state, in K.jump and K.impulse."""
    evaluate(K, t, q, y)
    load_accelerations(K)
    status = solve_rows(K, stepping_rows(K), False)
    if K.state[N_DROPPED] > 0:
        spread(K, K.impulse)
    return status


def load_accelerations(K: Any) -> None:
    """Right-hand sides of the acceleration level."""
    n = K.n
    o_bias = n * n + n + 2 * n * K.n_rows + 2 * K.n_rows
    for i in range(n):
        K.force[i] = K.acc[n * n + i]
    for k in range(K.n_rows):
        K.bias[k] = K.acc[o_bias + k]


def violation(K: Any, c: int, largest: float) -> float:
    """How badly contact c breaks complementarity, relative; ≤ 0 if it does not."""
    n = K.n
    row = K.normal[c]
    if K.active[c] == 1:
        return float(K.impulse[row] - 1e-11 * largest)  # λ > 0 would pull
    o_B = n * n + n + n * K.n_rows
    value = K.bias[row]
    size = abs(K.bias[row])
    for j in range(n):
        term = K.acc[o_B + row * n + j] * K.jump[j]
        value += term
        size = max(size, abs(term))
    return float(-value - 1e-11 * size)


def complementarity(K: Any) -> int:
    """Choose K.active among the contacts with K.free = 1 (others keep theirs) and solve.

    Principal pivoting: the worst first, then by least index, which cannot cycle where the
    Delassus matrix is a P-matrix; else every subset is tried while there are few.
    """
    n_free = 0
    for c in range(K.n_contacts):
        n_free += K.free[c]
    for attempt in range(4 * n_free * n_free + 8):
        status = solve_rows(K, active_rows(K, K.active), True)
        if status != 0:
            return status
        flip = first_violation(K, attempt <= n_free + 1)
        if flip < 0:
            return status
        K.active[flip] = 1 - K.active[flip]
    if n_free > 12:
        return NO_IMPACT
    for subset in range(1 << n_free):
        place = 0
        for c in range(K.n_contacts):
            if K.free[c] == 1:
                K.active[c] = (subset >> place) & 1
                place += 1
        status = solve_rows(K, active_rows(K, K.active), True)
        if status == 0 and first_violation(K, True) < 0:
            return status
    return NO_IMPACT


def first_violation(K: Any, worst: bool) -> int:
    """The contact that must change, or −1."""
    largest = 0.0
    for k in range(K.n_rows):
        largest = max(largest, abs(K.impulse[k]))
    found = -1
    most = 0.0
    for c in range(K.n_contacts):
        if K.free[c] == 1:
            size = violation(K, c, largest)
            if size > most:
                found = c
                if not worst:
                    return found
                most = size
    return found


def capture(K: Any, c: int) -> None:
    """Hold the anchors of a contact that closes; K.acc is evaluated at the instant."""
    o_captured = K.n * K.n + K.n + 2 * K.n * K.n_rows + 3 * K.n_rows
    for k in range(K.anchor_start[c], K.anchor_start[c + 1]):
        K.anchors[k] = K.acc[o_captured + k]


def gains_energy(K: Any) -> bool:
    """Whether impulses do work on the mechanism, −½ Σ Λ (γ⁻ + γ⁺) < 0: restitution that sticks can (Kane's paradox)."""
    n = K.n
    o_B = n * n + n + n * K.n_rows
    o_rate = o_B + n * K.n_rows + K.n_rows
    loss = 0.0
    size = 0.0
    for k in range(K.n_rows):
        if K.impulse[k] != 0.0:
            half = 0.0
            for j in range(n):
                half += 0.5 * K.acc[o_B + k * n + j] * K.jump[j]
            loss += K.impulse[k] * (K.acc[o_rate + k] + half)
            size += abs(K.impulse[k]) * (abs(K.acc[o_rate + k]) + abs(half))
    return bool(loss < -1e-9 * size)


def impact(K: Any, slow: bool) -> int:
    """Newton's impact law over all closed and closing rows together; the velocities in K.y jump.

    ``M (v⁺ − v⁻) + Bᵀ λ̂ = 0``, bilateral and held rows ``B v⁺ + h_t = 0``,
    ``0 ≤ γ⁺ + e γ⁻ ⟂ −λ̂ ≥ 0`` for contacts that may open. A slow impact (below the rest speed) sticks.
    Afterwards K.active says which contacts are closed; a contact that rebounds is not.
    """
    n = K.n
    evaluate(K, K.clock[NOW], K.q, K.y)
    o_rate = n * n + n + 2 * n * K.n_rows + K.n_rows
    for i in range(n):
        K.force[i] = 0.0
    for k in range(K.n_rows):
        c = K.row_contact[k]
        K.bias[k] = K.acc[o_rate + k]
        if c >= 0 and K.closing[c] == 1 and not slow and K.row_normal[k] == 1:
            K.bias[k] *= 1.0 + K.restitution[c]
    for c in range(K.n_contacts):
        both = K.closed[c] == 1 or K.closing[c] == 1
        K.active[c] = 1 if (both and K.kind[c] == 0) else 0
        K.free[c] = 1 if (K.active[c] == 1 and K.opens[c] == 0 and not slow) else 0
    status = complementarity(K)
    if status != 0:
        return status
    if not slow and gains_energy(K):
        return ENERGY_GAIN
    for i in range(n):
        K.y[i] += K.jump[i]
    K.counts[IMPACTS] += 1
    for c in range(K.n_contacts):
        if K.closing[c] == 1 and K.restitution[c] > 0.0 and not slow:
            K.active[c] = 0
    return 0
