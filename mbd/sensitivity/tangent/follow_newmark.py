"""One implicit step of the Newmark family, whose solution is known, with its derivatives."""

from mbd.kernel.algebra.linear import factor
from mbd.kernel.algebra.ordered import clear_tangent, solve_kkt
from mbd.kernel.algebra.redundancy import sharing
from mbd.kernel.hooks import call, call_on
from mbd.kernel.records import Kernel, Reals
from mbd.kernel.schemes.iteration import finish
from mbd.kernel.tangent_rules import NOT_FOLLOWED
from mbd.sensitivity.tangent.words import (
    MAX_CORRECTIONS,
    are_corrected,
    derivative_of,
    derivative_program,
    is_differentiated,
    largest_derivative,
    metric_place,
    metric_program,
    n_inputs,
    solution_place,
    solve_plain,
    solved_program,
    turned_program,
    without_tangent,
)


def note_matrix(K: Kernel) -> None:
    """The inputs that Newton's matrix is made from, into K.starts."""
    size = n_inputs(K)
    K.starts[:size] = K.block[:size]


def note_solution(K: Kernel) -> None:
    """The block of a solution, into K.starts."""
    size = n_inputs(K)
    o = solution_place(K)
    K.starts[o : o + size] = K.block[:size]


def follow_newton(K: Kernel, h: float, t1: float, c_C: float, c_K: float) -> int:
    """The derivatives of the solution noted last, from those of the prediction in the block.

    With the position correction W in the metric of Newton's matrix K₀ at the noted inputs, ``K₀ W = (0, g)``, with K
    at the solution, and with r, h, ḣ as the prediction and ``−K₀⁻¹ δK₀ W`` change them,

        K (δv̇, δλ) + (r_x Z, ḣ_x Z/c_C) δg = −(δr, δḣ/c_C)   c_K B δv̇ + B Z δg = −δh   Z = K₀⁻¹ (0, 1)

    is one system. Where coordinates do not add, and with friction in a plane in space, K is nearly the derivative, and
    corrections follow.
    """
    if sharing(K):
        return NOT_FOLLOWED
    n = K.n
    m = K.n_active
    o = solution_place(K)
    at = n_inputs(K)
    # is the position correction another one than was predicted?
    corrects = False
    if m > 0 and K.stabilized == 1:
        for i in range(K.n_v):
            corrects = corrects or K.starts[o + at - K.n_v + i] != K.shift1[i]
    if corrects:
        if is_later_matrix(K):
            return NOT_FOLLOWED
        corrects = begin_corrections(K, m, c_C)
    exact = K.vector == 1 and K.n_cones == 0  # is the matrix the derivative itself? then 0 is as good a guess as any
    by_v = without_tangent(c_C)
    by_x = without_tangent(c_K)
    # values of the solution, derivatives of the prediction
    for i in range(n):
        change = without_tangent(K.starts[o + K.o_a + i]) - without_tangent(K.block[K.o_a + i])
        guess = derivative_of(K.block[K.o_a + i]) if exact else 0.0
        K.block[K.o_a + i] += change - guess
        K.block[K.o_v + i] += c_C * change - by_v * guess
        if i < K.n_v:
            K.block[K.o_x + i] += c_K * change - by_x * guess
    for k in range(m):
        place = K.o_lam + K.rows[k]
        guess = 0.0 if exact else derivative_of(K.block[place])
        K.block[place] = without_tangent(K.starts[o + place]) + guess
    if exact and K.correction_program > 0 and solve_straight(K, m, by_v, by_x, corrects):
        finish(K, h)
        return 0
    size = n + 2 * m if corrects else n + m
    if prepare_newton(K, m, size, by_v, by_x) != 0:
        return NOT_FOLLOWED
    o_Z = metric_place(K)
    before = 1e300
    for _ in range(MAX_CORRECTIONS):
        call(K, derivative_program(K), K.out)
        for i in range(n):
            K.rhs[i] = -derivative_of(K.out[i])
        for k in range(m):
            K.rhs[n + k] = right_hand_side(K, k, m, by_v, by_x)
        for k in range(size - n - m):
            K.rhs[n + m + k] = 0.0 if K.row_level[K.rows[k]] == 1 else -derivative_of(K.out[n + k])
        solve_plain(K.kkt, size, K.pivots, K.rhs, 0)
        for i in range(K.n_v if corrects else 0):
            total = 0.0
            for k in range(m):
                total += without_tangent(K.starts[o_Z + k * (n + m) + i]) * K.rhs[n + m + k]
            K.shift1[i] += total
            K.block[K.o_x + i] += total
        change_of = 0.0
        largest = 0.0
        for i in range(n):
            K.block[K.o_a + i] += K.rhs[i]
            K.block[K.o_v + i] += by_v * K.rhs[i]
            if i < K.n_v:
                K.block[K.o_x + i] += by_x * K.rhs[i]
            if not exact:
                change_of = max(change_of, largest_derivative(K.rhs[i]))
                largest = max(largest, largest_derivative(K.block[K.o_a + i]))
        for k in range(m):
            K.block[K.o_lam + K.rows[k]] += K.rhs[n + k]
        if exact or are_corrected(change_of, before, largest):
            break
        before = change_of
    finish(K, h)
    return 0


