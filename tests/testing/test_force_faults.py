"""Wrong forces and measures of a user: each is caught by the law it breaks."""

from dataclasses import dataclass
from typing import Any

import pytest

import mbd
from mbd.bodies.algebra import difference, dot, norm
from mbd.bodies.base import Frame
from mbd.constraints.measure import Measure
from mbd.forces.base import Action, Force
from mbd.testing import LawBroken, check_force, check_measure


@dataclass(frozen=True)
class Own(Force):
    """A force by a function (scope, a, b) → Action."""

    name: str
    a: Frame
    b: Frame
    action: Any
    sort: str = "applied"
    told: tuple[str, ...] = ("a", "b")
    stiffness: float = 3.0

    @property
    def kind(self):
        return self.sort

    def mentions(self):
        return [getattr(self, end) for end in self.told]

    def parameters(self):
        return {f"{self.name}.stiffness": self.stiffness}

    def act(self, scope):
        k = scope.parameter(self.name, "stiffness", self.stiffness)
        return self.action(k, scope.frame(self.a), scope.frame(self.b))


def asymmetric(k, a, b):
    """A spring that pulls b with k and a with 2 k."""
    arm = difference(b.position, a.position)
    pulls = [(v, -k * x) for v, x in zip(b.velocity, arm, strict=True)]
    return Action(pairs=(*pulls, *((v, 2.0 * k * x) for v, x in zip(a.velocity, arm, strict=True))))


def crooked(k, a, b):
    """Opposite forces, but across the line between the points: a couple that nothing balances."""
    x, y, _ = difference(b.position, a.position)
    force = (-k * y, k * x, 0.0)
    return Action(pairs=tuple((u - v, f) for u, v, f in zip(b.velocity, a.velocity, force, strict=True)))


def anchored(k, a, b):
    """Balanced, but along the ground's x axis."""
    force = k * (b.position[0] - a.position[0])
    return Action(pairs=((b.velocity[0] - a.velocity[0], -force),))


def active_damper(k, a, b):
    """A damper that pushes the way it moves."""
    arm = difference(b.position, a.position)
    rate = dot(arm, difference(b.velocity, a.velocity)) / norm(arm)
    return Action(pairs=((rate, k * rate),))


def squared(k, a, b):
    """A 'velocity' that is none."""
    rate = dot(difference(b.velocity, a.velocity), difference(b.velocity, a.velocity))
    return Action(pairs=((rate, -k),))


def elastic(k, a, b):
    arm = difference(b.position, a.position)
    return Action(potential=0.5 * k * dot(arm, arm))


def kinked(k, a, b):
    """A force that jumps many times on its way."""
    arm = difference(b.position, a.position)
    rate = dot(arm, difference(b.velocity, a.velocity)) / norm(arm)
    return Action(pairs=((rate, k * mbd.sign(mbd.sin(1e5 * norm(arm)))),))


@dataclass(frozen=True)
class Undeclared(Own):
    def parameters(self):
        return {}


FORCES = {
    "action = reaction: the forces on all bodies balance": [
        (lambda a, b, hinge: Own("it", a, b, asymmetric), r"net force along x: expected 0, found .*seed 0"),
        (lambda a, b, hinge: Own("it", a, b, crooked), r"net moment about .: expected 0"),
    ],
    "frame invariance: turning and moving the whole scene changes nothing": [
        (lambda a, b, hinge: Own("it", a, b, anchored), r"absolute place or direction"),
    ],
    "passivity: a loss takes energy out": [
        (lambda a, b, hinge: Own("it", a, b, active_damper, "loss"), r"expected ≤ 0 W, found"),
    ],
    "velocities of pairs are linear in the rates": [
        (lambda a, b, hinge: Own("it", a, b, squared), r"a pair is \(velocity, force\)"),
    ],
    "kind agrees with the action": [
        (lambda a, b, hinge: Own("it", a, b, elastic, "applied"), r"kind is 'applied', and act\(\) gives a potential"),
        (lambda a, b, hinge: Own("it", a, b, elastic, "magic"), r"kind 'magic'"),
    ],
    "mentions are complete": [
        (lambda a, b, hinge: Own("it", a, b, elastic, "potential", ("a",)), r"not mentioned: shank"),
    ],
    "parameters are declared before they are used": [
        (lambda a, b, hinge: Undeclared("it", a, b, elastic, "potential"), r"it\.stiffness"),
    ],
    "tangent: ∂f/∂q and ∂f/∂v are slopes of f": [
        (lambda a, b, hinge: Own("it", a, b, kinked), r"generalized force entry"),
    ],
    "it finds no fault with itself": [
        (lambda a, b, hinge: mbd.Spring("it", a, b, stiffness=1.0, length=-1.0), r"length -1 m is negative"),
    ],
}


@pytest.mark.parametrize("law", FORCES)
def test_a_wrong_force_is_caught(law):
    for factory, reason in FORCES[law]:
        with pytest.raises(LawBroken, match=f"(?s){reason}") as caught:
            check_force(factory)
        assert law in caught.value.laws


def test_a_correct_force_of_ones_own_passes():
    verdict = check_force(lambda a, b, hinge: Own("it", a, b, elastic, "potential"))
    assert "action = reaction: the forces on all bodies balance" in verdict.laws
    assert "energy balance: v · (M a + f) = d(T + V)/dt − Σ P" in verdict.laws


