"""A mechanism given by its energies takes contacts, friction, events and controllers as one of bodies does."""

import pickle
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import sympy

import mbd
from mbd.equations import derive
from mbd.forces import Action, Force
from mbd.tape.evaluate import evaluate
from tests.equations.textbook_scenes import SCENES, Twins

HOW = {
    "HHT": {"integrator": mbd.HHT(0.05), "dt": 1e-3},
    "index 3": {"integrator": mbd.GeneralizedAlpha(0.9, formulation="index3"), "dt": 1e-3},
    "Radau": {"integrator": mbd.RadauIIA(), "dt": 2e-3},
    "Runge-Kutta": {"integrator": mbd.RungeKutta853(), "dt": 2e-3},
    "non-smooth": {"integrator": mbd.HHT(0.05), "dt": 1e-3, "contact": "nonsmooth"},
}
ROUND_OFF = 1e-6
"""Relative: events are located to round-off, whose growth along the motion this leaves room for."""


def both(twins: Twins, how: dict[str, Any]) -> tuple[mbd.Trajectory, mbd.Trajectory]:
    bodies, energies = twins.starts()
    return (
        mbd.simulate(twins.bodies, bodies, until=twins.until, **how),
        mbd.simulate(twins.energies, energies, until=twins.until, **how),
    )


def agree(one: Any, other: Any, size: float = 1.0) -> None:
    np.testing.assert_allclose(one, other, rtol=ROUND_OFF, atol=ROUND_OFF * size)


@pytest.mark.covering
@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_bodies_and_energies_give_the_same_motion_events_impulses_and_forces(scene: Any, how: str) -> None:
    twins = scene(np.random.default_rng(sum(map(ord, how))))
    of_bodies, of_energies = both(twins, HOW[how])
    assert [(e.kind, e.name) for e in of_bodies.events] == [(e.kind, e.name) for e in of_energies.events]
    for one, other in zip(of_bodies.events, of_energies.events, strict=True):
        assert other.time == pytest.approx(one.time, abs=1e-7)
        agree(one.impulse, other.impulse)
        agree(one.energy_loss, other.energy_loss)
    for name, counterpart in twins.names.items():
        for what in ("", ".rate", ".acceleration"):
            size = max(1.0, float(np.max(np.abs(of_bodies[counterpart + what]))))
            agree(of_bodies[counterpart + what], of_energies[name + what], size)
    for contact in twins.bodies.contacts:
        for what in (".gap", ".gap_rate", ".force", ".friction"):
            if contact.name + what in of_bodies.names:
                size = max(1.0, float(np.max(np.abs(of_bodies[contact.name + what]))))
                agree(of_bodies[contact.name + what], of_energies[contact.name + what], size)
    agree(of_bodies.energy.kinetic, of_energies.energy.kinetic)
    drift = of_energies.energy.potential - of_bodies.energy.potential
    agree(drift - drift[0], 0.0)


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.__name__)
def test_they_can_be_checked_described_printed_pickled_and_saved(scene: Any, tmp_path: Any) -> None:
    twins = scene(np.random.default_rng(3))
    model = twins.energies
    assert model.check() == []
    page = model.describe()
    for word in (*model.words, *model.applied):
        assert word.name in page
    assert "M[" in model.equations()
    assert set(model.parameters) >= {name for word in model.words for name in word.parameters()}
    if scene.__name__ not in ("mat", "sleigh"):  # which hold lambdas
        assert pickle.loads(pickle.dumps(model)).describe() == page
    _, start = twins.starts()
    whole = mbd.simulate(model, start, dt=2e-3, until=0.2)
    first = mbd.simulate(model, start, dt=2e-3, until=whole.time[20])
    again = mbd.load(first.save(tmp_path / "half"))
    second = mbd.simulate(model, again.final, dt=2e-3, until=0.2)
    assert np.array_equal(second.final.q, whole.final.q)
    for word in model.words:
        assert word.name not in [w.name for w in model.without(word.name).words]


# words and what is wrong with them -----------------------------------------------------------------------------------
def ball(**more: Any) -> tuple[mbd.Lagrangian, mbd.Coordinate, mbd.Coordinate]:
    x, y = mbd.Coordinate("x", unit="m"), mbd.Coordinate("y", unit="m")
    m, g = sympy.symbols("m g")
    return mbd.Lagrangian(
        "ball", [x, y], m * (x.v**2 + y.v**2) / 2, m * g * y.q, parameters={m: 0.5, g: 9.81}, **more
    ), x, y  # fmt: skip


