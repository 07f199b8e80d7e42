"""Edges of impacts: what neither pushes nor parts, or comes as fast as another, where a direction decides."""

from mbd.equal import EQUAL_RTOL, HALF_PRECISION_RTOL
from mbd.kernel.contact.branches import is_on
from mbd.kernel.contact.cones import follows, friction_size
from mbd.kernel.contact.impact_solve import is_held_through, speed
from mbd.kernel.records import Kernel
from mbd.sensitivity.tangent.words import edge_place, largest_derivative, without_tangent

EDGE, TIE, NO_REBOUND = 1.0, 2.0, 3.0
"""What is noted: who is on an edge between two branches, who come equally fast, and whose restitution is zero."""


def note(K: Kernel, kind: float, first: int, second: int) -> None:
    """A change decides about the first, about both, or which of both comes first: contacts, frictions behind them.

    What is noted first in a run stays; another one on an edge at that instant stands beside it. Non-smooth steps tell
    no instants, and are not asked.
    """
    place = edge_place(K)
    known = without_tangent(K.starts[place])
    if K.strategy == 0 and known == 0.0:
        K.starts[place] = kind
        K.starts[place + 1] = float(first)
        K.starts[place + 2] = float(second)
        K.starts[place + 3] = without_tangent(K.time)
    elif kind == EDGE and known == EDGE and without_tangent(K.starts[place + 3]) == without_tangent(K.time):
        if without_tangent(K.starts[place + 1]) != first and without_tangent(K.starts[place + 2]) < 0.0:
            K.starts[place + 2] = float(first)


def is_edge(value: float, size: float, sizes: float) -> bool:
    """Whether a value is zero, of such a size, and a derivative of it is not, of such sizes."""
    return abs(value) <= EQUAL_RTOL * size and largest_derivative(value) > HALF_PRECISION_RTOL * sizes


def note_edges(K: Kernel) -> None:
    """Note who obeys its law in the phase of an impact just found, but on an edge between two branches."""
    most = 1e-300
    much = 1e-300
    fast = 1e-300
    for k in range(K.n_rows):
        pushed = K.impulse[k] + K.given[k]
        most = max(most, abs(without_tangent(pushed)))
        much = max(much, largest_derivative(pushed))
    for i in range(K.n):
        fast = max(fast, largest_derivative(K.y[i] + K.total_jump[i] + K.jump[i]))
    for c in range(K.n_contacts):
        row = K.normal[c]
        if K.free[c] > 0 and K.active[c] == 1 and K.parting[c] == 0:
            if is_edge(K.impulse[row], most, much):
                note(K, EDGE, c, -1)
        elif K.free[c] > 0 and is_edge(speed_left(K, row), terms_of(K, row), fast):
            note(K, EDGE, c, -1)
    for f in range(K.n_frictions):
        if K.loose[f] == 0 or not is_on(K, f) or follows(K, f):
            continue
        if K.sticks[f] == 1:
            if K.limit[f] > 0.0 and is_edge(K.limit[f] - friction_size(K, f, K.impulse), most, much):
                note(K, EDGE, K.n_contacts + f, -1)
        elif is_edge(speed_along(K, f), terms_of(K, K.friction_row[f]), fast):
            note(K, EDGE, K.n_contacts + f, -1)


def speed_left(K: Kernel, row: int) -> float:
    """What the law of a row makes zero: its speed after the phase, with e times that before."""
    value = K.bias[row]
    for j in range(K.n):
        value += K.acc[K.acc_B + row * K.n + j] * K.jump[j]
    return float(value)


def speed_along(K: Kernel, f: int) -> float:
    """Speed after the phase along the direction in which the group of a friction slides."""
    value = 0.0
    for g in range(f, f + K.group_size[f]):
        value += K.slip[g] * speed_left(K, K.friction_row[g])
    return float(value)


def terms_of(K: Kernel, row: int) -> float:
    """The sum of the sizes of its terms."""
    size = 0.0
    for j in range(K.n):
        size += abs(without_tangent(K.acc[K.acc_B + row * K.n + j])) * (
            abs(without_tangent(K.y[j])) + abs(without_tangent(K.jump[j]))
        )
    return size


def change_of(K: Kernel, row: int) -> float:
    """The largest derivatives of the terms of a speed, added up."""
    size = 0.0
    for j in range(K.n):
        slope = K.acc[K.acc_B + row * K.n + j]
        rate = K.y[j] + K.total_jump[j]
        size += abs(without_tangent(slope)) * largest_derivative(rate)
        size += abs(without_tangent(rate)) * largest_derivative(slope)
    return size


def note_order(K: Kernel, fastest: float, ends: bool) -> None:
    """Note contacts of the sequential law that approach equally fast; as it `ends`, those that neither do nor part.

    Those that act in the next impact are K.active, those that take part K.touched.
    """
    first = -1
    size = 0.0
    chooses = False
    for c in range(K.n_contacts):
        if K.touched[c] == 1:
            size = max(size, change_of(K, K.normal[c]))
        chooses = chooses or (K.touched[c] == 1 and K.active[c] == 1 and not is_held_through(K, c))
    for c in range(K.n_contacts):
        if K.touched[c] == 0:
            continue
        rate = speed(K, K.normal[c])
        if ends:
            if not is_held_through(K, c) and is_edge(rate, fastest, size):
                note(K, EDGE, c, -1)
        elif K.active[c] == 1 and chooses:
            if first >= 0 and differs(K, first, c, size):
                note(K, TIE, first, c)
            first = c if first < 0 else first


def differs(K: Kernel, first: int, c: int, size: float) -> bool:
    """Whether a direction tells apart how fast two contacts approach."""
    return largest_derivative(approach(K, c) - approach(K, first)) > HALF_PRECISION_RTOL * size


def approach(K: Kernel, c: int) -> float:
    """How fast a contact approaches; one that is held counts either way."""
    rate = speed(K, K.normal[c])
    return abs(rate) if is_held_through(K, c) else -rate


def note_zero(K: Kernel, c: int, value: float) -> None:
    """Note a contact whose restitution is zero where a direction changes what it gives back."""
    if value == 0.0 and largest_derivative(value) > 0.0:
        note(K, NO_REBOUND, c, -1)
