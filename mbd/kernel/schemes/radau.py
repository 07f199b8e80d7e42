"""One step of the three-stage Radau IIA method of order 5 (Hairer & Wanner 1996, Solving ODEs II, IV.8 and VII.4).

Rows are held in the stabilized form at every stage (`stages`), the last of which is the end of the step.
Newton's method has one pair of matrices a step; next to a singular configuration stages are held to rows of their own
(`mbd.kernel.singular.stages`). Accelerations and multipliers of the end come from the balance and the rows at
acceleration level, which makes them as accurate as positions and velocities.
"""

from mbd.equal import HALF_PRECISION_RTOL
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.codes import EPS, NOT_CONVERGED, NOT_FINITE, PASSING, SINGULAR, STAGNATED, TOO_TIGHT
from mbd.kernel.contact.cones import HOLD_DIRECTION
from mbd.kernel.records import Kernel, Settings, SingularSteps, Steps
from mbd.kernel.schemes.collocation import RADAU
from mbd.kernel.schemes.contract import Abilities, Scheme
from mbd.kernel.schemes.coupled_stages import coupled_step
from mbd.kernel.schemes.direction_continuation import (
    NO_HOLD,
    begin_continuation,
    continue_directions,
    wants_continuation,
)
from mbd.kernel.schemes.iteration import (
    MAX_ITERATIONS,
    MIN_HALVED_RESIDUAL,
    MIN_RETRY_SHARE,
    roughly,
    runs_away,
    weigh_by_accelerations,
)
from mbd.kernel.schemes.memory import accept_step, forget_steps, look_a_step_ahead
from mbd.kernel.schemes.radau_end import complete
from mbd.kernel.schemes.stage_layout import (
    BALANCES,
    MU_REAL,
    STAGE_RATES,
    STAGES_END,
    stage_place,
)
from mbd.kernel.schemes.stage_masses import correct_by_own_masses
from mbd.kernel.schemes.stage_matrices import factor_stages
from mbd.kernel.schemes.stages import (
    correct_rates,
    evaluate_stages,
    hold_block,
    load_stage,
    predict_stages,
    retreat_stages,
)
from mbd.kernel.singular.stages import (
    MAX_NOISY_STEPS_AWAY,
    is_beside_singularity,
    replace_row_rates,
    solve_singular_stages,
    spans_singularity,
)
from mbd.kernel.singular.step_size import accept_row_norms, forget_row_norms
from mbd.kernel.stepping.restart import (
    lower_to_step,
    measure_accepted,
    note_scales,
    raise_scales,
    restore_scales,
    retain_scales,
)
from mbd.kernel.stepping.scales import FORCE_ULPS, add_force_floors
from mbd.kernel.tangent_rules import NOT_FOLLOWED, follow_stages, further_corrections, is_differentiated

MAX_CONTRACTION = 0.5
"""Part of the residual left by a correction above which the matrices are made again."""

MAX_CORRECTIONS = 6
"""Corrections after which residuals that meet the tolerance asked for are taken for what they are [-]."""
STALL_RATIO = 0.9
"""Part of the residual left by a correction above which it falls no more; between both it falls slowly."""
MAX_CORRECTION_RATIO = 2.0
"""Size of a correction over the largest rate above which it is made with the masses of each stage instead [-]."""

NEGLIGIBLE_CORRECTION = 1e-2
"""The same over the square of the first correction, the size of the step's own error [-]."""


def radau_start(K: SingularSteps) -> int:
    """The memory at a consistent state: stages of a step before it at rates and multipliers that do not change."""
    forget_steps(K)
    forget_stages(K)
    forget_row_norms(K)
    measure_accepted(K)
    look_a_step_ahead(K)
    K.scales_of_start = 1
    return 0


