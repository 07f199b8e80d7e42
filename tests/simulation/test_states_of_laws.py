"""First-order states of losses and of laws of constraints, beside those of forces."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from mbd.constraints import Closing, Constraint, Equation, Law
from mbd.joints.losses.base import Loss

ORDERS = {mbd.HHT(0.05): 2, mbd.GeneralizedAlpha(0.9): 2, mbd.RungeKutta4(): 4, mbd.RadauIIA(): 5}
SCHEMES = list(ORDERS)


@dataclass(frozen=True)
class SpringDashpot(Loss):
    """A spring and a dashpot in series: ``F = k z``, ``ż = v − k z/c``."""

    stiffness: float
    damping: float

    def fields(self):
        return {"stiffness": self.stiffness, "damping": self.damping}

    def _of(self, scope, owner):
        k, c = (scope.parameter(owner, field, value) for field, value in self.fields().items())
        return k, c, scope.state(owner, "stretch", 0.0)

    def force(self, rate, scope, owner):
        k, _, z = self._of(scope, owner)
        return k * z

    def rates(self, rate, scope, owner):
        k, c, z = self._of(scope, owner)
        return [(z, rate - k * z / c)]

    def elastic(self, scope, owner):
        k, _, z = self._of(scope, owner)
        return 0.5 * k * z * z


@dataclass(frozen=True)
class SoftMat(Constraint):
    """Two springs, one behind a dashpot: ``p = k (δ + (δ − x))``, ``c ẋ = k (δ − x)``."""

    name: str
    point: object
    stiffness: float
    damping: float
    kind = "penalty"

    def mentions(self):
        return [self.point]

    def act(self, scope, hold):
        gap, x = scope.frame(self.point).position[1], scope.state(self.name, "flow", 0.0)
        k, depth = self.stiffness, mbd.maximum(-gap, 0.5 * x)
        law = Law(contact=Closing(gap, opens_on="gap"), push=k * (2.0 * depth - x))
        stored = 0.5 * k * (depth * depth + (depth - x) ** 2)
        return Law(contact=law.contact, push=law.push, elastic=stored, rates=[(x, k * (depth - x) / self.damping)])


@dataclass(frozen=True)
class FadingBrake(Constraint):
    """A brake whose torque falls as it heats: ``|M| ≤ M₀/(1 + T/T₀)``, ``C Ṫ = |M ω|``."""

    name: str
    joint: object
    torque: float
    capacity: float
    kind = "nonholonomic"

    def mentions(self):
        return [self.joint]

    def act(self, scope, hold):
        (speed,) = scope.joint(self.joint.name).rates
        T = scope.state(self.name, "temperature", 0.0)
        limit = self.torque / (1.0 + T)
        return Law(
            [Equation(speed, unit="rad", level="velocity", limit=limit)],
            rates=[(T, limit * abs(speed) / self.capacity)],
        )


def pendulum(loss):
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=loss))
    return model, mbd.assemble(model, position={"pin.angle": 1.0})


def mat():
    model, ball = mbd.Model("drop"), mbd.PointMass("ball", 2.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, ball.origin, axis=(0, 1, 0)))
    model.constrain(SoftMat("mat", ball.origin, 4e3, 50.0))
    return model, mbd.assemble(model, position={"rail.displacement": 0.1})


def by_hand(until):
    """Angle, rate and stretch of the pendulum from an integration of its three equations."""

    def rates(_, y):
        angle, rate, z = y
        return [rate, (-9.81 * 0.5 * np.sin(angle) - 20.0 * z) / 0.35, rate - 20.0 * z / 2.0]

    return solve_ivp(rates, (0.0, until), [1.0, 0.0, 0.0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]


@pytest.mark.parametrize(("scheme", "order"), ORDERS.items(), ids=map(repr, ORDERS))
def test_a_loss_with_a_state_keeps_the_order_of_each_scheme(scheme, order):
    (model, start), exact = pendulum(SpringDashpot(20.0, 2.0)), by_hand(0.8)
    errors = []
    for dt in (4e-3, 2e-3) if order == 2 else (0.08, 0.04):
        run = mbd.simulate(model, start, scheme, dt=dt, until=0.8)
        ends = [run["pin.angle"][-1], run["pin.rate"][-1], run["pin loss.stretch"][-1]]
        errors.append(max(abs(np.array(ends) - exact)))
    assert np.log2(errors[0] / errors[1]) > order - 0.3
    assert errors[1] < 1e-4


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_what_states_store_and_lose_closes_the_ledger(scheme):
    for model, start, dt, name, kind in (
        (*pendulum(SpringDashpot(20.0, 2.0)), 1e-3, "pin loss", "joint loss"), (*mat(), 1e-4, "mat", "penalty"),
    ):  # fmt: skip
        run = mbd.simulate(model, start, scheme, dt=dt, until=0.5)
        (part,) = run.energy.parts
        assert (part.name, part.kind) == (name, kind)
        assert np.max(np.diff(part.energy) if kind == "joint loss" else part.energy) <= 1e-9
        assert np.max(np.abs(run.energy.numerical)) <= 2e-5 * np.ptp(run.energy.kinetic)


def test_the_energy_that_a_loss_stores_is_a_part_of_the_potential():
    model, start = pendulum(SpringDashpot(20.0, 2.0))
    run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=1e-3, until=0.3)
    stored = {part.name: part.energy for part in run.energy.stored}
    np.testing.assert_allclose(stored["pin loss"], 10.0 * run["pin loss.stretch"] ** 2, rtol=1e-12)
    np.testing.assert_allclose(run["pin loss.torque"], -20.0 * run["pin loss.stretch"], rtol=1e-12)


def test_a_limit_of_friction_may_follow_a_state():
    """All of ½ I ω² becomes heat: the disk stops at T = 25 J/C, after ``∫ (1 + T)/M₀ I dω`` seconds."""
    model = mbd.Model("brake", gravity=(0, 0, 0))
    disk = mbd.RigidBody("disk", 1.0, (1, 1, 0.5))
    model.connect(mbd.Revolute("hub", model.ground.origin, disk.origin))
    model.constrain(FadingBrake("brake", model.joints[0], 4.0, 20.0))
    start = mbd.assemble(model, velocity={"hub.angle": 10.0})
    run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=1e-2, until=3.0)
    assert run["brake.temperature"][-1] == pytest.approx(25.0 / 20.0, abs=1e-9)
    w = np.linspace(0.0, 10.0, 5)
    heat = (25.0 - 0.25 * w**2) / 20.0
    expected = np.sum(np.array([7.0, 32.0, 12.0, 32.0, 7.0]) * 2.0 / 45.0 * 2.5 * (1.0 + heat) / 4.0 * 0.5)  # Boole
    assert [event.kind for event in run.events] == ["stuck"]
    assert run.events[0].time == pytest.approx(expected, abs=1e-9)


def test_a_start_gives_states_their_values_and_derivatives_reach_them():
    model, _ = pendulum(SpringDashpot(20.0, 2.0))
    start = mbd.assemble(model, position={"pin.angle": 1.0, "pin loss.stretch": 0.05})
    how = {"integrator": mbd.RungeKutta853(), "dt": 0.02, "until": 0.4}
    wrt = ["pin loss.stretch", "pin loss.stiffness", "pin loss.damping"]
    found = mbd.sensitivities(model, start, wrt=wrt, of=["pin.angle"], **how)
    ends = []
    for change in (1e-4, -1e-4):
        moved = mbd.assemble(model, position={"pin.angle": 1.0, "pin loss.stretch": 0.05 + change})
        ends.append(mbd.simulate(model, moved, **how)["pin.angle"][-1])
    assert found["pin.angle", "pin loss.stretch"] == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-6)


def test_a_damper_between_points_takes_a_loss_with_a_state():
    model, ball = mbd.Model("hung"), mbd.PointMass("ball", 1.0)
    model.connect(mbd.Translation("p", model.ground.point(0, 1), ball.origin))
    model.apply(mbd.Damper("strut", model.ground.origin, ball.origin, SpringDashpot(50.0, 5.0)))
    run = mbd.simulate(model, mbd.assemble(model), mbd.RungeKutta4(), dt=1e-3, until=0.2)
    np.testing.assert_allclose(run["strut.force"], 50.0 * run["strut.stretch"], rtol=1e-12)
    assert run.energy.drift < 1e-8


def test_losses_with_states_are_refused_by_name_where_they_have_no_place():
    lag = SpringDashpot(20.0, 2.0)
    model, body = mbd.Model("several"), mbd.RigidBody("body", 1.0, (1, 1, 1))
    model.connect(mbd.Translation("p", model.ground.origin, mbd.PointMass("q", 1.0).origin, loss=lag))
    assert "'p loss': " in model.check()[0] and "'x': …, 'y': …" in model.check()[0]
    model = mbd.Model("ball joint")
    model.connect(mbd.Spherical("s", model.ground.origin, body.origin, loss=lag))
    assert "give one for each velocity" in model.check()[0]
    with pytest.raises(mbd.ModelError, match=r"friction of 'foot'.*has a state"):
        mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=lag)


def test_what_rates_returns_is_checked():
    @dataclass(frozen=True)
    class Wrong(SpringDashpot):
        def rates(self, rate, scope, owner):
            return self._of(scope, owner)[2]

    @dataclass(frozen=True)
    class Silent(SpringDashpot):
        def rates(self, rate, scope, owner):
            return []

    with pytest.raises(mbd.ModelError, match=r"Wrong: rates\(rate, scope, 'pin loss'\) must return pairs"):
        pendulum(Wrong(1.0, 1.0))
    with pytest.raises(mbd.ModelError, match=r"state 'pin loss\.stretch' has no rate"):
        pendulum(Silent(1.0, 1.0))


def test_the_kit_finds_a_memory_that_gives_energy():
    @dataclass(frozen=True)
    class Giving(SpringDashpot):
        def rates(self, rate, scope, owner):
            k, c, z = self._of(scope, owner)
            return [(z, rate + k * z / c)]

    assert "passivity of its memory" in mbd.testing.check_loss(SpringDashpot(20.0, 2.0)).laws
    with pytest.raises(mbd.testing.LawBroken, match="passivity of its memory"):
        mbd.testing.check_loss(Giving(20.0, 20.0))
