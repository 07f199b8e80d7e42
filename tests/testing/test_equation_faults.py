"""Equations with one thing wrong: each is caught by the law it breaks."""

from dataclasses import replace

import pytest

import mbd
from mbd.equations import derive
from mbd.equations.inputs import Inputs
from mbd.testing import LawBroken
from mbd.testing.equations import equation_laws
from mbd.testing.findings import Findings


def sound():
    """The equations of two links with a spring, a damper, a row, a blade, a foot and a pad."""
    model = mbd.Model("two links")
    upper, lower = (mbd.Link(name, 1.0, 0.5, 0.2, inertia=0.03) for name in ("upper", "lower"))
    model.connect(
        mbd.Revolute("shoulder", model.ground.origin, upper.start, loss=mbd.Viscous(0.3)),
        mbd.Revolute("elbow", upper.end, lower.start),
    )
    model.apply(mbd.Spring("spring", model.ground.point(1.0, 0.0), lower.end, stiffness=5.0, length=0.2))
    model.constrain(
        mbd.Bilateral("guide", mbd.separation(model.ground.origin, lower.end, (1, 1, 0)), -0.3),
        mbd.KnifeEdge("blade", lower.end),
        mbd.Unilateral("foot", mbd.touchdown(lower.end), friction=0.0),
        mbd.Penalty("pad", mbd.height(lower.end), stiffness=100.0, damping=3.0),
    )
    return derive(model)


class Bent:
    """A derivation whose known derivatives are wrong."""

    def __init__(self, geometry):
        self.geometry = geometry

    def balance_with(self, *what):
        return self.geometry.balance_with(*what)

    def mass_matrix(self):
        return [[1.1 * entry for entry in line] for line in self.geometry.mass_matrix()]

    def tangent(self, *what):
        return None

    def partials(self, outputs):
        return [{node: 1.1 * slope for node, slope in known.items()} for known in self.geometry.partials(outputs)]

    def rates(self, outputs):
        return {node: 1.1 * rate for node, rate in self.geometry.rates(outputs).items()}


def tampered(fault):
    """The equations after one change."""
    equations = sound()
    x, v, a = (getattr(Inputs.of(equations), kind) for kind in "xva")
    rows, contacts, effects = list(equations.rows), list(equations.contacts), list(equations.effects)
    bent = 0.1 * mbd.sin(x[0]) * v[1]
    if fault == "mass":
        return replace(equations, balance=(equations.balance[0] + 0.1 * a[1], *equations.balance[1:]))
    if fault == "negative mass":
        return replace(equations, balance=tuple(r - 9.0 * each for r, each in zip(equations.balance, a, strict=True)))
    if fault == "kinetic":
        return replace(equations, kinetic=1.1 * equations.kinetic)
    if fault == "rate":
        rows[0] = replace(rows[0], rate=-rows[0].rate)
        return replace(equations, rows=tuple(rows))
    if fault == "geometry":
        return replace(equations, geometry=Bent(equations.geometry))
    if fault == "kinked rate":
        rows[1] = replace(rows[1], rate=rows[1].rate + mbd.sign(mbd.sin(1e5 * v[0])))
        return replace(equations, rows=tuple(rows))
    if fault == "quadratic rate":
        rows[1] = replace(rows[1], rate=rows[1].rate + v[0] * v[1])
        return replace(equations, rows=tuple(rows))
    if fault == "gap rate":
        contacts[0] = replace(contacts[0], gap_rate=contacts[0].gap_rate + bent)
        return replace(equations, contacts=tuple(contacts))
    if fault == "one-sided push":
        contacts[1] = replace(contacts[1], generalized=(contacts[1].generalized[0], equations.tape.zero))
        return replace(equations, contacts=tuple(contacts))
    for k, effect in enumerate(effects):
        if fault == "potential" and effect.name == "spring":
            effects[k] = replace(effect, potential=2.0 * effect.potential)
        if fault in ("power", "active") and effect.kind == "loss":
            effects[k] = replace(effect, power=-effect.power)
    return replace(equations, effects=tuple(effects))


FAULTS = [
    ("mass", "M is symmetric"),
    ("negative mass", "M is positive semidefinite"),
    ("kinetic", "T = ½ vᵀ M v"),
    ("kinetic", "energy balance: v · (M a + f) = d(T + V)/dt − Σ P"),
    ("rate", "ḣ = B v + h_t"),
    ("geometry", "ḧ = B a + (ḣ)˙ at a = 0"),
    ("geometry", "B = ∂h/∂q"),
    ("geometry", "M = ∂r/∂a is that of composite bodies"),
    ("geometry", "tangent exactness: Newton's matrix against differences (index 3)"),
    ("kinked rate", "B = ∂ḣ/∂v of a row on velocities"),
    ("rate", "tangent exactness: Newton's matrix against differences (ggl)"),
    ("quadratic rate", "a row on velocities is B v + b"),
    ("gap rate", "ġ is the rate of g"),
    ("one-sided push", "a penalty force acts along the gradient of its gap"),
    ("potential", "a force with a potential is its gradient"),
    ("power", "power = −f · v"),
    ("active", "passivity: losses take energy out"),
]


def laws_of(equations, seed=0):
    findings = Findings("equations")
    equation_laws(findings, equations, postures=2, seed=seed)
    return findings


def test_sound_equations_keep_every_law():
    findings = laws_of(sound())
    assert not findings.broken
    assert {law for _, law in FAULTS} <= set(findings.tried)


@pytest.mark.parametrize(("fault", "law"), FAULTS)
def test_a_wrong_equation_is_caught(fault, law):
    findings = laws_of(tampered(fault))
    with pytest.raises(LawBroken, match="at posture [01] of the model 'two links': shoulder.angle = ") as caught:
        findings.verdict()
    assert law in caught.value.laws
