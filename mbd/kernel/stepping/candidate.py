"""The candidate of a step and the accepted state, the one taken for the other; numbers carried there and back."""

from typing import Any

from mbd.kernel.records import Events, Guards, Kernel, State


def carry(values: Any, kept: Any, place: int, count: int, out: bool) -> int:
    """Copy one array to its place among what is kept (`out`), or back; where the next one goes."""
    for i in range(count):
        if out:
            kept[place + i] = values[i]
        else:
            values[i] = kept[place + i]
    return place + count


def accept_candidate(K: Guards, t1: float) -> None:
    """The candidate becomes the accepted state ahead of a restart: what the scheme remembers stays behind."""
    exchange(K, False)
    K.time = t1
    accept_guards(K)


def accept_guards(K: Events) -> None:
    """Guards of the candidate become those of the accepted state."""
    K.guards0[: K.n_watched] = K.guards1[: K.n_watched]


def revert_candidate(K: Kernel) -> None:
    """The candidate becomes the accepted state itself: an event at the very start of the step."""
    exchange(K, True)
    K.aux1[: K.n] = K.aux[: K.n]
    K.guards1[: K.n_watched] = K.guards0[: K.n_watched]


def exchange(K: State, out: bool) -> None:
    """q, (v, z), their rates and multipliers of the accepted state into the candidate, or back."""
    carry(K.q, K.q1, 0, K.n_q, out)
    carry(K.y, K.y1, 0, K.n, out)
    carry(K.rate, K.rate1, 0, K.n, out)
    carry(K.lam, K.lam1, 0, K.n_rows, out)
