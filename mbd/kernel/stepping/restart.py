"""The block of inputs at a state, magnitudes, and consistent accelerations."""

from mbd.equal import NOMINAL_RTOL
from mbd.kernel.algebra.redundancy import find_dependence, find_shares, shared, sharing, spread, take_shares
from mbd.kernel.algebra.saddle import solve_rows
from mbd.kernel.codes import ACCELERATIONS, COMPOSE, EPS, NOT_CONVERGED, SCALES
from mbd.kernel.contact.cone_loads import keep_in_cones
from mbd.kernel.contact.cones import fill_slips, leads_group, sliding_force
from mbd.kernel.hooks import call
from mbd.kernel.records import (
    Balance,
    ContactForces,
    ContactRows,
    DependentRows,
    Equations,
    Integers,
    Mechanism,
    Model,
    Motion,
    Reals,
)
from mbd.kernel.stepping.loads import evaluate_loaded, limit_of
from mbd.kernel.stepping.scales import load_accepted, note_extent, restore_iterate

MAX_MAGNITUDE_RATIO = 100.0
"""Magnitudes over those of the accepted state above which they are lowered again, and the most in one step [-]."""
MAX_ROW_GROWTH = 16.0
"""Most by which the terms of a row may grow in a step: beyond that an iterate was thrown far away [-]."""
MAX_LOAD_ITERATIONS = 30
"""How often multipliers that friction follows are solved for again [-]."""


def fill_block(K: Mechanism, t: float, q: Reals, y: Reals) -> None:
    """The block at a state, with the accepted rates and multipliers; penalties act where closed."""
    block = K.block
    block[0] = t
    block[1] = 0.0
    block[2] = 0.0
    block[K.o_q : K.o_q + K.n_q] = q[: K.n_q]
    block[K.o_x : K.o_x + K.n_v] = 0.0
    for i in range(K.n):
        block[K.o_v + i] = y[i]
        block[K.o_a + i] = K.rate[i]
    block[K.o_lam : K.o_lam + K.n_rows] = K.lam[: K.n_rows]
    block[K.o_anchor : K.o_anchor + K.n_anchors] = K.anchors[: K.n_anchors]
    for c in range(K.n_contacts):
        block[K.o_switch + c] = 1.0 if (K.kind[c] == 1 and K.closed[c] == 1) else 0.0
    fill_slips(K)


def compose(K: Motion, q1: Reals) -> None:
    """q₁ = q ⊕ x with the accepted q and the increment x in the block."""
    if K.vector == 1:
        for i in range(K.n_q):
            q1[i] = K.q[i] + K.block[K.o_x + i]
    else:
        K.block[K.o_q : K.o_q + K.n_q] = K.q[: K.n_q]
        call(K, COMPOSE, q1)


def displace(K: Model, q: Reals, x: Reals) -> None:
    """q ← q ⊕ x."""
    if K.vector == 1:
        for i in range(K.n_q):
            q[i] += x[i]
        return
    K.block[K.o_q : K.o_q + K.n_q] = q[: K.n_q]
    K.block[K.o_x : K.o_x + K.n_v] = x[: K.n_v]
    call(K, COMPOSE, q)
    K.block[K.o_x : K.o_x + K.n_v] = 0.0


def refresh_scales(K: Model) -> None:
    """Magnitudes of r, h and ḣ, term by term before cancellation, at the state now in the block."""
    call(K, SCALES, K.scale)
    for i in range(K.n):
        K.scale[i] = max(K.scale[i], 1e-300)
    for unit in range(2):  # forces [N] and torques [N m] of a cluster are judged as blocks of their own
        K.typical[: K.n] = 0.0  # the largest of each cluster
        for i in range(K.n):
            if K.unit[i] == unit:
                K.typical[K.cluster[i]] = max(K.typical[K.cluster[i]], K.scale[i])
        for i in range(K.n):
            if K.unit[i] == unit:
                K.scale[i] = K.typical[K.cluster[i]]
    weigh(K)
    far = 1e-3
    if K.vector == 0:  # a coordinate without a velocity of its own has none of the units
        for i in range(K.n_q):
            far = max(far, abs(K.block[K.o_q + i]))
    for k in range(K.n_rows):  # a row that vanishes term by term still inherits the round-off of its coordinates
        size = far
        speed = 1e-3
        for i in range(K.n_v):
            if K.unit[i] == K.row_unit[k] and K.cluster[i] == K.cluster[K.n + k]:
                speed = max(speed, abs(K.block[K.o_v + i]))
                if K.vector == 1:
                    size = max(size, abs(K.block[K.o_q + i]))
        K.scale[K.n + k] = max(K.scale[K.n + k], size)
        K.scale[K.n + K.n_rows + k] = max(K.scale[K.n + K.n_rows + k], speed)


