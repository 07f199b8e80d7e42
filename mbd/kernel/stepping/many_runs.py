"""Many runs in one call, each from its start to its end, as `mbd.simulation.run` drives one.

What a run asks of Python between two calls is done here: the last step, which ends where the run does unless that of a
longer one would end there too; the event that ends it, and the start of the scheme after it; what was logged. Only code
for a mode that is met first, and a look whether somebody interrupts, need Python: it is given the call, and goes on
with it. Runs that Python must judge (`DOUBTFUL_START`, `NEEDS_PYTHON`) are left to it.
"""

from mbd.kernel.codes import DONE, EVENT, LAST, LOG_CLOSED, LOG_EVENT, LOG_OPENED, NEEDS_PYTHON, NEW_MODE, PAUSE
from mbd.kernel.contact.cones import phase_of
from mbd.kernel.records import Kernel
from mbd.kernel.stepping.advance import advance
from mbd.kernel.stepping.begin_run import begin_run
from mbd.kernel.stepping.candidate import carry

NEVER = float("inf")
"""When a run ends that is not to end [s]."""


def march_many(K: Kernel) -> int:
    """All runs that are left; DONE, or NEW_MODE or PAUSE in the midst of one."""
    while K.run < K.n_runs:
        status = 0
        if K.begun == 0:
            status = begin_run(K)
        if status == 0:
            status = march(K)
            if status == NEW_MODE or status == PAUSE:
                return status
        note_end(K, status)
        K.begun = 0
        K.run += 1
    return DONE


def march(K: Kernel) -> int:
    """The present run to its end: DONE, EVENT, a failure, NEEDS_PYTHON; or NEW_MODE or PAUSE on the way."""
    while K.steps_left > 0:
        before = K.n_steps
        status = advance_to_end(K)
        K.steps_left -= K.n_steps - before + 1
        see_events(K)
        # events of a run above which Python judges whether they crowd
        if K.fallback > 0 or K.n_lost > 0 or K.n_seen > 2000:
            return NEEDS_PYTHON
        if status == DONE or status == NEW_MODE:
            return status
        if status == EVENT and K.stopped_by >= 0:
            if K.stopped_by >= K.n_contacts and K.resets[K.stopped_by - K.n_contacts] == 1:
                return EVENT
            return finish(K)
        if status > LAST:
            return NEEDS_PYTHON if K.auto == 1 else status
    return PAUSE


def advance_to_end(K: Kernel) -> int:
    """As `mbd.simulation.run.ends.advance`: a step past the end of the run ends there, unless a longer run's does."""
    K.chunk = K.chunk_of_runs
    K.until = K.last_time
    K.end = K.last_time
    status = advance(K)
    if status != LAST:
        return status
    see_events(K)
    note(K, True)
    K.chunk = 1
    K.until = NEVER
    K.end = NEVER
    status = advance(K)
    stays = status == PAUSE or status == EVENT or status == NEW_MODE
    if K.auto == 1 and status > LAST:
        return status
    if stays and K.time <= K.last_time + K.near_end:
        return DONE if status == PAUSE and K.time >= K.last_time - K.near_end else status
    note(K, False)
    K.chunk = K.chunk_of_runs
    K.until = K.last_time
    return advance(K)


def finish(K: Kernel) -> int:
    """Start the scheme after the event that ended the run; EVENT, or a failure.

    Where somebody waits for others that happen at the same instant Python must judge.
    """
    K.chunk = K.chunk_of_runs
    K.until = K.time
    K.end = NEVER
    status = advance(K)
    see_events(K)
    if status == EVENT:
        return NEEDS_PYTHON
    return EVENT if status == DONE or status == NEW_MODE else status


def note(K: Kernel, out: bool) -> None:
    """What the next step depends on, kept or put back."""
    carry(K.whole_reals, K.noted_reals, 0, K.n_whole_reals, out)
    carry(K.whole_integers, K.noted_integers, 0, K.n_whole_integers, out)
    carry(K.counts, K.noted_counts, 0, K.n_counts, out)


def see_events(K: Kernel) -> None:
    """Take over what was logged; rows are not kept."""
    for line in range(K.n_logged):
        o = line * K.event_width
        kind = int(K.log[o + 1])
        index = int(K.log[o + 2])
        if K.n_lines < K.max_lines:
            for i in range(K.event_width):
                K.lines[(K.run * K.max_lines + K.n_lines) * K.event_width + i] = K.log[o + i]
            K.n_lines += 1
        if K.log[o] > K.before_time:
            K.before_time = K.log[o]
            carry(K.closed_now, K.closed_before, 0, K.n_contacts, True)
        if kind == LOG_CLOSED:
            K.closed_now[index] = 1
        elif kind == LOG_OPENED:
            K.closed_now[index] = 0
        flag = index + K.flag_user if kind == LOG_EVENT else index
        if (kind == LOG_CLOSED or kind == LOG_EVENT) and K.notify[flag] == 1:
            K.stopped_by = flag
        # modulo the largest prime below 2³¹, which a real holds exactly
        K.sequence = (K.sequence * 31 + 5 * index + kind + 1) % 2147483647
        K.n_seen += 1
    K.n_logged = 0
    K.n_stored = 0


def note_end(K: Kernel, status: int) -> None:
    """The line of the run among the ends: status, flag of the event that ended it, steps, events, sequence, lines and
    time; then the row of results, armed contacts, those closed just before the end, and what contacts hold.
    """
    o = K.run * K.end_width
    now = K.last_time if status == DONE else K.time
    K.ends[o] = float(status)
    K.ends[o + 1] = float(K.stopped_by) if status == EVENT else -1.0
    K.ends[o + 2] = float(K.n_steps)
    K.ends[o + 3] = float(K.n_seen)
    K.ends[o + 4] = float(K.sequence)
    K.ends[o + 5] = float(K.n_lines)
    K.ends[o + 6] = now
    o += K.end_row
    K.ends[o] = now
    o = carry(K.q, K.ends, o + 1, K.n_q, True)
    o = carry(K.y, K.ends, o, K.n, True)
    o = carry(K.rate, K.ends, o, K.n, True)
    o = carry(K.lam, K.ends, o, K.n_rows, True)
    for c in range(K.n_contacts):
        K.ends[o + c] = float(K.closed[c])
        K.ends[o + K.n_contacts + K.n_frictions + c] = float(K.armed[c])
        held = K.closed_before[c] if K.before_time >= K.time else K.closed_now[c]
        K.ends[o + 2 * K.n_contacts + K.n_frictions + c] = float(held)
    for f in range(K.n_frictions):
        K.ends[o + K.n_contacts + f] = phase_of(K, f)
    carry(K.anchors, K.ends, o + 3 * K.n_contacts + K.n_frictions, K.n_anchors, True)
