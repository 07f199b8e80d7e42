"""The size of a step next to a singular configuration, which has to lie between two stages of a scheme.

The widest gap between the nodes of a scheme is where it lies best, at K.middle. The steps before are shortened for
that, those behind go on from where this one ends. Where steps of the grid are so short that round-off counts at its
ends, the one over the singularity is longer; where round-off counts even so, the run ends.

The singularity is where a row of B depends on earlier ones: where its part w beside these, found by Gram–Schmidt on
columns scaled by √M_ii, passes zero. |w| at the ends of steps tells where it falls fast enough; then w is found along
``q + τ v + τ²/2 v̇`` as well, and where it vanishes by a secant.
"""

from mbd.kernel.algebra.column_weights import counted_inertia, least_inertia
from mbd.kernel.algebra.orthogonal import clear_row, square
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import EPS, PASSING
from mbd.kernel.records import (
    DependentRows,
    Equations,
    LinearAlgebra,
    Mechanism,
    Motion,
    Reals,
    SchemeAbilities,
    SingularSteps,
    Steps,
)
from mbd.kernel.schemes.iteration import note_fastest
from mbd.kernel.singular.gram_norms import gram_norms
from mbd.kernel.stepping.restart import compose, evaluate, fill_block

MAX_STEPS_CHECKED = 3.5
"""Steps to a singularity, as the last step tells, below which is looked closer [-]."""
MAX_CERTAIN_STEPS = 6.0
"""Steps to it below which it is taken for one; beyond, where nothing else asks for it, it may be none [-]."""
MAX_NOISY_STEPS = 14.0
"""The same where round-off asks for longer steps over the singularity; of a scheme K.far_look [-]."""
NOISE_GROWTH = 16.0
"""What round-off of a row makes of velocities over what it would if it were one unit in the last place [-]."""
NOISE_RTOL = 1e-9
"""Share of velocities that round-off may make up before the step over a singularity is longer than others [-]."""
MAX_NOISE = 1e-5
"""The same above which a step over a singularity is refused [-]."""
MAX_LONG_STEP_ERROR = 1e-8
"""Share of velocities by which a step over a singularity that is longer than others may err [-]."""
MIN_STEP_SHARE = 0.1
"""Part of a step below which none is made to lead up to a singularity [-]."""
MIN_NODE_DISTANCE = 0.06
"""Part of a step by which a singularity must be away from all nodes [-]."""
PLACE_RTOL = 0.01
"""Part of a step by which the last of these may differ from where w vanishes [-]."""
VANISHING_RATIO = 0.2
"""Length of w at a singularity, over that of now: more, and rows only come close to losing rank [-]."""
NEVER = 1e300
"""Time to a singularity where there is none [s]."""


def may_take_long_step(K: SchemeAbilities) -> bool:
    """Whether a step over a singularity may be longer than others: of most schemes only where no guard is watched."""
    return bool(K.n_watched == 0 or K.stretches == 1)


def forget_row_norms(K: DependentRows) -> None:
    """Nothing is known at the start of the scheme: whether a singularity is near is looked at before the first step."""
    K.singular_time = -NEVER
    K.misfit = 0.0
    for k in range(K.n_rows):
        K.left[k] = -1.0
    K.left[K.n_active] = 1.0


def note_row_norms(K: DependentRows) -> None:
    """|w| of each row at the candidate, at which K.acc is, and the motion beside it, for `accept_row_norms`.

    What rows that depend on others miss there counts like round-off of these: a leg that does not fit quite.
    """
    m = K.n_active
    K.misfit = 0.0
    for k in range(K.n_rows):
        if K.dropped[k] == 1 and K.row_level[k] == 0:
            K.misfit = max(K.misfit, abs(K.acc[K.acc_h + k]))
    row_norms_alone(K, m)
    for c in range(K.n_clusters):
        K.fastest[c] = 0.0  # the motion of each cluster, once for all of its rows: see `motion`
    for j in range(K.n_v):
        K.fastest[K.cluster[j]] += abs(K.acc[j * K.n + j]) * K.y1[j] * K.y1[j]
    for k in range(m):
        K.left1[k] = K.work[k]
        K.left1[m + k] = sqrt(K.fastest[K.cluster[K.n + K.rows[k]]]) + 1e-300


def accept_row_norms(K: DependentRows, h: float) -> None:
    """The candidate is accepted after a step of h: |w| of each row, and whether one falls to a singularity.

    K.left[m] = 1 where it is to be looked for, else 0.
    """
    m = K.n_active
    near = 0.0
    for k in range(m):
        fall = K.left[k] - K.left1[k]
        if K.left[k] < 0.0 or K.left1[k] < MAX_STEPS_CHECKED * fall:
            near = 1.0
        elif K.left1[k] < K.far_look * fall and K.adaptive == 0 and may_take_long_step(K):
            reach = sqrt(noise_coefficient(K, k, fall / h, K.left1[m + k]) / NOISE_RTOL)
            if reach > K.middle * h and K.left1[k] * h < (2.0 * reach + MAX_STEPS_CHECKED * h) * fall:
                near = 1.0
        K.left[k] = K.left1[k]
    K.left[m] = near


