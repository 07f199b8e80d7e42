"""Lines of the event log."""

from mbd.kernel.codes import LOG_CLOSED, LOG_EVENT, LOG_OPENED
from mbd.kernel.contact.impact_solve import strikes
from mbd.kernel.records import Sizes, Switching

NO_IMPULSE, OWN_IMPULSE, ALL_IMPULSES = 0, 1, 2
"""Which impulses a line of the event log holds [-]."""


def room_to_log(K: Sizes) -> int:
    """Lines of the event log that one step with its event and two restarts may fill.

    A restart logs each contact and each friction at most once. An event logs each guard at most once, as a step over a
    singular configuration does; an impact each contact at most three times: released by one that strikes, closed, and
    opened again.
    """
    return int(5 * K.n_contacts + 2 * K.n_frictions + 2 * K.n_guards + 64 * K.n_machines + K.n_impulses + 8)


def log_event(K: Switching, kind: int, index: int, loss: float, impulses: int) -> None:
    """One line of the event log: t, kind, index, energy loss, row of results, impulses.

    impulses : NO_IMPULSE; OWN_IMPULSE, those of the rows of contact `index`; ALL_IMPULSES, with those of the rows that
        belong to no contact that closes in this impact
    """
    if K.n_machines > 0:
        if kind == LOG_CLOSED or kind == LOG_OPENED:
            K.happened[kind * K.n_contacts + index] = 1
        elif kind == LOG_EVENT:
            K.happened[2 * K.n_contacts + index] = 1
    if K.n_logged >= K.event_capacity:  # never beyond the array; the run ends with an error
        K.n_lost += 1
        return
    o = K.n_logged * K.event_width
    K.log[o] = K.time
    K.log[o + 1] = float(kind)
    K.log[o + 2] = float(index)
    K.log[o + 3] = loss
    K.log[o + 4] = float(K.n_stored)
    for k in range(K.n_rows):
        c = K.row_contact[k]
        logged = impulses != NO_IMPULSE and (c == index or (impulses == ALL_IMPULSES and (c < 0 or not strikes(K, c))))
        K.log[o + 5 + k] = 0.0 - K.impulse[k] if logged else 0.0
    K.n_logged += 1
    K.n_events += 1
