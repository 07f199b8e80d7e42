"""Laws of joints: tree edge, cut edge, seen from either side, one definition describes the same mechanics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import mbd
from mbd.bodies import Ground
from mbd.bodies.base import Frame
from mbd.configuration import Configuration
from mbd.dataclass import dataclass
from mbd.joints import Reversed
from mbd.joints.base import Joint
from mbd.tape.derivatives import jvp
from mbd.tape.node import Node
from mbd.testing.equations import equation_laws
from mbd.testing.findings import Findings, Verdict
from mbd.testing.scope import FreeScope, Numbers, skew

EYE = np.eye(3)
DIFFERENCE_STEP = 1e-4
SOMEWHERE = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
"""Coordinates of a joint for questions about its words [m, rad, -]."""


@dataclass(frozen=True)
class Placed:
    """A joint at a posture: R and p on the tape, and as numbers."""

    joint: Joint
    scope: FreeScope
    q: list[Node]
    R: Any
    p: Any

    @classmethod
    def at(cls, joint: Joint, values: Sequence[float]) -> Placed:
        scope = FreeScope()
        q = [scope.tape.input("q", k) for k in range(len(joint.labels))]
        scope.numbers |= dict(zip(q, map(float, values), strict=True))
        R, p = joint.transform(q, scope)
        return cls(joint, scope, q, R, p)

    def numbers(self, given: dict[Any, float] | None = None) -> Numbers:
        """(4, 3): the rows of R, then p."""
        return np.array(self.scope.value(*(x for row in (*self.R, self.p) for x in row), given=given)).reshape(4, 3)


def check_joint(joint: Joint | Callable[[Frame, Frame], Joint], *, postures: int = 8, seed: int = 0) -> Verdict:
    """A joint's transform, subspace, rows and recover tell one story, forwards and backwards, cut or not.

    Parameters
    ----------
    joint : a joint, or a function ``factory(parent, child)`` that makes one between two frames
    postures : how many random postures are tried; angles up to 1.4 rad, displacements up to 1.4 m

    Raises
    ------
    LawBroken
        an AssertionError that lists the broken laws, with the coordinates that show them.
    """
    if not isinstance(joint, Joint):
        joint = joint(Ground().origin, mbd.RigidBody("child", 1.0, (1.0, 1.0, 1.0)).origin)
    findings = Findings(f"joint {type(joint).__name__} '{joint.name}'")
    _words(findings, joint)
    rng = np.random.default_rng(seed)
    for k in range(postures):
        values = np.array(joint.normalise(list(rng.uniform(-1.4, 1.4, len(joint.labels)))), dtype=float)
        shown = ", ".join(f"{label.name} = {value:.4f}" for label, value in zip(joint.labels, values, strict=True))
        for each, side in (joint, ""), (Reversed(joint), ", seen from the child"):
            findings.where = f"{shown or 'its one posture'}{side} (seed {seed}, posture {k})"
            placed = Placed.at(each, list(values))
            _transform_laws(findings, placed)
            _row_laws(findings, placed)
        _composition(findings, joint, values)
        if not joint.is_vector:
            _chart_laws(findings, joint, values, rng)
    findings.where = f"seed {seed}"
    _planarity(findings, joint)
    if not findings.broken:
        _mechanics(findings, joint, seed)
    return findings.verdict()


def _transform_laws(findings: Findings, placed: Placed) -> None:
    """R is a rotation; the subspace is the derivative of (R, p); recover inverts the transform."""
    joint, scope, place = placed.joint, placed.scope, placed.numbers()
    R = place[:3]
    hint = "transform() returns R with the child's axes as columns, seen from the parent, and p"
    findings.equal("R is a rotation", "R Rᵀ", R @ R.T, EYE, hint, 1e-12)
    findings.equal("R is a rotation", "det R", np.linalg.det(R), 1.0, hint, 1e-12)
    again = Placed.at(joint, scope.value(*placed.q)).numbers()
    findings.equal("determinism", "transform asked again", again, place, "it may depend on q alone", 0.0)
    law = "the subspace is the derivative of the transform"
    hint = "subspace() gives (ω, v) of the child frame per unit velocity in CHILD axes: [ω×] = Rᵀ ∂R/∂q, v = Rᵀ ∂p/∂q"
    subspace, here = joint.subspace(placed.q, scope), scope.value(*placed.q)
    if not findings.equal(law, "number of directions", len(subspace), len(joint.freedoms), hint):
        return
    for k, (label, (angular, linear)) in enumerate(zip(joint.freedoms, subspace, strict=True)):
        shifts = [[side * DIFFERENCE_STEP * (j == k) for j in range(len(subspace))] for side in (1.0, -1.0, 2.0, -2.0)]
        sides = [placed.numbers(dict(zip(placed.q, _moved(joint, here, x), strict=True))) for x in shifts]
        slopes = (8.0 * (sides[0] - sides[1]) - (sides[2] - sides[3])) / (12.0 * DIFFERENCE_STEP)
        turn = R.T @ slopes[:3]
        spin = [turn[2, 1], turn[0, 2], turn[1, 0]]
        findings.equal(law, f"angular velocity of '{label.name}'", scope.value(*angular), spin, hint, 1e-8)
        findings.equal(law, f"linear velocity of '{label.name}'", scope.value(*linear), R.T @ slopes[3], hint, 1e-8)
    found = scope.value(*joint.recover(placed.R, placed.p, scope))
    hint = "recover() reads the coordinates off R, p; angles between −π and π"
    off = np.array(joint.difference(list(here), list(found)), dtype=float)
    findings.equal("recover inverts the transform", "q less what it is", off, 0.0, hint, 1e-10)


def _moved(joint: Joint, q: Sequence[float], x: Sequence[float]) -> list[float]:
    """q ⊕ x in numbers."""
    return [float(value) for value in joint.compose(list(q), list(x))]


def _row_laws(findings: Findings, placed: Placed) -> None:
    """Rows vanish on the joint's own motion, and hold everything else."""
    joint, scope = placed.joint, placed.scope
    residuals = [value for _, value in joint.rows(placed.R, placed.p, scope)]
    hint = "rows() are the constraints that the joint's own motion satisfies at every q"
    findings.equal("rows vanish on the joint's own motion", "h", scope.value(*residuals), 0.0, hint, 1e-11)
    law, freedom = "rows and coordinates share the six freedoms", len(joint.freedoms)
    hint = "a joint with n velocities has 6 − n independent rows"
    if not findings.equal(law, "number of rows", len(residuals), 6 - freedom, hint):
        return
    jacobian = _row_jacobian(placed)
    smallest = float(np.linalg.svd(jacobian, compute_uv=False).min(initial=np.inf))
    sentence = f"the rows depend on each other: smallest singular value {smallest:.3g} of their Jacobian"
    findings.holds(law, smallest > 1e-6, sentence, hint)
    hint = "a row resists a motion that the joint allows, or the subspace is wrong"
    for label, (angular, linear) in zip(joint.freedoms, joint.subspace(placed.q, scope), strict=True):
        along = jacobian @ np.array(scope.value(*angular, *linear))
        findings.equal("rows do not resist the joint's motion", f"ḣ along '{label.name}'", along, 0.0, hint, 1e-10)


