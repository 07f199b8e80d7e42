"""Whether the change of a step has led across a place from which forces push back: another solution of its equations.

Where forces change by more than themselves within dt, the equations of an implicit step have several solutions, of
which one continues the motion: ``v̇ = c (v − v³)`` leads any v > 0 to 1, but v = −1 solves them as well. With the change
D of rates, and with s = 0 … 1 along it at the time of the end,

    e(s) = h D·M a(q₁ ⊖ (1 − s) h D/2, y₁ − (1 − s) D) / D·M D

are the forces along D over those that make D in h. Where e < 0 and further on e > 0, with a rise beyond that which a
step follows (`growth`), the motion would not have passed; friction that falls with speed has such a rise too, with
e > 0 on all the way.
"""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.records import Guards, Reals, Switching
from mbd.kernel.schemes.iteration import MAX_UNEXPLAINED_CHANGE, MIN_RATE_SHARE
from mbd.kernel.stepping.candidate import carry
from mbd.kernel.stepping.growth import MAX_GROWTH, leave_rows_alone, take_back
from mbd.kernel.stepping.restart import consistent, evaluate

PLACES_A_SIDE = 11
"""Places along D on either side of its middle: seven sixteenths, then halves of what is left, and its end."""


def crosses_barrier(K: Switching, h: float, t1: float, at_y: int, at_D: int) -> bool:
    """Whether the candidate in K.inside is behind such a place in a cluster; K.inside has D from `at_D` on then."""
    carry(K.q1, K.inside, 0, K.n_q, False)
    carry(K.y1, K.inside, at_y, K.n, False)
    evaluate(K, t1, K.q1, K.y1)
    for i in range(K.n):
        K.inside[at_D + i] = K.inside[at_y + i] - K.y[i]
    if K.n_active > 0:
        leave_rows_alone(K, at_D)
    # forces that make D, and that change little along half of it
    even = True
    for c in range(K.n_clusters):
        K.damping[c] = forces_along(K, h, K.rate1, at_y, at_D, c)
        mean = 0.5 * (K.damping[c] + forces_along(K, h, K.rate, at_y, at_D, c))
        even = even and abs(mean - 1.0) <= MAX_UNEXPLAINED_CHANGE
    if even:
        take_back(K, at_y, at_D, 0.5, 0.25 * h)
        even = consistent(K, t1, K.q1, K.y1) == 0
        for c in range(K.n_clusters):
            rise = abs(K.damping[c] - forces_along(K, h, K.jump, at_y, at_D, c))
            even = even and rise <= 0.5 * MAX_GROWTH
    if even:
        return False
    for c in range(K.n_clusters):
        K.damping[c] = 1e300
    # all of the way, from its end back to the start
    for place in range(-PLACES_A_SIDE, PLACES_A_SIDE + 1):
        away = abs(place)
        part = 0.0625 * away if away < 7 else 0.5 - (0.5 ** (away - 3) if away < PLACES_A_SIDE else 0.0)
        part = 0.5 + part if place > 0 else 0.5 - part
        take_back(K, at_y, at_D, part, 0.5 * h * part)
        if consistent(K, t1, K.q1, K.y1) == 0:
            for c in range(K.n_clusters):
                if pushes_back(K, h, part, at_y, at_D, c):
                    return True
    return False


def forces_along(K: Guards, h: float, rates: Reals, at_y: int, at_D: int, cluster: int) -> float:
    """e of a cluster with these accelerations; 1 where D is a share of its velocities that hardly counts."""
    size = 0.0
    motion = 0.0
    push = 0.0
    for i in range(K.n_v):
        for j in range(K.n_v if K.cluster[i] == cluster else 0):
            push += K.inside[at_D + i] * K.acc[i * K.n + j] * rates[j]
            size += K.inside[at_D + i] * K.acc[i * K.n + j] * K.inside[at_D + j]
            motion += K.inside[at_y + i] * K.acc[i * K.n + j] * K.inside[at_y + j]
    return h * push / size if size > MIN_RATE_SHARE * MIN_RATE_SHARE * motion else 1.0


def pushes_back(K: Switching, h: float, part: float, at_y: int, at_D: int, cluster: int) -> bool:
    """Whether e < 0 here and e > 0 further on, with the rise of the module's text in between.

    K.jump has a at this place, K.damping the least of ``MAX_GROWTH s − e`` further on. Forces that are round-off beside
    their terms push nowhere.
    """
    work = 0.0
    terms = 0.0
    for i in range(K.n_v):
        for j in range(K.n_v if K.cluster[i] == cluster else 0):
            work += K.inside[at_D + i] * K.acc[i * K.n + j] * K.jump[j]
        terms += abs(K.inside[at_D + i]) * K.scale[i] if K.cluster[i] == cluster else 0.0
    if abs(work) <= HALF_PRECISION_RTOL * terms:
        return False
    e = forces_along(K, h, K.jump, at_y, at_D, cluster)
    level = MAX_GROWTH * (1.0 - part) - e
    if e > 0.0:
        K.damping[cluster] = min(K.damping[cluster], level)
        return False
    return bool(K.damping[cluster] < level)
