"""`check()` finds what `assemble` refuses: every word of a model whose functions cannot be recorded, all at once."""

import random
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest

import mbd
from mbd.constraints import Closing, Constraint, Law


@dataclass(frozen=True)
class Creeping(Constraint):
    """A law with a first-order state, which laws do not have."""

    name: str
    point: object
    kind = "penalty"

    def mentions(self):
        return [self.point]

    def act(self, scope, hold):
        gap = scope.frame(self.point).position[1]
        return Law(contact=Closing(gap, opens_on="gap"), push=1e4 * (scope.state(self.name, "creep", 0.0) - gap))


@dataclass(frozen=True)
class Watching(Constraint):
    """A law by a force that names a contact while which it acts, as laws by rows alone do."""

    name: str
    point: object
    kind = "penalty"

    def mentions(self):
        return [self.point]

    def act(self, scope, hold):
        gap = scope.frame(self.point).position[1]
        return Law(contact=Closing(gap, opens_on="gap", only_while=self.name), push=-1e4 * gap)


def no_number(*arguments):
    return None


class Wrong:
    """Words that `assemble` refuses when it derives them, by what is wrong; each is given its own name and a joint."""

    arity = staticmethod(lambda name, j, b: mbd.Motor(name, j, lambda a, b: a, arguments=("pin.angle",)))
    nothing = staticmethod(lambda name, j, b: mbd.Motor(name, j, no_number))
    of_numpy = staticmethod(lambda name, j, b: mbd.Motor(name, j, lambda t: np.interp(t, [0, 1], [0, 1])))
    decision = staticmethod(lambda name, j, b: mbd.Motor(name, j, lambda t: 1.0 if t > 0 else 0.0))
    of_math = staticmethod(lambda name, j, b: mbd.Potential(name, lambda a: __import__("math").sin(a), "pin.angle"))
    no_law = staticmethod(lambda name, j, b: Creeping(name, b.end))
    watched = staticmethod(lambda name, j, b: Watching(name, b.end))
    squared = staticmethod(lambda name, j, b: mbd.Nonholonomic(name, lambda v: v * v, arguments=("pin.rate",)))
    idle = staticmethod(lambda name, j, b: mbd.Bilateral(name, mbd.measure(lambda a: a - a, "pin.angle")))
    guard = staticmethod(lambda name, j, b: mbd.Event(name, mbd.measure(no_number, "pin.angle")))


KINDS = [name for name in vars(Wrong) if not name.startswith("_")]


def model_of(kinds):
    """A pendulum with wrong words of these kinds."""
    model, rod = mbd.Model("pendulum"), mbd.Link("rod", 1.0, 1.0, 0.5, 0.1)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start)
    model.connect(pin)
    for number, kind in enumerate(kinds):
        word = getattr(Wrong, kind)(f"word {number}", pin, rod)
        (model.constrain if isinstance(word, Constraint | mbd.Event) else model.apply)(word)
    return model


@pytest.mark.parametrize("kind", KINDS)
def test_what_assemble_refuses_check_finds(kind):
    model = model_of([kind])
    found = model.check()
    with pytest.raises((mbd.ModelError, mbd.TraceError)) as told:
        mbd.assemble(model, backend="python")
    assert len(found) == 1
    assert found[0] == str(told.value) and "'word 0'" in found[0]


@pytest.mark.parametrize("seed", range(8))
def test_every_wrong_word_is_found_at_once(seed):
    kinds = random.Random(seed).sample(KINDS, 4)
    found = model_of(kinds).check()
    assert len(found) == 4 and all(sum(f"'word {k}'" in fault for fault in found) == 1 for k in range(4))
    with pytest.raises(mbd.ModelError) as told:
        mbd.assemble(model_of(kinds), backend="python")
    assert {fault.partition(" (")[0] for fault in told.value.faults} == {fault.partition(" (")[0] for fault in found}


def test_observations_are_traced_too():
    model = model_of([])
    model.observe("double", partial(no_number), "pin.angle")
    assert len(model.check()) == 1


def test_a_lagrangian_checks_its_words_too():
    system = mbd.Lagrangian("pendulum", ["theta"], lambda theta_rate: theta_rate**2)
    assert system.check() == []
    system.constrain(
        mbd.Event("one", mbd.measure(no_number, "theta")), mbd.Event("two", mbd.measure(no_number, "theta"))
    )
    assert len(system.check()) == 2


def atwood(masses, by):
    """A massless pulley between two ropes, which refer to joints by `by`."""
    model, pulley = mbd.Model("pulleys"), mbd.PointMass("pulley", 0.0)
    weights = [mbd.PointMass(f"weight {k}", mass) for k, mass in enumerate(masses)]
    rails = [
        mbd.Prismatic(f"y{k}", model.ground.point(0.2 * k, 0.0), body.origin, axis="y")
        for k, body in enumerate([*weights, pulley])
    ]
    model.connect(*rails)
    a, b, c, p = map(by, rails)
    model.constrain(
        mbd.Bilateral("rope 1", mbd.measure(lambda a, p: a + p, a, p)),
        mbd.Bilateral("rope 2", mbd.measure(lambda b, c, p: b + c - 2 * p, b, c, p)),
    )
    return model


@pytest.mark.parametrize("seed", range(4))
def test_massless_bodies_may_be_held_by_names_of_coordinates(seed):
    masses = np.random.default_rng(seed).uniform(0.5, 5.0, 3)
    models = [atwood(masses, by) for by in (lambda rail: rail, lambda rail: f"{rail.name}.displacement")]
    assert [model.check() for model in models] == [[], []]
    one, other = (
        mbd.simulate(model, mbd.assemble(model, backend="python"), dt=0.1, until=0.2, backend="python")
        for model in models
    )
    np.testing.assert_array_equal(one["y0.displacement"], other["y0.displacement"])
    m, (g,) = masses, (9.81,)
    tension = 4.0 * g / (1.0 / m[1] + 1.0 / m[2] + 4.0 / m[0])
    assert other["y1.displacement"][-1] == pytest.approx(0.5 * (tension / m[1] - g) * 0.04, rel=1e-9)


def test_a_massless_body_that_no_name_holds_is_still_refused():
    model = mbd.Model("loose")
    rails = [mbd.Prismatic(name, model.ground.origin, mbd.PointMass(f"{name} body", mass).origin, axis="y")
             for name, mass in (("y", 1.0), ("y2", 0.0))]  # fmt: skip
    model.connect(*rails)
    model.constrain(mbd.Bilateral("rope", mbd.measure(lambda a: a, "y.displacement")))
    assert "'y2 body' has neither mass nor inertia" in model.check()[0]