def _row_jacobian(placed: Placed) -> Numbers:
    """∂h against a twist (ω, v) in child axes (rows, 6), from rows on free inputs."""
    scope, place = placed.scope, placed.numbers()
    free = [scope.tape.input("placed", k) for k in range(12)]
    rotation: Any = (tuple(free[0:3]), tuple(free[3:6]), tuple(free[6:9]))
    point: Any = tuple(free[9:12])
    rows = [scope.tape.lift(value) for _, value in placed.joint.rows(rotation, point, scope)]
    scope.numbers |= dict(zip(free, map(float, place.ravel()), strict=True))
    columns = []
    for k in range(6):
        change = np.zeros((4, 3))
        if k < 3:
            change[:3] = place[:3] @ np.array(skew(list(map(float, EYE[k]))), dtype=float)
        else:
            change[3] = place[:3, k - 3]
        columns.append(scope.value(*jvp(rows, dict(zip(free, map(float, change.ravel()), strict=True)))))
    return np.array(columns).T.reshape(len(rows), 6)


def _composition(findings: Findings, joint: Joint, values: Numbers) -> None:
    """q ⊕ x."""
    scope = FreeScope()
    sizes = {"q": len(joint.labels), "x": len(joint.freedoms)}
    q, x = ([scope.tape.input(kind, k) for k in range(size)] for kind, size in sizes.items())
    composed, scope.numbers = joint.compose(q, x), scope.numbers | dict(zip(q, map(float, values), strict=True))
    rest = dict.fromkeys(x, 0.0)
    hint = "compose(q, x) is q ⊕ x, and q where x is zero"
    findings.equal("q ⊕ 0 = q", "q ⊕ 0", scope.value(*composed, given=rest), values, hint, 1e-14)
    if joint.is_vector:
        sum_ = scope.value(*composed, given=dict.fromkeys(x, 0.25))
        findings.equal("⊕ is + where is_vector says so", "q ⊕ x", sum_, values + 0.25, hint, 1e-12)


