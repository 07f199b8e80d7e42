"""Net moments of joints in runs: the sum of springs, losses, motors, stops and rows along a coordinate."""

import numpy as np
import pytest

import mbd


def leg():
    """Two links whose knee has everything, pushed from outside, with a foot that meets the ground."""
    model = mbd.Model("leg")
    thigh = mbd.Link("thigh", mass=8.0, length=0.42, center=0.18, inertia=0.13)
    shank = mbd.Link("shank", mass=3.5, length=0.43, center=0.2, inertia=0.06)
    hip = mbd.Revolute("hip", model.ground.point(0.0, 0.8), thigh.start)
    loss = mbd.Viscous(0.3) + mbd.Coulomb(0.4)
    knee = mbd.Revolute("knee", thigh.end, shank.start, loss=loss, stiffness=2.0, rest=0.1)
    model.connect(hip, knee)
    model.constrain(mbd.Unilateral("stop", mbd.flexion(knee)))
    model.constrain(mbd.Penalty("foot", mbd.height(shank.end), stiffness=2e4, damping=50.0))
    model.apply(mbd.Motor("servo", knee, torque=lambda t: 3.0 * mbd.sin(9.0 * t), arguments=("t",)))
    model.apply(mbd.Applied("push", shank.end, force=(5.0, 1.0)))
    start = mbd.assemble(model, position={"hip.angle": 0.9, "knee.angle": -0.6})
    return model, mbd.simulate(model, start, tol=1e-4, until=0.5)


def test_a_net_moment_is_the_sum_of_what_acts_at_the_joint():
    _, run = leg()
    assert {event.name for event in run.events} >= {"foot", "stop"}
    parts = ("knee loss.torque", "knee spring.torque", "knee.friction", "servo.torque")
    total = sum(run[name] for name in parts) - run["stop.force"]
    assert run["knee.net_moment"] == pytest.approx(total, abs=1e-9)
    assert np.array_equal(run["knee.angle.net_moment"], run["knee.net_moment"])
    assert np.abs(run["hip.net_moment"]).max() < 1e-12  # neither weight, nor the ground, nor a push from outside


def test_net_moments_are_neither_listed_nor_made_before_they_are_asked_for(tmp_path):
    _, run = leg()
    assert not any("net_moment" in name for name in run.names)
    assert "knee.net_moment" in run
    saved = mbd.load(run.save(tmp_path / "run"))
    assert saved["knee.angle.net_moment"] == pytest.approx(run["knee.net_moment"], abs=1e-12)
    between = [0.1234, 0.345]
    assert saved.at(between)["knee.angle.net_moment"] == pytest.approx(run.at(between)["knee.net_moment"], rel=1e-9)


def test_a_ball_joint_has_three_components_and_a_slide_a_force():
    model = mbd.Model("ball")
    rod = mbd.RigidBody("rod", mass=2.0, inertia=(0.1, 0.02, 0.1))
    cart = mbd.RigidBody("cart", mass=1.0, inertia=0.1)
    model.connect(
        mbd.Prismatic("rail", model.ground.origin, cart.origin, stiffness=40.0),
        mbd.Spherical("ball", cart.origin, rod.point(0.0, 0.5), loss=mbd.Viscous(0.4)),
    )
    start = mbd.assemble(model, velocity={"ball.angular_velocity": (1.0, 2.0, 3.0), "rail.displacement.rate": 0.2})
    run = mbd.simulate(model, start, tol=1e-7, until=0.3)
    assert run["ball.net_moment"] == pytest.approx(-0.4 * run["ball.angular_velocity"], abs=1e-12)
    assert run["rail.net_force"] == pytest.approx(-40.0 * run["rail.displacement"], abs=1e-12)
    assert run.to_dataframe(["ball.net_moment"]).attrs["units"]["ball.net_moment.x"] == "N m"


def test_the_torque_of_a_joint_that_has_none_of_that_name_is_offered():
    _, run = leg()
    with pytest.raises(mbd.UnknownNameError, match=r"'knee\.net_moment'"):
        run["knee.torque"]
