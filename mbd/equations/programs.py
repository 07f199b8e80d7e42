"""Programs: the lists of numbers that integrators, impacts and events ask of a set of equations.

With N = n_v + n_z rates, m active rows in ascending number, R rows and nC contacts in all:

=================  ==================================================================================
`newton`           K ((N+m) × (N+m), row-major) | r (N) | h (m) | ḣ (m) | ∂ḣ/∂x (m × n_v), both stabilized only
`residual`         r (N) | h (m) | ḣ (m, stabilized only)
`correction`       r, h and more as behind K in `newton` | sound | weakest | K⁻¹b (N+m) | change of U (n_v, stabilized
                   only) | S_ii (n_v) and B̃ (m × n_v) where the constraint Jacobian may lose rank | factors of K
`solution`         K⁻¹b from the factors in the output of `correction`, b in the place of the solution there
`accelerations`    M (N × N) | f (N) | ∂r/∂λ (N × R) | B (R × N) | h (R) | ḣ (R) | γ (R) | captured | T | limits
`guards`           g (nC) | ġ (nC) | penalty force (nC) | only_while (nC) | event values | event rates |
                   sliding velocity | its rate | limit of each friction | with machines conditions of transitions
`scales`           magnitudes of r (N) | of h (R) | of ḣ (R), term by term before cancellation
`compose`          q ⊕ x, or None where it is q + x
`increment_rates`  ẋ = D(x)⁻¹ v (n_v)
`free_rates`       ẋ (n_v) | v̇ (n_v) with M v̇ = −f | least part of an inertia that a pivot keeps | −v̇·f
=================  ==================================================================================

Of a row on velocities h is zero; index 3 has its rate in the place of h.

All are values: functions from equations to nodes, which the compile stage turns into code.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

from mbd.dataclass import dataclass
from mbd.equations.composite_mass import MassLoop
from mbd.equations.cones import cosine, sliding_force
from mbd.equations.equations import ActingForces, Contact, Eliminated, Equations
from mbd.equations.inputs import Inputs
from mbd.equations.magnitudes import magnitudes
from mbd.equations.tangents import Columns, seeded, tangent
from mbd.tape.derivatives import gradient, jvp, jvps, live, substitute, vjp
from mbd.tape.elimination import Factors, factors
from mbd.tape.node import Node, Scalar


class ActiveSet(NamedTuple):
    """What acts in a contact mode, and in which form its rows are held: all that the programs of a mode depend on.

    rows : that are held
    penalties : contacts that push by a penalty
    stabilized : rows are held at position and velocity, else by index 3
    sliding : dry frictions that slide
    given_rows : rows that depend on `rows`; they take part with their multipliers alone, which are given
    """

    rows: Sequence[int] = ()
    penalties: Sequence[int] = ()
    stabilized: bool = True
    sliding: Sequence[int] = ()
    given_rows: Sequence[int] = ()

    def tail(self, n: int) -> int:
        """How many numbers the residual has: r (n), h, and ḣ of the stabilized form."""
        return n + (2 if self.stabilized else 1) * len(self.rows)

    def size(self, n: int, n_v: int) -> int:
        """How many numbers `newton` gives."""
        return (n + len(self.rows)) ** 2 + self.tail(n) + (len(self.rows) * n_v if self.stabilized else 0)


def newton(equations: Equations, active: ActiveSet) -> list[Node]:
    """Tangent and residual of one Newton iteration of the Newmark family.

    ``K = [S  ∂r/∂λ; B̃  0]`` with ``S = M + c_C C_t + c_K K_t`` (`mbd.equations.tangents`) and
    ``B̃ = B`` (index 3) or ``B + (c_K/c_C) ∂ḣ/∂x`` (stabilized, and rows on velocities in both); the columns of
    first-order states are zero in B̃.
    """
    matrix, tail = _whole(equations, *system(equations, active))
    return [entry for line in matrix for entry in line] + tail


@dataclass(frozen=True)
class Correction:
    """Newton's first correction with its tangent, and code that solves with the same factors again.

    outputs : of the program `correction`
    solution : of the program `solution`, whose inputs are the outputs of the other
    tail : outputs of `newton` behind K, with which those of `correction` begin
    """

    outputs: list[Node]
    solution: list[Node]
    tail: int


MAX_UNKNOWNS = 20
"""Unknowns above which a system is not eliminated on the tape."""
MAX_OPERATIONS = 1000
"""Operations of an elimination beyond which making its code takes longer than it is likely to save."""
MIN_COORDINATES = 24
"""Coordinates of one tree from which on it is eliminated from its tips: matrices of small ones have few entries."""


def correction(equations: Equations, active: ActiveSet) -> Correction | None:
    """Tangent, its factors in a fixed order, and the Newton correction, as one program; None where that does not pay.

    Index 3 solves ``K (δv̇, δλ) = −(r, h/c_K)``, with ``rate/c_C`` for rows on velocities. The stabilized form first
    corrects positions, ``K (U, ·) = −(0, h − (c_K/c_C) ḣ − B̃ u)`` with the U = u of the prediction, then solves
    ``K (δv̇, δλ) = −(r, (ḣ + ∂ḣ/∂x (U − u))/c_C)``.
    """
    inputs, rows, stabilized, tape = Inputs.of(equations), sorted(active.rows), active.stabilized, equations.tape
    n, n_v, m = inputs.n, equations.n_v, len(rows)
    if n >= MIN_COORDINATES and m == 0:
        return _from_the_tips(equations, active)
    eliminated = eliminated_tangent(equations, active)
    if eliminated is None:
        return None
    matrix, tail, found = eliminated
    r, values = tail[:n], tail[n : n + m]
    by_C, by_K = 1.0 / inputs.c[0], 1.0 / inputs.c[1]
    fast = [equations.rows[k].is_velocity for k in rows]
    change: list[Node] = []
    goal = [value * (by_C if fast[k] else by_K) for k, value in enumerate(values)]
    if stabilized:
        rates, turning = tail[n + m : n + 2 * m], tail[n + 2 * m :]
        before = [tape.input("shift", j) for j in range(n_v)]
        apart = [values[k] - inputs.c[1] * by_C * rates[k] - _dot(matrix[n + k], before) for k in range(m)]
        right = [tape.zero if fast[k] else -apart[k] for k in range(m)]
        shift = found.solve([*([tape.zero] * n), *right])[:n_v]
        change = [after - u for after, u in zip(shift, before, strict=True)]
        goal = [(rates[k] + _dot(turning[k * n_v : (k + 1) * n_v], change)) * by_C for k in range(m)]
    solved = found.solve([-force for force in r] + [-row for row in goal])
    out = [*solved, *change]
    if stabilized and not found.weakest.is_zero:
        out += [matrix[j][j] for j in range(n_v)] + [entry for line in matrix[n:] for entry in line[:n_v]]
    return _kept(found, tail, out, n + m)


def eliminated_tangent(equations: Equations, active: ActiveSet) -> tuple[list[list[Node]], list[Node], Factors] | None:
    """K of `newton` line by line, what is behind it there, and the factors of K; None where they do not pay."""
    inputs = Inputs.of(equations)
    if not 0 < inputs.n + len(active.rows) <= MAX_UNKNOWNS:
        return None
    matrix, tail = _whole(equations, *system(equations, active))
    inertia = substitute([matrix[k][k] for k in range(inputs.n)], {inputs.c[0]: 0.0, inputs.c[1]: 0.0})
    found = factors(matrix, inputs.n, MAX_OPERATIONS, {k for k in range(inputs.n) if inertia[k].is_zero})
    return None if found is None else (matrix, tail, found)


def _from_the_tips(equations: Equations, active: ActiveSet) -> Correction | None:
    """The same of a large tree without rows, eliminated from its tips; None where its tangent is no sum over joints."""
    known = equations.geometry
    if known is None or known.largest_tree < MIN_COORDINATES:
        return None
    forces = _acting(equations, active)
    found = known.eliminated(forces)
    if found is None:
        return None
    r = _pushed(equations, forces)
    return _kept(found, r, found.solve([-force for force in r]), len(r))


def _kept(found: Eliminated, tail: list[Node], solved: Sequence[Node], size: int) -> Correction:
    """The programs of a correction whose solution, of `size`, and what follows it are `solved`."""
    tape = found.sound.tape
    out = [*tail, found.sound, found.weakest, *solved]
    kept = found.kept()
    at, place = len(out), len(tail) + 2
    again = found.read({node.index: tape.input("held", at + k) for k, node in enumerate(kept)})
    return Correction([*out, *kept], again.solve([tape.input("held", place + k) for k in range(size)]), len(tail))


def system(
    equations: Equations, active: ActiveSet, alone: bool = False
) -> tuple[Columns, Columns, list[list[Node]], list[Node]]:
    """S and ∂r/∂λ column by column, B̃ line by line, and r | h | ḣ | ∂ḣ/∂x, the last two stabilized only.

    alone : r are the forces of these rows, penalties and frictions, without those of the balance
    """
    inputs, rows, stabilized = Inputs.of(equations), sorted(active.rows), active.stabilized
    forces = _acting(equations, active)
    r = _pushed(equations, forces, alone)
    B = constraint_jacobian(equations, rows)
    bottom, turning = [inputs.row_by_increments(line) for line in B], list[Node]()
    fast = [place for place, k in enumerate(rows) if stabilized or equations.rows[k].is_velocity]
    ratio = inputs.c[1] / inputs.c[0]
    changes = _jacobian_rates(equations, [rows[place] for place in fast], [B[place] for place in fast])
    for place, change in zip(fast, changes, strict=True):
        bottom[place] = [b + ratio * g for b, g in zip(B[place], change, strict=True)]
    if stabilized:
        turning = [entry for change in changes for entry in change]
    right = row_forces(equations, r, rows, B)
    levels = _levels(equations, rows, stabilized)
    others = [*(entry for line in (*bottom, *right) for entry in line), *levels, *turning]
    S = seeded(equations, r) if alone else tangent(equations, r, forces, others)
    return S, right, bottom, r + levels + turning


def _whole(
    equations: Equations, S: Columns, right: Columns, bottom: list[list[Node]], tail: list[Node]
) -> tuple[list[list[Node]], list[Node]]:
    """K, line by line, and the tail as it is."""
    padding = [equations.tape.zero] * (equations.n_z + len(right))
    lines = [list(line) for line in zip(*S, *right, strict=True)]
    return lines + [[*line, *padding] for line in bottom], tail


def residual(equations: Equations, active: ActiveSet, alone: bool = False) -> list[Node]:
    """r | h | ḣ of one contact mode; `alone` as in `system`."""
    r = _pushed(equations, _acting(equations, active), alone)
    return r + _levels(equations, sorted(active.rows), active.stabilized)


def _levels(equations: Equations, rows: Sequence[int], stabilized: bool) -> list[Node]:
    """h | ḣ of the stabilized form; h alone in index 3, where the rate of a row on velocities takes its place."""
    chosen = [equations.rows[k] for k in rows]
    if stabilized:
        return [row.value for row in chosen] + [row.rate for row in chosen]
    return [row.rate if row.is_velocity else row.value for row in chosen]


def accelerations(equations: Equations, impacts: bool = True, loop: MassLoop | None = None) -> list[Node]:
    """What assembly, impacts and restarts need, over all rows and with penalties behind their switches.

    ``r = M a + f + (∂r/∂λ) λ``, ``ḣ = B v + h_t``, ``ḧ = B a + γ``; `captured` are the values that transitions
    and closing contacts store, in the order of anchors, and the whole turns as they are; T is the kinetic energy. In
    `impacts`, where c_C is 1, smooth friction of contacts has no impulse, nor have laws that read multipliers, and dry
    friction of contacts its limit at the slip before them. Where such a law is not linear in them, f + R λ is its
    tangent at the λ of the block.

    loop : fills M, whose places it leaves, from its numbers, which stand behind all else
    """
    inputs = Inputs.of(equations)
    tape = equations.tape
    rows = range(len(equations.rows))
    smooth = 1.0 - inputs.c[0] if impacts else 1.0
    r = switched_balance(equations, smooth)
    rest: dict[Node, float] = {node: 0.0 for node in (*inputs.a, *inputs.s, *inputs.lam)}
    f = [force + bent for force, bent in zip(substitute(r, rest), _bent_forces(equations), strict=True)]
    if loop is not None:
        M, untouched = [[tape.zero] * inputs.n for _ in range(inputs.n)], tape.untouched
        for j, path in enumerate(loop.paths):
            for i in path:
                M[i][j] = M[j][i] = untouched
    else:
        found = None if equations.geometry is None else equations.geometry.mass_matrix()
        M = _transposed(mass_matrix(equations, r)) if found is None else found
    B = constraint_jacobian(equations, rows)
    right = row_forces(equations, r, rows, B)
    if impacts and law_forces(equations):
        right = [_without(inputs.c[0], *pair) for pair in zip(right, law_forces(equations), strict=True)]
    hv = [row.rate for row in equations.rows]
    padding = [tape.zero] * equations.n_z
    out = [entry for line in M for entry in line] + f
    out += [right[k][i] for i in range(inputs.n) for k in rows]
    out += [entry for line in B for entry in [*line, *padding]]
    out += [row.value for row in equations.rows] + hv + _time_rates(equations, hv)
    out += [value for machine in equations.machines for value in machine.captured]
    out += [value for contact in equations.contacts for value in contact.captured]
    out += [tape.input("anchor", turn.anchor) for turn in equations.turns]
    out += [equations.kinetic, *(friction.limit_at_speed(smooth) for friction in equations.frictions)]
    out += [entry for impulse in equations.impulses for entry in impulse.vector] if impacts else []
    return out + list(() if loop is None else loop.numbers)


def constraint_terms(equations: Equations, rows: Sequence[int]) -> list[Node]:
    """h, ``ḣ = B v + h_t``, γ of ``ḧ = B v̇ + γ``, and B row by row, of some rows."""
    rates = [equations.rows[k].rate for k in rows]
    B = constraint_jacobian(equations, rows)
    values = [equations.rows[k].value for k in rows]
    return [*values, *rates, *_time_rates(equations, rates), *(entry for line in B for entry in line)]


def guards(equations: Equations) -> list[Node]:
    """What is watched at the end of a step; 1.0 stands where no measure is asked by `only_while`."""
    tape, contacts = equations.tape, equations.contacts
    out = [contact.gap for contact in contacts] + [contact.gap_rate for contact in contacts]
    out += [tape.zero if contact.force is None else contact.force for contact in contacts]
    out += [contact.only_while if isinstance(contact.only_while, Node) else tape.one for contact in contacts]
    out += [guard.value for guard in equations.guards] + [guard.rate for guard in equations.guards]
    frictions = equations.frictions
    out += [friction.rate for friction in frictions] + [friction.change for friction in frictions]
    out += [friction.sliding for friction in frictions]
    if not equations.machines:
        return out
    transitions = [guard.transition for guard in equations.guards]
    return out + [tape.one if each is None or each.condition is None else each.condition for each in transitions]


def scales(equations: Equations) -> list[Node]:
    """Σ|terms| of r, h and ḣ: how large they are before cancellation, which bounds their round-off."""
    r = switched_balance(equations)
    h = [row.value for row in equations.rows]
    hv = [row.rate for row in equations.rows]
    return magnitudes(equations.tape, [*r, *h, *hv], _amplitudes(equations) | _cosines(equations))


def _amplitudes(equations: Equations) -> dict[int, float]:
    return {} if equations.geometry is None else equations.geometry.amplitudes()


def _cosines(equations: Equations) -> dict[int, float]:
    """Of velocities over their own sizes, 1 however small both are beside the terms that they are made of."""
    grouped = [k for k, friction in enumerate(equations.frictions) if friction.group]
    return {cosine(equations, k).index: 1.0 for k in grouped}


def is_judged(equations: Equations) -> bool:
    """Whether the sign of a user's measure decides: an event, or contacts that are watched while it is positive."""
    return bool(equations.guards) or any(isinstance(contact.only_while, Node) for contact in equations.contacts)