def test_a_controller_and_parameters_of_words_act_as_in_a_model() -> None:
    model, x, y = ball()
    model.constrain(mbd.Unilateral("floor", mbd.measure(y.q, tangents=x.q), friction=0.3))

    def ice(t: float, values: Any, state: Any) -> dict[str, float]:
        return {"floor.mu": 0.1 if values["x"] > 0.2 else 0.3}

    model.apply(mbd.Controller("ice", ice, period=0.05, reads=("x",), writes="floor.mu"))
    start = mbd.assemble(model, velocity={"x": 2.0}, closed=["floor"])
    run = mbd.simulate(model, start, dt=1e-3, until=0.5)
    assert np.min(run["x.acceleration"]) == pytest.approx(-0.3 * 9.81)
    assert run["x.acceleration"][-1] == pytest.approx(-0.1 * 9.81)
    slow = model.without("ice")
    run = mbd.simulate(slow, start, dt=1e-3, until=0.1, parameters={"floor.mu": 0.2})
    assert run["x.acceleration"][-1] == pytest.approx(-0.2 * 9.81)
    with pytest.raises(mbd.ModelError, match="friction -0.2 is negative"):
        mbd.simulate(slow, start, dt=1e-3, until=0.1, parameters={"floor.mu": -0.2})
    bare = slow.without("floor friction")
    free = mbd.simulate(bare, mbd.assemble(bare, velocity={"x": 2.0}, closed=["floor"]), dt=1e-3, until=0.1)
    assert free["x.rate"][-1] == pytest.approx(2.0)
    ledger = run.energy
    assert ledger.kinetic[0] - ledger.kinetic[-1] == pytest.approx(0.2 * 0.5 * 9.81 * run["x"][-1], rel=1e-6)


@dataclass(frozen=True)
class Lagging(Force):
    """A force on a rate that follows a command with a lag, τ ż = u − z, and is damped."""

    name: str
    rate: str
    command: float = 3.0
    lag: float = 0.05
    kind = "applied"

    def mentions(self) -> list[Any]:
        return [self.rate]

    def parameters(self) -> dict[str, float]:
        return {f"{self.name}.command": self.command, f"{self.name}.lag": self.lag}

    def act(self, scope: Any) -> Action:
        z, v = scope.state(self.name, "force", 0.0), scope.named(self.rate)
        u, lag = (scope.parameter(self.name, field, getattr(self, field)) for field in ("command", "lag"))
        return Action(pairs=((v, z - 0.5 * v),), dissipation=0.1 * v**4, rates=((z, (u - z) / lag),))


@pytest.mark.parametrize("how", HOW)
def test_forces_with_states_and_guards_on_rates_act_as_in_a_model(how: str) -> None:
    """A cart on rough ground is pulled until it slips; an event on its rate turns it back at a speed."""
    bodies = mbd.Model("cart")
    cart = mbd.PointMass("cart", 0.5)
    bodies.connect(mbd.Translation("place", bodies.ground.origin, cart.origin))
    bodies.constrain(mbd.Unilateral("floor", mbd.touchdown(cart.origin), friction=0.3))
    bodies.apply(Lagging("pull", "place.x.rate"))
    fast = mbd.measure(lambda v: v - 1.0, "place.x.rate")
    bodies.constrain(mbd.Event("fast", fast, direction=1, reset={"place.x.rate": -0.5}))
    energies, x, y = ball()
    energies.constrain(mbd.Unilateral("floor", mbd.measure(y.q, tangents=x.q), friction=0.3))
    energies.apply(Lagging("pull", "x.rate"))
    energies.constrain(mbd.Event("fast", x.v - 1.0, direction=1, reset={x.v: -0.5}))
    twins = Twins(bodies, energies, {"x": "place.x", "y": "place.y"}, {}, {}, ("floor",), until=1.2)
    one, other = both(twins, HOW[how])
    assert [(e.kind, e.name) for e in one.events] == [(e.kind, e.name) for e in other.events]
    assert {("slipped", "floor"), ("event", "fast")} <= {(e.kind, e.name) for e in other.events}
    for theirs, mine in (("place.x", "x"), ("place.x.rate", "x.rate"), ("place.x.acceleration", "x.acceleration")):
        agree(one[theirs], other[mine])
    for name in ("pull.force", "pull.power", "floor.force", "floor.friction", "floor friction.power"):
        agree(one[name], other[name])