def forget_stages(K: Steps) -> None:
    """Stages to predict the next step from: those of rates and multipliers that do not change."""
    n = K.n
    for i in range(3):
        K.past_stages[i * n : i * n + n] = K.rate[:n]
        K.past_stages[3 * n + i * K.n_rows : 3 * n + i * K.n_rows + K.n_rows] = K.lam[: K.n_rows]
        K.past_stages[3 * n + 3 * K.n_rows + i * K.n_v : 3 * n + 3 * K.n_rows + i * K.n_v + K.n_v] = 0.0


def radau_accept(K: SingularSteps, h: float) -> None:
    """The candidate becomes the accepted state, its stages those to predict the next from."""
    accept_step(K, h)
    K.estimates_twice = 0
    o = stage_place(K, STAGE_RATES)
    K.past_stages[: 3 * (K.n + K.n_rows + K.n_v)] = K.stages[o : o + 3 * (K.n + K.n_rows + K.n_v)]
    if K.n_active > 0:
        accept_row_norms(K, h)


def radau_step(K: Kernel, h: float, t1: float) -> int:
    """Candidate state (q1, y1, rate1, aux1, lam1) after a step of size h; the accepted state is untouched."""
    m = K.n_active
    if is_differentiated():
        status = follow_stages(K, h, t1, m)
        if status != NOT_FOLLOWED:
            return status
    if m > 0 and spans_singularity(K, h):
        return singular_stages_step(K, h, t1)
    K.near_singular = 0
    hold = NO_HOLD
    while True:
        status = plain_step(K, h, t1, m, hold == NO_HOLD or hold == HOLD_DIRECTION)
        if hold == NO_HOLD and wants_continuation(K, status):
            hold = begin_continuation(K)
        elif hold > 0.0:
            hold = continue_directions(K, hold, status)
            if status != 0:
                break
        else:
            break
    if (
        (status == NOT_CONVERGED or status == STAGNATED or status == TOO_TIGHT)
        and m > 0
        and is_beside_singularity(K, h, MAX_NOISY_STEPS_AWAY)
    ):
        return singular_stages_step(K, h, t1)
    if (status == NOT_CONVERGED or status == STAGNATED) and K.adaptive == 0 and h <= MIN_RETRY_SHARE * K.step:
        return coupled_step(K, h, t1, m)
    return status


def plain_step(K: Kernel, h: float, t1: float, m: int, predicts: bool) -> int:
    """The same with one pair of matrices for all stages, from a prediction or from the stages that are there."""
    c = K.stages[MU_REAL] * h
    hold_block(K)
    if predicts:
        predict_stages(K, h, m)
    tolerance = 1e-3 * K.tolerance
    before = 1e300
    left = 1e300  # the error where the last correction started
    retreats = 0
    renew = True
    slow = False  # whether matrices of one stage leave much of the error
    status = NOT_CONVERGED
    K.failure_time = t1
    K.failure_step = h
    first = 0.0  # what the first correction changed, and the last
    moved = 0.0
    further = 0
    for iteration in range(MAX_ITERATIONS):
        error = evaluate_stages(K, h, t1, m, tolerance, c, c * c, renew)
        # shares that follow loads change it as well
        grown = error > MIN_HALVED_RESIDUAL and error > 0.9 * left and not sharing(K)
        if grown and m > 0:
            if weigh_by_accelerations(K):
                retreat_stages(K, m, 1.0)
                size = evaluate_stages(K, h, t1, m, tolerance, c, c * c, False)
                retreat_stages(K, m, -1.0)
                size = evaluate_stages(K, h, t1, m, tolerance, c, c * c, False) / (size + 1e-300)
                grown = size > 0.9
            restore_scales(K)
        if retreats < 10 and iteration > 0 and (error < 0.0 or grown):
            retreat_stages(K, m, 0.5)  # a full Newton step jumped over a steep place
            retreats += 1
            slow = True
            continue
        if error < 0.0:
            status = NOT_FINITE
            break
        K.failure_size = error
        if error > 1.0 and iteration >= 2 and error > 0.5 * before:
            status = judge_stagnation(
                K, h, t1, m, tolerance, iteration >= MAX_CORRECTIONS and error > STALL_RATIO * before
            )
            if status == 0:
                error = 1.0
            elif status != NOT_CONVERGED or K.failure_size < 0.0:
                break
        if error > 1.0 and was_enough(K, h, t1, m, iteration, error, left):
            return complete(K, h, t1, m, renew, True)
        if error > 1.0 and not renew and error > MAX_CONTRACTION * before:
            renew = True  # the old matrices have done their work: make them again at the same iterate
            slow = True
            before = 1e300
            continue
        if error <= 1.0 and K.scales_of_start == 1:
            load_stage(K, 2, h, t1)
            if lower_to_step(K):
                error = evaluate_stages(K, h, t1, m, tolerance, c, c * c, renew)
                K.failure_size = error
        before = K.failure_size  # as measured: one that passes as round-off is no bound for the next
        left = K.failure_size
        retreats = 0
        if renew and not factor_stages(K, K.n + m):
            status = SINGULAR
            break
        if error <= 1.0:  # the residuals are there: what they still correct costs two solutions
            last = moved
            moved = correct_by_own_masses(K, m, h, t1, renew, slow)
            renew = False
            if has_converged(moved, last, first):
                if further == further_corrections():
                    return complete(K, h, t1, m, False, iteration >= MAX_CORRECTIONS)
                further += 1
            continue
        moved = correct_by_own_masses(K, m, h, t1, renew, slow)
        if moved > MAX_CORRECTION_RATIO and m > 0 and K.vector == 0 and not slow:
            retreat_stages(K, m, 1.0)
            slow = True
            renew = True
            before = 1e300
            left = 1e300
            continue
        if iteration == 0 or (
            slow and first == 0.0
        ):  # the predictor is of order 3, the step of order 5: stay far below its error
            first = moved
            tolerance = min(K.tolerance, max(1e-3 * first * first, tolerance))
        renew = False
    if K.failure_size < 0.0:
        K.failure_size = 1e300
    return status


