"""The impact of an instant, one after the other in clusters that nothing connects (`mbd.equations.clusters`).

What strikes in one cluster says nothing of another: neither which law holds there, nor how much of an energetic
restitution it may give back.
"""

from __future__ import annotations

from mbd.kernel.contact.impact import impact_together
from mbd.kernel.contact.impact_solve import prepare, start_over
from mbd.kernel.records import ContactForces, ContactRows, Sizes, Switching

__all__ = ["impact"]


def impact(K: Switching, slow: bool) -> int:
    """The velocities in K.y jump, by K.jump; impulses, negative where they push, are left in K.impulse.

    Afterwards K.active says which contacts are closed. Non-smooth steps and impulses of users are solved for together.
    """
    prepare(K)
    apart = K.n_clusters > 1 and K.strategy == 0 and K.n_impulses == 0 and strikes_apart(K)
    status = 0
    if apart:
        begin_apart(K)
    for cluster in range(K.n_clusters if apart else 1):
        if apart and not choose(K, cluster):
            continue
        status = impact_together(K, slow)  # called from one place
        if status != 0:
            break
        if apart:
            keep(K, cluster)
    if apart:
        end_apart(K, status == 0)
    if status != 0:
        return status
    for i in range(K.n):
        K.y[i] += K.jump[i]
    K.n_impacts += 1
    return 0


def contacts_at(K: Sizes) -> int:
    """Where in K.kept, which non-smooth steps alone use otherwise, contacts come: closing, then active."""
    return int(K.n + K.n_rows)


def frictions_at(K: Sizes) -> int:
    """The same of frictions: sticks, then slip."""
    return int(contacts_at(K) + 2 * K.n_contacts)


def cluster_of(K: ContactRows, c: int) -> int:
    """The cluster of a unilateral contact; −1 of another."""
    return int(K.cluster[K.n + K.normal[c]]) if K.kind[c] == 0 else -1


def strikes_apart(K: ContactRows) -> bool:
    """Whether unilateral contacts of several clusters close at this instant."""
    first = -1
    for c in range(K.n_contacts):
        if K.closing[c] > 0 and K.kind[c] == 0:
            if first >= 0 and cluster_of(K, c) != first:
                return True
            first = cluster_of(K, c)
    return False


def begin_apart(K: ContactForces) -> None:
    """No jump yet; which contacts close is kept."""
    K.kept[: K.n + K.n_rows] = 0.0
    for c in range(K.n_contacts):
        K.kept[contacts_at(K) + c] = float(K.closing[c])


def choose(K: ContactForces, cluster: int) -> bool:
    """Leave in K.closing the contacts of a cluster that close; whether there are any."""
    found = False
    for c in range(K.n_contacts):
        K.closing[c] = int(K.kept[contacts_at(K) + c]) if cluster_of(K, c) == cluster else 0
        found = found or K.closing[c] > 0
    start_over(K)
    return found


def keep(K: ContactForces, cluster: int) -> None:
    """The jump and the impulses of a cluster, which of its contacts are closed then, and what its frictions do."""
    for i in range(K.n):
        if K.cluster[i] == cluster:
            K.kept[i] = K.jump[i]
    for k in range(K.n_rows):
        if K.cluster[K.n + k] == cluster:
            K.kept[K.n + k] = K.impulse[k]
    for c in range(K.n_contacts):
        if cluster_of(K, c) == cluster:
            K.kept[contacts_at(K) + K.n_contacts + c] = float(K.active[c])
    for f in range(K.n_frictions):
        if K.cluster[K.n + K.friction_row[f]] == cluster:
            K.kept[frictions_at(K) + f] = float(K.sticks[f])
            K.kept[frictions_at(K) + K.n_frictions + f] = K.slip[f]


def end_apart(K: ContactForces, whole: bool) -> None:
    """Which contacts close once more; with `whole`, all that was kept of the clusters that were struck."""
    for c in range(K.n_contacts):
        K.closing[c] = int(K.kept[contacts_at(K) + c])
    if not whole:
        return
    K.jump[: K.n] = K.kept[: K.n]
    K.impulse[: K.n_rows] = K.kept[K.n : K.n + K.n_rows]
    for f in range(K.n_frictions):
        if is_struck(K, int(K.cluster[K.n + K.friction_row[f]])):
            K.sticks[f] = int(K.kept[frictions_at(K) + f])
            K.slip[f] = K.kept[frictions_at(K) + K.n_frictions + f]
    for c in range(K.n_contacts):
        if is_struck(K, cluster_of(K, c)):
            K.active[c] = int(K.kept[contacts_at(K) + K.n_contacts + c])


def is_struck(K: ContactRows, cluster: int) -> bool:
    """Whether a contact of a cluster closes at this instant."""
    found = False
    for c in range(K.n_contacts):
        found = found or (K.closing[c] > 0 and cluster_of(K, c) == cluster)
    return found
