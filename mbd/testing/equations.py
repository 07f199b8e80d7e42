"""Laws of equations of motion: what holds for every mechanism, whatever it is made of."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.equal import NOMINAL_RTOL
from mbd.equations import derive
from mbd.equations.equations import Contact, Equations
from mbd.equations.programs import ActiveSet, accelerations, constraint_jacobian, mass_matrix, newton, residual
from mbd.tape.node import Node
from mbd.testing.findings import Findings, Verdict
from mbd.testing.numbers import Numbers, Point, at, block, derivative, inputs


def check_model(model: Any, *, postures: int = 2, seed: int = 0) -> Verdict:
    """The laws of the equations of motion of a model with everything in it.

    M is symmetric and positive semidefinite, T = ½ vᵀ M v, forces with a potential are its gradient, the power of the
    balance is the change of energy less the power of every effect, losses lose, B and ḣ are derivatives of the rows,
    contact forces act along the gradient of their gap, and Newton's matrix is the derivative of the residual.

    Parameters
    ----------
    model : a `Model` or a `Lagrangian`
    postures : how many random postures, rates, accelerations and multipliers are tried; rows need not hold there

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws.
    """
    findings = Findings(f"model '{getattr(model, 'name', model)}'")
    equation_laws(findings, model, postures=postures, seed=seed)
    return findings.verdict()


def equation_laws(findings: Findings, model: Any, *, postures: int = 2, seed: int = 0) -> None:
    """The laws of `check_model`, added to what was found before."""
    equations = model if isinstance(model, Equations) else derive(model)
    outside = findings.where
    for k in range(postures):
        point = inputs(equations, seed + k, x=0.1 if equations.configuration.is_vector else 0.5)
        findings.where = f"posture {seed + k} of the model '{equations.name}': {_shown(equations, point)}"
        with np.errstate(all="ignore"):
            _inertia(findings, equations, point)
            _effects(findings, equations, point)
            _energy(findings, equations, point)
            _rows(findings, equations, point)
            for contact in equations.contacts:
                _contact(findings, equations, contact, point)
            _tangent(findings, equations, point)
    findings.where = outside


def _shown(equations: Equations, point: Point) -> str:
    parts = [f"{c.name} = {point['q', k]:.4f}" for k, c in enumerate(equations.coordinates[:4])]
    parts += [f"{name} = {point['v', k]:.4f}" for k, name in enumerate(equations.velocity_names[:4])]
    return ", ".join(parts) + (", …" if equations.n_q > 4 else "")


def _along(equations: Equations, point: Point) -> Point:
    """The direction of the motion: ẋ = D⁻¹ v, ṫ = 1."""
    return _increments(equations, point, _speeds(equations, point)) | {("t", 0): 1.0}


def _increments(equations: Equations, point: Point, v: Numbers) -> dict[tuple[str, int], float]:
    """ẋ = D⁻¹ v as a direction of the inputs."""
    rates = equations.configuration.increment_rates(_speeds(equations, point, "x"), v)
    return {("x", k): float(rate) for k, rate in enumerate(rates)}


def _speeds(equations: Equations, point: Point, kind: str = "v") -> Numbers:
    return np.array([point[kind, k] for k in range(equations.n_v)])


def _gradient(equations: Equations, nodes: Any, point: Point, kind: str = "x") -> Numbers:
    """Derivatives along each velocity, or ∂ nodes/∂v, by differences (nodes, n_v)."""
    axes = np.eye(equations.n_v)
    along = [{(kind, j): 1.0} if kind == "v" else _increments(equations, point, axes[j]) for j in range(equations.n_v)]
    return np.array([derivative(nodes, point, each) for each in along]).T


def _inertia(findings: Findings, equations: Equations, point: Point) -> None:
    n = equations.n_v
    M = at([entry for column in mass_matrix(equations)[:n] for entry in column[:n]], point).reshape(n, n)
    findings.equal("M is symmetric", "M", M, M.T, "two definitions of the same motion disagree", 1e-11)
    composite = None if equations.geometry is None else equations.geometry.mass_matrix()
    if composite is not None:
        found = at([entry for line in composite for entry in line], point).reshape(n, n)
        hint = "the motion per unit rate of a coordinate is not that of its bodies"
        findings.equal("M = ∂r/∂a is that of composite bodies", "M", found, M, hint, 1e-11)
    law, hint = "M is positive semidefinite", "a mass or an inertia is negative somewhere"
    lowest = float(np.linalg.eigvalsh(0.5 * (M + M.T)).min()) / (1.0 + float(np.abs(M).max()))
    findings.holds(law, lowest > -1e-11, f"smallest eigenvalue {lowest:.3g} of its scale", hint)
    v = _speeds(equations, point)
    kinetic = at([equations.kinetic], point)[0]
    findings.equal("T = ½ vᵀ M v", "T", kinetic, 0.5 * v @ M @ v, "velocities must be derivatives of positions", 1e-10)


def _effects(findings: Findings, equations: Equations, point: Point) -> None:
    v = _speeds(equations, point)
    for friction in equations.frictions:  # its multiplier opposes the motion, as where it slides
        point = point | {("lam", friction.row): 0.7 * float(np.sign(at([friction.rate], point)[0]))}
    point = point | dict.fromkeys(_rubbing(equations), -1.3)  # pushes
    for effect in equations.effects:
        force = at(list(effect.generalized()), point)[: equations.n_v]
        exact = 1e-9
        if effect.potential is not None and effect.power is not None:  # springs beside dampers
            force, exact = force - _gradient(equations, [effect.potential], point)[0], NOMINAL_RTOL
        elif effect.potential is not None:
            slope = _gradient(equations, [effect.potential], point)[0]
            hint = "the exact derivative differs from the values of the energy: a kink, or a slope that is not its own"
            findings.equal("a force with a potential is its gradient", effect.name, force, slope, hint, NOMINAL_RTOL)
        if effect.power is not None:
            power = at([effect.power], point)[0]
            hint = "the velocities of its pairs must be the rates of the places where it acts"
            findings.equal("power = −f · v", effect.name, power, -force @ v, hint, exact)
            if effect.kind == "loss":
                sentence = f"'{effect.name}' gives {power:.6g} W to the mechanism; expected ≤ 0"
                hint = "a loss opposes the motion"
                findings.holds("passivity: losses take energy out", power <= 0.0, sentence, hint)


def _rubbing(equations: Equations) -> list[tuple[str, int]]:
    """Multipliers that smooth friction of contacts follows."""
    return [("lam", contact.rows[0]) for contact in equations.contacts if contact.drags and contact.rows]


def _energy(findings: Findings, equations: Equations, point: Point) -> None:
    """``v · (M a + f) = d(T + V)/dt − Σ P``, for any motion."""
    v = _speeds(equations, point)
    point = point | dict.fromkeys(_rubbing(equations), 0.0)  # forces of rows are no part of the balance here
    moving = _along(equations, point) | {("v", k): point["a", k] for k in range(equations.n_v)}
    moving |= {("z", k): point["s", k] for k in range(equations.n_z)}
    parts = derivative([equations.kinetic, equations.potential], point, moving)
    powers = [e.power for e in equations.effects if e.power is not None and e.contact < 0]
    given = at(powers, point) if powers else np.zeros(1)
    explicit = derivative([equations.kinetic, equations.potential], point, {("t", 0): 1.0})
    if np.abs(explicit).max() > 1e-12 or equations.n_z:
        return  # energy that depends on time or on states has a power of its own
    work = float(v @ at(list(equations.balance), point)[: equations.n_v])
    hint = "an effect is missing from the energies, or velocities are not the rates of positions"
    size = np.abs(parts).sum() + np.abs(given).sum()
    law = "energy balance: v · (M a + f) = d(T + V)/dt − Σ P"
    findings.equal(law, "power", work, parts.sum() - given.sum(), hint, NOMINAL_RTOL, size)


def _rows(findings: Findings, equations: Equations, point: Point) -> None:
    rows = equations.rows
    if not rows:
        return
    h, rates = [row.value for row in rows], [row.rate for row in rows]
    n, n_v, R = equations.n_v + equations.n_z, equations.n_v, len(rows)
    B = at([entry for line in constraint_jacobian(equations, range(R)) for entry in line], point).reshape(R, n_v)
    slopes = _gradient(equations, h, point)
    by_rate = np.array([derivative(rates, point, {("v", j): 1.0}) for j in range(n_v)]).T
    rest = at(rates, point | {("v", j): 0.0 for j in range(n_v)})
    size = np.abs(at(h, point)).max()
    hint = "the exact derivative of the row differs from its values: a kink, or rates that are not those of positions"
    found, motion = at(rates, point), _along(equations, point)
    v, explicit = _speeds(equations, point), derivative(h, point, {("t", 0): 1.0})
    for k, row in enumerate(rows):
        title = f"row {row.title}"
        if row.is_velocity:
            findings.equal("B = ∂ḣ/∂v of a row on velocities", title, B[k], by_rate[k], hint, NOMINAL_RTOL)
            linear = by_rate[k] @ v + rest[k]
            findings.equal("a row on velocities is B v + b", title, found[k], linear, hint, NOMINAL_RTOL)
            continue
        findings.equal("B = ∂h/∂q", title, B[k], slopes[k], hint, NOMINAL_RTOL, size)
        findings.equal("ḣ = B v + h_t", title, found[k], slopes[k] @ v + explicit[k], hint, NOMINAL_RTOL, size)
    skipped = n * n + n + 2 * n * R + 2 * R
    bias = at(accelerations(equations), point)[skipped : skipped + R]
    expected = derivative(rates, point, motion)
    hint = "the second derivative of the row differs from its values: a kink in its slope"
    findings.equal("ḧ = B a + (ḣ)˙ at a = 0", "all rows", bias, expected, hint, 10.0 * NOMINAL_RTOL, found)


def _contact(findings: Findings, equations: Equations, contact: Contact, point: Point) -> None:
    motion, title = _along(equations, point), f"'{contact.name}'"
    if contact.is_velocity:
        motion |= {("v", k): point["a", k] for k in range(equations.n_v)}
    rate = derivative([contact.gap], point, motion)[0]
    hint = "ġ must be the derivative of g along the motion"
    findings.equal("ġ is the rate of g", title, at([contact.gap_rate], point)[0], rate, hint, NOMINAL_RTOL)
    if contact.force is not None:
        kind = "v" if contact.is_velocity else "x"
        force, slope = at([contact.force], point)[0], _gradient(equations, [contact.gap], point, kind)[0]
        found = at(list(contact.generalized), point)[: equations.n_v]
        hint = "the force acts along ∂g/∂q with equal and opposite parts on both sides"
        law = "a penalty force acts along the gradient of its gap"
        findings.equal(law, title, found, -force * slope, hint, NOMINAL_RTOL, force)


def _tangent(findings: Findings, equations: Equations, point: Point) -> None:
    """``K = [S ∂r/∂λ; B̃ 0]`` against differences of the residual, with every row and penalty active."""
    rows = range(len(equations.rows))
    penalties = [k for k, contact in enumerate(equations.contacts) if contact.kind == "penalty"]
    n, n_v, m = equations.n_v + equations.n_z, equations.n_v, len(equations.rows)
    c_C, c_K = point["c", 0], point["c", 1]
    hint = "K_t, C_t or M differs from differences of the residual: a force with a kink, or an inexact derivative"
    for stabilized in False, True:
        law = f"tangent exactness: Newton's matrix against differences ({'ggl' if stabilized else 'index 3'})"
        sizes = ((n,), (m,), (m,), (m, n_v)) if stabilized else ((n,), (m,))
        active = ActiveSet(rows, penalties, stabilized)
        K, *parts = block(at(newton(equations, active), point), (n + m, n + m), *sizes)
        out = residual(equations, active)
        if stabilized:
            _turning(findings, law, parts.pop(), out, point, hint)
        r = np.concatenate(parts)
        findings.equal(law, "residual beside the matrix", r, at(out, point), hint, 1e-11, r)
        scale = np.abs(r[:n]).max(initial=0.0)
        factor = np.array([c_C if stabilized or row.is_velocity else c_K for row in equations.rows])
        for j in range(n):
            free = {("a", j): 1.0, ("v", j): c_C, ("x", j): c_K}
            change = derivative(out, point, free if j < n_v else {("s", j - n_v): 1.0, ("z", j - n_v): c_C})
            findings.equal(law, f"column {j} of S", K[:n, j], change[:n], hint, 10.0 * NOMINAL_RTOL, scale)
            bottom = change[n + m :] if stabilized else change[n : n + m]
            findings.equal(law, f"column {j} of the rows", factor * K[n:, j], bottom, hint, 10.0 * NOMINAL_RTOL, scale)
        for k in range(m):
            change = derivative(out, point, {("lam", k): 1.0})
            findings.equal(law, f"column of λ {k}", K[:n, n + k], change[:n], hint, NOMINAL_RTOL, scale)
        if not m:
            return


def _turning(findings: Findings, law: str, turning: Numbers, out: Sequence[Node], point: Point, hint: str) -> None:
    """∂ḣ/∂x (m, n_v) against differences of ḣ, the last m components of a residual."""
    m, n_v = turning.shape
    for j in range(n_v if m else 0):
        change = derivative(out, point, {("x", j): 1.0})[-m:]
        findings.equal(law, f"∂ḣ/∂x in column {j}", turning[:, j], change, hint, 10.0 * NOMINAL_RTOL, change)
