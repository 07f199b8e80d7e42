"""How contacts are treated where the user leaves it open."""

from __future__ import annotations

from mbd.kernel.active_set import ActiveSetManager

__all__ = ["MOST_LOCATED", "chosen"]

MOST_LOCATED = 16
"""Unilateral contacts up to which the instants of closing and opening are located by default [-]."""


def chosen(contact: str, manager: ActiveSetManager, locate: str = "root", tolerance: bool = False) -> tuple[str, str]:
    """The strategy and, where it was left open, the reason in a sentence.

    Located events keep the order of the scheme; their work grows with the number of closings, which many contacts
    multiply and no bound limits. Non-smooth steps cost the same whatever happens in them, and impacts are of order one.
    """
    if contact != "auto":
        return contact, ""
    count = sum(item.kind == "unilateral" for item in manager.contacts)
    if count > MOST_LOCATED and tolerance:
        return "events", f"contact='events' was chosen: tol= asks to locate the instants of {count} contacts"
    if count > MOST_LOCATED and locate == "linear":
        return "events", f"contact='events' was chosen: locate='linear' asks to locate the instants of {count} contacts"
    if count > MOST_LOCATED:
        return "nonsmooth", (
            f"contact='nonsmooth' was chosen: with {count} contacts, more than {MOST_LOCATED}, fixed steps cost "
            "less than locating every instant; contact='events' locates them, with second order"
        )
    if count == 0:
        return "events", ""
    several = "contact" if count == 1 else "contacts"
    return "events", (
        f"contact='events' was chosen: the instants of {count} {several} are located, which keeps the order of the "
        "scheme; contact='nonsmooth' takes fixed steps instead"
    )