def measure_accepted(K: DependentRows) -> None:
    """The block and magnitudes at the accepted state."""
    fill_block(K, K.time, K.q, K.y)
    measure(K)


def measure(K: Equations) -> None:
    """Magnitudes at the state now in the block.

    Where nothing acts, forces are measured by what a velocity does not notice in a step: they must not be zero, beside
    which round-off would be large.
    """
    for i in range(K.n_v):
        K.work[i] = K.block[K.o_a + i]
        unseen = EPS * abs(K.block[K.o_v + i]) / K.dt
        if abs(K.work[i]) < unseen:
            K.block[K.o_a + i] = unseen
    refresh_scales(K)
    K.block[K.o_a : K.o_a + K.n_v] = K.work[: K.n_v]
    measure_rates(K)
    note_extent(K)


def measure_rates(K: Equations) -> None:
    """Magnitudes of rates of first-order states that vanish at rest: those at the speeds that forces make in a step.

    K.work and K.typical are lost, and K.acc where one vanishes.
    """
    vanishing = False
    for i in range(K.n_v, K.n):
        vanishing = vanishing or K.scale[i] <= 1e-300
    if not vanishing:
        return
    call(K, ACCELERATIONS, K.acc)
    for i in range(K.n_v):
        K.typical[i] = K.block[K.o_v + i]
        mass = abs(K.acc[i * K.n + i])
        K.block[K.o_v + i] += K.dt * K.scale[i] / mass if mass > 0.0 else 0.0
    call(K, SCALES, K.work)
    K.block[K.o_v : K.o_v + K.n_v] = K.typical[: K.n_v]
    for i in range(K.n_v, K.n):
        if K.work[i] < 1e300:
            K.scale[i] = max(K.scale[i], K.work[i])
    weigh(K)


def weigh(K: Model) -> None:
    """Residuals are compared with their scale so often that its inverse is kept."""
    for i in range(K.n):
        K.weight[i] = 1.0 / K.scale[i]


def raise_scales(K: Equations, rows: bool) -> None:
    """Magnitudes at the state now in the block where they exceed those known; where a force passes zero it has none.

    Those of rows, by which gaps are judged too, only on demand and as far as coordinates may grow in a step from the
    accepted state: a state far ahead says nothing of the round-off here, nor does one from which the motion began.
    """
    known = K.n + 2 * K.n_rows
    K.work[:known] = K.scale[:known]
    if rows and K.n_rows > 0:
        raise_to_accepted(K)
    refresh_scales(K)
    for i in range(known):
        if i < K.n:
            K.scale[i] = max(K.scale[i] if K.scale[i] < 1e300 else 0.0, K.work[i])
        elif rows:
            K.scale[i] = max(min(K.scale[i], MAX_ROW_GROWTH * K.work[i]), K.work[i])
        else:
            K.scale[i] = K.work[i]
    weigh(K)


def raise_to_accepted(K: Equations) -> None:
    """Magnitudes of rows in K.work up to those of the accepted positions and velocities."""
    load_accepted(K)
    refresh_scales(K)
    restore_iterate(K)
    for i in range(K.n, K.n + 2 * K.n_rows):
        K.work[i] = max(K.work[i], K.scale[i])


def largest_force(K: Model, row: int) -> float:
    """The largest magnitude that forces have in the balance of the cluster of a row [N, N m].

    What is heavy apart says nothing of the round-off here.
    """
    force = 0.0
    for i in range(K.n_v):
        if K.cluster[i] == K.cluster[K.n + row]:
            force = max(force, K.scale[i])
    return float(force)


def note_scales(K: Model) -> None:
    """Keep the magnitudes known so far, which an iterate that is not accepted must leave as they are."""
    K.known[: K.n + 2 * K.n_rows] = K.scale[: K.n + 2 * K.n_rows]


