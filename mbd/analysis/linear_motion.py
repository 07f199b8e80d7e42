"""A, B, C and D about an instant: how small changes of states and inputs move a mechanism and its outputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbd.analysis.independent import Independent, row_sizes
from mbd.analysis.instant import Instant
from mbd.analysis.ports import Input, Output
from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.equal import HALF_PRECISION_RTOL, NOMINAL_RTOL
from mbd.equations.linearization import LinearTerms
from mbd.equations.ports import PortTerms
from mbd.errors import ModelError


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Derivatives of what inputs prescribe: columns for w and ẇ of each, and for the input.

    states : (number among the inputs, order) of each column of w and ẇ; names : theirs
    place, speed : (m, s) what these add to ``B δx`` and to ``B δv + ∂ḣ/∂x δx``
    force, change : (N, s) and (m, s) to the balance and to ḧ; input_force, input_change : (N, k), (m, k) of the inputs
    rates : (s, s), (s, k) of the states by themselves and by inputs
    through : (o, s) and (o, k) of the outputs directly
    """

    states: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    place: Matrix
    speed: Matrix
    force: Matrix
    change: Matrix
    input_force: Matrix
    input_change: Matrix
    rates: tuple[Matrix, Matrix]
    through: tuple[Matrix, Matrix]

    @classmethod
    def of(cls, inputs: Sequence[Input], terms: PortTerms, velocity: Matrix) -> Prescribed:
        """From the derivatives by all inputs that are in equations; of others the columns are 0."""
        columns = iter(range(terms.r.shape[1]))
        where = [None if each.node is None else next(columns) for each in inputs]
        states = tuple((k, order) for k, each in enumerate(inputs) for order in range(each.order))
        s, k, o = len(states), len(inputs), len(terms.y)
        m, n = len(terms.h), len(terms.r)
        place, speed, force, change = np.zeros((m, s)), np.zeros((m, s)), np.zeros((n, s)), np.zeros((m, s))
        into, bend, own, driven = np.zeros((n, k)), np.zeros((m, k)), np.zeros((s, s)), np.zeros((s, k))
        through, direct = np.zeros((o, s)), np.zeros((o, k))
        twice = np.where(velocity, 1.0, 2.0)  # d²/dt² h(p) = … + 2 ∂ḣ/∂p ṗ + ∂h/∂p p̈
        levels = terms.h, terms.rate
        for number, each in enumerate(inputs):
            column = where[number]
            if column is None:
                continue
            h, rate, bent = (part[:, column] for part in (*levels, terms.change))
            acts = [bent, twice * rate, h]  # on ḧ, by the order of the derivative
            if not each.order:
                into[:, number], direct[:, number] = terms.r[:, column], terms.through[:, column]
                continue
            bend[:, number] = acts[each.order]
            for order in range(each.order):
                j = states.index((number, order))
                speed[:, j] = (rate, h)[order]
                change[:, j] = acts[order]
                if order == 0:
                    place[:, j], force[:, j], through[:, j] = h, terms.r[:, column], terms.through[:, column]
                if order + 1 < each.order:
                    own[j, j + 1] = 1.0
                else:
                    driven[j, number] = 1.0
        names = tuple(name for each in inputs for name in each.states)
        return cls(states, names, place, speed, force, change, into, bend, (own, driven), (through, direct))


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """``δẋ = A δx + B δu``, ``δy = C δx + D δu`` of the independent states and those of prescribed motions.

    basis : (2 n_v + n_z, N) changes of (x, v, z) for a unit change of each state
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    basis: Matrix


def linear_motion(
    found: Instant,
    terms: LinearTerms,
    chosen: Independent,
    picked: Sequence[int],
    ports: PortTerms,
    given: Prescribed,
    outputs: Sequence[Output],
) -> LinearMotion:
    """Rates of all states and changes of all outputs, rows held at acceleration level.

    ``[M R; B 0] (δv̇, δλ) = −[K C F; ∂ḧ/∂x ∂ḧ/∂v H] (δx, δv, δw) − [F_u; H_u] δu``
    """
    n_v, n, s = terms.K.shape[1], len(terms.r), len(given.states)
    basis = np.hstack([chosen.basis, _followed(found, terms, chosen, given)])
    B, kept = found.kept(terms.B), found.kept
    m = len(B)
    still = np.zeros((m, n - n_v))
    matrix = np.block([[terms.M, found.forces(terms)], [B, still, np.zeros((m, m))]]) if m else terms.M
    right = np.vstack([
        np.hstack([terms.K, terms.C, given.force, given.input_force]),
        np.hstack([kept(terms.change_place), kept(terms.change_speed), still, kept(given.change),
                   kept(given.input_change)]),
    ])  # fmt: skip
    solved = -np.linalg.solve(matrix, right)
    own = n_v + n + s
    by_all = np.vstack([basis, np.hstack([np.zeros((s, basis.shape[1] - s)), np.eye(s)])])
    full = np.zeros((n_v + n, own))
    full[:n_v, n_v : 2 * n_v] = np.eye(n_v)
    full[:n_v, :n_v] = terms.carried
    full[n_v:] = solved[:n, :own]
    states = np.vstack([full[list(picked)] @ by_all, np.hstack([np.zeros((s, basis.shape[1] - s)), given.rates[0]])])
    by_input = np.vstack([np.zeros((n_v, solved.shape[1] - own)), solved[:n, own:]])[list(picked)]
    multipliers = _multipliers(found, terms, ports, outputs, solved[n:])
    rates = np.hstack([ports.acceleration, ports.state_rate])
    seen = rates @ solved[:n] + ports.multiplier @ multipliers
    direct = np.hstack([ports.place, ports.speed, ports.state, given.through[0]])
    return LinearMotion(
        states, np.vstack([by_input, given.rates[1]]), (direct + seen[:, :own]) @ by_all,
        seen[:, own:] + given.through[1], basis,
    )  # fmt: skip


def _followed(found: Instant, terms: LinearTerms, chosen: Independent, given: Prescribed) -> Matrix:
    """Changes of (x, v, z) with what is prescribed, independent ones held: rows stay closed."""
    n_v, s = terms.K.shape[1], len(given.states)
    change = np.zeros((2 * n_v + len(terms.r) - n_v, s))
    if not s:
        return change
    size = row_sizes(np.hstack([terms.B, given.place, given.speed]))[:, None]
    B, turning, held = terms.B / size, terms.turning / size, ~found.velocity
    place, speed = given.place / size, given.speed / size
    by_place = [k for k in range(n_v) if k not in chosen.places]
    by_speed = [k for k in range(n_v) if k not in chosen.speeds]
    change[by_place] = _solved(B[held][:, by_place], -place[held])
    change[[n_v + k for k in by_speed]] = _solved(B[:, by_speed], -(speed + turning @ change[:n_v]))
    place = np.where(held[:, None], B @ change[:n_v] + place, 0.0)
    left = np.abs(np.vstack([place, B @ change[n_v : 2 * n_v] + turning @ change[:n_v] + speed])) > HALF_PRECISION_RTOL
    if np.any(left):
        names = ", ".join(repr(name) for name, bad in zip(given.names, np.any(left, axis=0), strict=True) if bad)
        lines = np.any(left.reshape(2, len(B), s), axis=(0, 2))
        titles = ", ".join(title for title, bad in zip(found.titles, lines, strict=True) if bad)
        raise ModelError(f"the rows leave {names} no freedom: what they prescribe is held besides ({titles})")
    return change


def _solved(matrix: Matrix, right: Matrix) -> Matrix:
    if not matrix.size:
        return np.zeros((matrix.shape[1], right.shape[1]))
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=None)[0])


def _multipliers(
    found: Instant, terms: LinearTerms, ports: PortTerms, outputs: Sequence[Output], kept: Matrix
) -> Matrix:
    """Changes of the multipliers of all active rows, from those of the independent ones.

    Where rows depend on each other, multipliers are open, but what is made of their forces is not.
    """
    flags = np.array(found.dependent, dtype=bool)
    change = multiplier_map(found) @ kept
    if not np.any(flags) or found.sliding:
        return change
    from scipy.linalg import null_space

    size = row_sizes(terms.R.T)
    open_ones = null_space(terms.R / size, rcond=HALF_PRECISION_RTOL) / size[:, None]
    sizes = np.maximum(np.max(np.abs(ports.multiplier), axis=1, initial=0.0), 1e-300)
    loose = np.max(np.abs(ports.multiplier @ open_ones), axis=1, initial=0.0) > NOMINAL_RTOL * sizes
    if np.any(loose):
        names = ", ".join(repr(each.name) for each, is_loose in zip(outputs, loose, strict=True) if is_loose)
        titles = ", ".join(title for title, flag in zip(found.titles, flags, strict=True) if flag)
        raise ModelError(
            f"{names}: redundant rows ({titles}) share their load in ways that the equations leave open; ask for "
            "outputs that do not depend on the share, or leave out what is held twice"
        )
    return change


def multiplier_map(found: Instant) -> Matrix:
    """(m, kept) multipliers of all active rows from those of the independent ones: 0, or shares of sliding ones."""
    flags = np.array(found.dependent, dtype=bool)
    whole = np.zeros((len(flags), int(np.count_nonzero(~flags))))
    whole[~flags] = np.eye(whole.shape[1])
    part = found.loads()
    if part is not None:
        whole[flags] = part
    return whole


def singular(found: Instant, terms: LinearTerms, chosen: Independent) -> list[str]:
    """Rows that depend on others here but not nearby: their second derivatives along the free motions differ.

    For multipliers μ that make no force, ``∂(Bᵀμ)/∂x`` along the free motions vanishes where the rows agree nearby.
    """
    from scipy.linalg import null_space

    held = np.flatnonzero(~found.velocity)
    n_v, free = len(terms.K.T), chosen.basis[: len(terms.K.T), : len(chosen.places)]
    forces = terms.R[:, held] / row_sizes(terms.R[:, held].T)
    for idle in null_space(forces, rcond=HALF_PRECISION_RTOL).T if len(held) else ():
        extra = np.zeros(len(found.rows))
        extra[held] = idle / row_sizes(terms.R[:, held].T) * max(1.0, float(np.max(np.abs(found.lam), initial=0.0)))
        bent = [(found.terms(part).K - terms.K)[:n_v] for part in (extra, *np.diag(extra)[held])]
        size = sum(float(np.max(np.abs(each), initial=0.0)) for each in bent)  # what is left of rows may be round-off
        if np.max(np.abs(free.T @ bent[0] @ free), initial=0.0) > NOMINAL_RTOL * size:
            lost = [found.titles[k] for k in held[np.abs(idle) > 1e-6]]
            return [
                f"the constraint Jacobian loses rank at this posture only ({', '.join(lost)}), where branches of "
                "motion meet, so that no linear motion exists; move the state off it"
            ]
    return []
