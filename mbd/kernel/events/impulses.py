"""Impulses of the user's that act as contacts close: ``M (v⁺ − v⁻) + R λ̂ = w P`` beside the impact.

The impulse alone changes velocities by M⁻¹ w P. What rows and contacts make of that is an impact of the contacts that
are closed, in which none closes; with the order 'with' it is the impact of the closing ones itself.
"""

from mbd.kernel.algebra.saddle import solve_rows
from mbd.kernel.codes import LOG_OPENED, LOG_PUSHED
from mbd.kernel.contact.contact_log import NO_IMPULSE, log_event
from mbd.kernel.contact.impact import impact
from mbd.kernel.contact.impact_solve import loss_elsewhere
from mbd.kernel.records import Contacts, Reals, Switching
from mbd.kernel.stepping.restart import evaluate

BEFORE, BESIDE, AFTER = 0, 1, 2
"""Orders of impulses, as `mbd.constraints.impulse.ORDERS` has them."""


def is_pushed(K: Contacts, i: int, order: int) -> bool:
    """Whether impulse i acts now: its contact closes, or lies on its ground and takes part in an impact."""
    return bool(K.impulse_order[i] == order and K.closing[K.impulse_contact[i]] == 1)


def is_followed_by_impulse(K: Contacts, c: int) -> bool:
    """Whether an impulse follows each strike of contact c, so that strikes at one instant have no limit."""
    found = False
    for i in range(K.n_impulses):
        found = found or (K.impulse_contact[i] == c and K.impulse_order[i] == AFTER)
    return found


def push(K: Switching, order: int) -> int:
    """The impulses of an order on contacts that close now; 0, or why rows allow none."""
    count = 0
    for i in range(K.n_impulses):
        count += 1 if is_pushed(K, i, order) else 0
    if count == 0:
        return 0
    # the jump that they make alone, without rows
    evaluate(K, K.time, K.q, K.y)
    K.force[: K.n] = 0.0
    for i in range(K.n_impulses):
        if is_pushed(K, i, order):
            for j in range(K.n_v):
                K.pushes[i * K.n_v + j] = K.acc[K.acc_impulse + i * K.n_v + j]
                K.force[j] -= K.pushes[i * K.n_v + j]
    status = solve_rows(K, 0, False)
    if status != 0:
        return status
    for j in range(K.n):
        K.pushed_from[j] = K.y[j]
        K.y[j] += K.jump[j]
    # what closed contacts and other rows make of it; what their friction takes is that of those whose work they change
    taken = 0.0
    changed = 0.0
    if order != BESIDE:
        for c in range(K.n_contacts):
            K.pushed_closing[c] = K.closing[c]
            K.closing[c] = 0
        status = impact(K, False)
        taken = loss_elsewhere(K)
        for c in range(K.n_contacts):
            if status == 0 and K.kind[c] == 0 and K.closed[c] == 1 and K.active[c] == 0:
                K.closed[c] = 0
                K.armed[c] = 1
                log_event(K, LOG_OPENED, c, 0.0, NO_IMPULSE)
            K.closing[c] = K.pushed_closing[c]
            K.active[c] = 0
        if status != 0:
            return status
        for i in range(K.n_impulses):
            change = half_product(K, i, K.jump) if is_pushed(K, i, order) else 0.0
            taken += change
            changed += abs(change)
    # P w · (v⁻ + v⁺)/2
    for i in range(K.n_impulses):
        if is_pushed(K, i, order):
            work = half_product(K, i, K.pushed_from) + half_product(K, i, K.y)
            part = abs(half_product(K, i, K.jump)) / changed if changed > 0.0 else 0.0
            log_event(K, LOG_PUSHED, i, part * taken - work, NO_IMPULSE)
    return 0


def half_product(K: Contacts, i: int, v: Reals) -> float:
    """Half the product of impulse i and velocities: its work is the sum of two, of those before and after."""
    product = 0.0
    for j in range(K.n_v):
        product += 0.5 * K.pushes[i * K.n_v + j] * v[j]
    return product
