"""The step while a penalty contact acts: short enough for its impact, whatever dt.

An impact that lasts less than a few steps is not the force law's but the scheme's, which may give back more energy than
went in. As a contact closes the step is found in which its force changes the gap rate by a share of itself,

``h |A(h) − A(0)| ≤ share · |γ|,    A = J M⁻¹ Jᵀ p``  along the rows that hold,

for a spring ``(ω h)²`` with ω² = k/m. Steps stay that short until the contact opens, or until it rests.
"""

from mbd.kernel.codes import TOO_BRIEF
from mbd.kernel.events.guards import gap_tolerance, watch
from mbd.kernel.records import Guards, Switching
from mbd.kernel.stepping.restart import compose, consistent, fill_block

MAX_SHARE = 0.2
"""Share above which an impact has too few steps: half a period has π/√share, seven [-]."""
TARGET_SHARE = 0.02
"""Share of the steps taken instead, 22 in half a period [-]."""
MIN_STEP_RATIO = 1e-6
"""Step over dt below which a run ends instead [-]."""
WINDOW_STEPS = 44
"""Short steps, a period, after which it is asked whether the contact rests [-]."""
REST_RATE_RATIO = 1e-2
"""Share of the gap rate at closing below which, over a window, it does [-]."""
MAX_SHORT_STEPS = 20 * WINDOW_STEPS
"""Short steps after which those of a contact that goes on vibrating become longer all the same [-]."""


def find_pace(K: Switching) -> int:
    """The present full step from the penalty contacts that act; those that have just closed are asked for theirs."""
    step = K.dt
    for c in range(K.n_contacts):
        if K.kind[c] == 1:
            if K.closed[c] == 0:
                K.contact_step[c] = 0.0
            elif K.contact_step[c] == 0.0:
                K.contact_step[c] = pace_of(K, c)
                K.largest_rate[c] = 0.0
                K.contact_steps[c] = 0.0
                if K.contact_step[c] < MIN_STEP_RATIO * K.dt:
                    K.failure_step = K.contact_step[c]
                    K.failure_index = c
                    return TOO_BRIEF
                if K.contact_step[c] < K.dt and (
                    K.least_contact_step[c] == 0.0 or K.contact_step[c] < K.least_contact_step[c]
                ):
                    K.least_contact_step[c] = K.contact_step[c]
            if K.closed[c] == 1:
                step = min(step, K.contact_step[c])
    K.step = step
    return 0


def pace_of(K: Switching, c: int) -> float:
    """The step that resolves the impact of contact c from the accepted state on; dt where that does."""
    h = K.dt
    watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards1)
    here = K.guards1[c]
    touches = abs(here) <= 1e6 * gap_tolerance(K, c)
    first = 0.0 if touches else acceleration_of(K, c, 0.0)
    share = MAX_SHARE
    while h >= MIN_STEP_RATIO * K.dt:
        change = h * abs(acceleration_of(K, c, h) - first)
        rate = K.closing_rate[c]
        outside = touches and K.guards1[c] > 0.0 and change > 0.0
        if rate * h <= gap_tolerance(K, c) or (change <= share * rate and not outside):
            return float(h)
        share = TARGET_SHARE
        h *= 0.5
    return float(h)


def acceleration_of(K: Switching, c: int, h: float) -> float:
    """What the force of contact c does to its gap rate [m/s², rad/s²], as the accelerations of now lead on for h.

    The larger of the rates now and then is left in K.closing_rate, the guards then in K.guards1.
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
        difference += (1.0 - 2.0 * side) * K.guards1[K.at_gap_rate + c]
    watch(K, t, K.q, K.y, K.rate, K.lam, K.guards1)
    rate = abs(K.guards1[K.at_gap_rate + c])
    watch(K, t + h, K.q1, K.y1, K.rate, K.lam, K.guards1)
    K.closing_rate[c] = max(rate, abs(K.guards1[K.at_gap_rate + c]))
    return float(difference / scale)


def relax_pace(K: Guards) -> None:
    """After a short step: longer ones where the contact rests, or goes on vibrating for long."""
    for c in range(K.n_contacts):
        if K.kind[c] == 1 and K.closed[c] == 1 and 0.0 < K.contact_step[c] < K.dt:
            K.largest_rate[c] = max(K.largest_rate[c], abs(K.guards0[K.at_gap_rate + c]))
            K.contact_steps[c] += 1.0
            if K.contact_steps[c] % WINDOW_STEPS == 0.0:
                rests = K.largest_rate[c] < REST_RATE_RATIO * K.closing_rate[c]
                if rests or K.contact_steps[c] >= MAX_SHORT_STEPS:
                    K.contact_step[c] = min(2.0 * K.contact_step[c], K.dt)
                    K.restart_due = 2
                K.largest_rate[c] = 0.0
