"""Steps where coordinates do not add: the motion in the chart of a step, and how far it may turn a joint.

The increment x of a step is unique up to half a turn: q ⊖ q₀, by which guards inside the step and results between rows
are found, gives the shorter way around, and rational charts have no increment for half a turn at all. Within a quarter
of a turn charts are as good as coordinates that add. A step that would turn such a joint farther is divided into parts
that do not, and rows are stored so close that there is one way from each to the next.
"""

from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import CHART_END, CHART_MOTION
from mbd.kernel.hooks import call_on
from mbd.kernel.records import Model, Motion, Reals
from mbd.kernel.stepping.candidate import carry

QUARTER_TURN = 1.5707963267948966
"""Way of a joint at the speed with which a step begins, above which the step is divided [rad]."""
MIN_TURN = 0.1
"""Way below which a step that fails does so for another reason than how far it turns a joint [rad]."""
PART_GROWTH = 1.02
"""Growth of the parts from one to the next, after a step has failed for how far it turns a joint [-]."""
MAX_TURN = 1.5 * QUARTER_TURN
"""Way at the speed with which it ends, above which a step is not accepted: three eighths of a turn [rad]."""


def whole_step(K: Motion) -> float:
    """The present full step, less where that would turn a joint too far."""
    step = float(K.step)
    if K.vector == 0:
        way = largest_turn(K, K.y, step)
        if way > QUARTER_TURN:
            step *= QUARTER_TURN / way
    return step


def turned_end(K: Motion, t1: float) -> float:
    """Where a step to t1 is to end: there, or after the first of the equal parts into which it is divided."""
    h = t1 - K.time
    part = QUARTER_TURN
    if K.part_turn > 0.0:
        part = min(part, K.part_turn)
        K.part_turn = PART_GROWTH * part if part < QUARTER_TURN else 0.0
    parts = largest_turn(K, K.y, h) / part
    if not 1.0 < parts < 1e4:  # beyond, the motion is lost otherwise
        return t1
    count = 1.0
    while count < parts:
        count += 1.0
    return float(K.time + h / count)


def divides_further(K: Motion, h: float) -> bool:
    """Whether steps are divided into parts like one of h, the first that succeeds, for how far they turn a joint.

    Newton's matrices of a scheme with several stages are those of one of them: where bodies turn far within a step,
    they are not close enough to those of the others.
    """
    if K.vector == 1 or K.explicit == 1 or K.n_nodes == 0:
        return False
    way = largest_turn(K, K.y, h)
    if way < MIN_TURN:
        return False
    K.part_turn = way
    return True


def turns_too_far(K: Motion, h: float) -> bool:
    """Whether the candidate turns a joint so fast that the increment of its step may not be unique."""
    return bool(largest_turn(K, K.y1, h) > MAX_TURN)


def largest_turn(K: Model, y: Reals, h: float) -> float:
    """Largest way |ω| h among the joints whose coordinates do not add [rad]."""
    largest = 0.0
    square = 0.0
    for i in range(K.n_v):
        if K.turned_by[i] == 0:
            continue
        if i > 0 and K.turned_by[i] != K.turned_by[i - 1]:
            square = 0.0
        square += y[i] * y[i]
        largest = max(largest, square)
    return float(sqrt(largest) * h)


def wants_row(K: Motion, h: float) -> bool:
    """Whether a row is stored after a step of h, as another one might turn a joint too far away from the last row."""
    way = largest_turn(K, K.y, h)
    K.turned += way
    return bool(K.turned + way > MAX_TURN)


def find_chart_end(K: Motion) -> None:
    """Increment, rate and its change of the candidate in the chart of the step."""
    o = carry(K.q, K.chart, 0, K.n_q, True)
    o = carry(K.q1, K.chart, o, K.n_q, True)
    o = carry(K.y1, K.chart, o, K.n_v, True)
    carry(K.rate1, K.chart, o, K.n_v, True)
    call_on(K, CHART_END, K.chart, K.chart_end)


def leave_chart(K: Motion) -> None:
    """Velocities and accelerations in place of the rates of the increment and their changes."""
    n_v = K.n_v
    K.chart[:n_v] = K.block[K.o_x : K.o_x + n_v]
    o = carry(K.y1, K.chart, n_v, n_v, True)
    carry(K.rate1, K.chart, o, n_v, True)
    call_on(K, CHART_MOTION, K.chart, K.chart_motion)
    carry(K.y1, K.chart_motion, 0, n_v, False)
    carry(K.rate1, K.chart_motion, n_v, n_v, False)
