"""What a scheme takes along from step to step, as it is at a start: nothing, and sizes of forces to measure by."""

from mbd.kernel.records import SingularSteps, State, Steps
from mbd.kernel.stepping.restart import note_scales, raise_scales, retain_scales

PEAK_KEPT = 0.9
"""Part of the largest rate so far that counts a step later: what was fast some tens of steps ago hides nothing [-]."""


def start_step(K: State) -> float:
    """The step that a start prepares for."""
    return float(K.dt if K.adaptive == 1 else K.step)


def forget_steps(K: SingularSteps) -> None:
    """Nothing is known of steps before: rates and multipliers do not change, no singular configuration is near."""
    for i in range(K.n):
        K.slope[i] = 0.0
        K.aux[i] = K.rate[i]
        K.shift[i] = 0.0
        K.shift_change[i] = 0.0
    K.lam_slope[: K.n_rows] = 0.0
    K.aux_step = start_step(K)
    K.near_singular = 0
    K.inverse_pivot = 0.0


def accept_step(K: Steps, h: float) -> None:
    """The candidate after a step of size h becomes the accepted state, with the slopes of its rates and multipliers."""
    inverse = 1.0 / h
    K.q[: K.n_q] = K.q1[: K.n_q]
    for i in range(K.n):
        K.y[i] = K.y1[i]
        K.slope[i] = (K.rate1[i] - K.rate[i]) * inverse
        K.rate[i] = K.rate1[i]
        K.aux[i] = K.aux1[i]
    for i in range(K.n_v if K.second_look > 0 else 0):
        K.peak[i] = max(abs(K.y1[i]), PEAK_KEPT * K.peak[i])
    for k in range(K.n_rows):
        K.lam_slope[k] = (K.lam1[k] - K.lam[k]) * inverse
        K.lam[k] = K.lam1[k]
    K.aux_step = h


def look_a_step_ahead(K: Steps) -> None:
    """Raise the sizes noted at the accepted state, which is in the block, to those a step later.

    A force that is zero just now has its size then.
    """
    step = start_step(K)
    for i in range(K.n):
        K.block[K.o_a + i] += step * K.slope[i]
        K.block[K.o_v + i] += step * K.rate[i]
        if i < K.n_v:
            K.block[K.o_x + i] = step * (K.y[i] + 0.5 * step * K.rate[i])
    note_scales(K)
    raise_scales(K, False)
    retain_scales(K)
