"""The linear equations of a set of branches: who pushes, who sticks, and which way the rest slides."""

from mbd.kernel.algebra.redundancy import sharing, spread
from mbd.kernel.algebra.saddle import solve_at
from mbd.kernel.contact.cone_loads import keep_in_cones
from mbd.kernel.records import Balance, Complementarity, ContactForces, Frictions, Reals
from mbd.kernel.stepping.loads import evaluate_loaded, limit_of
from mbd.kernel.stepping.restart import MAX_LOAD_ITERATIONS, active_rows, load_accelerations
from mbd.kernel.tangent_rules import takes_part


def solve_directed(K: Balance, level: int) -> int:
    """Solve with the present branches and directions; friction that slides is put into K.impulse of its row."""
    if K.n_frictions == 0 and (K.loaded == 0 or level != 0):
        load(K, level)
        return solve_at(K, active_rows(K, K.active), level)
    status = 0
    for _ in range(MAX_LOAD_ITERATIONS):
        evaluate_loaded(K, whole(K, level))
        find_limits(K, level)
        load(K, level)
        status = solve_at(K, active_rows(K, K.active), level)
        if status != 0:
            return status
        change = evaluate_loaded(K, whole(K, level))
        if change < 1e-13 or (K.loaded == 0 and not sharing(K)):
            break
    find_limits(K, level)
    if K.n_dropped > 0 and not sharing(K):
        for _ in range(
            MAX_LOAD_ITERATIONS
        ):  # frictions that hold together share by their limits, which follow their loads
            spread(K, K.impulse)
            change = evaluate_loaded(K, whole(K, level))
            find_limits(K, level)
            if change < 1e-13:
                break
    if K.n_dropped > 0 and K.n_cones > 0:
        for k in range(K.n_rows):  # of a non-smooth step with those of its smooth part
            K.impulse[k] += K.past[k]
        keep_in_cones(K, K.impulse)
        for k in range(K.n_rows):
            K.impulse[k] -= K.past[k]
        evaluate_loaded(K, whole(K, level))
        find_limits(K, level)
    for f in range(K.n_frictions):
        if slides(K, f):
            row = K.friction_row[f]
            K.impulse[row] = K.slip[f] * K.limit[f] - (K.past[row] if level == 1 else 0.0)
    return status


def find_limits(K: ContactForces, level: int) -> None:
    """Largest frictions at the multipliers now in the block, of impulses without those of forces that stay finite."""
    for f in range(K.n_frictions):
        K.limit[f] = limit_of(K, f)
        if level == 1:  # only over the time of a non-smooth step
            K.limit[f] += (K.past_time - 1.0) * K.base_limit[f]


def whole(K: Complementarity, level: int) -> Reals:
    """The multipliers that friction follows: with the impulses that are given, and those of a smooth step before."""
    for k in range(K.n_rows):
        K.loads[k] = K.impulse[k] + (K.given[k] + K.past[k] if level == 1 else 0.0)
    return K.loads


def load(K: ContactForces, level: int) -> None:
    """Force and bias of the accelerations, or the force of the impulses that are given."""
    if level == 0:
        load_accelerations(K)
        return
    o_R = K.acc_R
    for i in range(K.n):
        K.force[i] = 0.0
        for k in range(K.n_rows):
            K.force[i] += K.acc[o_R + i * K.n_rows + k] * K.given[k] if takes_part(K.given[k]) else 0.0
    if K.strategy == 1 and level == 1:
        for f in range(K.n_frictions):
            if slides(K, f):  # what friction lacks of its limit under the forces of the smooth step
                row = K.friction_row[f]
                for i in range(K.n):
                    K.force[i] += K.acc[o_R + i * K.n_rows + row] * (K.slip[f] * K.past_limit[f] - K.past[row])


def is_on(K: Frictions, f: int) -> bool:
    """Whether a friction acts: its contact is closed, or it always does."""
    c = K.friction_contact[f]
    return bool(c < 0 or K.active[c] == 1)


def slides(K: Frictions, f: int) -> bool:
    """Whether a friction acts and slides."""
    return bool(is_on(K, f) and K.sticks[f] == 0)
