"""Wrong joints and losses of a user: each is caught by the law it breaks, with a reason that can be read."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pytest

import mbd
from mbd.joints import Revolute
from mbd.joints.base import Joint, Label
from mbd.joints.losses import DissipationFunction, Loss
from mbd.testing import LawBroken, Verdict, check_joint, check_loss

COUNT: list[int] = []


def wrong(name: str, base: type = Revolute, **methods: Any) -> type:
    """A hinge, or another joint, some of whose methods are wrong."""
    return type(name, (base,), methods)


def turning(self, q, scope):
    return Revolute.transform(self, q, scope)


def all_rows(self, R, p, scope):
    return list(Revolute.rows(self, R, p, scope))


def shaken(self, q, scope):
    """Drawn again each time it is asked."""
    COUNT.append(1)
    return turning(self, q, scope)[0], (1e-4 * len(COUNT), 0.0, 0.0)


def with_a_secret(self, q, scope):
    scope.parameter(self.name, "play", 0.25)
    return turning(self, q, scope)


def stretched(self, q, scope):
    R, p = turning(self, q, scope)
    return tuple(tuple(1.01 * x for x in row) for row in R), p


def half(self, R, p, scope):
    return [0.5 * Revolute.recover(self, R, p, scope)[0]]


def turned_slide(self, q, scope):
    R, _ = Revolute("turn", self.parent, self.child).transform([0.5], scope)
    return R, (q[0], 0.0, 0.0)


WrongSign = wrong("WrongSign", subspace=lambda self, q, scope: [((0.0, 0.0, -1.0), (0.0, 0.0, 0.0))])
GroundAxes = wrong(
    "GroundAxes", mbd.Prismatic, transform=turned_slide,
    subspace=lambda self, q, scope: [((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))],
)  # fmt: skip
Forgetful = wrong("Forgetful", recover=half)
Stiff = wrong("Stiff", rows=lambda self, R, p, scope: [*all_rows(self, R, p, scope)[:4], ("turn z", R[1][0])])
Flat = wrong("Flat", is_planar=True)
Short = wrong("Short", rows=lambda self, R, p, scope: all_rows(self, R, p, scope)[:4])


@dataclass(frozen=True)
class Corkscrew(Joint):
    """A correct joint of a user's own: a screw about z of unit pitch."""

    name: str
    parent: Any
    child: Any
    loss: Any = None
    stiffness: float = 0.0
    rest: float = 0.0

    @property
    def labels(self) -> tuple[Label, ...]:
        return (Label("angle", "rad"),)

    @property
    def is_planar(self) -> bool:
        return False

    def transform(self, q, scope):
        return Revolute("turn", self.parent, self.child).transform(q, scope)[0], (0.0, 0.0, q[0])

    def subspace(self, q, scope):
        return [((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))]

    def rows(self, R, p, scope):
        angle = mbd.atan2(R[1][0], R[0][0])
        return [("x", p[0]), ("y", p[1]), ("along", p[2] - angle), ("turn x", R[0][2]), ("turn y", R[1][2])]

    def recover(self, R, p, scope) -> Sequence[Any]:
        return [mbd.atan2(R[1][0], R[0][0])]


