"""One impact: the jump of velocities and its impulses, of all contacts and frictions that take part in it."""

from mbd.kernel.codes import ACCELERATIONS
from mbd.kernel.contact.complementarity import complementarity
from mbd.kernel.contact.cones import hold_directions
from mbd.kernel.hooks import call
from mbd.kernel.records import Balance, Complementarity, ContactForces, Contacts, Frictions, Guards, Mechanism
from mbd.kernel.stepping.loads import evaluate_loaded, limit_of
from mbd.kernel.stepping.restart import capture, evaluate, row_speed
from mbd.kernel.tangent_rules import note_edges


def prepare(K: Balance) -> None:
    """K.acc at the instant, directions of sliding and of sticking where contacts are now; all frictions begin stuck.

    A contact that closes holds the place that it strikes from here on: its tangents are those of the ground there, also
    where it rebounds. Forces that follow multipliers (K.loads_act), as smooth friction, take no part; dry friction of
    contacts has its limit at the slip before the impact.
    """
    evaluate(K, K.time, K.q, K.y)
    if K.n_cones > 0:
        hold_directions(K)
    hold_places(K)
    if K.n_frictions > 0:
        K.given[: K.n_rows] = 0.0
        K.block[1] = 1.0
        evaluate_loaded(K, K.given)
        for f in range(K.n_frictions):
            K.base_limit[f] = limit_of(K, f)  # no impulse comes from a force that stays finite
        if K.strategy == 1:
            evaluate_loaded(K, K.past)
            for f in range(K.n_frictions):
                K.past_limit[f] = limit_of(K, f) + (K.past_time - 1.0) * K.base_limit[f]
    elif K.loads_act == 1:  # smooth friction follows forces that stay finite
        K.block[1] = 1.0
        call(K, ACCELERATIONS, K.acc)
    start_over(K)


def hold_places(K: Mechanism) -> None:
    """Anchors of contacts that close, and of those that slide, at the present state; K.acc with them."""
    moved = False
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.closing[c] > 0 and K.anchor_start[c] < K.anchor_start[c + 1]:
            capture(K, c)
            moved = True
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        if c >= 0 and K.closed[c] == 1 and K.sticks[f] == 0 and K.anchor_start[c] < K.anchor_start[c + 1]:
            capture(K, c)
            moved = True
    if moved:
        evaluate(K, K.time, K.q, K.y)


def start_over(K: Complementarity) -> None:
    """No jump and no impulse yet."""
    for i in range(K.n):
        K.jump[i] = K.total_jump[i] = 0.0
    for k in range(K.n_rows):
        K.impulse[k] = K.total[k] = 0.0


def gather(K: Guards, slow: bool, hold: bool) -> None:
    """All closed and closing contacts take part; those that open on pull may choose.

    With `hold` all are held; where impacts follow without end, the one that fired and cannot rise.
    """
    for c in range(K.n_contacts):
        both = K.closed[c] == 1 or K.closing[c] > 0
        held = hold and (K.plastic_impact == 0 or K.strategy == 1 or K.event_index == c)
        K.active[c] = 1 if (both and K.kind[c] == 0) else 0
        K.free[c] = 1 if (K.active[c] == 1 and K.opens[c] == 0 and not held) else 0
    if not slow or K.strategy == 1:
        loosen(K)
        return
    for f in range(K.n_frictions):  # what sticks goes on to stick, what slides feels nothing
        K.loose[f] = 0
        K.slip[f] = 0.0


def loosen(K: Frictions) -> None:
    """Frictions of this impact may choose, from sticking."""
    for f in range(K.n_frictions):
        c = K.friction_contact[f]
        K.loose[f] = 1 if (c < 0 or K.active[c] == 1) else 0
        if K.loose[f] == 1:
            K.sticks[f] = 1
            K.slip[f] = 0.0


def speed(K: ContactForces, row: int) -> float:
    """γ of a row after the jumps so far."""
    value = row_speed(K, row)
    for j in range(K.n):
        value += K.acc[K.acc_B + row * K.n + j] * K.total_jump[j]
    return value


