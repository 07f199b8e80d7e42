"""Friction and stops that remember: what their papers say of them in closed form."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd


def ramp(u):
    """From 0 to 1 as u goes there, with rates and accelerations that begin and end at 0."""
    u = mbd.minimum(mbd.maximum(u, 0.0), 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u * u)


def moved(loss=None, motion=lambda t: 0.1 * mbd.sin(t)):
    """A slider of 1 kg, moved as told, with a loss."""
    model, body = mbd.Model("moved", gravity=(0, 0, 0)), mbd.PointMass("body", 1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, body.origin, loss=loss)
    model.connect(rail)
    model.constrain(mbd.Bilateral("drive", rail, value=motion))
    return model, mbd.assemble(model)


def pressed(make, motion):
    """A stop at 0 below a body that is moved up and down."""
    model, body = mbd.Model("pressed", gravity=(0, 0, 0)), mbd.PointMass("body", 1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, body.origin, axis=(0, 1, 0))
    model.connect(rail)
    model.constrain(mbd.Bilateral("drive", rail, value=motion), make(mbd.height(body.origin)))
    return model, mbd.assemble(model)


def test_dahl_friction_grows_with_the_travel_and_not_with_the_speed():
    """Along a first loading from rest, ``F = T (1 − e^{−σ x/T})``, however fast it is."""
    for pace in (1.0, 7.0):
        model, start = moved(mbd.Dahl(2.0, 300.0), lambda t, w=pace: 0.02 * (1.0 - mbd.cos(w * t)))
        run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=2e-3 / pace, until=3.0 / pace)
        x = run["rail.displacement"]
        np.testing.assert_allclose(-run["rail loss.force"], 2.0 * (1.0 - np.exp(-150.0 * x)), atol=1e-8)


def test_a_dahl_loop_takes_its_energy_whatever_its_period():
    taken = []
    for pace in (1.0, 10.0):
        model, start = moved(mbd.Dahl(2.0, 300.0), lambda t, w=pace: 0.02 * (1.0 - mbd.cos(w * t)))
        run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=np.pi / 1000 / pace, until=2.0 * np.pi / pace)
        taken.append({part.name: part.energy[-1] for part in run.energy.parts}["rail loss"])
    assert taken[0] == pytest.approx(taken[1], rel=1e-6)
    assert taken[0] < -0.05


def test_lugre_slides_steadily_with_the_friction_of_stribeck():
    loss = mbd.LuGre(3.0, 2.0, 0.5, 400.0, 0.8) + mbd.Viscous(0.6)
    for speed in (0.1, 0.5, 2.0):
        model, start = moved(loss, lambda t, v=speed: v * t)
        run = mbd.simulate(model, start, mbd.RadauIIA(), dt=2e-3, until=4.0)
        expected = 2.0 + np.exp(-((speed / 0.5) ** 2)) + 0.6 * speed
        assert -run["rail loss.force"][-1] == pytest.approx(expected, rel=1e-6)


def test_lugre_holds_a_load_below_its_static_friction_as_a_spring():
    model, body = mbd.Model("held", gravity=(0, 0, 0)), mbd.PointMass("body", 1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, body.origin, loss=mbd.LuGre(3.0, 2.0, 0.5, 400.0, 20.0))
    model.connect(rail)
    model.apply(mbd.Motor("pull", rail, torque=lambda t: 1.5 * mbd.minimum(t, 1.0)))
    run = mbd.simulate(model, mbd.assemble(model), mbd.HHT(), dt=1e-3, until=5.0)
    assert abs(run["rail.rate"][-1]) < 1e-6
    assert run["rail loss.deflection"][-1] == pytest.approx(1.5 / 400.0, rel=1e-3)


def on_bristles(friction, pull=None, lift=None):
    """A puck of 2 kg on a mat, pulled by a function of time and lifted by another."""
    model, puck = mbd.Model("rubber"), mbd.PointMass("puck", 2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, puck.origin))
    model.constrain(mbd.Penalty("mat", mbd.touchdown(puck.origin), 2e4, 200.0, friction=friction))
    model.apply(mbd.Applied("pull", puck.origin, (pull or (lambda t: 0.0 * t), lift or (lambda t: 0.0 * t))))
    return model, mbd.assemble(model, {"slide.y": -2.0 * 9.81 / 2e4}, {"slide.x": 0.3}, closed="mat")


def test_a_foot_on_bristles_sticks_and_slides_as_scipy_has_it():
    """To round-off at a fixed dt: steps end where it begins to slide, and no event tells of that."""
    mu, stiffness, damping, weight = 0.4, 5e3, 80.0, 2.0 * 9.81
    model, start = on_bristles(
        mbd.Bristles(mu, stiffness, damping), lambda t: 6.0 * mbd.sin(3.0 * t), lambda t: 15.0 * mbd.sin(7.0 * t) - 4.0
    )

    def rates(t, y):
        push = -2e4 * y[1] - 200.0 * y[3]
        force = np.clip(stiffness * y[4] + damping * y[2], -mu * push, mu * push)
        up = 15.0 * np.sin(7.0 * t) - 4.0 + push - weight
        return [y[2], y[3], (6.0 * np.sin(3.0 * t) - force) / 2.0, up / 2.0, (force - stiffness * y[4]) / damping]

    begin = [0.0, -weight / 2e4, 0.3, 0.0, 0.0]
    y = solve_ivp(rates, (0.0, 0.5), begin, method="DOP853", rtol=1e-12, atol=1e-14, max_step=1e-4).y[:, -1]
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=0.5)
    names = "slide.x", "slide.y", "slide.x.rate", "slide.y.rate", "mat.bristle"
    np.testing.assert_allclose([run[name][-1] for name in names], y, atol=1e-10)
    share = run["mat.friction"] / run["mat.force"]
    assert len(run.events) == 0
    assert np.max(np.abs(share)) == pytest.approx(mu, rel=1e-12)
    assert np.min(np.abs(share)) < 0.3
    assert abs(run.energy.numerical[-1]) < 1e-9


def test_bristles_take_energy_however_their_load_changes():
    """The work of friction and ½ σ₀ z² never rise together, though the foot is pressed and relieved as it slides."""
    model, start = on_bristles(
        mbd.Bristles(0.4, 5e3, 80.0), lambda t: 9.0 * mbd.sin(11.0 * t), lambda t: 17.0 * mbd.sin(23.0 * t)
    )
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=2.0)
    taken = run.energy["mat friction"] + 0.5 * 5e3 * run["mat.bristle"] ** 2
    assert np.max(np.diff(taken)) < 1e-9
    assert taken[-1] < -0.5


def test_the_derivative_of_a_run_on_bristles_is_that_of_its_differences():
    model, start = on_bristles(mbd.Bristles(0.4, 5e3, 80.0), lambda t: 12.0 * mbd.sin(3.0 * t))
    wrt, scheme = ["mat.mu", "mat.bristle_stiffness"], mbd.RungeKutta853()
    found = mbd.sensitivities(model, start, scheme, dt=2e-3, until=0.5, wrt=wrt, of=["slide.x"])
    for name, change in zip(wrt, (1e-4, 1.0), strict=True):
        value = model.parameters[name]
        ends = [
            mbd.simulate(model, start, scheme, dt=2e-3, until=0.5, parameters={name: value + step})["slide.x"][-1]
            for step in (change, -change)
        ]
        assert found["slide.x", name] == pytest.approx((ends[0] - ends[1]) / (2.0 * change), rel=1e-5)


def test_schemes_keep_their_order_where_friction_that_remembers_reverses():
    """RungeKutta4: sixteen times less at half the step, with two reversals on the way."""
    ends = []
    for dt in (4e-3, 2e-3, 1e-3):
        model, body = mbd.Model("shank"), mbd.Link("shank", mass=2.5, length=0.42, center=0.19, inertia=0.04)
        model.connect(mbd.Revolute("knee", model.ground.origin, body.start, loss=mbd.Dahl(0.4, 25.0)))
        start = mbd.assemble(model, {"knee.angle": 0.9})
        ends.append(mbd.simulate(model, start, mbd.RungeKutta4(), dt=dt, until=1.5)["knee.angle"][-1])
    assert np.log2(abs((ends[0] - ends[1]) / (ends[1] - ends[2]))) == pytest.approx(4.0, abs=0.15)


def test_a_maxwell_stop_relaxes_to_its_slow_stiffness():
    """At a depth d since t = 0, ``p = d (k + k₁ e^{−k₁ t/c})`` but for what flowed while it was pressed."""
    model, start = pressed(
        lambda where: mbd.MaxwellStop("stop", where, 1000.0, 2000.0, 100.0),
        lambda t: 0.01 - 0.03 * ramp(t / 0.004),
    )
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-4, until=0.3)
    late = run.time > 0.01
    excess = run["stop.force"][late] - 0.02 * 1000.0
    np.testing.assert_allclose(np.diff(np.log(excess)), -2000.0 / 100.0 * np.diff(run.time[late]), rtol=1e-6)
    assert run["stop.force"].max() == pytest.approx(0.02 * 3000.0, rel=0.03)


def test_a_maxwell_stop_comes_back_while_it_is_open():
    """Free, ``ẋ = −x/(c (1/k + 1/k₁))``; it never pulls."""
    model, start = pressed(
        lambda where: mbd.MaxwellStop("stop", where, 1000.0, 2000.0, 100.0),
        lambda t: 0.01 - 0.03 * (ramp(t / 0.1) - ramp((t - 0.1) / 0.1)),
    )
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-4, until=0.8)
    assert run["stop.force"].min() >= -1e-12
    late = run.time > 0.35
    rate = 1.0 / (100.0 * (1.0 / 1000.0 + 1.0 / 2000.0))
    np.testing.assert_allclose(np.diff(np.log(run["stop.flow"][late])), -rate * np.diff(run.time[late]), rtol=1e-6)


def test_a_hysteretic_stop_follows_its_closed_forms_and_gives_back_less():
    """Loading ``p = (1−η) k δ + η k d (1 − e^{−δ/d})``; then ``z = −d + (d + z₁) e^{−(δ₁−δ)/d}``."""
    k, share, d = 1000.0, 0.4, 0.01
    model, start = pressed(
        lambda where: mbd.HystereticStop("stop", where, k, share, d), lambda t: 0.01 - 0.03 * mbd.sin(t)
    )
    run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=1e-3, until=3.0)
    depth, going = -run["stop.gap"], run.time < 0.5 * np.pi
    down, up = going & (depth > 0.0), ~going & (run["stop.force"] > 0.02)
    one = d * (1.0 - np.exp(-depth / d))
    np.testing.assert_allclose(run["stop.deflection"][down], one[down], atol=1e-7)
    deepest = 0.02
    last = d * (1.0 - np.exp(-deepest / d))
    np.testing.assert_allclose(
        run["stop.deflection"][up], (-d + (d + last) * np.exp((depth - deepest) / d))[up], atol=1e-6
    )
    assert run["stop.force"].min() >= -1e-12
    (part,) = [part for part in run.energy.parts if part.name == "stop"]
    assert part.energy[-1] < -0.02
    assert np.max(np.abs(run.energy.numerical)) < 1e-6


@pytest.mark.parametrize(
    "make",
    [
        lambda where: mbd.HystereticStop("stop", where, 5000.0, 0.4, 0.01),
        lambda where: mbd.MaxwellStop("stop", where, 2000.0, 4000.0, 60.0),
        lambda where: mbd.Penalty("stop", where, 4000.0, 30.0, release="pull"),
    ],
)
def test_the_ledger_closes_though_rubber_is_struck_again_before_it_has_come_back(make):
    """What it holds as it closes comes from the impact before, or from below the surface: it gives nothing then."""
    model, body = mbd.Model("struck"), mbd.PointMass("body", 1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, body.origin, axis=(0, 1, 0)))
    model.constrain(make(mbd.height(body.origin)))
    run = mbd.simulate(model, mbd.assemble(model, {"rail.displacement": 0.3}), mbd.RungeKutta853(), dt=1e-3, until=1.0)
    assert len([event for event in run.events if event.kind == "closed"]) > 1
    assert np.max(np.abs(run.energy.numerical)) < 1e-5


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda where: mbd.MaxwellStop("stop", where, 0.0, 1.0, 1.0), "'stop'.*stiffness 0 does not push it back"),
        (lambda where: mbd.HystereticStop("stop", where, 1.0, 1.0, 0.1), "share 1 is not between 0 and 1"),
        (lambda where: mbd.Dahl(0.0, 1.0), "torque 0 is not positive"),
        (lambda where: mbd.LuGre(1.0, 1.0, 0.0, 1.0), "speed 0 is not positive"),
    ],
)
def test_numbers_without_a_meaning_are_refused_by_name(make, told):
    with pytest.raises(mbd.ModelError, match=told):
        make(mbd.height(mbd.PointMass("body", 1.0).origin))


def test_a_compressible_damper_flows_slowly_as_its_orifice_and_is_oil_when_fast():
    """Steadily ``F = c v + b v²``; within times far below c/k it is the spring k."""
    loss = mbd.CompressibleDamper(30.0, 80.0, 4e3)
    model, start = moved(loss, lambda t: 0.5 * t)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=1.0)
    assert -run["rail loss.force"][-1] == pytest.approx(30.0 * 0.5 + 80.0 * 0.25, rel=1e-9)
    model, start = moved(loss, lambda t: 0.01 * ramp(t / 1e-5))
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-6, until=1e-5)
    assert -run["rail loss.force"][-1] == pytest.approx(40.0, rel=2e-2)


def test_the_force_of_a_compressible_damper_lags_behind_its_rate():
    """Linear oil is a Maxwell element, ``F = c ω A/√(1 + (ωc/k)²)`` with the phase arctan(ωc/k)."""
    c, k, w = 30.0, 4e3, 40.0
    model, start = moved(mbd.CompressibleDamper(c, 0.0, k), lambda t: 0.02 * mbd.sin(w * t))
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=1.0)
    late = run.time > 0.5
    lag = np.arctan(w * c / k)
    expected = 0.02 * w * c * np.cos(lag) * np.cos(w * run.time - lag)
    np.testing.assert_allclose(-run["rail loss.force"][late], expected[late], atol=1e-5)
    taken = {part.name: part.energy for part in run.energy.parts}["rail loss"]
    assert np.max(taken) <= 1e-9
    per_time = 0.5 * (0.02 * w * np.cos(lag)) ** 2 * c
    assert -taken[-1] == pytest.approx(per_time * run.time[-1], rel=0.05)


FROM_REST = [
    mbd.Dahl(3.0, 400.0), mbd.LuGre(3.0, 2.0, 0.5, 400.0, 20.0), mbd.CompressibleDamper(3.0, 0.8, 40.0),
    mbd.Valves(mbd.CompressibleDamper(3.0, 0.8, 40.0), mbd.CompressibleDamper(1.0, 0.2, 40.0)),
]  # fmt: skip


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta4()])
@pytest.mark.parametrize("loss", FROM_REST)
@pytest.mark.parametrize("force", [lambda t: 30.0 * mbd.sin(9.0 * t), lambda t: 3.0 * mbd.sin(20.0 * t)])
def test_what_begins_at_rest_under_no_force_moves_as_one_that_is_hardly_bent(loss, scheme, force):
    """All terms of the rate of a deflection vanish at the start, beside which any residual is large."""
    ends = []
    for bent in (0.0, 1e-9):
        model, body = mbd.Model("from rest", gravity=(0.0, 0.0, 0.0)), mbd.PointMass("body", mass=1.0)
        rail = mbd.Prismatic("rail", model.ground.origin, body.origin, loss=loss)
        model.connect(rail)
        model.apply(mbd.Motor("drive", rail, force=force))
        start = mbd.assemble(model, position={"rail loss.deflection": bent}, velocity={"rail.displacement": bent})
        run = mbd.simulate(model, start, scheme, dt=1e-3, until=1.0)
        ends.append([run.final[name] for name in ("rail.displacement", "rail.rate", "rail loss.deflection")])
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-4, atol=1e-6)
