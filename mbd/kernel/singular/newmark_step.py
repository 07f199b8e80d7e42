"""The Newmark family next to a singular configuration: a few steps of the stabilized form taken as index 3.

Within `MAX_STEPS_AWAY` steps of it h alone is held, with ∂h/∂x = B = H − (c_K/c_C) ∂ḣ/∂x; then the velocities are
projected onto the rows and the scheme starts again, but for the average that it carries. See `mbd.kernel.singular`.
"""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.algebra.linear import factor
from mbd.kernel.algebra.ordered import OF_TANGENT, clear_tangent, factor_ordered, order_at, solve_kkt, weakest_pivot
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import EPS, LEFT, NOT_CONVERGED, NOT_FINITE, PASSING, SINGULAR
from mbd.kernel.hooks import call
from mbd.kernel.records import DependentRows, Equations, Kernel, Motion, SingularSteps
from mbd.kernel.schemes.iteration import (
    MAX_ITERATIONS,
    finish,
    is_below_floors,
    overturns,
    predict,
    residual_size,
    runs_away,
    soundness_at,
)
from mbd.kernel.singular.gram_norms import pivoted_gram_norms
from mbd.kernel.singular.step_pairs import is_of_pair, is_whole
from mbd.kernel.stepping.restart import (
    add_shares,
    note_scales,
    raise_scales,
    restore_scales,
    retain_scales,
    share_loads,
)
from mbd.kernel.stepping.scales import still_speed
from mbd.kernel.tangent_rules import further_corrections, is_differentiated

MAX_STEPS_AWAY = 4.0
"""Steps to a singular configuration, at the present speed, below which positions alone are held [-]."""
MIN_STEPS_AWAY = 0.2
"""Steps from one below which no step ends where round-off of h makes too much of rates [-]."""
MIN_PREDICTED_STEPS_AWAY = 0.25
"""The same, of the end of a step still to come: more, since how far the singularity is then is only estimated [-]."""
VANISHING_RATIO = 0.5
"""What is left of a row where it should vanish, over that of now: more, and there is no singularity [-]."""
VELOCITY_RTOL = 0.05
"""Part of the speed by which a step near it may differ from its prediction: the branch goes on in v [-]."""


def steps_by_pivot(K: DependentRows, m: int, straight: bool) -> float:
    """Steps until the smallest pivot of the rows vanishes, if it goes on as since the last step; a cheap first look.

    Pivots in an order given beforehand tell their own; where they gave way to a search for pivots, they do not compare:
    then it may be now.
    """
    size = K.n + m
    largest = 0.0
    if straight:
        largest = K.out[soundness_at(K, m) + 1]
    elif K.order_start > 0:
        largest = weakest_pivot(K)
    else:
        for k in range(K.n, size):  # the inverses are on the diagonal
            largest = max(largest, abs(K.kkt[k * size + k]))
        if K.correction_program > 0 or order_at(K, m) > 0:
            K.inverse_pivot = 0.0
            return 0.0
    before = K.inverse_pivot
    K.inverse_pivot = largest
    return float(before / (largest - before)) if largest > before else 1e300


def steps_to_singularity(K: SingularSteps, m: int, h: float, ratio: float, straight: bool) -> float:
    """Steps of size h until a row of B depends on the others: how far it is from that, over what a step changes of it.

    1e300 where the row does not vanish there: it turns, and others with it.

    K.out holds the diagonal of S and H = B + ratio ∂ḣ/∂x, in the tangent or, of straight-line code, behind the shift;
    K.turning holds ∂ḣ/∂x, which is the rate of B. K.velocity_noise tells what round-off of that row makes of
    velocities, over the speed of its cluster, in a whole step that holds positions.
    """
    size = K.n + m
    o_S = 0
    o_H = K.n * size
    width = size
    if straight:
        o_S = soundness_at(K, m) + 2 + size + K.n_v
        o_H = o_S + K.n_v
        width = K.n_v
        K.turning[: m * K.n_v] = K.out[K.n + 2 * m : K.n + 2 * m + m * K.n_v]
    stride = 1 if straight else size + 1
    pivoted_gram_norms(K, m, h, ratio, 0.0, 0, o_S, stride, o_H, width)
    pivoted_gram_norms(K, m, h, ratio, -h, m, o_S, stride, o_H, width)
    pivoted_gram_norms(K, m, h, ratio, h, 2 * m, o_S, stride, o_H, width)
    fewest = 1e300
    nearest = 0
    for k in range(m):
        here = K.spare[k]
        change = max(abs(K.spare[m + k] - here), abs(K.spare[2 * m + k] - here))
        if here < fewest * change:
            fewest = here / change
            nearest = k
    if fewest < 1e300:
        row = K.rows[K.columns[nearest]]
        speed = 0.0
        for j in range(K.n_v):
            if K.cluster[j] == K.cluster[K.n + row]:
                speed += abs(K.out[o_S + stride * j]) * K.block[K.o_v + j] * K.block[K.o_v + j]
        across = 4.0 * EPS * K.scale[K.n + row] / (K.spare[nearest] * K.spare[3 * m + nearest] + 1e-300)
        K.velocity_noise = across / (K.step * sqrt(speed) + 1e-300)
    if (
        MIN_STEPS_AWAY < fewest < MAX_STEPS_AWAY + 2.0
    ):  # a row that turns, beside others that turn with it, changes but does not vanish
        pivoted_gram_norms(K, m, h, ratio, -fewest * h, m, o_S, stride, o_H, width)
        pivoted_gram_norms(K, m, h, ratio, fewest * h, 2 * m, o_S, stride, o_H, width)
        if min(K.spare[m + nearest], K.spare[2 * m + nearest]) > VANISHING_RATIO * K.spare[nearest]:
            return 1e300
    return fewest


