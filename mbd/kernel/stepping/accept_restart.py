"""Taking over a candidate before a restart (at events, after uneven steps).

Steps of index 3 leave B v + h_t of the size of their error, which a candidate loses as it is taken over. Forces and
guards change with it: where an event is looked for, they are those of the velocities that it will leave.
"""

from mbd.kernel.algebra.saddle import correct_velocities, solve_rows
from mbd.kernel.codes import PULL
from mbd.kernel.events.guards import watch
from mbd.kernel.records import Balance, Guards, Kernel, Reals, Switching
from mbd.kernel.stepping.candidate import accept_candidate, revert_candidate
from mbd.kernel.stepping.restart import active_rows, consistent, evaluate, largest_force, stepping_rows, take_consistent
from mbd.kernel.stepping.trial_step import try_step


def project_velocity(K: Balance, t: float, q: Reals, y: Reals, m: int, dropping: bool) -> int:
    """The nearest velocities to y, in the metric of M, with B v + h_t = 0 on the m rows in K.rows.

    They may depend on each other where `dropping` finds out again which do.
    """
    if m == 0:
        return 0
    evaluate(K, t, q, y)
    K.force[: K.n] = 0.0
    K.bias[: K.n_rows] = K.acc[K.acc_rate : K.acc_rate + K.n_rows]
    status = correct_velocities(K, y, m, dropping)
    if status == 0:
        for i in range(K.n):
            y[i] += K.jump[i]
    return status


def put_on_rows(K: Switching, t1: float) -> None:
    """A candidate of index 3 with the velocities and guards that it has once it is taken over."""
    if K.stabilized == 1 or K.n_active == 0:
        return
    if project_velocity(K, t1, K.q1, K.y1, stepping_rows(K), False) == 0:
        watch(K, t1, K.q1, K.y1, K.rate1, K.lam1, K.guards1)
        K.limit[: K.n_frictions] = K.guards1[K.at_limit : K.at_limit + K.n_frictions]


def event_candidate(K: Kernel, h: float, t1: float) -> int:
    """A candidate at t1 = t + h as an event there would take it over."""
    status = try_step(K, h, t1)
    if status == 0:
        put_on_rows(K, t1)
    return status


def event_at_start(K: Kernel) -> None:
    """The accepted state as the candidate of an event at the very start of the step."""
    revert_candidate(K)
    put_on_rows(K, K.time)


def would_pull(K: Balance) -> bool:
    """Whether a contact that pushes by the multipliers of the step pulls by those in K.impulse."""
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.closed[c] == 1 and K.opens[c] == 0:
            row = K.normal[c]
            if K.lam[row] <= 0.0 < K.impulse[row] and K.impulse[row] > PULL * largest_force(K, row):
                return True
    return False


def turns_to_pull(K: Guards) -> bool:
    """Whether a closed penalty contact that pushes with the velocities of the candidate pulls with those in K.y."""
    looked = False
    for c in range(K.n_contacts):
        if K.kind[c] == 1 and K.closed[c] == 1 and K.opens[c] == 0 and K.guards0[K.at_force + c] >= 0.0:
            if not looked:
                watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards1)
                looked = True
            if K.guards1[K.at_force + c] < 0.0:
                return True
    return False


def balance(K: Balance) -> None:
    """Accelerations from the multipliers K.lam at the accepted state, where M determines them."""
    n = K.n
    evaluate(K, K.time, K.q, K.y)
    K.force[:n] = K.acc[K.acc_f : K.acc_f + n]
    for k in range(active_rows(K, K.closed)):
        row = K.rows[k]
        for i in range(n):
            K.force[i] += K.acc[K.acc_R + i * K.n_rows + row] * K.lam[row]
    if solve_rows(K, 0, False) == 0:
        K.rate[:n] = K.jump[:n]


def accept_for_restart(K: Switching, t1: float) -> None:
    """The candidate becomes the accepted state ahead of a restart, consistent in the old mode at every level.

    A shortened index-3 step leaves B v + h_t of the size of its error; it would survive a release, so it is removed.
    Where dt is so long that a contact pushes by the step but would pull by consistent multipliers or velocities, those
    of the step stay, and the restart decides; accelerations follow from them.
    """
    accept_candidate(K, t1)
    status = project_velocity(K, t1, K.q, K.y, active_rows(K, K.closed), True)
    if status == 0 and K.stabilized == 0 and turns_to_pull(K):
        K.y[: K.n] = K.y1[: K.n]
    if status == 0 and consistent(K, t1, K.q, K.y) == 0:
        if would_pull(K):
            balance(K)
            return
        take_consistent(K)