def has_converged(moved: float, last: float, first: float) -> bool:
    """Whether a correction of residuals that pass was small, or as small as round-off lets it be.

    Masses that differ by 10⁶ make a change of 10⁻³ in the rates of the light one of residuals of 10⁻⁹.
    """
    return moved <= max(HALF_PRECISION_RTOL, NEGLIGIBLE_CORRECTION * first * first) or (
        last > 0.0 and moved > 0.5 * last
    )


def singular_stages_step(K: Kernel, h: float, t1: float) -> int:
    """The candidate of a step with stages on both sides of a singular configuration: see `mbd.kernel.singular.stages`.

    Newton's method is linear there, with matrices made again each time.
    """
    m = K.n_active
    c = K.stages[MU_REAL] * h
    K.near_singular = PASSING
    K.failure_time = t1
    K.failure_step = h
    hold_block(K)
    predict_stages(K, h, m)
    tolerance = 1e-3 * K.tolerance
    before = 1e300
    first = 0.0
    moved = 1e300
    last = 0.0
    for iteration in range(MAX_ITERATIONS):
        status = solve_singular_stages(K, h, t1, m, iteration == 0)
        if status != 0:
            return status
        error = evaluate_stages(K, h, t1, m, tolerance, c, c * c, True)
        if error < 0.0:
            return NOT_FINITE
        K.failure_size = error
        if error > 1.0 and iteration > 2 and error > MAX_CONTRACTION * before:
            if evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, False) <= 1.0:
                return complete(K, h, t1, m, True, False)
            if iteration >= MAX_CORRECTIONS:
                return NOT_CONVERGED
            evaluate_stages(K, h, t1, m, tolerance, c, c * c, False)
        if error <= 1.0 and iteration > 0 and has_converged(moved, last, first):
            return complete(K, h, t1, m, True, False)
        before = error
        replace_row_rates(K, stage_place(K, BALANCES), m)
        if not factor_stages(K, K.n + m):
            return SINGULAR
        last = moved
        moved = correct_rates(K, m, h)
        if iteration == 0:
            first = moved
            last = 0.0
            tolerance = min(K.tolerance, max(1e-3 * first * first, tolerance))
    return NOT_CONVERGED