def guard_terms(equations: Equations) -> list[Node]:
    """Σ|terms| of users' guards and of the conditions of contacts, 1 where there is none."""
    one = equations.tape.one
    values = [guard.value for guard in equations.guards]
    values += [c.only_while if isinstance(c.only_while, Node) else one for c in equations.contacts]
    return magnitudes(equations.tape, values, _amplitudes(equations))


def compose(equations: Equations) -> list[Node] | None:
    """q ⊕ x, or None where every coordinate adds."""
    return None if equations.compose is None else list(equations.compose)


def increment_rates(equations: Equations) -> list[Node]:
    """ẋ = D(x)⁻¹ v, v itself where coordinates add."""
    inputs = Inputs.of(equations)
    return list(inputs.v if inputs.chart is None else inputs.chart.rates)


def free_rates(equations: Equations, f: Sequence[Node]) -> list[Node] | None:
    """Rates of a tree on which no row acts, without M; None where only M leads to them.

    f : of `accelerations`
    """
    found = None if equations.geometry is None else equations.geometry.accelerations([-force for force in f])
    if found is None:
        return None
    rates, kept = found
    return [*increment_rates(equations), *rates, kept, -_dot(rates, f)]


# parts --------------------------------------------------------------------------------------------------------------
def balance_with(
    equations: Equations, rows: Iterable[int], penalties: Iterable[int], sliding: Iterable[int] = ()
) -> list[Node]:
    """``r = M a + f + Bᵀλ`` with these rows active, these penalty contacts acting and these frictions sliding."""
    return _balance(equations, rows, [(c, equations.tape.one) for c in penalties], sliding)