def solve_straight(K: Kernel, m: int, c_C: float, c_K: float, corrects: bool) -> bool:
    """The same by straight-line code (`systems.step`), in the block; false where a pivot is too small."""
    n = K.n
    if m > 0 and K.stabilized == 1:
        o_Z = metric_place(K)
        o = n_inputs(K) + n + K.n_rows + K.n_v
        for k in range(m):
            for j in range(K.n_v):
                K.block[o + k * K.n_v + j] = without_tangent(K.starts[o_Z + k * (n + m) + j]) if corrects else 0.0
        K.block[o + m * K.n_v] = 0.0 if corrects else 1.0
    call(K, solved_program(K), K.out)
    if without_tangent(K.out[0]) != 1.0:
        return False
    for i in range(n):
        change = derivative_of(K.out[i])
        K.block[K.o_a + i] += change
        K.block[K.o_v + i] += c_C * change
        if i < K.n_v:
            shift = derivative_of(K.out[n + m + i]) if corrects else 0.0
            K.shift1[i] += shift
            K.block[K.o_x + i] += c_K * change + shift
    for k in range(m):
        K.block[K.o_lam + K.rows[k]] += derivative_of(K.out[n + k])
    return True


def is_later_matrix(K: Kernel) -> bool:
    """Whether the matrix noted last is that of an iterate, whose derivatives are not those of the prediction."""
    later = False
    for i in range(n_inputs(K)):
        later = later or without_tangent(K.starts[i]) != without_tangent(K.block[i])
    return later


def right_hand_side(K: Kernel, k: int, m: int, c_C: float, c_K: float) -> float:
    """Of active row k in the equations of rates and multipliers, as `schemes.newton.right_hand_sides` has it."""
    if K.stabilized == 1:
        return -derivative_of(K.out[K.n + m + k]) / c_C
    return -derivative_of(K.out[K.n + k]) / (c_C if K.row_level[K.rows[k]] == 1 else c_K)


def prepare_newton(K: Kernel, m: int, size: int, c_C: float, c_K: float) -> int:
    """Factors of the matrix of `follow_newton` at the block, with δg where it is that large; 0, or it is singular."""
    n = K.n
    whole = n + m
    clear_tangent(K, m, K.out)
    call(K, K.tangent_program, K.out)
    if size == whole:
        K.kkt[: whole * whole] = K.out[: whole * whole]
    else:
        K.spare[: whole * whole] = K.out[: whole * whole]
        K.block_c_K = 0.0  # what K is less then is the part of it that positions make
        call(K, K.tangent_program, K.out)
        K.block_c_K = c_K
        enlarge(K, m, size, c_K)
    K.order_start = 0
    return factor(K.kkt, size, K.pivots)


def enlarge(K: Kernel, m: int, size: int, c_K: float) -> None:
    """``[K P; c_K B  B Z]`` with ``P = (r_x Z, ḣ_x Z/c_C)`` in K.kkt; K is in K.spare, what it is at c_K = 0 in K.out.

    A row on velocities corrects no positions: its part of δg is 0.
    """
    n = K.n
    whole = n + m
    o_Z = metric_place(K)
    inverse = 1.0 / c_K
    for i in range(whole):
        K.kkt[i * size : i * size + whole] = K.spare[i * whole : i * whole + whole]
        for j in range(K.n_v):
            K.spare[i * whole + j] = (K.spare[i * whole + j] - K.out[i * whole + j]) * inverse
        for k in range(m):
            total = 0.0
            for j in range(K.n_v):
                total += K.spare[i * whole + j] * K.starts[o_Z + k * whole + j]
            K.kkt[i * size + whole + k] = total
    for i in range(m):
        o = (whole + i) * size
        K.kkt[o : o + size] = 0.0
        if K.row_level[K.rows[i]] == 1:
            K.kkt[o + whole + i] = 1.0
        else:
            for j in range(K.n_v):
                K.kkt[o + j] = c_K * K.out[(n + i) * whole + j]
            for k in range(m):
                total = 0.0
                for j in range(K.n_v):
                    total += K.out[(n + i) * whole + j] * K.starts[o_Z + k * whole + j]
                K.kkt[o + whole + k] = total


