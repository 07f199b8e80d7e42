"""Whether located impacts crowd, as in a pile, whose contacts close and open faster than they can be told apart.

An impact among contacts that are closed already makes them take part in it, and those that it opens strike again.
The more contacts lie on each other, the more such impacts follow until all rest, closer and closer; at last some
contacts touch by round-off only, and rows seem independent that are not. Contacts that strike apart from each other,
however many, take part in no other's impact. What is counted depends on the motion alone: a run decides at the same
instant wherever it is cut.
"""

from mbd.equal import NOMINAL_RTOL
from mbd.kernel.records import Guards, Switching

MAX_EXCESS_IMPACTS = 64.0
"""Impacts through several contacts, less one for each dt, from which on steps are non-smooth [-]."""
MIN_CONTACTS = 2
"""Contacts closed already that take part in such an impact [-]."""


def crowd(K: Guards) -> float:
    """Impacts through several contacts, less one for each dt since."""
    since = K.time - K.crowding_time if K.crowding > 0.0 else 0.0  # nothing was counted before the first impact
    return float(max(K.crowding - since / K.dt, 0.0))


def count_impact(K: Switching) -> None:
    """Count the impact of this instant, whose impulses are in K.impulse, if it goes through several closed contacts."""
    largest = 0.0
    for c in range(K.n_contacts):
        if K.kind[c] == 0:
            largest = max(largest, abs(K.impulse[K.normal[c]]))
    several = 0
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.closing[c] == 0 and abs(K.impulse[K.normal[c]]) > NOMINAL_RTOL * largest:
            several += 1
    if several >= MIN_CONTACTS:
        K.crowding = crowd(K) + 1.0
        K.crowding_time = K.time


def crowds(K: Guards) -> bool:
    """Whether non-smooth steps follow from now on, as impacts have crowded; said once."""
    if K.auto == 0 or K.fallback > 0 or K.crowding <= MAX_EXCESS_IMPACTS:
        return False
    K.fallback = 1
    K.fallback_time = K.time
    return True
