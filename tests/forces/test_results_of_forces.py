"""Forces among the results, under the names of their parameters; each gives the power that the ledger counts."""

import random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.errors import ModelError


def driven(seed: int) -> tuple[mbd.Trajectory, mbd.Model]:
    """A slider with a pendulum, under every force there is."""
    rng = random.Random(seed)
    model = mbd.Model("slider")
    cart = mbd.RigidBody("cart", mass=rng.uniform(1.0, 3.0), inertia=0.1)
    rod = mbd.Link("rod", mass=rng.uniform(0.5, 1.0), length=0.7, center=0.3, inertia=0.02)
    rail = mbd.Prismatic("rail", model.ground.origin, cart.origin)
    pin = mbd.Revolute("pin", cart.origin, rod.start)
    model.connect(rail, pin)
    post = model.ground.point(rng.uniform(1.0, 2.0), rng.uniform(0.5, 1.0), name="post")
    arm = rod.point(0.1, -0.6, name="arm")
    model.apply(
        mbd.Motor("drive", pin, torque=lambda t: 2.0 * mbd.sin(5.0 * t)),
        mbd.Motor("pull", rail, force=rng.uniform(-5.0, 5.0)),
        mbd.Motor("old", rail, torque=lambda x: -3.0 * x, arguments=("rail.displacement",)),
        mbd.Applied("push", arm, force=lambda t: (3.0 * t, 1.0), torque=rng.uniform(-1.0, 1.0)),
        mbd.Spring("band", post, arm, stiffness=rng.uniform(5.0, 20.0), length=rng.choice([0.0, 0.4])),
        mbd.Damper("valve", post, arm, loss=mbd.Quadratic(0.3)),
        mbd.TorsionSpring("coil", pin, stiffness=rng.uniform(1.0, 4.0), rest=0.3),
        mbd.TorsionSpring("bumper", rail, stiffness=10.0),
    )
    start = mbd.assemble(model, position={"pin.angle": rng.uniform(-1.0, 1.0)}, velocity={"rail.displacement": 0.5})
    return mbd.simulate(model, start, dt=2e-3, until=0.02, backend="python"), model


@settings(max_examples=5)
@given(seed=st.integers(0, 10_000))
def test_forces_give_the_power_that_is_counted(seed):
    run, _ = driven(seed)
    apart = run["rod.arm"] - run["ground.post"]
    length = np.linalg.norm(apart, axis=1)
    velocity = np.column_stack([run[f"rod.arm.v{axis}"] for axis in "xyz"])
    rate = np.sum(apart * velocity, axis=1) / length
    close = {"rtol": 1e-9, "atol": 1e-9}
    np.testing.assert_allclose(run["drive.torque"] * run["pin.rate"], run["drive.power"], **close)
    np.testing.assert_allclose(run["pull.force"] * run["rail.rate"], run["pull.power"], **close)
    np.testing.assert_allclose(run["old.force"] * run["rail.rate"], run["old.power"], **close)
    work = np.sum(run["push.force"] * velocity, axis=1) + run["push.torque.z"] * run["pin.rate"]
    np.testing.assert_allclose(work, run["push.power"], **close)
    np.testing.assert_allclose(-run["valve.force"] * rate, run["valve.power"], **close)
    spring = run.parameters
    stretch = length - spring.get("band.length", 0.0)
    np.testing.assert_allclose(run["band.force"], spring["band.stiffness"] * stretch, **close)
    np.testing.assert_allclose(0.5 * run["band.force"] * stretch, run["band.energy"], **close)
    bend = run["pin.angle"] - spring["coil.rest"]
    np.testing.assert_allclose(run["coil.torque"], -spring["coil.stiffness"] * bend, **close)
    np.testing.assert_allclose(-0.5 * run["coil.torque"] * bend, run["coil.energy"], **close)
    np.testing.assert_allclose(run["bumper.force"], -10.0 * run["rail.displacement"], **close)


def test_a_result_has_the_name_of_its_parameter():
    run, model = driven(1)
    assert run["pull.force"][0] == model.parameters["pull.force"] == run.parameters["pull.force"]
    assert run["push.torque.z"][0] == model.parameters["push.torque.z"]
    units = run.to_dataframe(["pull.force", "drive.torque", "push.force", "band.force"]).attrs["units"]
    assert [units[name] for name in ("pull.force", "drive.torque", "push.force.x", "band.force")] == [
        "N",
        "N m",
        "N",
        "N",
    ]
    changed = mbd.simulate(
        model, mbd.assemble(model), dt=1e-2, until=0.02, backend="python", parameters={"pull.force": 7.0}
    )  # fmt: skip
    assert changed["pull.force"][-1] == 7.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "takes torque=… of an angle, or force=… along a slider, one of the two"),
        ({"torque": 1.0, "force": 1.0}, "one of the two"),
        ({"force": 1.0}, "Motor 'm' turns 'pin', so that it has a torque"),
        ({"torque": "strong"}, "torque of 'm' must be a number"),
    ],
)
def test_a_motor_with_the_wrong_effort_is_refused(given, words):
    pin = mbd.Revolute("pin", mbd.Model("m").ground.origin, mbd.Link("rod", 1.0, 1.0, 0.5).start)
    with pytest.raises(ModelError, match=words):
        mbd.Motor("m", pin, **given)


@pytest.mark.parametrize("cut", [(), "all"])
def test_losses_and_springs_of_joints_give_their_power_and_energy(cut):
    """Dry friction that sticks is a row of its own, and none of the loss."""
    model = mbd.Model("arm", cut=cut)
    one, two = (mbd.Link(name, 1.0, 1.0, 0.5, 0.1) for name in ("one", "two"))
    loss = mbd.Viscous(0.3) + mbd.Coulomb(0.2)
    model.connect(mbd.Revolute("shoulder", model.ground.origin, one.start, loss=loss, stiffness=4.0, rest=0.2))
    model.connect(mbd.Cylindrical("wrist", one.end, two.start, loss={"angle": mbd.Quadratic(0.5)}))
    model.connect(mbd.Prismatic("rail", two.end, mbd.PointMass("bob", 0.1).origin, axis="z", stiffness=5.0))
    start = mbd.assemble(
        model, {"shoulder.angle": 0.5, "wrist.angle": 0.3, "rail.displacement": 0.1}, {"wrist.angle": 2.0}
    )
    run = mbd.simulate(model, start, dt=0.01, until=0.05, backend="python")
    for name, rate in ("shoulder loss", "shoulder.rate"), ("wrist loss.angle", "wrist.angle.rate"):
        power = run[f"{name.partition(' loss')[0]} loss.power"]
        np.testing.assert_allclose(run[f"{name}.torque"] * run[rate], power, rtol=1e-12, atol=1e-15)
    stretch = run["shoulder.angle"] - 0.2
    np.testing.assert_allclose(run["shoulder spring.torque"], -4.0 * stretch, rtol=1e-12)
    np.testing.assert_allclose(
        -0.5 * run["shoulder spring.torque"] * stretch, run["shoulder spring.energy"], rtol=1e-12
    )
    np.testing.assert_allclose(run["rail spring.force"], -5.0 * run["rail.displacement"], rtol=1e-12)
    units = run.to_dataframe(["wrist loss.angle.torque", "rail spring.force"]).attrs["units"]
    assert list(units.values())[-2:] == ["N m", "N"]
    with pytest.raises(mbd.UnknownNameError, match="did you mean 'shoulder loss.torque' or 'shoulder spring.torque'"):
        run["shoulder.torque"]
