"""Systems that a step solves, with what they make of the derivatives of their residuals, in straight-line code.

By the implicit function theorem ``A δu = −δr`` at the solution u, with the factors of A in a fixed order
(`mbd.tape.elimination`). Where there are none, or they are too many, the kernel solves with a matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.equations import programs
from mbd.equations.inputs import Inputs
from mbd.tape.derivatives import jvps
from mbd.tape.elimination import factors
from mbd.tape.node import Node


@dataclass(frozen=True)
class System:
    """Residuals, the derivatives of which are asked for, and what they are solved for.

    known : expressions of inputs of the residuals, which have no derivatives then
    values : of the outputs, instead of those of the residuals
    answer : gives the derivatives of the outputs from those of the residuals, in nodes
    """

    lines: Sequence[Node]
    known: Mapping[Node, Node] = field(default_factory=dict)
    values: Sequence[Node] = ()
    answer: Callable[[Sequence[Node]], Sequence[Node]] | None = None


def balance(mechanism: Mechanism, rows: Sequence[int]) -> list[Node]:
    """``M v̇ + f + R λ`` (n) and ``B v̇ + γ`` of some rows, at any v̇ and λ."""
    inputs, (M, f, R, B, gamma) = Inputs.of(mechanism.equations), _parts(mechanism, rows)
    accelerations, forces = [*inputs.a, *inputs.s], [inputs.lam[k] for k in rows]
    lines = [plus(plus(own, M[i], accelerations), R[i], forces) for i, own in enumerate(f)]
    return lines + [plus(own, line, accelerations) for line, own in zip(B, gamma, strict=True)]


def _parts(
    mechanism: Mechanism, rows: Sequence[int]
) -> tuple[list[list[Node]], list[Node], list[list[Node]], list[list[Node]], list[Node]]:
    """M (n × n), f (n), R (n × m), B (m × n) and γ (m) of the program `accelerations`."""
    known, n, count = mechanism.acceleration_nodes, mechanism.layout.n, mechanism.layout.n_rows
    at_R, at_B = n * n + n, n * n + n + n * count
    at_gamma = at_B + n * count + 2 * count
    M = [list(known[i * n : (i + 1) * n]) for i in range(n)]
    R = [[known[at_R + i * count + k] for k in rows] for i in range(n)]
    B = [list(known[at_B + k * n : at_B + (k + 1) * n]) for k in rows]
    return M, list(known[n * n : n * n + n]), R, B, [known[at_gamma + k] for k in rows]


def rates(mechanism: Mechanism, active: programs.ActiveSet) -> System:
    """v̇ (n) and λ (m) of a mode from balance and rows, and 1.0 where every pivot kept four of its digits."""
    inputs, tape, rows = Inputs.of(mechanism.equations), mechanism.equations.tape, sorted(active.rows)
    M, f, R, B, gamma = _parts(mechanism, rows)
    matrix = [[*line, *right] for line, right in zip(M, R, strict=True)]
    matrix += [[*line, *([tape.zero] * len(rows))] for line in B]
    n, massless = len(M), {k for k, line in enumerate(M) if line[k].is_zero}
    found = None
    if not active.given_rows and 0 < len(matrix) <= programs.MAX_UNKNOWNS:
        found = factors(matrix, n, programs.MAX_OPERATIONS, massless, DIRECT_PIVOT_RTOL)
    if found is None:
        return System((), values=[tape.zero] * (len(matrix) + 1))
    solved = found.solve([-each for each in (*f, *gamma)])
    known: dict[Node, Node] = dict.fromkeys(inputs.lam, tape.zero)
    known |= dict(zip([*inputs.a, *inputs.s, *(inputs.lam[k] for k in rows)], solved, strict=True))
    return System(
        balance(mechanism, rows), known, [*solved, found.sound], lambda given: found.solve([-each for each in given])
    )


def step(mechanism: Mechanism, active: programs.ActiveSet) -> System:
    """The rates v̇ (n) and λ (m) of a step of the Newmark family; of the stabilized form the change δW (n_v) of u too.

    ``K (δv̇, δλ) = −(δr, δh/c_K)`` of index 3, of which the value is 1.0 where pivots are sound. The stabilized form has
    ``K (δv̇, δλ) + P δg = −(δr, δḣ/c_C)`` and ``c_K B δv̇ + B Z δg = −δh`` with ``P = (r_x Z, ḣ_x Z/c_C)``, δW = Z δg.
    Behind the block are W, Z (m × n_v), and 1.0 where there is no W, with Z = 0.
    """
    equations, layout = mechanism.equations, mechanism.layout
    tape, inputs, rows, n, n_v = equations.tape, Inputs.of(equations), sorted(active.rows), layout.n, layout.n_v
    m = len(rows)
    eliminated = None if active.given_rows or not mechanism.vector else programs.eliminated_tangent(equations, active)
    if eliminated is None:
        return System((), values=[tape.zero])
    found, lines = eliminated[2], programs.residual(equations, active)
    by_C, by_K = 1.0 / inputs.c[0], 1.0 / inputs.c[1]
    fast = [equations.rows[k].is_velocity for k in rows]
    if not active.stabilized or not m:

        def solved(given: Sequence[Node]) -> list[Node]:
            goal = [given[n + k] * (by_C if fast[k] else by_K) for k in range(m)]
            return found.solve([-each for each in (*given[:n], *goal)])

        return System(lines, {}, [found.sound], solved)
    behind = layout.size + n + layout.n_rows + n_v
    Z = [[tape.zero if fast[k] else tape.input("held", behind + k * n_v + j) for j in range(n_v)] for k in range(m)]
    none = tape.input("held", behind + m * n_v)
    B = programs.constraint_jacobian(equations, rows)
    slopes = list(zip(*jvps(lines, [{x: 1.0} for x in inputs.x]), strict=True))
    pushed = [[plus(tape.zero, line, column) for line in slopes] for column in Z]
    Y = [found.solve([*line[:n], *(by_C * each for each in line[n + m :])]) for line in pushed]
    c_K_B = [[] if fast[k] else [inputs.c[1] * each for each in line] for k, line in enumerate(B)]
    less_Y = [[-each for each in column] for column in Y]
    matrix = [[plus(line[n + i], c_K_B[i], less_Y[k]) for k, line in enumerate(pushed)] for i in range(m)]
    for k in range(m):
        matrix[k][k] = matrix[k][k] + (1.0 if fast[k] else none)
    small = factors(matrix, m)
    if small is None:
        return System((), values=[tape.zero])

    def corrected(given: Sequence[Node]) -> list[Node]:
        alone = found.solve([-each for each in (*given[:n], *(by_C * each for each in given[n + m :]))])
        g = small.solve([-plus(given[n + k], c_K_B[k], alone) for k in range(m)])
        rates = [plus(each, [column[i] for column in less_Y], g) for i, each in enumerate(alone)]
        return [*rates, *(plus(tape.zero, [column[j] for column in Z], g) for j in range(n_v))]

    return System(lines, {}, [found.sound * small.sound], corrected)


def metric(mechanism: Mechanism, active: programs.ActiveSet) -> System:
    """The derivatives ``−(K₀⁻¹ δK₀ W)`` (n_v) of a position correction, ``K₀ W = (0, g)``; g is what rows make of it.

    The size of the step is held. Values are Z (m × n_v), columns of K₀⁻¹, and 1.0 where pivots are sound. Behind the
    block is the correction (n_v).
    """
    equations, layout = mechanism.equations, mechanism.layout
    tape, rows, n, n_v = equations.tape, sorted(active.rows), layout.n, layout.n_v
    m = len(rows)
    eliminated = programs.eliminated_tangent(equations, active) if mechanism.vector and not active.given_rows else None
    if eliminated is None or not m or not active.stabilized:
        return System((), values=[tape.zero] * (m * n_v + 1))
    matrix, _, found = eliminated
    fast = [equations.rows[k].is_velocity for k in rows]
    shift = [tape.input("held", layout.size + j) for j in range(n_v)]
    Z = [found.solve([tape.lift(float(i == n + k and not fast[k])) for i in range(n + m)]) for k in range(m)]
    g = [plus(tape.zero, matrix[n + k], shift) for k in range(m)]
    W = [tape.input("turned", k) for k in range(n + m)]
    known = {w: plus(tape.zero, [column[i] for column in Z], g) for i, w in enumerate(W)}
    return System(
        turned(matrix, n, fast, W), known, [*(each for column in Z for each in column[:n_v]), found.sound],
        lambda given: found.solve([-each for each in given])[:n_v],
    )  # fmt: skip


def turned(matrix: Sequence[Sequence[Node]], n: int, fast: Sequence[bool], W: Sequence[Node]) -> list[Node]:
    """K W, of the n equations of balance and of rows on velocities; those on positions have what is left of W, 0."""
    zero = matrix[0][0].tape.zero
    return [plus(zero, line, W) if i < n or fast[i - n] else zero for i, line in enumerate(matrix)]


def plus(found: Node, a: Sequence[Node], b: Sequence[Node]) -> Node:
    """A node and Σ aᵢ bᵢ over the shorter of both."""
    for left, right in zip(a, b, strict=False):
        found = found + left * right
    return found