def test_what_pushes_from_outside_may_say_so():
    factory = lambda a, b, hinge: Own("it", a, b, anchored)  # noqa: E731
    assert not any(law.startswith("frame") for law in check_force(factory, internal=False).laws)


def test_an_instance_is_taken_too():
    a, b = mbd.PointMass("one", 1.0), mbd.PointMass("two", 1.0)
    check_force(mbd.Spring("spring", a.origin, b.origin, stiffness=2.0, length=0.5))
    with pytest.raises(LawBroken, match="Own 'it' breaks"):
        check_force(Own("it", a.origin, b.origin, asymmetric))


def test_something_else_is_told_what_is_expected():
    with pytest.raises(mbd.ModelError, match="takes a force or a function"):
        check_force(lambda a, b, hinge: 3)


# measures ---------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Place(Measure):
    """A measure by functions of two frames' motions."""

    a: Frame
    b: Frame
    function: Any
    slips: tuple[Any, ...] = ()
    offset: float = 0.0
    sticks: bool = True
    unit_: str = "m"
    told: tuple[str, ...] = ("a", "b")

    def gap(self, scope):
        return self.function(scope.frame(self.a), scope.frame(self.b))

    @property
    def unit(self):
        return self.unit_

    def mentions(self):
        return [getattr(self, end) for end in self.told]

    @property
    def has_tangents(self):
        return self.sticks and bool(self.slips)

    def captured(self, scope):
        return [slip(scope.frame(self.a), scope.frame(self.b)) for slip in self.slips]

    def tangents(self, scope, anchors):
        now = self.captured(scope)
        return [(f"slip {k}", a - b + self.offset) for k, (a, b) in enumerate(zip(now, anchors, strict=True))]


@dataclass(frozen=True)
class Growing(Place):
    """A gap that grows each time it is asked."""

    def gap(self, scope):
        COUNT.append(1)
        return super().gap(scope) + 1e-3 * len(COUNT)


COUNT: list[int] = []


def stretch(a, b):
    arm = difference(b.position, a.position)
    return dot(arm, arm)


def from_origin(a, b):
    """A distance of two bodies that also asks where the first of them is."""
    return stretch(a, b) + 0.1 * a.position[0]


def across(a, b):
    return a.position[0]


def speed(a, b):
    return a.velocity[1]


MEASURES = {
    "frame invariance: turning and moving the whole scene changes nothing": (
        lambda a, b, hinge: Place(a, b, from_origin), r"gap after the move: expected .*, found .*absolute place"
    ),
    "action = reaction: the forces λ ∂g/∂q on all bodies balance": (
        lambda a, b, hinge: Place(a, b, from_origin), r"net force along x for λ = 1: expected 0, found 0\.1"
    ),
    "it depends on the posture and the time": (
        lambda a, b, hinge: Place(a, b, speed), r"it depends on inputs \['v'\]"
    ),
    "mentions are complete": (lambda a, b, hinge: Place(a, b, stretch, told=("a",)), r"not mentioned: shank"),
    "tangents are zero where the contact closed": (
        lambda a, b, hinge: Place(a, b, stretch, (across,), 0.01), r"slip entry|slip: expected 0, found 0\.01"
    ),
    "tangents are independent of the normal": (
        lambda a, b, hinge: Place(a, b, stretch, (stretch,)), r"smallest singular value"
    ),
    "tangents are as announced": (
        lambda a, b, hinge: Place(a, b, stretch, (across,), sticks=False), r"has_tangents is False"
    ),
    "unit is 'm' or 'rad'": (lambda a, b, hinge: Place(a, b, stretch, unit_="deg"), r"unit 'deg'"),
    "determinism": (lambda a, b, hinge: Growing(a, b, stretch), r"two expressions"),
    "Jacobian: ∂g/∂q is the slope of g": (
        lambda a, b, hinge: mbd.measure(lambda p: p[1] + mbd.sign(mbd.sin(1e5 * p[0])), a), r"gap entry .*expected"
    ),
}  # fmt: skip


@pytest.mark.parametrize("law", MEASURES)
def test_a_wrong_measure_is_caught(law):
    factory, reason = MEASURES[law]
    with pytest.raises(LawBroken, match=f"(?s){reason}") as caught:
        check_measure(factory)
    assert law in caught.value.laws


def test_a_correct_measure_of_ones_own_passes():
    verdict = check_measure(lambda a, b, hinge: Place(a, b, stretch))
    assert "frame invariance: turning and moving the whole scene changes nothing" in verdict.laws
    check_measure(lambda a, b, hinge: Place(a, b, from_origin), invariant=False)


def test_invariance_of_a_function_is_asked_for():
    tilted = lambda a, b, hinge: mbd.measure(lambda p, q: p[1] - q[1], a, b)  # noqa: E731
    check_measure(tilted)
    with pytest.raises(LawBroken, match="invariant=False"):
        check_measure(tilted, invariant=True)


def test_an_instance_may_name_its_joints_and_frames():
    rod, body = mbd.Link("rod", 1.0, 0.5, 0.2), mbd.PointMass("body", 1.0)
    pin = mbd.Revolute("pin", body.origin, rod.start)
    check_measure(mbd.measure("pin.angle", unit="rad"), joints=[pin])
    check_measure(mbd.measure(lambda y: 2.0 * y, "rod.end.y"), frames=[rod.end])
    with pytest.raises(mbd.UnknownNameError, match="did you mean 'pin"):
        check_measure(mbd.measure("pn.angle", unit="rad"), joints=[pin])