def switched_balance(equations: Equations, rubbed: Scalar = 1.0) -> list[Node]:
    """r with every row, penalties behind switches, frictions behind slips, and a part of smooth friction."""
    switches = [(c, equations.tape.input("switch", c)) for c in range(len(equations.contacts))]
    return _balance(equations, range(len(equations.rows)), switches, range(len(equations.frictions)), rubbed)


def _balance(
    equations: Equations, rows: Iterable[int], penalties: Iterable[tuple[int, Node]], sliding: Iterable[int],
    rubbed: Scalar = 1.0,
) -> list[Node]:  # fmt: skip
    """balance + Σ λ_k ∂h_k/∂x − Σ switch_c F_c ∂g_c/∂x + Σ slip_k limit_k ∂γ_k/∂v.

    Of rows on velocities λ_k ∂rate_k/∂v.
    """
    return _pushed(equations, _forces(equations, rows, penalties, sliding, rubbed))


def loaded_balance(equations: Equations) -> list[Node]:
    """r with every row, dry friction too, acting by its multiplier, and penalties behind switches.

    The multiplier of a friction acts along its slide of now, whatever place its row holds while it sticks.
    """
    inputs = Inputs.of(equations)
    switches = [(c, equations.tape.input("switch", c)) for c in range(len(equations.contacts))]
    plain = [k for k, row in enumerate(equations.rows) if row.friction < 0]
    forces = _forces(equations, plain, switches, ())
    rates = [*forces.rates, *(friction.rate for friction in equations.frictions)]
    along_rates = [*forces.along_rates, *(inputs.lam[friction.row] for friction in equations.frictions)]
    return _pushed(equations, replace(forces, rates=rates, along_rates=along_rates))


