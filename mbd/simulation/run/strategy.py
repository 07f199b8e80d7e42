"""How contacts are treated where the user leaves it open: located, and in non-smooth steps once that cannot go on."""

import numpy as np

from mbd.kernel import codes
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.kernel.events.crowding import MIN_CONTACTS, crowd
from mbd.simulation.run.data import RunData

ENDLESS = (codes.CHATTER, codes.NO_LOCATION, codes.NO_IMPACT)
"""Failures of locating itself: switches without end at one instant, no root, no set of branches that obeys all laws."""
MAX_EXCESS_IMPACTS = 1.0
"""Impacts through several contacts, less one for each dt, from which a step that fails is taken to fail of them [-]."""


def chosen(contact: str, manager: ActiveSetManager, locate: str = "root", tolerance: bool = False) -> tuple[str, str]:
    """The strategy that a run begins with and, where it was left open, the reason in a sentence.

    Located instants keep the order of the scheme, however many contacts there are. Where they crowd, or locating fails
    among them, `go_on_unlocated` and the kernel take non-smooth steps, which cost the same whatever happens in them.
    """
    if contact != "auto":
        return contact, ""
    count = sum(item.kind == "unilateral" for item in manager.contacts)
    if count == 0:
        return "events", ""
    several = "contact" if count == 1 else "contacts"
    if tolerance or locate == "linear":
        why = "tol=" if tolerance else "locate='linear'"
        return "events", f"contact='events' was chosen: {why} asks to locate the instants of {count} {several}"
    return "events", (
        f"contact='events' was chosen: the instants of {count} {several} are located, which keeps the order of the "
        "scheme; contact='nonsmooth' takes fixed steps instead"
    )


def may_go_on_unlocated(run: RunData, status: int) -> bool:
    """Whether a step that failed while instants were located is to be taken as a non-smooth one."""
    v = run.kernel
    if run.limit is not None or not v.auto or v.fallback or status <= codes.NOT_FINITE:
        return False
    crowded = crowd(v) > MAX_EXCESS_IMPACTS
    several = np.count_nonzero(v.closed[: v.n_contacts]) >= MIN_CONTACTS  # a single one has no other to be told from
    return bool(crowded or (status in ENDLESS and several))


def go_on_unlocated(run: RunData) -> None:
    """Take non-smooth steps from the accepted state on, before which the step that failed was taken back."""
    v = run.kernel
    v.fallback, v.restart_due = 2, 2
    v.fallback_time = run.now