def restore_scales(K: Model) -> None:
    """The magnitudes of `note_scales`: where an iterate was thrown far away, its forces excuse nothing."""
    K.scale[: K.n + 2 * K.n_rows] = K.known[: K.n + 2 * K.n_rows]
    weigh(K)


def retain_scales(K: Model) -> None:
    """Go on with raised magnitudes, those of a candidate; K.scales_raised where they are far above what was known."""
    for i in range(K.n):
        if K.scale[i] > MAX_MAGNITUDE_RATIO * K.known[i]:
            K.scales_raised = 1


def lower_to_step(K: Equations) -> bool:
    """Magnitudes of a start down to those of the first candidate, in the block, where they were far above these.

    In a pose in which a force has no limit, such as that of a disk that passes flat, its terms excuse any residual.
    """
    K.scales_of_start = 0
    note_scales(K)
    measure(K)
    lowered = False
    for i in range(K.n + 2 * K.n_rows):
        bound = MAX_MAGNITUDE_RATIO * K.scale[i] if i < K.n else K.known[i]
        lowered = lowered or bound < K.known[i]
        K.scale[i] = min(bound, K.known[i])
    weigh(K)
    return lowered


def lower_scales(K: DependentRows) -> None:
    """Magnitudes of forces down towards those of the accepted state, by a hundred at most.

    After a moment of huge forces residuals are judged too mildly otherwise.
    """
    note_scales(K)
    measure_accepted(K)
    K.scales_raised = 0
    for i in range(K.n):
        floor = K.known[i] / MAX_MAGNITUDE_RATIO
        if floor > K.scale[i]:
            K.scale[i] = floor
            K.scales_raised = 1
    weigh(K)


def is_held(K: ContactRows, row: int, flags: Integers) -> bool:
    """Whether a row acts: always, while its contact is closed and does not part, and while its friction sticks.

    Trivial rows never do, and those with K.lifting = 1 are left out while contacts are lifted out of their surfaces.
    """
    contact = K.row_contact[row]
    friction = K.row_friction[row]
    if contact >= 0 and (flags[contact] == 0 or (K.normal[contact] == row and K.parting[contact] == 1)):
        return False
    if K.lifting[row] == 1 or K.row_trivial[row] == 1:
        return False
    return bool(friction < 0 or K.sticks[friction] == 1)


def stepping_rows(K: DependentRows) -> int:
    """The active rows of the closed contacts that do not depend on others, into K.rows; how many."""
    m = 0
    for row in range(K.n_rows):
        if K.dropped[row] == 0 and is_held(K, row, K.closed):
            K.rows[m] = row
            m += 1
    return m


def active_rows(K: Mechanism, flags: Integers) -> int:
    """Numbers of the active rows into K.rows, ascending; how many."""
    m = 0
    for row in range(K.n_rows):
        if is_held(K, row, flags):
            K.rows[m] = row
            m += 1
    return m


def evaluate(K: Mechanism, t: float, q: Reals, y: Reals) -> None:
    """M, f, R, B, h, ḣ, bias, captured, kinetic energy, limits at a state, into K.acc."""
    fill_block(K, t, q, y)
    call(K, ACCELERATIONS, K.acc)


def row_speed(K: Model, row: int) -> float:
    """ḣ of a row, from K.acc."""
    return float(K.acc[K.acc_rate + row])


def consistent(K: Balance, t: float, q: Reals, y: Reals) -> int:
    """Rates and multipliers of the closed rows at a state, in K.jump and K.impulse."""
    evaluate(K, t, q, y)
    m = stepping_rows(K)
    together = sharing(K)
    if together:
        find_dependence(K, m)
        find_limits_of_loads(K)
        find_shares(K)
    load_accelerations(K)
    status = solve_rows(K, m, False)
    if K.loaded > 0 or together:  # R follows multipliers: of degree one, so that to solve again is Newton's method
        change = 0.0
        for _ in range(MAX_LOAD_ITERATIONS):
            if status != 0:
                break
            change = evaluate_loaded(K, K.impulse)
            if change < 1e-13:
                break
            if together:
                find_limits_of_loads(K)
                find_shares(K)
            load_accelerations(K)
            status = solve_rows(K, m, False)
        if status == 0 and change > NOMINAL_RTOL:
            K.failure_size = change / NOMINAL_RTOL
            return NOT_CONVERGED
    if K.n_dropped > 0 and status == 0:
        minimum_norm_multipliers(K, K.impulse)
    if status == 0 and K.n_frictions > 0:
        find_sliding_friction(K)
    return status


