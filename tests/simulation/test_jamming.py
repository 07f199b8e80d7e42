"""Pins are said to jam where their friction can lock the motion, and only those, by every scheme."""

import random

import pytest

import mbd

SCHEMES = [
    mbd.Newmark(), mbd.HHT(0.05), mbd.HHT(0.1, formulation="index3"), mbd.GeneralizedAlpha(0.7), mbd.RadauIIA(),
    mbd.RungeKutta853(),
]  # fmt: skip


def spoiled(seed: int, part: float) -> tuple[mbd.Model, mbd.State]:
    """A pendulum whose pin has μ r = `part` of the lever arm J/(m c), J about the pin.

    A torque that jumps with the state makes steps fail whatever the pin does.
    """
    rng = random.Random(seed)
    mass, center, inertia = rng.uniform(0.2, 5.0), rng.uniform(0.05, 0.5), rng.choice([0.0, rng.uniform(1e-3, 0.1)])
    arm = (inertia + mass * center**2) / (mass * center)
    mu = rng.uniform(0.1, 1.5)
    model = mbd.Model("pendulum")
    bob = mbd.Link("bob", mass=mass, length=2.0 * center, center=center, inertia=inertia)
    model.connect(mbd.Revolute("hinge", model.ground.origin, bob.start, loss=mbd.PinFriction(mu, part * arm / mu)))
    turn = rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 6.0)
    angle = rng.uniform(-2.0, 2.0)
    model.apply(
        mbd.Motor("switch", model.joints[0], lambda x: mbd.where(x > angle, -1e7, 1e7), arguments=("hinge.angle",))
    )
    return model, mbd.assemble(model, position={"hinge.angle": angle}, velocity={"hinge.angle": turn})


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_a_point_mass_on_a_pin_that_reaches_its_lever_arm_does_not_move_and_is_named(scheme):
    for part in (1.01, 1.44, 3.0):
        model = mbd.Model("pendulum")
        bob = mbd.Link("bob", mass=1.0, length=0.1, center=0.05)
        model.connect(mbd.Revolute("hinge", model.ground.origin, bob.start, loss=mbd.PinFriction(1.0, part * 0.05)))
        start = mbd.assemble(model, position={"hinge.angle": 1.0}, velocity={"hinge.angle": 5.0})
        run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.2, on_failure="return")
        assert not run.success
        assert "pin friction of 'hinge' may jam: μ r reaches the lever arm" in run.message, run.message


@pytest.mark.covering
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("seed", range(6))
def test_a_pin_is_said_to_jam_where_it_reaches_the_lever_arm_and_not_below(seed, scheme):
    for part, jams in ((0.3, False), (0.9, False), (1.1, True)):
        run = mbd.simulate(*spoiled(seed, part), scheme, dt=1e-2, until=2.0, on_failure="return")
        assert run.success or ("may jam" in run.message) == jams, (part, run.message)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_only_the_pin_that_can_jam_is_named(scheme):
    model = mbd.Model("two links")
    upper, lower = mbd.Link("upper", 1.0, 1.0, 0.5, 0.1), mbd.Link("lower", 1.0, 0.1, 0.05)
    model.connect(
        mbd.Revolute("shoulder", model.ground.origin, upper.start, loss=mbd.PinFriction(0.1, 0.01)),
        mbd.Revolute("elbow", upper.end, lower.start, loss=mbd.PinFriction(1.0, 0.2)),
    )
    start = mbd.assemble(model, position={"shoulder.angle": 0.5}, velocity={"elbow.angle": 8.0, "shoulder.angle": 1.0})
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.5, on_failure="return")
    assert run.success or "pin friction of 'elbow' may jam" in run.message, run.message
    assert "'shoulder'" not in run.message.split("may jam")[0]