def _pushed(equations: Equations, forces: ActingForces, alone: bool = False) -> list[Node]:
    """The balance with these forces, or these forces alone."""
    inputs = Inputs.of(equations)
    values, multipliers, rates, rubbing = forces.values, forces.multipliers, forces.rates, forces.along_rates
    result = [equations.tape.zero] * inputs.n if alone else list(equations.balance)
    if not values and not rates:
        return result
    if equations.geometry is not None:
        return (equations.geometry.forces if alone else equations.geometry.balance_with)(forces)
    for outputs, adjoints, along in (values, multipliers, inputs.x), (rates, rubbing, inputs.v):
        if outputs:
            added = vjp(outputs, adjoints, along) + [equations.tape.zero] * equations.n_z
            result = [r + extra for r, extra in zip(result, added, strict=True)]
    return result


def _acting(equations: Equations, active: ActiveSet) -> ActingForces:
    """What acts in a contact mode besides `balance`."""
    rows, penalties = sorted({*active.rows, *active.given_rows}), [(c, equations.tape.one) for c in active.penalties]
    return _forces(equations, rows, penalties, active.sliding)


def _forces(
    equations: Equations, rows: Iterable[int], penalties: Iterable[tuple[int, Node]], sliding: Iterable[int],
    rubbed: Scalar = 1.0,
) -> ActingForces:  # fmt: skip
    """What acts besides `balance`."""
    inputs, rows = Inputs.of(equations), list(rows)
    work = [(equations.rows[k].value, inputs.lam[k]) for k in rows if not equations.rows[k].is_velocity]
    fast = [k for k in rows if equations.rows[k].is_velocity]
    rates, forces = [equations.rows[k].rate for k in fast], [inputs.lam[k] for k in fast]
    for k in sliding:
        rates.append(equations.frictions[k].rate)
        forces.append(sliding_force(equations, k, rubbed))
    for contact in _rubbing(equations, rows):
        rates += [velocity for _, velocity, _ in contact.drags]
        forces += [-(rubbed * force) for _, _, force in contact.drags]
    for c, switch in penalties:
        contact = equations.contacts[c]
        if contact.force is None:
            continue
        if not contact.is_velocity:
            work.append((contact.gap, -(switch * contact.force)))
        else:
            rates.append(contact.gap)
            forces.append(-(switch * contact.force))
        for _, velocity, drag in contact.drags:
            rates.append(velocity)
            forces.append(-(switch * drag))
    return ActingForces([value for value, _ in work], [multiplier for _, multiplier in work], rates, forces)


