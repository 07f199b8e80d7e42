"""Words of users' own whose methods cannot be called, or answer wrongly: named errors before anything runs."""

import re
from collections.abc import Callable
from functools import partialmethod
from typing import Any

import pytest
import sympy

import mbd
from mbd.constraints.base import Constraint
from mbd.constraints.law import Law
from mbd.constraints.measure import Measure
from mbd.forces import Action, Force
from mbd.joints.losses.base import DissipationFunction

HERE = re.escape(__file__)


class OwnForce(Force):
    """A force that does nothing."""

    kind, name = "applied", "own"

    def mentions(self):
        return []

    def parameters(self):
        return {}

    def act(self, scope):
        return Action()


class OwnConstraint(Constraint):
    """A law without rows."""

    kind, name = "bilateral", "own"

    def mentions(self):
        return []

    def act(self, scope, hold):
        return Law()


class OwnMeasure(Measure):
    """A distance."""

    unit = "m"

    def mentions(self):
        return []

    def gap(self, scope):
        return scope.named("pin.angle")


class OwnLoss(DissipationFunction):
    """``D = v²/2``."""

    def fields(self):
        return {}

    def dissipation(self, rate, scope, owner):
        return 0.5 * rate * rate


def parts(loss: Any = None) -> tuple[mbd.Model, mbd.Revolute]:
    model, rod = mbd.Model("pendulum"), mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=loss)
    model.connect(pin)
    return model, pin


def with_force(force: Force) -> mbd.Model:
    model, _ = parts()
    model.apply(force)
    return model


def with_constraint(constraint: Constraint) -> mbd.Model:
    model, _ = parts()
    model.constrain(constraint)
    return model


def with_measure(measure: Measure) -> mbd.Model:
    return with_constraint(mbd.Unilateral("stop", measure))


def with_loss(loss: DissipationFunction) -> mbd.Model:
    return parts(loss)[0]


KINDS: dict[type, Callable[[Any], mbd.Model]] = {
    OwnForce: with_force, OwnConstraint: with_constraint, OwnMeasure: with_measure, OwnLoss: with_loss,
}  # fmt: skip


def asking(scope: Any, *arguments: Any) -> Action:
    """An action that asks for a parameter."""
    scope.parameter(*arguments)
    return Action()


CALLS = [
    (OwnForce, "act", lambda self: Action(), r"act\(scope\), which .* write def act\(self, scope\)"),
    (OwnForce, "act", lambda self, scope, q: Action(), r"missing a required argument: 'q'"),
    (OwnForce, "parameters", lambda self, scope: {}, r"parameters\(\), which .* write def parameters\(self\)"),
    (OwnForce, "parameters", property(lambda self: {}), r"parameters is a property.* without @property"),
    (OwnForce, "parameters", {"own.k": 1.0}, r"parameters is \{'own.k': 1.0\}, .* write def parameters\(self\)"),
    (OwnForce, "kind", lambda self: "applied", r"kind at {0}:\d+ is a method.* @property"),
    (OwnConstraint, "act", lambda self, scope: Law(), r"act\(self, scope\)|act\(scope, hold\)"),
    (OwnMeasure, "gap", lambda self: 1.0, r"'stop' \(Unilateral\), its OwnMeasure: .* called as gap\(scope\)"),
    (
        OwnLoss,
        "dissipation",
        lambda self, v: v * v,
        r"'pin' \(Revolute\), its OwnLoss: .* dissipation\(rate, scope",
    ),
]
ANSWERS = [
    (OwnForce, "parameters", lambda self: ["k"], r"parameters\(\) at {0}:\d+ must return a mapping .* got \['k'\]"),
    (OwnForce, "parameters", lambda self: {"own.k": "soft"}, r"'own.k' must be a finite number, not 'soft'"),
    (OwnForce, "mentions", lambda self: None, r"mentions\(\) at {0}:\d+ must return a list"),
    (OwnForce, "domains", lambda self: {"own.k": 1.0}, r"domains\(\) .* to mbd.Domain, got"),
    (OwnForce, "domains", lambda self: {}["k"], r"domains\(\) at {0}:\d+ raised KeyError at {0}:\d+: 'k'"),
    (OwnLoss, "fields", lambda self: ["k"], r"its OwnLoss: fields\(\) .* got \['k'\]"),
]
DERIVED = [
    (OwnForce, "act", lambda self, scope: None, r"must return an mbd.forces.Action, got None"),
    (OwnForce, "act", lambda self, scope: Action(pairs=(1.0, 2.0)), r"give pairs \(velocity, force\)"),
    (OwnForce, "act", lambda self, scope: scope.joints, r"'own' \(OwnForce\): act\(scope\).* raised Attr.* at {0}"),
    (OwnForce, "act", lambda self, scope: asking(scope, "k"), r"raised TypeError at {0}:\d+: .*'field' and 'value'"),
    (OwnForce, "act", lambda self, scope: asking(scope, "own", "k", 0.5), r"'k', 0.5\) at {0}:\d+ .* not declared"),
    (OwnMeasure, "gap", lambda self, scope: None, r"OwnMeasure: gap\(scope\) .* got None; is a 'return' missing\?"),
    (OwnLoss, "dissipation", lambda self, v, s, o: None, r"dissipation\(rate, scope, 'pin loss'\) .* got None"),
    (OwnLoss, "dissipation", lambda self, v, s, o: v * s.parameter(o, "c", 2.5), r"'c', 2.5\) at {0}.* not declared"),
]  # fmt: skip