def judge_stagnation(K: Kernel, h: float, t1: float, m: int, tolerance: float, stuck: bool) -> int:
    """What residuals that fall no more mean: 0 round-off, NOT_CONVERGED go on, else the end of the iteration.

    K.failure_size < 0 where multipliers run away, and what is left over what was asked for at such an end.
    """
    note_scales(K)
    status = judge_raised(K, h, t1, m, tolerance, stuck)
    if status == 0:
        retain_scales(K)
    else:
        restore_scales(K)
    return status


def judge_raised(K: Kernel, h: float, t1: float, m: int, tolerance: float, stuck: bool) -> int:
    """The same with magnitudes raised to those of the stages."""
    c = K.stages[MU_REAL] * h
    for turn in range(3):
        load_stage(K, 2 - turn, h, t1)
        raise_scales(K, True)
        if turn == 0 and m > 0 and runs_away(K, m):
            K.failure_size = -1.0
            return NOT_CONVERGED
    rough = evaluate_stages(K, h, t1, m, 256.0 * EPS, 0.0, 0.0, False)
    if rough <= roughly(K):
        left = evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, False)
        if left <= 1.0:
            K.n_stagnations += 1
            return 0
        # earlier, one good correction makes the next look like the last; below EPS nothing but luck is left
        if stuck or K.tolerance < EPS:
            K.failure_size = left
            return TOO_TIGHT
    status = NOT_CONVERGED
    left = 0.0
    if stuck:
        left = evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, False)  # at most 1: they do for what was asked
        if left > 1.0 and evaluate_stages(K, h, t1, m, 1e5 * EPS, 0.0, 0.0, False) <= 1e3:
            status = STAGNATED
    if status == NOT_CONVERGED and evaluate_stages(K, h, t1, m, tolerance, c, c * c, False) <= 1.0:
        return 0
    if m > 0 or stuck:
        add_force_floors(K, min(1.0, FORCE_ULPS * EPS / K.tolerance))
        if evaluate_stages(K, h, t1, m, 1.0, 0.0, 0.0, False) <= 16.0:  # rows are round-off
            if evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, False) <= 1.0:
                K.n_stagnations += 1
                return 0
    if status == STAGNATED:
        K.failure_size = left
    return status


def was_enough(K: Kernel, h: float, t1: float, m: int, iteration: int, error: float, left: float) -> bool:
    """Whether residuals meet the tolerance that was asked for where the tighter one of the step is not reached.

    Where they fall slowly, as they are; where they grow, as they were: the last correction is taken back.
    """
    c = K.stages[MU_REAL] * h
    if error > left and left < 1e300:
        retreat_stages(K, m, 1.0)
        if evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, False) <= 1.0:
            return True
        retreat_stages(K, m, -1.0)
        evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, False)
        return False
    if iteration < MAX_CORRECTIONS:
        return False
    return evaluate_stages(K, h, t1, m, K.tolerance, c, c * c, False) <= 1.0


def radau_memory(K: Settings) -> dict[str, int]:
    """Lengths of what stages take, and of those of the last step."""
    size = 3 * (K.n + K.n_rows)
    return {
        "stages": stage_place(K, STAGES_END), "past_stages": size + 3 * K.n_v,
        "coupled": size * size, "coupled_rhs": size, "coupled_pivots": size,
    }  # fmt: skip


SCHEME = Scheme(
    "radau", radau_start, radau_step, radau_accept,
    abilities=Abilities(
        estimates=1, singular_size=1, stretches=1, look_twice=0.25, most_growth=5.0,
        middle=0.4,  # between the nodes at (4 ± √6)/10
        far_look=400.0, longest_over=512.0,  # it takes such steps where forces are stiff, too
    ),
    nodes=(RADAU.c[0], RADAU.c[1]),
    memory=radau_memory,
    coefficients=lambda: {"stages": RADAU.numbers()},
)  # fmt: skip
