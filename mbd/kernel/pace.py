"""The step while a penalty contact acts: short enough for its blow, whatever dt.

A blow that lasts less than a few steps is not the force law's but the scheme's, which may give back more energy than
went in. As a contact closes the step is found in which its force changes the gap rate by a share of itself,

``h |A(h) − A(0)| ≤ share · |γ|,    A = J M⁻¹ Jᵀ p``  along the rows that hold,

for a spring ``(ω h)²`` with ω² = k/m. Steps stay that short until the contact opens, or until it rests.
"""

from __future__ import annotations

from mbd.kernel.codes import TOO_BRIEF
from mbd.kernel.guards import gap_tolerance, watch
from mbd.kernel.records import Kernel
from mbd.kernel.restart import compose, consistent, fill_block

__all__ = ["find_pace", "relax_pace"]

FEW = 0.2
"""Share above which a blow has too few steps: half a period has π/√share, seven [-]."""
ENOUGH = 0.02
"""Share of the steps taken instead, 22 in half a period [-]."""
BRIEFEST = 1e-6
"""Step over dt below which a run ends instead [-]."""
WINDOW = 44
"""Short steps, a period, after which it is asked whether the contact rests [-]."""
RESTS = 1e-2
"""Share of the gap rate at closing below which, over a window, it does [-]."""
PATIENCE = 880
"""Short steps after which those of a contact that goes on vibrating become longer all the same [-]."""
PACE, FIRST_RATE, LARGEST_RATE, TAKEN, LEAST_PACE = range(5)
"""Places of a contact in K.pace: step (0: not asked), |γ| as it closed and in the window, steps, least step ever."""


def find_pace(K: Kernel) -> int:
    """The present full step from the penalty contacts that act; those that have just closed are asked for theirs."""
    step = K.dt
    for c in range(K.n_contacts):
        if K.kind[c] == 1:
            o = 5 * c
            if K.closed[c] == 0:
                K.pace[o + PACE] = 0.0
            elif K.pace[o + PACE] == 0.0:
                K.pace[o + PACE] = pace_of(K, c)
                K.pace[o + LARGEST_RATE] = 0.0
                K.pace[o + TAKEN] = 0.0
                if K.pace[o + PACE] < BRIEFEST * K.dt:
                    K.failure_step = K.pace[o + PACE]
                    K.failure_index = c
                    return TOO_BRIEF
                if K.pace[o + PACE] < K.dt and (
                    K.pace[o + LEAST_PACE] == 0.0 or K.pace[o + PACE] < K.pace[o + LEAST_PACE]
                ):
                    K.pace[o + LEAST_PACE] = K.pace[o + PACE]
            if K.closed[c] == 1:
                step = min(step, K.pace[o + PACE])
    K.step = step
    return 0


def pace_of(K: Kernel, c: int) -> float:
    """The step that resolves the blow of contact c from the accepted state on; dt where that does."""
    h = K.dt
    watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards1)
    here = K.guards1[c]
    touches = abs(here) <= 1e6 * gap_tolerance(K, c)
    first = 0.0 if touches else acceleration_of(K, c, 0.0)
    share = FEW
    while h >= BRIEFEST * K.dt:
        change = h * abs(acceleration_of(K, c, h) - first)
        rate = K.pace[5 * c + FIRST_RATE]
        outside = touches and K.guards1[c] > 0.0 and change > 0.0
        if rate * h <= gap_tolerance(K, c) or (change <= share * rate and not outside):
            return float(h)
        share = ENOUGH
        h *= 0.5
    return float(h)


def acceleration_of(K: Kernel, c: int, h: float) -> float:
    """What the force of contact c does to its gap rate [m/s², rad/s²], as the accelerations of now lead on for h.

    The larger of the rates now and then is left in K.pace, the guards then in K.guards1.
    """
    t = K.time
    fill_block(K, t, K.q, K.y)
    for i in range(K.n_v):
        K.block[K.o_x + i] = h * (K.y[i] + 0.5 * h * K.rate[i])
    compose(K, K.q1)
    for i in range(K.n):
        K.y1[i] = K.y[i] + h * K.rate[i]
    scale = max(h, 1e-3 * K.dt)
    difference = 0.0
    for side in range(2):
        K.closed[c] = 1 - side
        status = consistent(K, t + h, K.q1, K.y1)
        K.closed[c] = 1
        if status != 0:
            return 0.0
        for i in range(K.n):
            K.rate1[i] = K.y1[i] + scale * K.jump[i]
        watch(K, t + h, K.q1, K.rate1, K.rate, K.lam, K.guards1)
        difference += (1.0 - 2.0 * side) * K.guards1[K.n_contacts + c]
    watch(K, t, K.q, K.y, K.rate, K.lam, K.guards1)
    rate = abs(K.guards1[K.n_contacts + c])
    watch(K, t + h, K.q1, K.y1, K.rate, K.lam, K.guards1)
    K.pace[5 * c + FIRST_RATE] = max(rate, abs(K.guards1[K.n_contacts + c]))
    return float(difference / scale)


def relax_pace(K: Kernel) -> None:
    """After a short step: longer ones where the contact rests, or goes on vibrating for long."""
    for c in range(K.n_contacts):
        o = 5 * c
        if K.kind[c] == 1 and K.closed[c] == 1 and 0.0 < K.pace[o + PACE] < K.dt:
            K.pace[o + LARGEST_RATE] = max(K.pace[o + LARGEST_RATE], abs(K.guards0[K.n_contacts + c]))
            K.pace[o + TAKEN] += 1.0
            if K.pace[o + TAKEN] % WINDOW == 0.0:
                rests = K.pace[o + LARGEST_RATE] < RESTS * K.pace[o + FIRST_RATE]
                if rests or K.pace[o + TAKEN] >= PATIENCE:
                    K.pace[o + PACE] = min(2.0 * K.pace[o + PACE], K.dt)
                    K.restart_due = 2
                K.pace[o + LARGEST_RATE] = 0.0