def motion(K: Motion, y: Reals, k: int) -> float:
    """√(Σ M_jj v_j²) of the cluster of row k of those in K.rows, of the size of √(2 T), with M in K.acc."""
    size = 0.0
    for j in range(K.n_v):
        if K.cluster[j] == K.cluster[K.n + K.rows[k]]:
            size += abs(K.acc[j * K.n + j]) * y[j] * y[j]
    return float(sqrt(size) + 1e-300)


def larger_motion(K: Motion, k: int) -> float:
    """The larger one of that in K.y and that in K.y1: it may start from rest."""
    return max(motion(K, K.y, k), motion(K, K.y1, k))


def noise_coefficient(K: Motion, k: int, fall: float, speed: float) -> float:
    """c [s²] of the share c/τ² of the velocities that round-off makes of them where a step ends τ from a singularity.

    Round-off δ of a row leaves positions open by δ/|w|; ḣ = 0 makes velocities δ/(|w| τ) of that, with |w| = fall τ. So
    does what rows miss that depend on it.
    """
    turned = 1.0
    for i in range(K.n_v if K.vector == 1 else 0):  # quaternions do not grow
        if K.unit[i] == 1 and K.cluster[i] == K.cluster[K.n + K.rows[k]]:
            turned = max(turned, abs(K.q[i]))
    noise = NOISE_GROWTH * EPS * turned * K.scale[K.n + K.rows[k]]
    return float(max(noise, K.misfit) / (fall * speed + 1e-300))


def weigh_columns(K: Equations) -> None:
    """1/√M_jj into K.spare, with M in K.acc."""
    least_mass = least_inertia(K, K.acc, 0, K.n + 1, 0)
    least_turning = least_inertia(K, K.acc, 0, K.n + 1, 1)
    for j in range(K.n):
        weight = counted_inertia(K, j, K.acc[j * K.n + j], least_mass, least_turning)
        K.spare[j] = 1.0 / sqrt(weight) if weight > 0.0 else 1.0


def load_row(K: DependentRows, k: int) -> None:
    """Row k of those in K.rows, of B in K.acc, on the columns weighed by `weigh_columns`, into line k of K.basis."""
    n = K.n
    row = K.acc_B + K.rows[k] * n
    for j in range(n):
        K.basis[k * n + j] = K.acc[row + j] * K.spare[j]


def row_norms(K: DependentRows, m: int) -> None:
    """Gram–Schmidt on the rows of B in K.acc, in their order: |w| into K.work, w/|w| into K.basis."""
    n = K.n
    weigh_columns(K)
    for k in range(m):
        load_row(K, k)
        for i in range(k):
            clear_row(K.basis, k * n, i * n, n)
        left = sqrt(square(K.basis, k * n, n))
        K.work[k] = left
        inverse = 1.0 / (left + 1e-300)
        for j in range(n):
            K.basis[k * n + j] *= inverse


def row_norms_alone(K: DependentRows, m: int) -> None:
    """|w| into K.work without its directions, by products of rows: see `mbd.kernel.singular.gram_norms`."""
    n = K.n
    weigh_columns(K)
    for k in range(m):
        load_row(K, k)
        length = sqrt(square(K.basis, k * n, n)) + 1e-300
        count = 0
        for j in range(n):
            if K.basis[k * n + j] != 0.0:
                K.basis[k * n + j] /= length
                count += 1
                K.support[k * (n + 1) + count] = j
        K.support[k * (n + 1)] = count
        K.columns[k] = k
        K.work[k] = length
    gram_norms(K, m, n, n, n + m, False)
    for k in range(m):
        K.work[k] *= K.spare[n + k]


def evaluate_ahead(K: Mechanism, ahead: float) -> None:
    """K.acc at the state that is `ahead` of the accepted one, along its velocities and accelerations."""
    fill_block(K, K.time, K.q, K.y)
    for i in range(K.n_v):
        K.block[K.o_x + i] = ahead * (K.y[i] + 0.5 * ahead * K.rate[i])
    compose(K, K.q1)
    for i in range(K.n):
        K.y1[i] = K.y[i] + ahead * K.rate[i]
    evaluate(K, K.time + ahead, K.q1, K.y1)