JOINTS = {
    "the subspace is the derivative of the transform": (WrongSign, r"expected 1, found -1.*at angle = .*seed 0"),
    "R is a rotation": (wrong("Stretching", transform=stretched), r"R Rᵀ entry .*expected 1, found 1\.02"),
    "recover inverts the transform": (Forgetful, r"expected .*, found"),
    "rows vanish on the joint's own motion": (Stiff, r"h entry 4: expected 0"),
    "rows and coordinates share the six freedoms": (
        wrong("Loose", rows=lambda self, R, p, scope: [
            *(rows := all_rows(self, R, p, scope))[:4], ("turn again", rows[3][1])
        ]), r"smallest singular value",
    ),
    "rows do not resist the joint's motion": (Stiff, r"ḣ along 'angle' entry 4: expected 0"),
    "units are 'rad' or 'm'": (wrong("Degrees", labels=(Label("angle", "deg"),)), r"units \['deg'\]"),
    "names are told apart": (
        wrong("Twins", rows=lambda self, R, p, scope: [("x", row) for _, row in all_rows(self, R, p, scope)]),
        r"row names \['x', 'x'",
    ),
    "q ⊕ 0 = q": (wrong("Shifted", compose=lambda self, q, x: [a + b + 0.1 for a, b in zip(q, x, strict=True)]),
                  r"q ⊕ 0: expected"),
    "it finds no fault with itself": (wrong("Weak", faults=lambda self: ["the pin is worn"]), r"the pin is worn"),
    "determinism": (wrong("Drawn", transform=shaken), r"transform asked again"),
    "parameters are declared before they are used": (
        wrong("Secret", transform=with_a_secret), r"undeclared: \{'joint\.play': 0\.25\}",
    ),
    "is_planar tells the truth": (Flat, r"is_planar is True, the transform moves z"),
    "⊕ is + where is_vector says so": (
        wrong("Wide", compose=lambda self, q, x: [a + 2.0 * b for a, b in zip(q, x, strict=True)]), r"q ⊕ x",
    ),
}  # fmt: skip


@pytest.mark.parametrize("law", JOINTS)
def test_a_wrong_joint_is_caught(law):
    kind, reason = JOINTS[law]
    axis = (1, 0, 0) if kind is Flat else (0, 0, 1)
    with pytest.raises(LawBroken, match=f"(?s){reason}") as caught:
        check_joint(lambda a, b: kind("joint", a, b, axis=axis))
    assert law in caught.value.laws
    assert f"joint {kind.__name__} 'joint' breaks" in str(caught.value)


def test_a_missing_row_is_caught():
    with pytest.raises(LawBroken, match=r"number of rows: expected 5, found 4"):
        check_joint(lambda a, b: Short("joint", a, b))


def test_a_velocity_in_the_wrong_axes_is_caught():
    with pytest.raises(AssertionError, match=r"CHILD axes"):
        check_joint(lambda a, b: GroundAxes("joint", a, b))


def test_a_correct_joint_of_ones_own_passes():
    verdict = check_joint(lambda a, b: Corkscrew("joint", a, b))
    assert isinstance(verdict, Verdict)
    assert "laws hold" in str(verdict)


def test_an_instance_is_taken_too():
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", 1.0, 0.5, 0.2)
    check_joint(mbd.Revolute("pin", model.ground.origin, rod.start))
    with pytest.raises(LawBroken, match="WrongSign 'pin'"):
        check_joint(WrongSign("pin", model.ground.origin, rod.start))


def test_every_broken_law_is_listed():
    class Both(WrongSign, Forgetful):
        pass

    with pytest.raises(LawBroken) as caught:
        check_joint(lambda a, b: Both("joint", a, b))
    assert {"the subspace is the derivative of the transform", "recover inverts the transform"} <= set(
        caught.value.laws
    )


# losses -----------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Own(Loss):
    """A loss by a function of the rate."""

    function: Any
    coefficient: float = 0.5

    def force(self, rate, scope, owner):
        return self.function(rate) * scope.parameter(owner, "coefficient", self.coefficient)

    def fields(self):
        return {"coefficient": self.coefficient}


@dataclass(frozen=True)
class Undeclared(Own):
    """It does not declare its coefficient."""

    def fields(self):
        return {}


@dataclass(frozen=True)
class Mismatched(DissipationFunction):
    """Its force is not ∂D/∂v."""

    sign: float = 1.0

    def dissipation(self, rate, scope, owner):
        return self.sign * rate * rate

    def force(self, rate, scope, owner):
        return rate

    def fields(self):
        return {}


