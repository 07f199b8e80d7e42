"""Steps of an explicit scheme taken again from stored rows, many in one call, for states between the rows of a run.

A line of `starts` is a step: number of its row, t and the time of its end, q, (v, z), (v̇, ż), λ, anchors and closed
contacts of the row. Its line of `ends` begins with the status, then tells the determinants of [M R; B 0] at the row, at
the stages and at the end, parts first and then the powers of `FAR` that they are to be multiplied by; then q, (v, z),
(v̇, ż) and λ at the end. A step of no length tells the determinant at its row alone. Contacts stay as the row has them.
"""

from mbd.kernel.algebra.redundancy import find_dependent
from mbd.kernel.codes import DONE, NEW_MODE
from mbd.kernel.hooks import scheme_start, scheme_step
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.determinant import note_determinant
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.restart import active_rows, evaluate, stepping_rows
from mbd.kernel.stepping.starting import find_mode

__all__ = ["steps_again"]


def steps_again(K: Kernel) -> int:
    """All steps that are left; DONE, or NEW_MODE before one whose mode has no code."""
    while K.run < K.n_runs:
        width = 3 + K.n_q + 2 * K.n + K.n_rows + K.n_anchors + K.n_contacts
        o = K.run * width
        status = 0
        if K.begun != int(K.starts[o]) + 1:
            status = load_row(K, o)
            if status == NEW_MODE:
                return NEW_MODE
        h = K.starts[o + 2] - K.time
        if status == 0 and h == 0.0:
            evaluate(K, K.time, K.q, K.y)
            note_determinant(K, 0)
        elif status == 0:
            status = scheme_step(K, h, K.starts[o + 2])
            if status == 0:
                note_determinant(K, K.n_nodes)
        write_end(K, status)
        K.run += 1
    return DONE


def load_row(K: Kernel, o: int) -> int:
    """The row of a line as the accepted state, with the scheme started from it; 0, NEW_MODE or a failure."""
    same = K.begun > 0
    K.begun = 0
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
        if K.mode_id < 0:
            return NEW_MODE
    status = scheme_start(K)
    if status == 0:
        K.begun = int(K.starts[o]) + 1
    return status


def write_end(K: Kernel, status: int) -> None:
    """The line of the present step among the ends, but for its determinants."""
    count = 2 * (K.n_nodes + 1)
    o = K.run * (1 + count + K.n_q + 2 * K.n + K.n_rows)
    K.ends[o] = float(status)
    place = carry(K.q1, K.ends, o + 1 + count, K.n_q, True)
    place = carry(K.y1, K.ends, place, K.n, True)
    place = carry(K.rate1, K.ends, place, K.n, True)
    carry(K.lam1, K.ends, place, K.n_rows, True)