def solve_impact(K: Balance) -> int:
    """The next jump and its impulses, beside the impulses in K.given: bias is in place, contacts have been gathered."""
    K.impulse[: K.n_rows] = 0.0
    status = complementarity(K, 1)
    if status != 0:
        return status
    note_edges(K)
    for i in range(K.n):
        K.total_jump[i] += K.jump[i]
        K.jump[i] = K.total_jump[i]
    for k in range(K.n_rows):
        K.total[k] += K.impulse[k] + K.given[k]
        K.impulse[k] = K.total[k]
        K.given[k] = 0.0
    K.parting[: K.n_contacts] = 0
    return 0


def is_held_through(K: Contacts, c: int) -> bool:
    """Whether a contact acts in every impact whatever the sign of its impulse: it has a rule, and does not rebound."""
    return bool(K.opens[c] != 0 and (K.closed[c] == 1 or K.restitution[c] == 0.0))


def restitution_of(K: Contacts, c: int) -> float:
    """e, or 0 at the end of impacts without end."""
    return 0.0 if K.plastic_impact == 1 else float(K.restitution[c])


def let_rebound(K: ContactForces) -> None:
    """Contacts that closed with a restitution leave again."""
    for c in range(K.n_contacts):
        rests = K.strategy == 1 and K.before[c] >= 0.0
        if K.closing[c] > 0 and restitution_of(K, c) > 0.0 and not rests:
            K.active[c] = 0


def energy_gain(K: ContactForces) -> float:
    """Work of all impulses on the mechanism, ½ Σ λ̂ (γ⁻ + γ⁺), relative to its terms; the most of any cluster struck.

    Of a cluster that nothing strikes impulses are round-off: it counts with all others alone. Non-smooth steps in space
    find friction for the whole step: what the smooth one had of it may be given back.
    """
    most = relative_gain(K, -1)
    for c in range(K.n_contacts):
        if K.closing[c] > 0 and abs(row_speed(K, K.normal[c])) > K.rest_speed:
            most = max(most, relative_gain(K, K.cluster[K.n + K.normal[c]]))
    return most


def relative_gain(K: ContactForces, cluster: int) -> float:
    """The same of one cluster, of all with −1."""
    n = K.n
    loss = 0.0
    size = 1e-300
    for k in range(K.n_rows):
        if K.impulse[k] != 0.0 and (cluster < 0 or K.cluster[n + k] == cluster):
            half = 0.0
            for j in range(n):
                half += 0.5 * K.acc[K.acc_B + k * n + j] * K.jump[j]
            before = row_speed(K, k)
            loss += K.impulse[k] * (before + half)
            size += abs(K.impulse[k]) * (abs(before) + abs(half))
            if K.strategy == 1 and K.n_cones > 0 and K.row_friction[k] >= 0:
                loss += abs(K.past[k]) * (abs(before) + abs(half))
    return -loss / size


def strikes(K: ContactForces, c: int) -> bool:
    """Whether a contact closes in the impact just found; one that only touches takes no impulse."""
    return bool(K.kind[c] == 0 and K.closing[c] > 0 and (K.closing[c] == 1 or K.impulse[K.normal[c]] != 0.0))


def loss_of(K: ContactForces, row: int) -> float:
    """What the impulse of a row took, −½ Λ (γ⁻ + γ⁺): its part of the kinetic energy lost."""
    rate = row_speed(K, row)
    for j in range(K.n):
        rate += 0.5 * K.acc[K.acc_B + row * K.n + j] * K.jump[j]
    return float(K.impulse[row] * rate)


def loss_in(K: ContactForces, c: int) -> float:
    """What the impulses of a contact took."""
    loss = 0.0
    for k in range(K.n_rows):
        if K.row_contact[k] == c:
            loss += loss_of(K, k)
    return loss


def loss_elsewhere(K: ContactForces) -> float:
    """What friction in joints, and contacts that were closed before, took in an impact.

    Where an impulse of the user's acts in the same problem, rows that always hold take their part of it, −½ Λ B·Δv.
    """
    loss = 0.0
    for k in range(K.n_rows):
        c = K.row_contact[k]
        if (c < 0 and K.row_friction[k] >= 0) or (c >= 0 and not strikes(K, c)):
            loss += loss_of(K, k)
        elif c < 0 and K.n_impulses > 0:
            for j in range(K.n):
                loss -= 0.5 * K.impulse[k] * K.acc[K.acc_B + k * K.n + j] * K.jump[j]
    return loss
