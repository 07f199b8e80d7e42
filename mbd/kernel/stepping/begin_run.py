"""How a run begins: the start in the arrays, where one of many is put first, is judged as in `simulation.run.begin`."""

from mbd.kernel.codes import ACCELERATIONS, DOUBTFUL_START, GUARDS, SCALES
from mbd.kernel.events.guard_round_off import guard_round_off
from mbd.kernel.events.guards import is_watched
from mbd.kernel.events.transitions import begins_now
from mbd.kernel.hooks import call
from mbd.kernel.records import Guards, Kernel, Mechanism, Switching
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.restart import fill_block, refresh_scales

LONG_AGO = float("-inf")
"""When the last switch was, before any [s]."""
MAX_START_DEPTH = 1e-6
"""Depth inside a surface from which an open contact cannot start, and a start is reported [m, rad]."""
INCONSISTENT, ROUND_OFF = 1e-6, 1e-8
"""Residuals of rows, as in `mbd.assembly.consistency`."""
CLOSE, SLOW = 1e-8, 1e-9
"""Gap [m, rad] and its rate [m/s, rad/s] up to which a contact touches."""


def begin_run(K: Kernel) -> int:
    """The run `K.run` from its line of starts; `DOUBTFUL_START` where it is for Python to judge."""
    put_start(K)
    status = judge_start(K)
    if status == 0:
        K.begun = 1
    return status


def judge_start(K: Switching) -> int:
    """On which sides of contacts and guards the start in the arrays lies; `DOUBTFUL_START` where Python must judge."""
    for i in range(K.n_block):
        K.block[i] = 0.0
    K.block[0] = K.time
    carry(K.q, K.block, K.o_q, K.n_q, True)
    carry(K.y, K.block, K.o_v, K.n, True)
    carry(K.anchors, K.block, K.o_anchor, K.n_anchors, True)
    if K.n_rows > 0 or K.n_contacts > 0:
        call(K, ACCELERATIONS, K.acc)
        if K.n_rows > 0:
            call(K, SCALES, K.out)
            if not holds_its_rows(K):
                return DOUBTFUL_START
    if K.n_watched > 0:
        call(K, GUARDS, K.guards1)
        if not touch(K):
            return DOUBTFUL_START
        for e in range(K.n_guards):
            set_side(K, e)
    return 0


def put_start(K: Kernel) -> None:
    """Everything as it is before any run, but for the start."""
    carry(K.fresh_reals, K.whole_reals, 0, K.n_whole_reals, True)
    carry(K.fresh_integers, K.whole_integers, 0, K.n_whole_integers, True)
    for i in range(K.n_counts):
        K.counts[i] = 0
    carry(K.params, K.given_parameters, K.run * K.n_parameters, K.n_parameters, False)
    o = K.run * K.start_width
    K.time = K.starts[o]
    K.grid_start = K.starts[o]
    o = carry(K.q, K.starts, o + 1, K.n_q, False)
    o = carry(K.y, K.starts, o, K.n, False)
    o = carry(K.anchors, K.starts, o, K.n_anchors, False)
    for c in range(K.n_contacts):
        K.closed[c] = int(K.starts[o + c])
        K.armed[c] = int(K.starts[o + K.n_contacts + c])
        K.closed_now[c] = K.closed[c]
        K.closed_before[c] = K.closed[c]
    K.before_time = K.time
    K.last_switch = LONG_AGO
    K.restart_due = 1
    K.mode_id = -1
    K.stopped_by = -1
    K.sequence = 0
    K.n_seen = 0
    K.n_lines = 0


def holds_its_rows(K: Mechanism) -> bool:
    """Whether the rows that act hold; h and ḣ are in K.acc, the sizes of their terms in K.out."""
    fast = 1.0
    for i in range(K.n_v):
        fast = max(fast, abs(K.y[i]))
    for k in range(K.n_rows):
        if K.row_trivial[k] == 1 or K.row_friction[k] >= 0:
            continue
        if K.row_contact[k] >= 0 and K.closed[K.row_contact[k]] == 0:
            continue
        allowed = max(ROUND_OFF, INCONSISTENT * min(1.0, K.out[K.n + k]))
        if not abs(K.acc[K.acc_h + k]) <= allowed:
            return False
        allowed = max(ROUND_OFF * fast, INCONSISTENT * min(fast, K.out[K.n + K.n_rows + k]))
        if not abs(K.acc[K.acc_rate + k]) <= allowed:
            return False
    return True


def touch(K: Guards) -> bool:
    """Note which contacts touch at the start; False where one that is open lies inside its surface."""
    for c in range(K.n_contacts):
        ready = K.armed[c] == 1 and is_watched(K, c, K.guards1)
        near = abs(K.guards1[c]) <= CLOSE and abs(K.guards1[K.at_gap_rate + c]) <= SLOW
        for k in range(K.n_rows):
            if K.row_contact[k] == c and K.row_friction[k] < 0:
                near = near and abs(K.acc[K.acc_rate + k]) <= SLOW
        K.touched[c] = 1 if ready and K.kind[c] == 0 and near else 0
        if ready and K.closed[c] == 0 and K.guards1[c] < -MAX_START_DEPTH:
            return False
    return True


def set_side(K: Switching, e: int) -> None:
    """The side of a user's guard, whose value and rate are in K.guards1: that of its rate where it is round-off."""
    value = K.guards1[K.at_user + e]
    rate = K.guards1[K.at_user_rate + e]
    fill_block(K, K.time, K.q, K.y)
    refresh_scales(K)
    doubt = guard_round_off(K, e, K.time, K.q, K.y)
    timed = K.guard_timed[e] if K.n_machines > 0 else 0
    late = timed % 4 == 3 and value > 0.0 and int(K.anchors[K.machine_start[K.guard_machine[e]]]) == K.guard_source[e]
    if late or (abs(value) <= doubt and timed >= 4) or (timed % 2 == 1 and begins_now(K, e)):
        value = -1.0  # a timer that is due, or was before a parameter or the time was changed
    elif abs(value) <= doubt:
        value = rate if abs(rate) * K.step > doubt else 0.0
    K.side[e] = 0.0
    K.passing[e] = 0
    if value > 0.0:
        K.side[e] = 1.0
    elif value < 0.0:
        K.side[e] = -1.0