class Moody(Own):
    """Its force grows each time it is asked."""

    def force(self, rate, scope, owner):
        COUNT.append(1)
        return rate * (1.0 + 1e-3 * len(COUNT))

    def fields(self):
        return {}


@dataclass(frozen=True)
class Dry(Own):
    """Friction that sticks, by a function of the force in the joint; it also asks for the joint to be cut, or not."""

    cuts: bool = True

    @property
    def needs_reaction(self):
        return self.cuts

    def force(self, rate, scope, owner):
        return 0.0

    def dry(self, load, scope, owner):
        return self.function(load) * scope.parameter(owner, "coefficient", self.coefficient)


class MoodyDry(Dry):
    """Its limit grows each time it is asked."""

    def dry(self, load, scope, owner):
        COUNT.append(1)
        return super().dry(load, scope, owner) * (1.0 + 1e-3 * len(COUNT))


DRY = {
    "dry friction has a limit ≥ 0": (lambda: Dry(lambda load: 1.0 - load), "expected dry ≥ 0, found -"),
    "dry friction follows the force in proportion": (
        lambda: Dry(lambda load: load * load),
        "a constant times the force",
    ),
    "determinism of dry friction": (lambda: MoodyDry(lambda load: load), "may depend on its load alone"),
    "a limit that follows the force asks for it": (lambda: Dry(lambda load: load, 0.5, False), "needs_reaction"),
}


@pytest.mark.parametrize("law", DRY)
def test_wrong_friction_that_sticks_is_caught(law):
    make, reason = DRY[law]
    with pytest.raises(LawBroken, match=reason) as caught:
        check_loss(make)
    assert law in caught.value.laws


def test_friction_of_ones_own_that_sticks_passes():
    assert "dry friction has a limit ≥ 0" in check_loss(Dry(lambda load: 2.0 + 0.1 * load)).laws


def of_inputs_only(rate):
    """It asks whether the rate is an input, and forgets the sign of any other."""
    return rate if rate.op == "input" else -rate


LOSSES = {
    "passivity: it never feeds energy in": (lambda: Own(lambda v: -v), r"expected ≥ 0 W, found -"),
    "no force at rest": (lambda: Own(lambda v: v + 0.1), r"F\(0\): expected 0, found 0\.05"),
    "parameters are declared before they are used": (lambda: Undeclared(lambda v: v), r"declared \{\}"),
    "F = ∂D/∂v": (Mismatched, r"force\(\) must be the derivative"),
    "D is least at rest": (lambda: Mismatched(-1.0), r"is less than D\(0\)"),
    "determinism": (lambda: Moody(None), r"F may depend on its rate alone"),
    "any scalar may be the rate": (lambda: Own(of_inputs_only), r"F\(−v\)"),
    "it finds no fault with itself": (lambda: Own(lambda v: -v, -1.0), r"negative"),
}


@pytest.mark.parametrize("law", LOSSES)
def test_a_wrong_loss_is_caught(law):
    make, reason = LOSSES[law]
    with pytest.raises(LawBroken, match=reason) as caught:
        check_loss(make)
    assert law in caught.value.laws
    assert "at rate" in str(caught.value) or "at rest" in law or "declared" in law or "fault" in law


def test_a_jump_is_caught_where_it_is_met():
    with pytest.raises(LawBroken, match=r"continuity\n +F jumps from"):
        check_loss(Own(lambda v: mbd.sign(mbd.sin(1e9 * v)) * v + 2.0 * v))


def test_an_active_loss_is_caught_though_it_hides_its_fault():
    """Taking at small rates and giving at large ones."""
    with pytest.raises(LawBroken, match="passivity"):
        check_loss(Own(lambda v: v - 1e-3 * v**3))


def test_a_correct_loss_of_ones_own_passes():
    assert "passivity: it never feeds energy in" in check_loss(Own(lambda v: v + v**3)).laws
