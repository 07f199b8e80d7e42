"""Rotors of drives: reflected inertia on the coordinate of a joint."""

import numpy as np
import pytest

import mbd
from mbd.testing import check_model


def leg(rotor: bool, geared: bool = False) -> tuple[mbd.Model, mbd.State]:
    """A double pendulum whose hip has a drive on the ground: as a `Rotor`, or as a body behind a gear."""
    model = mbd.Model("driven leg")
    thigh, shank = mbd.Link("thigh", 2.0, 0.5, 0.2, 0.05), mbd.Link("shank", 1.0, 0.4, 0.2, 0.02)
    hip = mbd.Revolute("hip", model.ground.origin, thigh.start)
    knee = mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(hip, knee)
    model.constrain(mbd.Unilateral("stop", mbd.flexion(knee), restitution=0.4))
    if rotor:
        model.apply(mbd.Rotor("rotor", hip, inertia=1e-3, ratio=12.0))
    position = {"hip.angle": 0.8, "knee.angle": -0.2}
    if geared:
        disk = mbd.RigidBody("disk", 1.0, (1.0, 1.0, 1e-3))
        model.connect(mbd.Revolute("axle", model.ground.point(0.5, 0.0), disk.origin))
        gear = mbd.measure(lambda a, b: a - 12.0 * b, "axle.angle", "hip.angle", unit="rad")
        model.constrain(mbd.Bilateral("gear", gear))
        position["axle.angle"] = 9.6
    return model, mbd.assemble(model, position=position)


def test_a_rotor_moves_as_the_geared_body_that_it_stands_for():
    """Along free motion and through impacts of the knee."""
    one, other = (
        mbd.simulate(*leg(*which), mbd.RungeKutta853(), dt=0.01, until=2.0) for which in ((True,), (False, True))
    )
    assert [event.name for event in one.events] == [event.name for event in other.events]
    assert any(event.kind == "closed" for event in one.events)
    times = np.linspace(0.0, 2.0, 41)
    for name in ("hip.angle", "knee.angle", "hip.rate"):
        np.testing.assert_allclose(one.at(times)[name], other.at(times)[name], atol=1e-9)
    np.testing.assert_allclose(one.at(times)["kinetic_energy"], other.at(times)["kinetic_energy"], rtol=1e-8, atol=1e-9)
    assert one.energy.drift < 1e-8


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta4()], ids=repr)
def test_a_pendulum_with_a_rotor_swings_more_slowly(scheme):
    """ω² = m g c/(I + m c² + J r²) of small swings."""
    model, rod = mbd.Model("pendulum"), mbd.Link("rod", 1.0, 1.0, 0.5, 0.1)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start)
    model.connect(pin)
    model.apply(mbd.Rotor("rotor", pin, inertia=2e-3, ratio=10.0))
    check_model(model)
    w = np.sqrt(9.81 * 0.5 / (0.1 + 0.25 + 0.2))
    run = mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 1e-4}), scheme, dt=1e-3, until=2.0)
    np.testing.assert_allclose(run["pin.angle"], 1e-4 * np.cos(w * run.time), atol=1e-9)
    faster = mbd.simulate(
        model, mbd.assemble(model, position={"pin.angle": 1e-4}), scheme, dt=1e-3, until=0.5,
        parameters={"rotor.ratio": 0.0},
    )  # fmt: skip
    w = np.sqrt(9.81 * 0.5 / 0.35)
    np.testing.assert_allclose(faster["pin.angle"], 1e-4 * np.cos(w * faster.time), atol=1e-9)


def test_the_models_with_rotors_keep_the_laws_of_the_equations():
    model, _ = leg(True)
    check_model(model)
    looped = mbd.Model("loop")
    a, b = mbd.Link("a", 1.0, 0.5, 0.2, 0.02), mbd.Link("b", 1.0, 0.6, 0.3, 0.03)
    looped.connect(mbd.Revolute("p", looped.ground.origin, a.start), mbd.Revolute("q", a.end, b.start))
    slide = mbd.Prismatic("slide", looped.ground.point(0.0, 0.1), b.end)
    looped.connect(slide)
    looped.apply(mbd.Rotor("screw", slide, inertia=1e-4, ratio=80.0))
    check_model(looped)


def test_a_rotor_with_a_negative_inertia_is_refused_by_name():
    model, rod = mbd.Model("m"), mbd.Link("rod", 1.0, 1.0, 0.5)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start)
    with pytest.raises(mbd.ModelError, match="Rotor 'rotor': inertia -1 kg m² is negative"):
        mbd.Rotor("rotor", pin, -1.0)


def test_computed_torque_knows_the_rotors():
    """τ = M u + h with u = 3 rad/s² accelerates the driven coordinate by just that."""
    model, rod = mbd.Model("m"), mbd.Link("rod", 1.0, 1.0, 0.5, 0.1)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start)
    model.connect(pin)
    arguments = [mbd.mass_matrix("pin"), mbd.bias_forces("pin")]
    model.apply(mbd.Rotor("rotor", pin, 2e-3, 10.0))
    model.apply(mbd.Motor("drive", pin, torque=lambda M, h: 3.0 * M[0][0] + h[0], arguments=arguments))
    run = mbd.simulate(model, mbd.assemble(model), mbd.RungeKutta4(), dt=0.01, until=0.2)
    np.testing.assert_allclose(run["pin.acceleration"], 3.0, rtol=1e-12)


def test_armature_alone_moves_a_body_without_mass_and_none_is_an_error() -> None:
    for inertia in (0.5, 0.0):
        model, point = mbd.Model("slider", gravity=(0.0, 0.0, 0.0)), mbd.PointMass("point", mass=0.0)
        rail = mbd.Prismatic("rail", model.ground.origin, point.origin, stiffness=10.0)
        model.connect(rail)
        model.apply(mbd.Rotor("rotor", rail, inertia, 2.0))
        assert model.check() == []
        if inertia:
            start = mbd.assemble(model, {"rail.displacement": 1.0})
            run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.5)
            np.testing.assert_allclose(run["rail.displacement"], np.cos(np.sqrt(5.0) * run.time), atol=1e-12)
        else:
            with pytest.raises(mbd.AssemblyError, match=r"nothing determines the motion of 'rail.displacement'"):
                mbd.assemble(model, {"rail.displacement": 1.0})