def take_consistent(K: Balance) -> None:
    """The rates in K.jump and the multipliers in K.impulse become those of the accepted state."""
    K.rate[: K.n] = K.jump[: K.n]
    K.lam[: K.n_rows] = K.impulse[: K.n_rows]


def find_limits_of_loads(K: ContactRows) -> None:
    """Largest frictions at the multipliers now in the block."""
    for f in range(K.n_frictions):
        K.limit[f] = limit_of(K, f)


def minimum_norm_multipliers(K: Balance, lam: Reals) -> None:
    """Multipliers of dependent rows beside those of K.rows, which were solved with, at the state now in the block.

    Frictions that hold together share by their limits, which follow their loads: they are found by turns.
    """
    for turn in range(MAX_LOAD_ITERATIONS):
        change = evaluate_loaded(K, lam)
        if turn == 0:
            find_dependence(K, stepping_rows(K))
        find_limits_of_loads(K)
        if sharing(K):  # they have been part of the equations
            break
        spread(K, lam)
        if K.n_frictions == 0 or (turn > 0 and change < 1e-13):
            break
    if K.n_cones > 0:
        keep_in_cones(K, lam)


def share_loads(K: Balance, m: int, known: bool) -> None:
    """Multipliers of dependent rows in the block, where they are part of the step's equations, at its iterate.

    By the shares found last, where these are `known`.
    """
    K.loads[: K.n_rows] = K.block[K.o_lam : K.o_lam + K.n_rows]
    call(K, ACCELERATIONS, K.acc)
    if not known:
        find_dependence(K, m)
        find_limits_of_loads(K)
        find_shares(K)
    take_shares(K, K.loads)
    K.block[K.o_lam : K.o_lam + K.n_rows] = K.loads[: K.n_rows]


def add_shares(K: DependentRows, A: Reals, m: int) -> None:
    """What the multipliers of a step bring along through dependent rows, into the tangent A of m rows."""
    size = K.n + m
    for i in range(K.n):
        for k in range(m):
            A[i * size + K.n + k] += shared(K, i, K.rows[k])


def holds_rows(K: Motion, m: int) -> bool:
    """Whether the rows on positions hold at the candidate, at which K.acc is."""
    for k in range(m):
        row = K.rows[k]
        size = max(K.scale[K.n + row], 1e-3)
        if K.row_level[row] == 0 and not abs(K.acc[K.acc_h + row]) <= max(K.tolerance, 1024.0 * EPS) * size:
            return False
    return True


def find_sliding_friction(K: ContactForces) -> None:
    """Friction that slides follows the multipliers of the held rows in K.impulse, at the state now in K.acc.

    Its tangents are those of where the contact is, as in the equations, not of the place that it held last: the block
    has these for the anchors of both directions of a contact in space.
    """
    if K.n_cones > 0:
        for f in range(K.n_frictions):
            c = K.friction_contact[f]
            if c >= 0 and leads_group(K, f) and K.slip[f] != 0.0:
                for k in range(K.anchor_start[c], K.anchor_start[c + 1]):
                    K.block[K.o_anchor + k] = K.acc[K.acc_captured + k]
    evaluate_loaded(K, K.impulse)
    for f in range(K.n_frictions):
        if K.slip[f] != 0.0:
            K.impulse[K.friction_row[f]] = sliding_force(K, f, limit_of(K, f), K.acc, K.acc_rate, True)


def load_accelerations(K: ContactForces) -> None:
    """Right-hand sides of the acceleration level."""
    n = K.n
    K.force[:n] = K.acc[K.acc_f : K.acc_f + n]
    K.bias[: K.n_rows] = K.acc[K.acc_bias : K.acc_bias + K.n_rows]


def capture(K: Mechanism, c: int) -> None:
    """Hold the anchors of a contact that closes; K.acc is evaluated at the instant."""
    for k in range(K.anchor_start[c], K.anchor_start[c + 1]):
        K.anchors[k] = K.acc[K.acc_captured + k]