def times_to_singularities(K: SingularSteps, m: int, unit: float) -> float:
    """Times from now to where each row comes to depend on others, into K.work[m:2m]; the first.

    K.velocity_noise is its c.
    """
    n = K.n
    evaluate_ahead(K, 0.0)
    row_norms(K, m)
    K.turning[: m * n] = K.basis[: m * n]
    for k in range(m):
        K.work[2 * m + k] = K.work[k]
        K.work[m + k] = NEVER
    ahead = unit
    first = NEVER
    for _ in range(4):
        evaluate_ahead(K, ahead)
        row_norms(K, m)
        first = NEVER
        for k in range(m):
            along = 0.0
            for j in range(n):
                along += K.basis[k * n + j] * K.turning[k * n + j]
            here = K.work[2 * m + k]
            fall = here - along * K.work[k]
            until = ahead * here / fall if fall > 1e-3 * here else NEVER
            if abs(until - ahead) < 0.1 * ahead and K.work[k] > VANISHING_RATIO * here:
                until = NEVER
            K.work[m + k] = until
            first = min(first, until)
        if first > horizon(K, m, unit, first) or abs(first - ahead) < PLACE_RTOL * unit:
            break
        ahead = first
    K.velocity_noise = 0.0
    for k in range(m):
        if K.work[m + k] < 1.1 * first and first < NEVER:
            K.velocity_noise += noise_coefficient(K, k, K.work[2 * m + k] / K.work[m + k], larger_motion(K, k))
    return first


def horizon(K: Equations, m: int, unit: float, first: float) -> float:
    """Time beyond which none is looked for: nothing is arranged so early, and the motion is not known so far."""
    limit = 4.0 * MAX_NOISY_STEPS * unit
    if K.stretches == 1 and first < NEVER:
        for k in range(m):
            if K.work[m + k] == first:
                noise = noise_coefficient(K, k, K.work[2 * m + k] / first, larger_motion(K, k))
                reach = sqrt(noise / NOISE_RTOL)
                limit = max(limit, 4.0 * min(reach, K.longest_over * unit))
    return limit


def singular_step_size(K: SingularSteps, unit: float, longest: float) -> float:
    """The step to take in place of one of this size, so that no stage is next to a singularity; `unit` far off.

    Where round-off would make much of velocities that near, the step over the singularity lasts up to `longest` units.
    """
    m = K.n_active
    K.near_singular = 0
    K.velocity_noise = 0.0
    if K.left[m] == 0.0:
        return unit
    first = times_to_singularities(K, m, unit)
    limit = horizon(K, m, unit, first)
    stretched = limit > 4.0 * MAX_NOISY_STEPS * unit and first <= limit
    if K.stretches == 0 or first <= MAX_CERTAIN_STEPS * unit or stretched:
        K.singular_time = K.time + first
    span = unit
    if may_take_long_step(K):
        span = min(max(sqrt(K.velocity_noise / NOISE_RTOL) / K.middle, unit), longest * unit)
    rest = (first - K.middle * span) / unit
    if rest >= 2.0:
        K.velocity_noise = 0.0  # far: what may come of it is judged nearer
        return unit
    if rest > 1.0:
        return 0.5 * rest * unit
    if rest >= MIN_STEP_SHARE:
        return rest * unit
    K.near_singular = PASSING
    return clearest(K, m, span, min(1.0, first / K.middle / span))


def noise_share(K: DependentRows, h: float) -> float:
    """Share of the velocities that round-off makes of them in a step of size h to or over it; 0 far off."""
    if K.velocity_noise == 0.0:
        return 0.0
    away = K.singular_time - K.time - h
    return float(min(K.velocity_noise / (away * away + 1e-300), 1.0))


def is_too_noisy(K: SingularSteps, h: float) -> bool:
    """Whether round-off makes too much of velocities in such a step; K.detail then tells when, where, how much."""
    share = noise_share(K, h)
    if share <= MAX_NOISE:
        return False
    m = K.n_active
    first = times_to_singularities(K, m, h)
    for k in range(m):
        if K.work[m + k] == first:
            K.failure_index = K.n + k
    K.failure_time = K.singular_time
    K.failure_size = share
    K.failure_step = h
    return True


def is_resolved(K: Steps, h: float) -> bool:
    """Whether the candidate errs little enough after a step over a singularity that was longer than others."""
    note_fastest(K, True)
    for i in range(K.n):
        size = max(max(abs(K.y[i]), abs(K.y1[i])), h * abs(K.rate[i]))
        if i < K.n_v:
            size = K.fastest[K.cluster[i]]
        if not abs(K.error[K.n_v + i]) <= MAX_LONG_STEP_ERROR * size:
            return False
    return True


def clearest(K: LinearAlgebra, m: int, unit: float, wanted: float) -> float:
    """The step over singularities nearest below the wanted part of a unit with none of them close to a node."""
    best = wanted
    widest = -1.0
    for k in range(17):
        part = wanted * (1.0 - 0.05 * k)
        clear = 0.5 * K.middle
        for row in range(m):
            place = K.work[m + row] / (part * unit)
            clear = min(clear, clearance(K, place))
        if clear > widest + 1e-9:
            best = part
            widest = clear
        if widest >= MIN_NODE_DISTANCE:
            break
    return best * unit


def clearance(K: SchemeAbilities, place: float) -> float:
    """Distance of a place, part of a step, from the nearest node or the end [-]."""
    clear = abs(place - 1.0)
    for node in range(K.n_nodes):
        clear = min(clear, abs(place - K.nodes[node]))
    return clear
