"""Steps that do not resolve the motion: what a run says, and the step that it asks for."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import mbd
from mbd.simulation.diagnostics.coarse import percent
from tests.simulation.mechanisms import falling, run

STIFF = 1e9


def dropped(integrator, dt, **law):
    """A ball of 2 kg falls 0.1 m onto a penalty contact."""
    model, body = falling()
    model.constrain(mbd.Penalty("floor", mbd.height(body.origin), **{"stiffness": STIFF} | law))
    start = mbd.assemble(model, position={"fall.displacement": 0.1})
    return mbd.simulate(model, start, integrator, dt=dt, until=0.2, on_failure="return")


def oscillator(stiffness, integrator, dt, damping=0.0):
    """A mass of 1 kg on a spring, pulled out by 0.1 m."""
    model = mbd.Model("oscillator", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    loss = mbd.Viscous(damping) if damping else None
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=stiffness, loss=loss))
    start = mbd.assemble(model, position={"slide.displacement": 0.1})
    return mbd.simulate(model, start, integrator, dt=dt, until=100 * dt, on_failure="return")


@pytest.mark.parametrize(
    "law", [{}, {"exponent": 1.5}, {"restitution": 0.5, "exponent": 1.5}, {"damping": 2e4}], ids=str
)
def test_the_step_asked_for_is_that_of_penalty_parameters(law):
    (told,) = dropped(mbd.HHT(0.05), 1e-3, **law).stats["notes"]
    (asked,) = re.findall(r"'floor' took steps of .*; dt below ([\d.e-]+) s has", told)
    speed, e = np.sqrt(2.0 * 9.81 * 0.1), law.get("restitution", 1.0)
    if "damping" in law:
        ratio = law["damping"] / (2.0 * np.sqrt(STIFF * 2.0))
        expected = np.arccos(ratio) / np.sqrt(1.0 - ratio**2) * np.sqrt(2.0 / STIFF) / 5.0
    else:  # the stiffness follows from the depth: k ~ δ^-(n+1)
        n = law.get("exponent", 1.0)
        near = mbd.penalty_parameters(e, 1e-4, effective_mass=2.0, approach_speed=speed, exponent=n)
        depth = 1e-4 * (near.stiffness / STIFF) ** (1.0 / (n + 1.0))
        expected = mbd.penalty_parameters(e, depth, effective_mass=2.0, approach_speed=speed, exponent=n).largest_dt
    assert float(asked) == pytest.approx(expected, rel=0.06)


def test_a_blow_that_is_resolved_leaves_the_message_alone():
    found = dropped(mbd.HHT(0.05), 4e-6)
    assert found.message == "reached t = 0.2 s" and not found.stats["notes"]


def test_an_explicit_blow_takes_steps_of_its_own_and_makes_no_energy():
    found = dropped(mbd.RungeKutta853(), 1e-3)
    assert found.success and found.message == "reached t = 0.2 s"
    assert found.energy.total[-1] == pytest.approx(found.energy.total[0], rel=1e-3)


def test_a_scheme_that_takes_all_energy_of_a_stiff_spring_says_so_in_the_message():
    found = oscillator(STIFF, mbd.HHT(0.05), 1e-4)
    assert found.success and "3.16e+04 rad/s, dt below 9.9e-06 s does" in found.message


@pytest.mark.parametrize(("stiffness", "damping", "limit"), [(1e6, 0.0, 6e-3), (1e8, 0.0, 6e-4), (1.0, 1e4, 6e-4)])
def test_an_explicit_run_above_its_limit_of_stability_tells_the_limit(stiffness, damping, limit):
    found = oscillator(stiffness, mbd.RungeKutta853(), 3.0 * limit, damping)
    assert not found.success and f"stable for dt below {limit:.2g} s only" in found.message
    assert oscillator(stiffness, mbd.RungeKutta853(), 0.5 * limit, damping).success


@pytest.mark.parametrize("integrator", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_speeds_whose_energy_no_number_holds_warn_in_words_only(integrator):
    model, _ = falling()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = run(model, {}, {"fall.rate": 1e200}, integrator=integrator, dt=1e-3, until=1e-2)
        assert "not judged" in str(found) and "kinetic" in str(found.energy)


def test_a_mass_that_vanishes_is_no_matter_of_rows():
    fading = mbd.Lagrangian(
        "fading",
        ["x", "y"],
        kinetic=lambda x, x_rate, y_rate: 0.5 * mbd.where(x > 0.5, 1.0, 0.0) * x_rate**2 + 0.5 * y_rate**2,
        potential=lambda x: 9.81 * x,
    )
    start = mbd.assemble(fading, position={"x": 1.0})
    with pytest.raises(mbd.SimulationError, match="no row acts there, so its mass matrix is") as failed:
        mbd.simulate(fading, start, mbd.HHT(0.05), dt=1e-2, until=1.0)
    assert "rows depend" not in str(failed.value)


COARSE = [mbd.HHT(0.05), mbd.Newmark(), mbd.GeneralizedAlpha(0.9), mbd.RadauIIA(), mbd.RungeKutta853()]


def between_walls(seed):
    """A mass that flies to and fro between two steep walls; how deep it goes into them, its speed, the way to them."""
    rng = np.random.default_rng(seed)
    speed, depth, reach = rng.uniform(0.5, 2.0), 10.0 ** rng.uniform(-3.0, -2.0), rng.uniform(0.5, 1.5)
    energy = 0.5 * speed**2
    walls = [
        lambda x: energy * (mbd.exp((x - reach) / depth) + mbd.exp((-x - reach) / depth)),
        lambda x: energy / depth**2 * mbd.where(abs(x) > reach, (abs(x) - reach) ** 2, 0.0),
    ]
    model = mbd.Model("between walls", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin))
    model.apply(mbd.Potential("walls", walls[seed % 2], ("slide.displacement",)))
    return model, mbd.assemble(model, velocity={"slide.displacement": speed}), depth, speed, reach


def coarse_notes(found):
    return [note for note in found.stats["notes"] if "not resolved by dt" in note]


@pytest.mark.covering
@pytest.mark.parametrize("integrator", COARSE, ids=lambda scheme: type(scheme).__name__)
@pytest.mark.parametrize("seed", range(4))
def test_a_wall_that_is_thinner_than_a_step_is_told_with_a_step_that_resolves_it(seed, integrator):
    model, start, depth, speed, reach = between_walls(seed)
    until, dt = 6.0 * reach / speed, min(20.0 * depth, 0.3 * reach) / speed
    found = mbd.simulate(model, start, integrator, dt=dt, until=until, on_failure="return")
    if not found.success:  # the other way to say it
        assert "dt" in found.message
        return
    times = np.linspace(0.0, until, 101)
    exact = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.1 * depth / speed, until=until).at(times)
    off = np.max(np.abs(found.at(times)["slide.displacement"] - exact["slide.displacement"]))
    (note,) = coarse_notes(found) or [""]
    assert note or off < 0.1 * reach
    if note:
        asked = float(re.findall(r"try dt <= ([\d.e-]+) s", note)[0])
        assert 0.02 * depth / speed < asked < 5.0 * depth / speed
        finer = mbd.simulate(model, start, integrator, dt=asked, until=until)
        assert not coarse_notes(finer)
        assert np.max(np.abs(finer.at(times)["slide.displacement"] - exact["slide.displacement"])) < 0.1 * reach


@pytest.mark.parametrize("share", [0.2, 1.0, 2.6])
@pytest.mark.parametrize("scheme", [mbd.GeneralizedAlpha(rho_inf=0.0), mbd.GeneralizedAlpha(rho_inf=0.5), mbd.HHT(0.3)])
def test_a_scheme_that_lags_behind_a_steep_brake_says_so(scheme, share):
    """``v̇ = −c v³`` from v₀ has ``v = v₀ / √(1 + 2 c v₀² t)``; the first step brakes v₀ by about `share`."""
    speed, dt = 33.0, 1e-3
    model = mbd.Model("braked wheel", gravity=(0.0, 0.0, 0.0))
    wheel = mbd.RigidBody("wheel", mass=1.0, inertia=0.01)
    model.connect(mbd.Revolute("pin", model.ground.origin, wheel.origin))
    c = share / (speed**2 * dt)
    model.apply(mbd.Motor("brake", model.joints[0], lambda v: -0.01 * c * v**3, arguments=["pin.rate"]))
    start = mbd.assemble(model, velocity={"pin.angle": speed})
    run = mbd.simulate(model, start, scheme, dt=dt, until=10.0 * dt)
    exact = speed / np.sqrt(1.0 + 2.0 * c * speed**2 * run.time)
    off = np.max(np.abs(run["pin.rate"] - exact) / exact)
    assert off < 0.5 or any("not resolved by dt" in note for note in run.stats["notes"])


@pytest.mark.parametrize(("share", "told"), [(1.7, "170"), (0.23, "23"), (0.0012, "0.1"), (4e-6, "0.0004")])
def test_uncertain_rates_are_never_told_to_be_certain(share, told):
    assert percent(share) == told