def _chart_laws(findings: Findings, joint: Joint, values: Numbers, rng: np.random.Generator) -> None:
    """⊖ inverts ⊕, N(q) is the derivative of ⊕, and D(x) tells how increments move (see `mbd.configuration`)."""
    findings.where = f"q = {np.array2string(values, precision=4)}"
    whole = Configuration.of_joints([joint])
    n, reach = whole.n_v, rng.uniform(0.0, 1.2)
    x, v = rng.uniform(-reach, reach, n), rng.uniform(-1.0, 1.0, n)
    there = whole.compose(values, x)
    hint = "difference(q, other) is the increment x with q ⊕ x = other"
    findings.equal("(q ⊕ x) ⊖ q = x", "x", whole.difference(values, there), x, hint, 1e-12)
    tiny = whole.difference(values, whole.compose(values, 1e-9 * x))
    findings.equal("(q ⊕ x) ⊖ q = x", "a tiny x", tiny, 1e-9 * x, hint, 1e-15)
    back = whole.compose(values, whole.difference(values, there))
    findings.equal("q ⊕ (q' ⊖ q) = q'", "q'", back, there, hint, 1e-12)
    hint = "normalise(q) is q of every placement, and q ⊕ x is one"
    findings.equal("q ⊕ x is a placement", "q", whole.normalise(there), there, hint, 1e-14)
    sides = (1.0, -1.0, 2.0, -2.0)

    def slope(points: list[Numbers]) -> Numbers:
        return np.asarray((8.0 * (points[0] - points[1]) - (points[2] - points[3])) / (12.0 * DIFFERENCE_STEP))

    rates = slope([whole.compose(values, side * DIFFERENCE_STEP * v) for side in sides])
    hint = "coordinate_rates(q, v) is ∂(q ⊕ x)/∂x · v at x = 0"
    findings.equal("q̇ = N(q) v is the rate of q ⊕ s v", "q̇", whole.rates(values, v), rates, hint, 1e-9)
    moving = whole.increment_rates(x, v)
    points = [whole.difference(there, whole.compose(values, x + side * DIFFERENCE_STEP * moving)) for side in sides]
    hint = "increment_rates(x, v) is ẋ of the motion q ⊕ x(t) with velocities v"
    findings.equal("ẋ = D(x)⁻¹ v moves q ⊕ x with v", "v", slope(points), v, hint, 1e-9)
    hint = "increment_velocities is the inverse of increment_rates"
    findings.equal("v = D(x) ẋ", "v", whole.increment_velocities(x, moving), v, hint, 1e-12)
    bent = slope([whole.increment_rates(side * DIFFERENCE_STEP * v, v) for side in sides])
    hint = "ẋ = v + ½ [x, v] + O(x²), skew in x and v; else schemes of second order lose one"
    findings.equal("the part of D⁻¹ that is linear in x is skew", "d/ds D(s v)⁻¹ v at s = 0", bent, 0.0, hint, 1e-9)


