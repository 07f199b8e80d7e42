"""Wrong constraints of a user, and wrong runs: each is caught by the law it breaks."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.equations.equations import Contact
from mbd.testing import LawBroken, check_constraint, check_model
from mbd.testing.findings import Findings
from mbd.testing.runs import run_laws
from tests.helpers import one_body
from tests.testing.test_force_faults import Own, Place, active_damper, asymmetric, from_origin
from tests.testing.test_joint_faults import WrongSign


@dataclass(frozen=True)
class Rubber(mbd.Penalty):
    """A penalty by a function of (k, δ, δ̇)."""

    function: Any = None

    def force(self, gap, gap_rate, scope, approach=1.0):
        k = scope.parameter(self.name, "stiffness", self.stiffness)
        return self.function(k, -gap, -gap_rate)


@dataclass(frozen=True)
class Superball(mbd.Unilateral):
    """It gives energy at each impact and finds no fault with that."""

    def faults(self):
        return []


@dataclass(frozen=True)
class Hidden(mbd.Bilateral):
    """A rod whose residual depends on a body that it does not mention, so it may be anything."""

    def residual(self, scope):
        return super().residual(scope) + mbd.sign(mbd.sin(1e5 * scope.frame(self.subject.a).position[0]))


def pad(function):
    return lambda a, b, hinge: Rubber("pad", mbd.touchdown(a), 1e3, function=function)


CONSTRAINTS = {
    "a penalty pushes when pressed": (pad(lambda k, d, rate: -k * d), r"'pad' at rest: expected p > 0, found -"),
    "passivity: a penalty resists its penetration": (
        pad(lambda k, d, rate: k * d - 0.02 * k * rate), r"at ġ = ∓0\.01: .* pressing \(expected ≥ 0\)"
    ),
    "passivity: a penalty gives back no more than it took": (
        pad(lambda k, d, rate: k * d - 0.02 * k * rate), r"'pad' gave .* of the swing"
    ),
    "a penalty starts from zero": (pad(lambda k, d, rate: k * d + 5.0), r"at the first touch, at rest: expected 0"),
    "frame invariance: turning and moving the whole scene changes nothing": (
        lambda a, b, hinge: mbd.Bilateral("rod", Place(a, b, from_origin), 0.4), r"gap after the move"
    ),
    "the run goes through": (
        lambda a, b, hinge: Superball("ball", mbd.height(a), restitution=1.5), r"the impact law would create energy"
    ),
    "B = ∂h/∂q": (lambda a, b, hinge: Hidden("rod", mbd.distance(a, b), 0.6), r"row 'rod'"),
    "it finds no fault with itself": (
        lambda a, b, hinge: mbd.Unilateral("ball", mbd.height(a), restitution=1.5), r"restitution 1\.5"
    ),
}  # fmt: skip


@pytest.mark.parametrize("law", CONSTRAINTS)
def test_a_wrong_constraint_is_caught(law):
    factory, reason = CONSTRAINTS[law]
    with pytest.raises(LawBroken, match=f"(?s){reason}") as caught:
        check_constraint(factory, postures=1)
    assert law in caught.value.laws


def test_an_instance_floats_in_the_plane():
    rod = mbd.Link("rod", 1.0, 0.5, 0.25, inertia=0.02)
    bead = mbd.PointMass("bead", 1.0)
    check_constraint(mbd.Bilateral("string", mbd.distance(rod.end, bead.origin), 0.7), postures=1)
    with pytest.raises(LawBroken, match="Rubber 'pad' breaks"):
        check_constraint(Rubber("pad", mbd.height(rod.end), 1e3, function=lambda k, d, rate: -k * d), postures=1)


def falling(random: bool):
    """A bead over the ground, with a controller that may draw its force by lot."""
    model, bead = one_body(mbd.PointMass("bead", 1.0), mbd.Prismatic, "fall", axis=(0, 1, 0))
    push = mbd.Applied("push", bead.origin, force=(0.0, 2.0, 0.0))
    lot = np.random.default_rng() if random else np.random.default_rng(1)
    fixed = float(lot.uniform())
    model.apply(
        push,
        mbd.Controller(
            "lot", lambda t, reads, state: {"push.force.y": float(lot.uniform()) if random else fixed}, period=0.05,
            writes=["push.force.y"],
        ),
    )  # fmt: skip
    model.constrain(mbd.Unilateral("floor", mbd.height(bead.origin), restitution=0.5))
    return model, mbd.assemble(model, position={"fall.displacement": 0.05})


def test_a_start_may_be_given_and_a_run_that_differs_is_caught():
    assert "impact: no energy is made" in check_constraint(lambda: falling(False)).laws
    with pytest.raises(LawBroken, match="determinism: a run repeated gives the same bits"):
        check_constraint(lambda: falling(True))


def test_a_lagrangian_is_taken_too():
    rod = mbd.Lagrangian(
        "pendulum in x and y", ["x", "y"], kinetic=lambda x_rate, y_rate: (x_rate**2 + y_rate**2) / 2,
        potential=lambda y: 9.81 * y, constraints={"rod": lambda x, y: (x**2 + y**2 - 1) / 2},
    )  # fmt: skip
    verdict = check_constraint(lambda: (rod, mbd.assemble(rod, position={"x": 1.0})))
    assert {"B = ∂h/∂q", "rows hold along the run"} <= set(verdict.laws)


def test_something_else_is_told_what_is_expected():
    with pytest.raises(mbd.ModelError, match="check_constraint takes a constraint"):
        check_constraint(lambda: 3)


# models -----------------------------------------------------------------------------------------------------------
def two_links(wrong: str) -> mbd.Model:
    model = mbd.Model("two links", cut=["elbow"] if wrong == "cut" else "auto")
    upper, lower = (mbd.Link(name, 1.0, 0.5, 0.2, inertia=0.03) for name in ("upper", "lower"))
    kind = WrongSign if wrong in ("sign", "cut") else mbd.Revolute
    model.connect(mbd.Revolute("shoulder", model.ground.origin, upper.start), kind("elbow", upper.end, lower.start))
    if wrong == "damper":
        model.apply(Own("it", upper.end, lower.end, active_damper, "loss"))
    if wrong == "spring":
        model.apply(Own("it", upper.end, lower.end, asymmetric))
    model.constrain(mbd.Bilateral("tip", mbd.height(lower.end), -0.5))
    return model


@pytest.mark.parametrize(
    ("wrong", "law"),
    [("sign", "ḣ = B v + h_t"), ("sign", "energy balance"), ("damper", "passivity: losses take energy out")],
)
def test_a_wrong_word_in_a_model_is_caught(wrong, law):
    with pytest.raises(LawBroken) as caught:
        check_model(two_links(wrong))
    assert any(found.startswith(law) for found in caught.value.laws), str(caught.value)


def test_the_model_without_faults_passes():
    check_model(two_links("none"))
    check_model(two_links("spring"))  # unbalanced, but a force like any other: check_force asks for balance


# runs -------------------------------------------------------------------------------------------------------------
class Run(SimpleNamespace):
    """A stand-in for a run of one contact."""

    def __getitem__(self, name):
        return np.array(getattr(self, name.rpartition(".")[2]), dtype=float)


def told(gap, force, closed, kind="unilateral", opens_on="pull", impulse=0.0, loss=0.0, parts=(), kinetic=(1, 2, 1)):
    """What the laws of a run find wrong with three rows of numbers."""
    zero = np.zeros(3)
    energy = SimpleNamespace(
        kinetic=np.array(kinetic, dtype=float), potential=zero, numerical=zero,
        parts=[SimpleNamespace(name=name, kind=sort, energy=np.array(e, dtype=float)) for name, sort, e in parts],
    )  # fmt: skip
    event = SimpleNamespace(time=0.1, kind="closed", name="foot", impulse=np.array([impulse]), energy_loss=loss)
    run = Run(
        time=np.array([0.0, 0.1, 0.2]), gap=gap, force=force, events=[event], energy=energy,
        columns=SimpleNamespace(record=SimpleNamespace(closed=np.array(closed, dtype=np.uint8).reshape(3, 1))),
    )  # fmt: skip
    contact = Contact("foot", kind, Any, Any, opens_on=opens_on)  # type: ignore[arg-type]
    findings = Findings("a run", "here")
    run_laws(findings, run, SimpleNamespace(contacts=[contact], rows=(), frictions=()))  # type: ignore[arg-type]
    return findings


RUNS = {
    "complementarity: gap ≥ 0": {"gap": [1.0, -0.1, 0.0], "force": [0, 0, 0], "closed": [0, 0, 1]},
    "complementarity: force ≥ 0": {"gap": [1.0, 0.0, 0.0], "force": [0, -2, 3], "closed": [0, 1, 1]},
    "complementarity: gap × force = 0": {"gap": [1.0, 0.3, 0.0], "force": [0, 2, 3], "closed": [0, 0, 1]},
    "a closed contact stays closed": {"gap": [1.0, 0.0, 0.2], "force": [0, 2, 0], "closed": [0, 1, 1]},
    "a penalty pushes": {"gap": [1, -1, -1], "force": [0, 2, -1], "closed": [0, 1, 1], "kind": "penalty"},
    "impact: impulses push": {"gap": [1, 0, 0], "force": [0, 2, 1], "closed": [0, 1, 1], "impulse": -0.2},
    "impact: no energy is made": {"gap": [1, 0, 0], "force": [0, 2, 1], "closed": [0, 1, 1], "loss": -0.2},
    "passivity: a damper takes energy along the run": {
        "gap": [1, 0, 0], "force": [0, 2, 1], "closed": [0, 1, 1], "parts": [("loss", "damper", [0, -1, -0.5])],
    },
    "passivity: an impact takes energy along the run": {
        "gap": [1, 0, 0], "force": [0, 2, 1], "closed": [0, 1, 1], "parts": [("foot", "impact", [0, 0, 0.5])],
    },
    "passivity: a penalty gives back no more than it took": {
        "gap": [1, -1, 1], "force": [0, 2, 0], "closed": [0, 1, 0], "kind": "penalty",
        "parts": [("foot", "penalty", [0, -1, 0.5])],
    },
}  # fmt: skip


@pytest.mark.parametrize("law", RUNS)
def test_a_wrong_run_is_caught(law):
    findings = told(**RUNS[law])
    assert list(findings.broken) == [law]
    with pytest.raises(LawBroken, match="t = 0\\.[012] s of the run from here|at here"):
        findings.verdict()


def test_a_right_run_passes():
    assert not told([1.0, 0.0, 0.0], [0.0, 2.0, 1.0], [0, 1, 1], impulse=0.3, loss=0.1).broken


def test_energy_that_no_effect_tells_is_caught():
    findings = told([1, 1, 1], [0, 0, 0], [0, 0, 0])
    findings.broken.clear()
    run = Run(time=np.zeros(2), energy=SimpleNamespace(
        kinetic=np.array([0.0, 1.0]), potential=np.zeros(2), numerical=np.array([0.0, 0.1]), parts=[]
    ), columns=SimpleNamespace(record=SimpleNamespace(closed=np.zeros((2, 0)))), events=[],
       violation=SimpleNamespace(length=1e-3, angle=0.0, worst="rod"))  # fmt: skip
    run_laws(findings, run, SimpleNamespace(contacts=[], rows=(1,), frictions=()))  # type: ignore[arg-type]
    assert set(findings.broken) == {"energy books close", "rows hold along the run"}


@pytest.mark.parametrize(
    ("law", "wrong"),
    [
        (
            "friction stays within its limit",
            lambda friction: replace(friction, limit=0.5 * friction.limit, sliding=0.5 * friction.sliding),
        ),
        ("friction opposes sliding", lambda friction: replace(friction, rate=-friction.rate)),
    ],
)
def test_friction_beyond_its_law_is_caught(law, wrong):
    """A real run, judged by half its limit, or by sliding the other way."""
    model, body = one_body(mbd.PointMass("block", mass=1.0), mbd.Translation, "place")
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=0.3))
    start = mbd.assemble(model, velocity={"place.x": 1.0}, closed="foot")
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=0.2)
    equations = mechanism_of(model).equations
    right = Findings("right")
    run_laws(right, run, equations)
    assert law in right.verdict().laws
    findings = Findings("wrong")
    run_laws(findings, run, replace(equations, frictions=tuple(wrong(each) for each in equations.frictions)))
    with pytest.raises(LawBroken) as caught:
        findings.verdict()
    assert set(caught.value.laws) == {law}
