"""What a run leaves behind: rows of results, and events that someone waits for."""

from mbd.kernel.codes import LOG_EVENT, LOG_PUSHED, LOG_SLIPPED, LOG_STUCK
from mbd.kernel.contact.cones import phase_of
from mbd.kernel.records import Reals, Switching
from mbd.kernel.stepping.candidate import carry


def store_row(K: Switching) -> None:
    """One row of results: the accepted state."""
    store_state(K, K.q, K.y, K.rate, K.lam)


def store_passed_row(K: Switching) -> None:
    """The same for a row between events of which only the values are asked (see `tangent_rules.follows_rows`)."""
    store_row(K)


def store_state(K: Switching, q: Reals, y: Reals, rate: Reals, lam: Reals) -> None:
    """One row of results: t, q, (v, z), (v̇, ż), λ, closed, and what frictions do: 2 sticks, ±1 slides, 0 off.

    K.row_bounds follows the rows, so that notes on turns and pulls need no look at all of them.
    """
    if K.n_stored >= K.capacity:  # never beyond the array; the run ends with an error
        K.n_lost += 1
        return
    o = K.n_stored * K.width
    before = K.width if K.n_stored > 0 else 0  # the row before, or this one where there is none
    K.store[o] = K.time
    o += 1
    change = K.row_bounds[0]
    for i in range(K.n_q):
        K.store[o + i] = q[i]
        change = max(change, abs(q[i] - K.store[o + i - before]))
    K.row_bounds[0] = change
    o = carry(y, K.store, o + K.n_q, K.n, True)
    o = carry(rate, K.store, o, K.n, True)
    o = carry(lam, K.store, o, K.n_rows, True)
    for c in range(K.n_contacts):
        K.store[o + c] = float(K.closed[c])
        if K.normal[c] >= 0:
            K.row_bounds[1 + c] = max(K.row_bounds[1 + c], lam[K.normal[c]])
    for f in range(K.n_frictions):
        K.store[o + K.n_contacts + f] = phase_of(K, f)
    K.n_stored += 1
    K.steps_since_row = 0
    K.turned = 0.0


def is_awaited(K: Switching, first: int) -> bool:
    """Whether someone waits for an event logged since the line `first`."""
    for line in range(first, K.n_logged):
        index = int(K.log[line * K.event_width + 2])
        kind = int(K.log[line * K.event_width + 1])
        if kind == LOG_EVENT:
            index += K.flag_user
        elif kind == LOG_STUCK or kind == LOG_SLIPPED:
            index += K.flag_friction
        if kind != LOG_PUSHED and K.notify[index] == 1:
            return True
    return False