def misses(K: DependentRows, away: float, h: float) -> bool:
    """Whether whole steps from the end of this one would end too close to the singularity: then it gets another size.

    While ḣ is held too, steps may do that; those that hold h alone begin to oscillate. It is the last whole one before
    these that is looked at, or one that was shortened for another reason; those of a pair (`step_pairs`) are not.
    """
    if away < 1.0 or away >= MAX_STEPS_AWAY + 1.0 or is_of_pair(h / K.step):
        return False
    part = away - int(away)
    part = min(part, 1.0 - part)
    foreseen = away >= MAX_STEPS_AWAY - MIN_PREDICTED_STEPS_AWAY and is_whole(
        K, h
    )  # nearer it was judged already, as a rule
    doubt = MIN_PREDICTED_STEPS_AWAY - MIN_STEPS_AWAY if foreseen else 0.0
    return bool(part < MIN_STEPS_AWAY + doubt and K.velocity_noise * away > K.tolerance * max(part - doubt, 1e-3))


def singular_newmark_step(K: Kernel, h: float, t1: float) -> int:
    """The step with h held and ḣ left alone: the scheme's own, so that the motion along the branch errs as before.

    The correction of positions stays what it was in the last step that held both: without it, accelerations would have
    to make it good and multipliers begin with a transient of order dt. The steps are too few for undamped multipliers
    to grow. Newton's method has a tangent each time.
    """
    m = K.n_active
    o_r = (K.n + m) * (K.n + m)
    c = (1.0 - K.alpha_f) / (1.0 - K.alpha_m)
    c_C = K.gamma * h * c
    c_K = K.beta * h * h * c
    predict_along_branch(K, h, t1, c_C, c_K)
    K.near_singular = PASSING
    K.failure_time = t1
    K.failure_step = h
    tolerance = 4.0 * EPS if K.exact == 1 else 1e-3 * K.tolerance
    before = 1e300
    away = 0.0
    further = 0
    for iteration in range(MAX_ITERATIONS + further_corrections()):
        # tangent and residual at the iterate
        if sharing(K):
            share_loads(K, m, False)
        clear_tangent(K, m, K.out)
        call(K, K.tangent_program, K.out)
        K.n_tangents += 1
        error = residual_size(K, o_r, m, c_C, c_K, tolerance, 0)
        if error < 0.0:
            return NOT_FINITE
        if error > 1.0 and iteration >= 2 and error > 0.5 * before:
            error = error_or_round_off(K, o_r, m, c_C, c_K, tolerance)
            if error < 0.0:
                return NOT_CONVERGED
        K.failure_size = error
        # distance of the singularity, from the first tangent
        if iteration == 0:
            K.turning[: m * K.n_v] = K.out[o_r + K.n + 2 * m : o_r + K.n + 2 * m + m * K.n_v]
            away = steps_to_singularity(K, m, h, c_K / c_C, False)
            if away < MIN_STEPS_AWAY and K.velocity_noise > K.tolerance:
                return SINGULAR
        # the candidate, or the next iterate
        if error <= 1.0:
            if further == further_corrections():
                return conclude_singular_step(K, h, away)
            further += 1
        before = error
        if not correct_positions(K, m, c_C, c_K):
            return SINGULAR
    return NOT_CONVERGED


