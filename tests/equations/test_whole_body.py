"""Results of the whole body: sums over bodies, conservation laws, and the center of pressure of contacts."""

import numpy as np
import pytest

import mbd


@pytest.fixture(scope="module")
def fall():
    """A person who tumbles freely."""
    body = mbd.human(75.0, 1.8).without("left arm", "right arm")
    model = mbd.Model("person")
    model.connect(*body.joints)
    rng = np.random.default_rng(0)
    rest = mbd.assemble(model, position=body.standing(0.3))
    velocity = {name: float(rng.normal()) for name in rest.velocity_names}
    start = mbd.assemble(model, position=body.standing(0.3), velocity=velocity)
    return body, mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=0.2)


def test_the_center_of_mass_is_the_mean_of_the_centers(fall):
    body, run = fall
    masses = {name: each.fields()["mass"] for name, each in body.bodies.items()}
    mean = sum(mass * run[f"{name}.center"] for name, mass in masses.items()) / sum(masses.values())
    assert run["center of mass"] == pytest.approx(mean, abs=1e-12)
    speed = sum(
        mass * np.column_stack([run[f"{name}.center.v{axis}"] for axis in "xyz"]) for name, mass in masses.items()
    )
    assert run["momentum"] == pytest.approx(speed, abs=1e-9)


def test_a_free_fall_keeps_momentum_sideways_and_all_angular_momentum(fall):
    _, run = fall
    time, mass = run.time, fall[0].mass
    assert run["momentum.x"] == pytest.approx(run["momentum.x"][0], abs=1e-7)
    assert run["momentum.y"] == pytest.approx(run["momentum.y"][0] - 9.81 * mass * time, abs=1e-6)
    assert np.abs(run["angular momentum"] - run["angular momentum"][0]).max() < 1e-6
    assert run["center of mass.ay"] == pytest.approx(-9.81, abs=1e-8)
    assert np.abs(run["external force"]).max() < 1e-6 and np.abs(run["external moment"]).max() < 1e-6
    assert np.isnan(run["center of pressure.x"]).all()


def test_the_center_of_pressure_is_that_of_the_contacts():
    model = mbd.Model("stool")
    seat = mbd.RigidBody("seat", mass=20.0, inertia=1.0)
    model.connect(mbd.Planar("base", model.ground.origin, seat.origin))
    feet = [seat.point(x, -0.5) for x in (-0.2, 0.3)]
    for name, foot in zip(("left", "right"), feet, strict=True):
        model.constrain(mbd.Penalty(name, mbd.height(foot), stiffness=1e5, damping=300.0))
    model.apply(mbd.Applied("drift", seat.origin, torque=lambda t: 10.0 * mbd.sin(20.0 * t)))
    start = mbd.assemble(model, position={"base.y": 0.501})
    run = mbd.simulate(model, start, tol=1e-8, until=0.3)
    push = run["left.force"] + run["right.force"]
    loaded = push > 20.0
    assert loaded.sum() > 20
    assert run["external force.y"] == pytest.approx(push, abs=1e-6)
    places = [run["base.x"] + np.cos(run["base.angle"]) * x + 0.5 * np.sin(run["base.angle"]) for x in (-0.2, 0.3)]
    moment = sum(x * run[f"{name}.force"] for name, x in zip(("left", "right"), places, strict=True))
    moment = moment + 10.0 * np.sin(20.0 * run.time)  # the torque acts from outside too
    assert run["center of pressure.x"][loaded] == pytest.approx((moment / push)[loaded], abs=1e-6)
    assert run["center of pressure.y"][loaded] == pytest.approx(0.0)


def test_the_extrapolated_center_of_mass_leads_by_the_time_of_an_inverted_pendulum(fall):
    _, run = fall
    lead = np.sqrt(run["center of mass.y"] / 9.81)
    expected = run["center of mass.x"] + lead * run["center of mass.vx"]
    assert run["extrapolated center of mass.x"] == pytest.approx(expected, abs=1e-12)


def test_they_are_answered_and_not_listed(fall):
    _, run = fall
    assert "center of mass.x" in run and "center of mass" in run and "center of mass.x" not in run.names