def _rubbing(equations: Equations, rows: Iterable[int]) -> list[Contact]:
    """The contacts by rows, among those whose normal row is here, that have smooth friction."""
    normal = {contact.rows[0]: contact for contact in equations.contacts if contact.rows and contact.drags}
    return [normal[k] for k in rows if k in normal]


def constraint_jacobian(equations: Equations, rows: Sequence[int]) -> list[list[Node]]:
    """B = ∂ḣ/∂v of the rows, ∂h/∂x where coordinates add, ∂rate/∂v of those on velocities; n_v entries a row."""
    inputs = Inputs.of(equations)
    h = [equations.rows[k].value for k in rows]
    B = _slopes(equations, h)
    for place, k in enumerate(rows):
        if equations.rows[k].is_velocity:
            B[place] = gradient(equations.rows[k].rate, inputs.v)
    return B


def _slopes(equations: Equations, values: Sequence[Node]) -> list[list[Node]]:
    """Derivatives along each velocity, ∂value/∂x where coordinates add, one list of n_v entries a value."""
    inputs = Inputs.of(equations)
    if equations.geometry is None or not values:
        return [gradient(value, inputs.x) for value in values]
    known = equations.geometry.partials(values)
    return _transposed(jvps(values, [{**inputs.along[j], **known[j]} for j in range(len(known))]))