def names(cases: list[Any]) -> list[str]:
    return [f"{kind.__name__}.{method} {number}" for number, (kind, method, *_) in enumerate(cases)]


@pytest.mark.parametrize(("kind", "method", "own", "said"), [*CALLS, *ANSWERS], ids=names([*CALLS, *ANSWERS]))
def test_a_method_that_cannot_be_called_or_answers_wrongly_is_refused_as_the_word_is_taken_up(kind, method, own, said):
    with pytest.raises(mbd.ModelError, match=said.replace("{0}", HERE)):
        KINDS[kind](type(kind.__name__, (kind,), {method: own})())


@pytest.mark.parametrize(("kind", "method", "own", "said"), DERIVED, ids=names(DERIVED))
def test_what_shows_as_equations_are_derived_is_named(kind, method, own, said):
    with pytest.raises(mbd.ModelError, match=said.replace("{0}", HERE)):
        mbd.assemble(KINDS[kind](type(kind.__name__, (kind,), {method: own})()))


def test_what_the_base_leaves_open_may_be_left_out_or_made_in_other_ways():
    """An integrator whose `order` takes no system, a static and a partial method, a field in place of a property."""

    class Own(mbd.HHT):
        def order(self):
            return 2

    own = {
        "act": partialmethod(lambda self, more, scope: Action(), 1.0), "parameters": staticmethod(dict),
        "mentions": classmethod(lambda cls: []), "kind": "potential",
    }  # fmt: skip
    model = with_force(type("Own", (OwnForce,), own)())
    assert mbd.simulate(model, mbd.assemble(model), Own(), dt=1e-2, until=0.02).success


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_word_may_take_more_than_it_is_given_and_be_made_of_others(kind):
    """Defaults, names of one's own, a class between, a static method."""
    method = {OwnForce: "act", OwnConstraint: "act", OwnMeasure: "gap", OwnLoss: "dissipation"}[kind]
    usual = getattr(kind, method)
    between = type("Between", (kind,), {method: lambda self, *given, more=1.0: usual(self, *given)})
    assert KINDS[kind](type("Own", (between,), {"unknown": lambda self, a, b: None})())


def test_a_parameter_has_the_value_that_is_declared():
    own = {"parameters": lambda self: {"own.k": 0.4}, "act": lambda self, scope: asking(scope, "own", "k", 0.5)}
    with pytest.raises(mbd.ModelError, match=r"'k', 0.5\) at .* declares as 0.4; give one value in both places"):
        mbd.assemble(with_force(type("Own", (OwnForce,), own)()))


def test_a_lagrangian_asks_its_words_for_the_same():
    theta = mbd.Coordinate("theta")
    system = mbd.Lagrangian("disk", [theta], 0.5 * theta.v**2, sympy.cos(theta.q))
    system.apply(type("Own", (OwnForce,), {"act": lambda self, scope: asking(scope, "own", "k", 0.5)})())
    with pytest.raises(mbd.ModelError, match="not declared"):
        mbd.assemble(system)
    with pytest.raises(mbd.ModelError, match=r"write def act\(self, scope\)"):
        system.apply(type("Own", (OwnForce,), {"act": lambda self: Action()})())


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: mbd.Controller("knee", lambda t, v: {}, period=0.1), r"\(t, v\).*\(time, values, state\)"),
        (
            lambda: mbd.Event("hit", mbd.measure("pin.angle"), reset=lambda: {"pin.rate": 0.0}),
            r"\(named\), which .* lambda named: …",
        ),
        (lambda: mbd.Event("hit", mbd.measure("pin.angle"), reset={"pin.rate": lambda a, b: 0.0}), "reset of Event"),
    ],
    ids=("controller", "reset", "reset of a value"),
)
def test_functions_of_controllers_and_events_can_be_called(make, said):
    with pytest.raises(mbd.ModelError, match=f"at {HERE}:.*|" + said) as told:
        make()
    assert re.search(said, str(told.value))


def test_an_integrator_whose_step_cannot_be_called_is_refused_before_the_run():
    class Own(mbd.HHT):
        def step(self, system, state):
            raise AssertionError

    model, _ = parts()
    with pytest.raises(mbd.ModelError, match=r"Own: step\(self, system, state\) at .* step\(system, state, dt"):
        mbd.simulate(model, mbd.assemble(model), Own(), dt=1e-2, until=0.1)