def test_guards_on_rates_and_frictions_change_with_accelerations() -> None:
    model, x, y = ball()
    model.constrain(mbd.Unilateral("floor", mbd.measure(y.q, tangents=x.q), friction=0.3), mbd.Event("fast", x.v * y.q))
    equations = derive(model)
    numbers = {("x", 0): 0.3, ("x", 1): 0.7, ("v", 0): 2.0, ("v", 1): -1.5, ("a", 0): 5.0, ("a", 1): 11.0}
    inputs = {**numbers, ("q", 0): 0.0, ("q", 1): 0.0, ("lam", 0): 0.0, ("lam", 1): 0.0}
    changes = evaluate([equations.guards[0].rate, equations.frictions[0].change], inputs)
    assert changes == pytest.approx([5.0 * 0.7 - 2.0 * 1.5, 5.0])


def test_words_may_be_given_at_once_or_in_functions_of_time() -> None:
    q = mbd.Coordinate("q", unit="m")
    from sympy.physics.mechanics import dynamicsymbols

    given = mbd.Lagrangian(
        "given", [q], q.v**2, 20.0 * q.q, constraints=[mbd.Unilateral("floor", q.q, restitution=0.5)]
    )
    theta = dynamicsymbols("q")
    later = mbd.Lagrangian("later", [theta], theta.diff() ** 2, 20.0 * theta)
    later.constrain(mbd.Unilateral("floor", theta, restitution=0.5))
    runs = [mbd.simulate(each, mbd.assemble(each, {"q": 0.2}), dt=1e-3, until=0.5) for each in (given, later)]
    assert np.array_equal(runs[0]["q"], runs[1]["q"]) and len(runs[0].events) >= 2
    by_function = mbd.Lagrangian("by function", ["q"], lambda q_rate: q_rate**2, lambda q: 20.0 * q)
    by_function.constrain(mbd.Unilateral("floor", mbd.measure(lambda q: q), restitution=0.5))
    run = mbd.simulate(by_function, mbd.assemble(by_function, {"q": 0.2}), dt=1e-3, until=0.5)
    np.testing.assert_allclose(run["q"], runs[0]["q"], atol=1e-12)


def test_a_change_of_its_words_derives_it_again() -> None:
    model, _, y = ball()
    fall = mbd.simulate(model, mbd.assemble(model, {"y": 0.1}), dt=1e-3, until=0.3)
    model.constrain(mbd.Unilateral("floor", y.q))
    rest = mbd.simulate(model, mbd.assemble(model, {"y": 0.1}), dt=1e-3, until=0.3)
    assert fall["y"][-1] < -0.3 and rest["y"][-1] == pytest.approx(0.0, abs=1e-9)


BODY = mbd.PointMass("body", 1.0)


@pytest.mark.parametrize(
    ("word", "said"),
    [
        (lambda x, y: mbd.Unilateral("floor", mbd.touchdown(BODY.origin)), "which a Lagrangian has not"),
        (lambda x, y: mbd.Unilateral("floor", sympy.Symbol("z")), "'floor': no quantity named 'z'"),
        (lambda x, y: mbd.Unilateral("floor", y.q, friction=0.3), "no direction to slide"),
        (lambda x, y: mbd.Unilateral("floor", y.q, restitution=1.5), "restitution 1.5"),
        (lambda x, y: mbd.Unilateral("floor", y.q, release=mbd.When("flor")), "no contact named 'flor'"),
        (lambda x, y: mbd.Unilateral("floor", y.q + x.v), "depends on velocities"),
        (lambda x, y: mbd.Unilateral("floor", sympy.Symbol("m") + 1), "whatever the motion"),
        (lambda x, y: mbd.Unilateral("x", y.q), "the name 'x' is used 2 times"),
        (lambda x, y: mbd.Nonholonomic("row", x.v**2), "not linear in velocities"),
        (lambda x, y: mbd.Event("up", y.q, reset={"z": 1.0}), "'up': no quantity named 'z'"),
        (lambda x, y: mbd.Event("up", y.q, reset={y.v: sympy.Symbol("w")}), "reset of 'up': no quantity named 'w'"),
    ],
)
def test_what_is_wrong_with_a_word_is_told(word: Any, said: str) -> None:
    model, x, y = ball()
    model.constrain(word(x, y))
    with pytest.raises(mbd.ModelError, match=said):
        mbd.assemble(model, {"y": 1.0})


def test_what_is_no_word_and_what_is_given_twice_is_refused() -> None:
    model, _, y = ball()
    with pytest.raises(mbd.ModelError, match="constrain takes constraints"):
        model.constrain(y.q)
    with pytest.raises(mbd.ModelError, match="apply takes forces"):
        model.apply(mbd.Unilateral("floor", y.q))
    model.constrain(mbd.Unilateral("floor", y.q))
    with pytest.raises(mbd.ModelError, match="has a 'floor' already"):
        model.constrain(mbd.Unilateral("floor", y.q))