def predict_along_branch(K: SingularSteps, h: float, t1: float, c_C: float, c_K: float) -> None:
    """The prediction with the position correction of the last step that held both; its velocities also into K.y1."""
    predict(K, h, t1, c_C, c_K)
    stretch = min(h / K.aux_step, 1.0)
    cube = stretch * stretch * stretch
    for i in range(K.n):
        K.y1[i] = K.block[K.o_v + i]
        if i < K.n_v:
            K.block[K.o_x + i] -= K.shift1[i]
            K.shift1[i] = K.shift[i] * cube
            K.block[K.o_x + i] += K.shift1[i]


def error_or_round_off(K: Equations, o_r: int, m: int, c_C: float, c_K: float, tolerance: float) -> float:
    """A residual that falls no more, by sizes of forces as they are here; 1 if it is round-off, −1 if it runs away."""
    note_scales(K)
    raise_scales(K, True)
    if runs_away(K, m):
        restore_scales(K)
        return -1.0
    error = residual_size(K, o_r, m, c_C, c_K, tolerance, 0)
    rough = residual_size(K, o_r, m, 0.0, 0.0, 256.0 * EPS, 0)
    if error > 1.0 and (rough <= 16.0 or is_below_floors(K, o_r, m, 0)):
        K.n_stagnations += 1
        error = 1.0
    if error <= 1.0:
        retain_scales(K)
    else:
        restore_scales(K)
    return float(error)


def conclude_singular_step(K: SingularSteps, h: float, away: float) -> int:
    """The iterate becomes the candidate if it continues the motion on its branch; 0, or `NOT_CONVERGED`."""
    K.failure_size = 0.0
    if leaves_branch(K, h):
        return NOT_CONVERGED
    finish(K, h)
    if overturns(K, h):
        K.failure_size = -1.0
        return NOT_CONVERGED
    if not is_differentiated():  # which takes the same step once more
        K.n_singular_steps += 1
    K.near_singular = PASSING if away < MAX_STEPS_AWAY else LEFT
    return 0


def correct_positions(K: DependentRows, m: int, c_C: float, c_K: float) -> bool:
    """One Newton correction of the index-3 step from the tangent in K.out; false if singular."""
    n = K.n
    size = n + m
    o_h = size * size + n
    for i in range(n):
        K.rhs[i] = -K.out[size * size + i]
    for k in range(m):
        if K.row_level[K.rows[k]] == 1:
            K.rhs[n + k] = -K.out[o_h + m + k] / c_C
            continue
        K.rhs[n + k] = -K.out[o_h + k] / c_K
        for j in range(K.n_v):
            K.out[(n + k) * size + j] -= c_K / c_C * K.out[o_h + 2 * m + k * K.n_v + j]
    if not factor_positions(K, m):
        return False
    solve_kkt(K, size, K.rhs)
    K.n_factorizations += 1
    K.n_iterations += 1
    for i in range(n):
        K.block[K.o_a + i] += K.rhs[i]
        K.block[K.o_v + i] += c_C * K.rhs[i]
        if i < K.n_v:
            K.block[K.o_x + i] += c_K * K.rhs[i]
    for k in range(m):
        K.block[K.o_lam + K.rows[k]] += K.rhs[n + k]
    return True


def factor_positions(K: DependentRows, m: int) -> bool:
    """LU factors of the index-3 tangent in K.out; false if a pivot is missing."""
    size = K.n + m
    o = 0 if sharing(K) else order_at(K, m)
    if o > 0 and factor_ordered(K, K.out, o, OF_TANGENT, HALF_PRECISION_RTOL):
        return True
    K.n_pivoted += 1 if o > 0 else 0
    K.order_start = 0
    K.kkt[: size * size] = K.out[: size * size]
    if sharing(K):
        add_shares(K, K.kkt, m)
    return bool(factor(K.kkt, size, K.pivots) == 0)


def leaves_branch(K: Motion, h: float) -> bool:
    """Whether velocities are no continuation of those before the step (the predicted ones are in K.y1).

    Those of one cluster are compared with the fastest of it.
    """
    for c in range(K.n_clusters):
        K.fastest[c] = 0.0
    for i in range(K.n_v):
        c = K.cluster[i]
        K.fastest[c] = max(K.fastest[c], max(abs(K.y[i]), abs(K.y1[i])) + h * abs(K.rate[i]))
    for i in range(K.n_v):
        change = abs(K.block[K.o_v + i] - K.y1[i]) - still_speed(K, i)
        if change > VELOCITY_RTOL * K.fastest[K.cluster[i]]:
            return True
    return False