def prepare_metric(K: Kernel, m: int) -> int:
    """Factors of K₀, columns Z of its inverse behind the candidate in K.starts, and W of `follow_newton` from them."""
    n = K.n
    size = n + m
    at = n_inputs(K)
    clear_tangent(K, m, K.out)
    call_on(K, K.tangent_program, K.starts, K.out)
    K.kkt[: size * size] = K.out[: size * size]
    K.order_start = 0
    if factor(K.kkt, size, K.pivots) != 0:
        return 1
    shift = solution_place(K) + at - K.n_v
    K.starts[at : at + size + K.n_v] = 0.0  # what rows make of W is left to g
    o_Z = metric_place(K)
    K.spare[: size * m] = 0.0
    for k in range(m):
        K.spare[k * size + n + k] = 1.0
        solve_plain(K.kkt, size, K.pivots, K.spare, k * size)
        g = 0.0
        for j in range(K.n_v):
            g += K.out[(n + k) * size + j] * K.starts[shift + j]
        for i in range(size):
            K.starts[at + i] += K.spare[k * size + i] * g
            K.starts[o_Z + k * size + i] = K.spare[k * size + i]
        if K.row_level[K.rows[k]] == 1:  # those on velocities correct no positions
            K.starts[o_Z + k * size : o_Z + k * size + size] = 0.0
    return 0


def begin_corrections(K: Kernel, m: int, c_C: float) -> bool:
    """The position correction of the solution in the block, with the derivatives −K₀⁻¹ δK₀ W; whether K₀ is regular."""
    size = K.n + m
    at = n_inputs(K)
    shift = solution_place(K) + at - K.n_v
    if K.correction_program > 0 and K.vector == 1 and largest_derivative(c_C) == 0.0:  # the step is held
        for i in range(K.n_v):
            K.block[at + i] = without_tangent(K.starts[shift + i])
        call(K, metric_program(K), K.out)
        if without_tangent(K.out[m * K.n_v]) == 1.0:
            o_Z = metric_place(K)
            for k in range(m):
                for i in range(K.n_v):
                    K.starts[o_Z + k * size + i] = without_tangent(K.out[k * K.n_v + i])
            take_shift(K, shift)
            return True
    if prepare_metric(K, m) != 0:
        return False
    for i in range(size + K.n_v):
        K.block[at + i] = without_tangent(K.starts[at + i])
    call(K, turned_program(K), K.spare)
    for i in range(size):
        K.out[i] = -derivative_of(K.spare[i])
    solve_plain(K.kkt, size, K.pivots, K.out, 0)
    take_shift(K, shift)
    return True


def take_shift(K: Kernel, shift: int) -> None:
    """The position correction of the solution in the block, with the derivatives in K.out."""
    for i in range(K.n_v):
        found = without_tangent(K.starts[shift + i]) + derivative_of(K.out[i])
        K.block[K.o_x + i] += found - K.shift1[i]
        K.shift1[i] = found


def further_corrections() -> int:
    """Those that derivatives need to follow the solution where `NOT_FOLLOWED`, as they lag behind it by one."""
    return 3 if is_differentiated() else 0


def follow_matrix(K: Kernel, m: int, x: Reals, whole: bool) -> None:
    """``K x = b → K δx = δb − δK x`` of a correction x, whose derivatives are all but −K⁻¹ δK x.

    ``δK x`` is the derivative of a program of the mode (see `programs`) that reads x behind the inputs of the matrix,
    and for the rows what is left of it without the position correction that was there, with `whole`.
    """
    if not is_differentiated():
        return
    size = K.n + m
    o = n_inputs(K)
    for i in range(size):
        K.starts[o + i] = without_tangent(x[i])
    for i in range(K.n_v):
        K.starts[o + size + i] = without_tangent(x[i])
        if whole:
            K.starts[o + size + i] -= without_tangent(K.shift1[i])
    call_on(K, turned_program(K), K.starts, K.spare)
    for i in range(size):
        K.spare[i] = derivative_of(K.spare[i])
    solve_kkt(K, size, K.spare)
    for i in range(size):
        x[i] -= K.spare[i]