def mass_matrix(equations: Equations, balance: Sequence[Node] | None = None) -> list[list[Node]]:
    """M = ∂r/∂(a, ż), column by column."""
    inputs = Inputs.of(equations)
    r = equations.balance if balance is None else balance
    return jvps(r, [{rate: 1.0} for rate in (*inputs.a, *inputs.s)])


def row_forces(
    equations: Equations, r: Sequence[Node], rows: Sequence[int], B: Sequence[Sequence[Node]] | None = None
) -> list[list[Node]]:
    """∂r/∂λ, column by column: Bᵀ, and more where forces depend on multipliers; B is made where it is not given."""
    inputs = Inputs.of(equations)
    B = constraint_jacobian(equations, rows) if B is None else B
    loaded = any(node.op == "input" and node.data[0] == "slip" for node in live(r))
    loaded = loaded or bool(_rubbing(equations, rows))
    if loaded or law_forces(equations):
        return jvps(r, [{inputs.lam[k]: 1.0} for k in rows])
    padding = [equations.tape.zero] * equations.n_z
    return [[*line, *padding] for line in B]


def law_forces(equations: Equations) -> list[list[Node]]:
    """What laws that read multipliers add to ∂r/∂λ, column by column over all rows; empty where none reads any."""
    if "law forces" not in equations.memory:
        inputs, laws = Inputs.of(equations), _laws(equations) if equations.held_forces else []
        reads = any(node.op == "input" and node.data[0] == "lam" for node in live(laws))
        columns = jvps(laws, [{lam: 1.0} for lam in inputs.lam]) if reads else []
        equations.memory["law forces"] = columns
    found: list[list[Node]] = equations.memory["law forces"]
    return found


