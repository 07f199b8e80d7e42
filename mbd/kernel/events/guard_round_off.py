"""Round-off of what a user's guard measures: a sign that changes by less is no crossing.

A guard g of positions and velocities inherits theirs:

    δg = ε Σ|terms of g| + Σ |∂g/∂x_i| δx_i + Σ |∂g/∂v_i| δv_i

A velocity is known to its own round-off, to what the round-off of the balance over its mass makes of it in some steps,
and to what rows leave open; a position as well, and it moves with its velocity for a step. In index 3, which holds
positions alone and to Newton's tolerance, what is open of these in a step is a velocity as well.

    δv_i = ε |v_i| + h ε F_i / M_ii + Σ_k w_ki δḣ_k,   δx_i = ε |q_i| + h δv_i + Σ_k w_ki δh_k,
    w_ki = M_ii⁻¹ |B_ki| / Σ_j M_jj⁻¹ B_kj²

with F the largest terms of the balance among those of a unit, and δh_k no less than what the row misses at the state: a
guard that a closed contact holds at zero, as its own gap, is not crossed by what Newton's method leaves of it. Whatever
its units, a small guard is thus measured by its own scale; nothing of this is evaluated unless a sign has changed.
"""

from mbd.kernel.codes import EPS, GUARDS, TERMS
from mbd.kernel.hooks import call
from mbd.kernel.records import Guards, Model, Reals, Switching
from mbd.kernel.stepping.restart import evaluate, is_held

NUMBER_ULPS = 4.0
"""Round-off of a number, in units of its last place [-]."""
ROW_ULPS = 64.0
"""The same of what rows leave open, in which many terms take part [-]."""
BALANCE_ULPS = 2.0**14
"""The same of the balance, which may push the same way in many steps: near rest, for part of a period of motion [-]."""
TRUSTED_CHANGE = 4.0
"""Round-offs of a change whose sign is to be trusted [-]."""
PROBE_ULPS = 2.0**20
"""Times round-off by which a coordinate is moved to see what it does to a guard, so that it is seen at all [-]."""


def guard_round_off(K: Switching, e: int, t: float, q: Reals, y: Reals) -> float:
    """Round-off of user guard e at a state; K.acc and the block are overwritten."""
    return inherited(K, K.at_user + e, e, t, q, y)


def condition_round_off(K: Switching, c: int, t: float, q: Reals, y: Reals) -> float:
    """The same of the measure that contact c is watched by."""
    return inherited(K, K.at_condition + c, K.n_guards + c, t, q, y)


def inherited(K: Switching, place: int, term: int, t: float, q: Reals, y: Reals) -> float:
    """Round-off of the guard value at a place, whose terms have another in their program."""
    evaluate(K, t, q, y)
    call(K, TERMS, K.doubt)
    doubt = NUMBER_ULPS * EPS * K.doubt[term]
    call(K, GUARDS, K.doubt)
    here = K.doubt[place]
    doubts_of_state(K, q, y)
    for i in range(K.n_v):
        doubt += change_by(K, place, here, K.o_x + i, K.doubt[K.doubt_x + i])
    for i in range(K.n):
        doubt += change_by(K, place, here, K.o_v + i, K.doubt[K.doubt_v + i])
    return float(doubt)


def change_by(K: Guards, place: int, here: float, at: int, doubt: float) -> float:
    """What round-off of one input of the block does to a guard value, which is `here` without it."""
    kept = K.block[at]
    K.block[at] = kept + PROBE_ULPS * doubt
    call(K, GUARDS, K.doubt)
    K.block[at] = kept
    return float(abs(K.doubt[place] - here) / PROBE_ULPS)


def doubts_of_state(K: Switching, q: Reals, y: Reals) -> None:
    """Round-off of positions and velocities into K.doubt, with M, B in K.acc."""
    n = K.n
    h = K.step
    largest = 0.0
    for i in range(K.n_q):
        largest = max(largest, abs(q[i]))
    fastest = 0.0
    for i in range(n):
        mass = abs(K.acc[i * n + i])
        acceleration = K.scale[i] / mass if mass > 0.0 else 0.0
        fastest = max(fastest, acceleration)
        K.doubt[K.doubt_v + i] = NUMBER_ULPS * EPS * abs(y[i]) + BALANCE_ULPS * EPS * h * acceleration
    for i in range(K.n_v):
        K.doubt[K.doubt_x + i] = NUMBER_ULPS * EPS * (abs(q[i]) if K.vector == 1 else largest)
    o_B = K.acc_B
    loose = K.tolerance / (ROW_ULPS * EPS) * h * h * fastest
    for k in range(K.n_rows):
        if not is_held(K, k, K.closed) or K.dropped[k] == 1:
            continue
        size = 0.0
        for j in range(K.n_v):
            size += K.acc[o_B + k * n + j] * K.acc[o_B + k * n + j] * lightness(K, j)
        missed = max(EPS * ROW_ULPS * K.scale[n + k], abs(K.acc[K.acc_h + k]))
        for i in range(K.n_v):
            share = abs(K.acc[o_B + k * n + i]) * lightness(K, i) / (size + 1e-300)
            K.doubt[K.doubt_v + i] += EPS * ROW_ULPS * share * K.scale[n + K.n_rows + k]
            if K.row_level[k] == 0:
                K.doubt[K.doubt_x + i] += share * missed
                if K.stabilized == 0:
                    K.doubt[K.doubt_v + i] += EPS * ROW_ULPS * share * (K.scale[n + k] + loose) / h
    for i in range(K.n_v):
        K.doubt[K.doubt_x + i] += h * K.doubt[K.doubt_v + i]


def lightness(K: Model, i: int) -> float:
    """1/M_ii, with M in K.acc; 1 of a coordinate without mass, which rows alone determine."""
    mass = abs(K.acc[i * K.n + i])
    return 1.0 / mass if mass > 0.0 else 1.0
