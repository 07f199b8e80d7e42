"""Steps that do not resolve the motion: what a run says, and the step that it asks for."""

import random
import re
import warnings

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

import mbd
from mbd.equations.clusters import clusters
from mbd.equations.derivation import derive
from mbd.simulation.diagnostics.coarse import percent
from mbd.testing.mechanisms import random_tree
from tests.helpers import one_body
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
    model, _ = one_body(mbd.PointMass("body", mass=1.0), mbd.Prismatic, "slide", gravity=(0.0, 0.0, 0.0))
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
    model, _ = one_body(mbd.RigidBody("wheel", mass=1.0, inertia=0.01), mbd.Revolute, "pin", gravity=(0.0, 0.0, 0.0))
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


# who else is there --------------------------------------------------------------------------------------------------
def at_walls(seed, beside):
    """A random tree of two bodies with a stiff wall on each side of one coordinate, and something apart from it."""
    rng = random.Random(seed)
    model = random_tree(seed, 2, spatial=seed % 2 == 1, most=4)
    names = [f"{joint.name}.{label.name}" for joint in model.joints for label in joint.labels]
    velocity = {name: rng.uniform(-2.0, 2.0) for name in names}
    reach, depth, energy = rng.uniform(0.02, 0.4), 10.0 ** rng.uniform(-4.0, -2.0), rng.uniform(0.1, 3.0)

    def wall(x):
        return energy / depth**2 * mbd.where(abs(x) > reach, (abs(x) - reach) ** 2, 0.0)

    model.apply(mbd.Potential("walls", wall, (rng.choice(names),)))
    if beside == "wheel":
        wheel = mbd.RigidBody("wheel", mass=3.0, inertia=0.7)
        model.connect(mbd.Revolute("pin", model.ground.origin, wheel.origin))
        velocity["pin.angle"] = 800.0
    elif beside == "stone":
        stone = mbd.PointMass("stone", mass=900.0)
        model.connect(mbd.Translation("flight", model.ground.origin, stone.origin))
        velocity["flight.x"] = 300.0
    elif beside == "weight":
        weight = mbd.PointMass("weight", mass=50.0)
        spring = {"stiffness": 2e3, "loss": mbd.Viscous(3.0)}
        model.connect(mbd.Prismatic("swing", model.ground.origin, weight.origin, **spring))
        velocity["swing.displacement"] = 40.0
    return model, mbd.assemble(model, velocity=velocity)


def told(seed, integrator, beside=""):
    """Whether a run goes as far as it is asked to, what ends it, and what it says of its steps."""
    model, start = at_walls(seed, beside)
    dt = 10.0 ** random.Random(seed + 1).uniform(-3.0, -1.7)
    found = mbd.simulate(model, start, integrator, dt=dt, until=40.0 * dt, on_failure="return")
    failed = found.message if not found.success else ""
    return failed, coarse_notes(found)


@settings(max_examples=12, deadline=None)
@given(
    st.integers(0, 10**6),
    st.sampled_from([mbd.RungeKutta4(), mbd.RungeKutta853()]),
    st.sampled_from(["wheel", "stone", "weight"]),
)
def test_what_an_explicit_run_says_of_its_steps_is_the_same_beside_a_body_apart(seed, integrator, beside):
    alone, together = told(seed, integrator), told(seed, integrator, beside)
    assume("energy" not in alone[0])  # which is judged of all bodies as one
    assert alone == together


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([mbd.HHT(0.05), mbd.GeneralizedAlpha(0.5), mbd.RadauIIA()]))
def test_what_an_implicit_run_says_of_its_steps_is_the_same_beside_a_wheel(seed, integrator):
    alone, together = told(seed, integrator), told(seed, integrator, "wheel")
    assume(not alone[0] and not together[0])
    assert alone[1] == together[1]


def test_what_forces_masses_or_rows_connect_is_one_cluster():
    model = mbd.Model("apart", gravity=(0.0, 0.0, 0.0))
    bodies = [mbd.PointMass(f"body {k}", mass=1.0) for k in range(7)]
    slides = [mbd.Translation(f"place {k}", model.ground.origin, body.origin) for k, body in enumerate(bodies)]
    model.connect(*slides)
    model.apply(mbd.Spring("spring", bodies[0].origin, bodies[2].origin, stiffness=10.0, length=1.0))
    model.constrain(mbd.Bilateral("rod", mbd.distance(bodies[3].origin, bodies[1].origin), value=1.0))
    model.constrain(mbd.Penalty("bumper", mbd.distance(bodies[4].origin, bodies[5].origin), stiffness=1e3))
    found = clusters(derive(model))
    assert found[:2] == found[4:6] and found[2:4] == found[6:8] and found[8:10] == found[10:12]
    assert len({found[k] for k in (0, 2, 8, 12, 13)}) == len(set(found)) == 5, "both ways of a point are apart, too"
    assert found[14:] == (found[2],), "a row is of the cluster that it connects"


# forces that begin, end or act within a step ------------------------------------------------------------------------
def pushed(integrator, force, dt, until, speed=1.0, arguments=("t",), wheel=0.0):
    """A mass of 1 kg on a slide that a force pushes, perhaps beside a wheel."""
    model = mbd.Model("pushed", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin))
    model.apply(mbd.Motor("push", model.joints[0], force, arguments=list(arguments)))
    velocity = {"slide.displacement": speed}
    if wheel:
        round_ = mbd.RigidBody("wheel", mass=1.0, inertia=0.01)
        model.connect(mbd.Revolute("pin", model.ground.origin, round_.origin))
        velocity["pin.angle"] = wheel
    start = mbd.assemble(model, velocity=velocity)
    return mbd.simulate(model, start, integrator, dt=dt, until=until, on_failure="return")