def follows_multipliers(equations: Equations) -> int:
    """How the laws of forces follow multipliers: 0 not at all, 1 linearly, 2 in another way."""
    columns = law_forces(equations)
    entries = [entry for column in columns for entry in column]
    bent = any(node.op == "input" and node.data[0] == "lam" for node in live(entries))
    return 0 if not columns else 1 + int(bent)


def _laws(equations: Equations) -> list[Node]:
    """The balance with penalties behind their switches, without rows."""
    switches = [(c, equations.tape.input("switch", c)) for c in range(len(equations.contacts))]
    return _balance(equations, (), switches, ())


def _bent_forces(equations: Equations) -> list[Node]:
    """F(λ) − F(0) − F′(λ) λ of laws F that are not linear in multipliers; zeros for others."""
    tape, inputs = equations.tape, Inputs.of(equations)
    if follows_multipliers(equations) < 2:
        return [tape.zero] * inputs.n
    still: dict[Node, float] = {node: 0.0 for node in (*inputs.a, *inputs.s)}
    laws = substitute(_laws(equations), still)
    zero = substitute(laws, dict.fromkeys(inputs.lam, 0.0))
    bent = [at - none for at, none in zip(laws, zero, strict=True)]
    for lam, column in zip(inputs.lam, law_forces(equations), strict=True):
        bent = [force - slope * lam for force, slope in zip(bent, column, strict=True)]
    return bent


def _without(part: Node, column: Sequence[Node], law: Sequence[Node]) -> list[Node]:
    """Column less a part of what laws have in it."""
    return [entry if slope.is_zero else entry - part * slope for entry, slope in zip(column, law, strict=True)]


def _jacobian_rates(equations: Equations, rows: Sequence[int], B: Sequence[Sequence[Node]]) -> Sequence[Sequence[Node]]:
    """∂ḣ/∂x of each row; of positions, where coordinates add, it is dB/dt, which reuses what B is made of."""
    inputs = Inputs.of(equations)
    hv = [equations.rows[k].rate for k in rows]
    if equations.compose is not None:
        known: dict[int, list[Node]] = equations.memory.setdefault("slopes of rates", {})
        return [known.get(k) or known.setdefault(k, gradient(equations.rows[k].rate, inputs.x)) for k in rows]
    flat = _time_rates(equations, [entry for line in B for entry in line])
    found = [flat[k * equations.n_v : (k + 1) * equations.n_v] for k in range(len(B))]
    fast = [place for place, k in enumerate(rows) if equations.rows[k].is_velocity]
    for place, slopes in zip(fast, _slopes(equations, [hv[place] for place in fast]), strict=True):
        found[place] = slopes
    return found


def _time_rates(equations: Equations, values: Sequence[Node]) -> list[Node]:
    """d/dt of functions of t and q ⊕ x."""
    inputs = Inputs.of(equations)
    known = {} if equations.geometry is None else equations.geometry.rates(values)
    return jvp(values, {inputs.t: 1.0, **inputs.clock, **known})


def _dot(a: Sequence[Node], b: Sequence[Node]) -> Node:
    """Σ aᵢ bᵢ over the shorter of both."""
    result = b[0].tape.zero
    for x, y in zip(a, b, strict=False):
        result = result + x * y
    return result


def _transposed(columns: Sequence[Sequence[Node]]) -> list[list[Node]]:
    return [list(line) for line in zip(*columns, strict=True)]