def _words(findings: Findings, joint: Joint) -> None:
    """Labels, parameters, faults."""
    placed = Placed.at(joint, SOMEWHERE[: len(joint.labels)])
    scope = placed.scope
    rows = [label for label, _ in joint.rows(placed.R, placed.p, scope)]
    joint.subspace(placed.q, scope)
    joint.recover(placed.R, placed.p, scope)
    joint.elastic_energy(placed.q, scope)
    joint.resistance([scope.tape.input("v", k) for k in range(len(joint.freedoms))], scope)
    declared = joint.parameters()
    undeclared = {name: value for name, value in scope.recorded.items() if declared.get(name) != value}
    hint = "parameters() must name every scope.parameter(…) with the same value"
    findings.holds("parameters are declared before they are used", not undeclared, f"undeclared: {undeclared}", hint)
    units = {label.unit for label in joint.freedoms}
    findings.holds("units are 'rad' or 'm'", units <= {"rad", "m"}, f"units {sorted(units)}", "see Label")
    named = {"coordinate": joint.labels, "velocity": joint.velocity_labels}
    for kind, names in *((kind, [label.name for label in labels]) for kind, labels in named.items()), ("row", rows):
        sentence = f"{kind} names {names}"
        findings.holds("names are told apart", len(set(names)) == len(names), sentence, "give each its own label")
    faults = joint.faults()
    findings.holds("it finds no fault with itself", not faults, "; ".join(faults), "its own faults() complains")


def _planarity(findings: Findings, joint: Joint) -> None:
    """A planar joint leaves z alone exactly, so that a planar model folds to the plane."""
    placed = Placed.at(joint, SOMEWHERE[: len(joint.labels)])
    R, p = placed.R, placed.p
    z = [placed.scope.tape.lift(x) for x in (R[0][2], R[1][2], R[2][0], R[2][1], p[2])]
    flat = all(node.is_zero for node in z) and placed.scope.tape.lift(R[2][2]).is_constant
    sentence = f"is_planar is {joint.is_planar}, the transform {'leaves z alone' if flat else 'moves z'}"
    hint = "is_planar: it turns about z only and shifts in x–y only; zeros must be exact to fold"
    findings.holds("is_planar tells the truth", flat == joint.is_planar, sentence, hint)


def _mechanics(findings: Findings, joint: Joint, seed: int) -> None:
    """In a mechanism: the laws of its equations, and one motion whether the joint is walked or cut."""
    joint = Reversed(joint).joint
    base = mbd.RigidBody("base", 2.0, (0.3, 0.4, 0.5, 0.01, 0.02, 0.03), center=(0.1, 0.2, 0.05))
    load = mbd.RigidBody("load", 1.0, (0.2, 0.3, 0.4, 0.01, 0.0, 0.02), center=(0.1, -0.3, 0.2))
    flat = joint.is_planar
    moved: Any = replace(joint, parent=_like(joint.parent, base), child=_like(joint.child, load))  # type: ignore[type-var]
    for cut in ("auto", (joint.name,)):
        model = mbd.Model("two bodies", gravity=(1.0, -9.81, 0.0 if flat else 2.0), cut=cut)
        hinge = mbd.Revolute("hinge", model.ground.point(0.3, 0.1), base.point(0.1, 0.4), loss=mbd.Viscous(0.2))
        model.connect(hinge, moved)
        if cut != "auto":  # another way to the ground
            ends = model.ground.point(-0.2, 0.3), load.point(0.1, 0.2)
            model.connect(mbd.Planar("arm", *ends) if flat else mbd.Universal("arm", *ends))
        equation_laws(findings, model, postures=1, seed=seed)


def _like(frame: Frame, body: mbd.RigidBody) -> Frame:
    """The same place and axes on another body; shifted, so that lever arms show."""
    return Frame(body, "attachment", (0.2, -0.1, 0.0), frame.rotation)