@settings(max_examples=25, deadline=None)
@given(
    st.floats(-1.0, 1.0), st.floats(-3.0, -1.5), st.floats(0.1, 5.0), st.floats(5.0, 40.0),
    st.one_of(st.none(), st.floats(1.1, 3.0)), st.sampled_from([0.0, 1e3]),
)  # fmt: skip
def test_four_stages_that_meet_a_wall_tell_a_rate_that_is_wrong(speed, step, push, way, width, wheel):
    """A wall that steps cannot leap over throws a body back as fast as it came."""
    speed, dt = 10.0**speed, 10.0**step
    force, at = 10.0**push * speed / dt, way * speed * dt
    end = np.inf if width is None else at + width * speed * dt
    found = pushed(
        mbd.RungeKutta4(), lambda x: mbd.where(x > at, mbd.where(x < end, -force, 0.0), 0.0), dt, 2.2 * way * dt, speed,
        ("slide.displacement",), wheel,
    )  # fmt: skip
    thrown = abs(found.final["slide.rate"] + speed) / speed
    assert not found.success or coarse_notes(found) or thrown < 0.35
    if not found.success:
        assert "slide.displacement" in found.message and "pin" not in found.message


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0, 1.0), st.floats(0.1, 1.3), st.floats(-2.0, 2.0))
def test_a_smooth_motion_that_four_stages_follow_is_not_doubted(phase, turn, scale):
    """``v = V cos(ω t + φ)`` with 0.1 < ω dt < 1.3: four stages are right within 3 % in a step."""
    angle, dt = 2.0 * np.pi * phase, 0.01
    found = oscillator_at(turn / dt, 10.0**scale * np.sin(angle), 10.0**scale * np.cos(angle) * turn / dt, dt)
    assert found.success and not coarse_notes(found)


def oscillator_at(frequency, place, speed, dt):
    model = mbd.Model("oscillator", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=frequency**2))
    start = mbd.assemble(model, {"slide.displacement": place}, velocity={"slide.displacement": speed})
    return mbd.simulate(model, start, mbd.RungeKutta4(), dt=dt, until=20.0 * dt, on_failure="return")


@pytest.mark.parametrize("power", [1, 2, 3])
@pytest.mark.parametrize("speed", [0.0, 1e-3])
def test_a_force_that_grows_from_nothing_is_not_doubted(power, speed):
    found = pushed(mbd.RungeKutta4(), lambda t: 1e3 * t**power, 0.01, 0.1, speed)
    assert found.final["slide.rate"] == pytest.approx(speed + 1e3 * 0.1 ** (power + 1) / (power + 1), rel=1e-2)
    assert not coarse_notes(found)


@pytest.mark.parametrize("force", [0.3, 3.0])
def test_friction_that_turns_within_a_step_of_a_swing_is_not_doubted(force):
    """What it errs by is small beside how fast the swing was, if not beside how fast it is as it turns."""
    model = mbd.Model("swing", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    loss = mbd.Coulomb(force, smoothing=0.01)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=40.0, loss=loss))
    start = mbd.assemble(model, {"slide.displacement": 1.0})
    found = mbd.simulate(model, start, mbd.RungeKutta4(), dt=0.01, until=3.0)
    exact = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-8, until=3.0)
    assert not coarse_notes(found)
    assert abs(found.final["slide.rate"] - exact.final["slide.rate"]) < 0.02


@pytest.mark.parametrize("before", [1.0, 20.0, 200.0])
def test_a_body_that_was_fast_long_before_hides_no_wall(before):
    def force(v, t):
        return mbd.where(t < 1.0, -8.0 * (v - 1.0), 0.0)

    model = mbd.Model("braked", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    slide = mbd.Prismatic("slide", model.ground.origin, body.origin)
    model.connect(slide)
    model.apply(mbd.Motor("brake", slide, force, arguments=["slide.rate", "t"]))
    wall = 1.5 + before / 8.0
    push = mbd.Motor(
        "wall", slide, lambda x: mbd.where(x > wall, -4e4 * (x - wall), 0.0), arguments=["slide.displacement"]
    )
    model.apply(push)
    start = mbd.assemble(model, velocity={"slide.displacement": before})
    run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=0.01, until=4.0, on_failure="return")
    right = abs(run["slide.rate"][-1] + 1.0) < 0.2
    assert right or not run.success or coarse_notes(run)


@pytest.mark.parametrize("b", [1e-3, 3e-2])
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RungeKutta4()])
def test_a_pole_that_a_step_passes_is_refused_beside_a_body_that_is_shaken(scheme, b):
    def end(beside):
        model = mbd.Model("pole", gravity=(0.0, 0.0, 0.0))
        planet, weight = mbd.PointMass("planet", mass=1.0), mbd.PointMass("weight", mass=1.0)
        model.connect(mbd.Translation("place", model.ground.origin, planet.origin))
        model.apply(mbd.Potential("pull", lambda x, y: -1.0 / mbd.sqrt(x * x + y * y), ("place.x", "place.y")))
        if beside:
            slide = mbd.Prismatic("slide", model.ground.origin, weight.origin)
            model.connect(slide)
            model.apply(mbd.Motor("push", slide, lambda t: 1e4 * mbd.sin(25.0 * t), arguments=["t"]))
        start = mbd.assemble(model, {"place.x": -1.0, "place.y": b}, {"place.x": 1.0, "place.y": 0.0})
        return mbd.simulate(model, start, scheme, dt=0.1, until=3.0, on_failure="return").success

    assert end(False) or not end(True)
