"""Whether what a step did not predict grows: by forces that feed it, or by an explicit step beyond its stability.

With the change D of (v, z) that the previous accelerations did not predict, and what accelerations a owe to it,

``ζ = h D·M (a(y₁) − a(y₁ − D)) / D·M D``.

A force that depends on time has ζ = 0, a stiff spring or damper ζ < 0, ``v̇ = c v`` has ζ = c h: more than `MAX_GROWTH`
grows by more than e in a step, which no scheme of order 2 follows. Explicit schemes follow a stiff spring or damper up
to their bound of stability only.
"""

from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.algebra.saddle import solve_rows
from mbd.kernel.codes import COMPOSE
from mbd.kernel.hooks import call
from mbd.kernel.records import Guards, Kernel, SchemeAbilities, Switching
from mbd.kernel.stepping.restart import consistent, stepping_rows
from mbd.kernel.stepping.scales import still_energy

MAX_GROWTH = 0.8
"""ζ in a whole step that the trapezoidal rule still follows; less where the error of a scheme is larger [-]."""
TRAPEZOID_ERROR = 1.0 / 12.0
"""Constant of its error, in h³ times the rate of accelerations [-]."""


def note_unforeseen(K: Kernel, h: float, t1: float, at_y: int, at_D: int) -> bool:
    """D and a(y₁), in K.inside and K.trial_jump, of the candidate (q₁, y₁) in K.inside; false where there are none."""
    if consistent(K, t1, K.q1, K.y1) != 0:
        return False
    for i in range(K.n):
        K.trial_jump[i] = K.jump[i]  # as exact as can be: the step's own rates err by its tolerance
        K.inside[at_D + i] = K.inside[at_y + i] - K.y[i] - h * (K.rate[i] + 0.5 * h * K.slope[i])
    if K.n_active > 0:
        leave_rows_alone(K, at_D)
    return True


def outgrows(K: Switching, h: float, t1: float, stretch: float, at_y: int, at_D: int) -> bool:
    """Whether the change that was not predicted feeds itself by over `MAX_GROWTH`; `note_unforeseen` has found it."""
    n = K.n
    part = 1.0
    while part >= 1.0 / 4096.0:  # least part of D that is tried where accelerations are not finite at its other end
        take_back(K, at_y, at_D, part, 0.5 * h * part)
        if consistent(K, t1, K.q1, K.y1) == 0:
            moved = largest_growth(K, h, stretch, part, at_D, 0, K.n_v)
            states = growth_of_states(K, h, t1, stretch, part, at_y, at_D) if n > K.n_v else 0.0
            K.unforeseen_change = max(moved, states)
            return max(moved, states) > resolved_growth(K)
        part *= 0.0625
    return False


def take_back(K: Guards, at_y: int, at_D: int, part: float, time: float) -> None:
    """The candidate in K.inside without a part of D in its rates, and without D over a time in its places: (q1, y1)."""
    for i in range(K.n):
        K.y1[i] = K.inside[at_y + i] - part * K.inside[at_D + i]
    if K.vector == 1:
        for i in range(K.n_q):
            K.q1[i] = K.inside[i] - time * K.inside[at_D + i]
        return
    K.block[K.o_q : K.o_q + K.n_q] = K.inside[: K.n_q]
    for i in range(K.n_v):
        K.block[K.o_x + i] = -time * K.inside[at_D + i]
    call(K, COMPOSE, K.q1)


def growth_of_states(K: Switching, h: float, t1: float, stretch: float, part: float, at_y: int, at_D: int) -> float:
    """ζ of the first-order states alone: what they owe to the change of the motion, as ``ż = v``, is no growth."""
    for i in range(K.n):
        K.y1[i] = K.inside[at_y + i] - (part * K.inside[at_D + i] if i >= K.n_v else 0.0)
    K.q1[: K.n_q] = K.inside[: K.n_q]
    if consistent(K, t1, K.q1, K.y1) != 0:
        return 0.0
    return largest_growth(K, h, stretch, part, at_D, K.n_v, K.n)


def leave_rows_alone(K: Switching, at_D: int) -> None:
    """Take from D what moves rows: no motion, but what index 3 leaves of velocities; K.acc is at the candidate."""
    K.force[: K.n] = 0.0
    for k in range(K.n_rows):
        K.bias[k] = 0.0
        for j in range(K.n):
            K.bias[k] += K.acc[K.acc_B + k * K.n + j] * K.inside[at_D + j]
    if solve_rows(K, stepping_rows(K), False) == 0:
        for i in range(K.n):
            K.inside[at_D + i] += K.jump[i]


def resolved_growth(K: SchemeAbilities) -> float:
    """`MAX_GROWTH`, less where the error of the scheme is larger than that of the trapezoidal rule."""
    error = abs(K.error_constant)
    return MAX_GROWTH * TRAPEZOID_ERROR / error if error > TRAPEZOID_ERROR else MAX_GROWTH


def largest_growth(K: Switching, h: float, stretch: float, part: float, at_D: int, first: int, last: int) -> float:
    """The largest ζ of a cluster, over some components, or 0."""
    largest = 0.0
    for c in range(K.n_clusters):
        largest = max(largest, growth_between(K, h, stretch, part, at_D, first, last, c))
    return largest


def growth_between(
    K: Switching, h: float, stretch: float, part: float, at_D: int, first: int, last: int, cluster: int
) -> float:
    """ζ of the module's text over some components of a cluster, over a whole step.

    K.trial_jump has a(y₁), K.jump a(y₁ − part D).
    """
    fed = 0.0
    size = 0.0
    for i in range(first, last):
        for j in range(first, last if K.cluster[i] == cluster else first):
            weight = K.inside[at_D + i] * K.acc[i * K.n + j]
            fed += weight * (K.trial_jump[j] - K.jump[j])
            size += weight * K.inside[at_D + j]
    if size <= (2.0 * still_energy(K) if first < K.n_v else 0.0):  # in a mechanism at rest round-off feeds itself
        return 0.0
    return float(h * stretch * fed / (part * size))


def is_unstable(K: Switching, h: float, t1: float, at_y: int, at_D: int) -> bool:
    """Whether an explicit step amplifies D, as `note_unforeseen` has it: |μ| in K.unforeseen_change above K.stability.

    Along D of a cluster the forces are those of a spring and a damper, ω² and δ by differences of accelerations at the
    candidate, and ``μ² + h δ μ + h² ω² = 0``: where a root is beyond the region of stability, so is one of the whole
    mechanism, as these are Rayleigh quotients. What was not predicted then grows from step to step, by |μ|^p/p! with
    order p.
    """
    take_back(K, at_y, at_D, 1.0, 0.0)
    if consistent(K, t1, K.q1, K.y1) != 0:
        return False
    for c in range(K.n_clusters):
        K.damping[c] = -growth_between(K, h, 1.0, 1.0, at_D, 0, K.n_v, c)
    take_back(K, at_y, at_D, 0.0, 0.5 * h)
    if consistent(K, t1, K.q1, K.y1) != 0:
        return False
    K.unforeseen_change = 0.0
    for c in range(K.n_clusters):
        damping = K.damping[c]
        square = -2.0 * growth_between(K, h, 1.0, 1.0, at_D, 0, K.n_v, c)
        inside = 0.25 * damping * damping - square
        largest = 0.5 * abs(damping) + sqrt(inside) if inside > 0.0 else sqrt(square)
        if max(damping, square) > 0.0:
            K.unforeseen_change = max(K.unforeseen_change, largest)
    return K.unforeseen_change > K.stability
