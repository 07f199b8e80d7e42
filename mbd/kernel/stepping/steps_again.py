"""States between the rows of a run, many in one call: steps of an explicit scheme from stored rows, and balances.

A line of `starts` is a step: number of its row, t and the time of its end, q, (v, z), (v̇, ż), λ, anchors, closed
contacts of the row and room for ḣ*. Its line of `ends` begins with the status and how many rows depend on others,
then tells the determinants of [M R; B 0] at the row, at the stages and at the end, parts first and then the powers of
`FAR` that they are to be multiplied by; then q, (v, z), (v̇, ż) and λ at the end. Contacts stay as the row has them.

A step of no length asks for the determinant and the consistent (v̇, ż) and λ at its row, which may be any state, and
where lines of the log are kept, for M and f in the place of one. A step that ends at −∞ asks for the positions and
velocities nearest to those of its line, in the metric of M, with h = h*, which stands in the place of λ, and ḣ = ḣ*
(see `mbd.results.projection`). Which rows depend on others is judged at the first of neighbouring lines of one mode.
"""

from mbd.equal import DIRECT_PIVOT_RTOL, ROUND_OFF_RTOL
from mbd.kernel.algebra.ordered import solve_kkt
from mbd.kernel.algebra.redundancy import find_dependent
from mbd.kernel.algebra.saddle import factor_saddle
from mbd.kernel.codes import DONE, NEW_MODE, NOT_CONVERGED, SINGULAR
from mbd.kernel.hooks import scheme_start, scheme_step
from mbd.kernel.records import DependentRows, Kernel, Reals
from mbd.kernel.schemes.determinant import note_determinant
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.restart import active_rows, consistent, displace, evaluate, stepping_rows
from mbd.kernel.stepping.starting import find_mode

__all__ = ["steps_again"]


def steps_again(K: Kernel) -> int:
    """All lines that are left; DONE, or NEW_MODE before one whose mode has no code."""
    while K.run < K.n_runs:
        o = K.run * (3 + K.n_q + 2 * K.n + 2 * K.n_rows + K.n_anchors + K.n_contacts)
        if K.begun != int(K.starts[o]) + 1 and not load_row(K, o):
            return NEW_MODE
        end = K.starts[o + 2]
        if end > K.time:
            status = step_from_row(K, end)
        elif end == K.time:
            status = balance(K)
        else:
            status = lead(K, o + 3 + K.n_q + 2 * K.n + K.n_rows + K.n_anchors + K.n_contacts)
        write_end(K, status)
        K.run += 1
    return DONE


def load_row(K: Kernel, o: int) -> bool:
    """The row of a line as the accepted state; false where its mode has no code."""
    same = K.begun > 0
    K.begun = 0
    K.restart_due = 1
    K.time = K.starts[o + 1]
    if K.n_parameters > 0:
        carry(K.params, K.given_parameters, K.run * K.n_parameters, K.n_parameters, False)
    place = carry(K.q, K.starts, o + 3, K.n_q, False)
    place = carry(K.y, K.starts, place, K.n, False)
    place = carry(K.rate, K.starts, place, K.n, False)
    place = carry(K.lam, K.starts, place, K.n_rows, False)
    place = carry(K.anchors, K.starts, place, K.n_anchors, False)
    for c in range(K.n_contacts):
        same = same and K.closed[c] == int(K.starts[place + c])
        K.closed[c] = int(K.starts[place + c])
    if not same:
        evaluate(K, K.time, K.q, K.y)
        K.mode_id = -1
        find_dependent(K, active_rows(K, K.closed))
        K.n_active = stepping_rows(K)
        K.mode_id = find_mode(K)
    if K.mode_id >= 0:
        K.begun = int(K.starts[o]) + 1
    return bool(K.mode_id >= 0)


def balance(K: Kernel) -> int:
    """Consistent rates and multipliers at the accepted state as those of the candidate; 0, or a failure."""
    status = consistent(K, K.time, K.q, K.y)
    note_determinant(K, 0)
    if K.max_lines > 0:
        count = K.n * (K.n + 1)
        carry(K.acc, K.lines, K.run * count, count, True)
    carry(K.q, K.q1, 0, K.n_q, True)
    carry(K.y, K.y1, 0, K.n, True)
    carry(K.jump, K.rate1, 0, K.n, True)
    carry(K.impulse, K.lam1, 0, K.n_rows, True)
    return status


def step_from_row(K: Kernel, t1: float) -> int:
    """A step from the accepted state, from which the scheme is started if it is not yet; 0, or a failure."""
    status = 0
    if K.restart_due == 1:
        status = scheme_start(K)
        K.restart_due = 0 if status == 0 else 1
    if status == 0:
        status = scheme_step(K, t1 - K.time, t1)
    if status == 0:
        note_determinant(K, K.n_nodes)
    return status


def lead(K: Kernel, o_aim: int) -> int:
    """The state on the rows by Newton's method, then by one correction of velocities; 0, or a failure."""
    carry(K.q, K.q1, 0, K.n_q, True)
    carry(K.y, K.y1, 0, K.n, True)
    before = 0.0
    for _ in range(40):  # halved as often, 1 is round-off
        if not correct(K, K.acc_h, K.lam, 0):
            return SINGULAR
        size = 0.0
        for i in range(K.n_v):
            size = max(size, abs(K.rhs[i]))
        if not (size <= ROUND_OFF_RTOL or before == 0.0 or size < 0.5 * before):
            return NOT_CONVERGED
        displace(K, K.q1, K.rhs)
        following = size * (size / before) * (size / before) if before > 0.0 else size
        before = size
        if not following > ROUND_OFF_RTOL:
            break
    if not correct(K, K.acc_rate, K.starts, o_aim):
        return SINGULAR
    for i in range(K.n_v):
        K.y1[i] += K.rhs[i]
    return 0


def correct(K: DependentRows, o_off: int, aims: Reals, o_aim: int) -> bool:
    """The least change x with ``B x = h* − h``, or of ḣ, at the candidate, in K.rhs; false without a pivot."""
    evaluate(K, K.time, K.q1, K.y1)
    if not factor_saddle(K, K.n_active, True, DIRECT_PIVOT_RTOL):
        return False
    K.rhs[: K.n] = 0.0
    for k in range(K.n_active):
        row = K.rows[k]
        skipped = o_off == K.acc_h and K.row_level[row] == 1
        K.rhs[K.n + k] = 0.0 if skipped else aims[o_aim + row] - K.acc[o_off + row]
    solve_kkt(K, K.n + K.n_active, K.rhs)
    return True


def write_end(K: Kernel, status: int) -> None:
    """The line of the present step among the ends, but for its determinants."""
    count = 2 * (K.n_nodes + 1)
    o = K.run * (2 + count + K.n_q + 2 * K.n + K.n_rows)
    K.ends[o] = float(status)
    K.ends[o + 1] = float(K.n_dropped)
    place = carry(K.q1, K.ends, o + 2 + count, K.n_q, True)
    place = carry(K.y1, K.ends, place, K.n, True)
    place = carry(K.rate1, K.ends, place, K.n, True)
    carry(K.lam1, K.ends, place, K.n_rows, True)
