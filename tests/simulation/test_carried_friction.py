"""Dry friction along prescribed motion slides from the instant at which the drive moves, however smoothly."""

import numpy as np
import pytest

import mbd

SCHEMES = [
    mbd.HHT(0.05), mbd.HHT(0.05, formulation="index3"), mbd.GeneralizedAlpha(0.7), mbd.Newmark(), mbd.RadauIIA(),
    mbd.RungeKutta853(),
]  # fmt: skip
DWELL = 0.05


def after_dwell(power: int, sign: float):
    """Rest, then the power of the time since its end."""
    return lambda t: mbd.where(t < DWELL, 0.0, sign * 4.0 * (t - DWELL) ** power)


def braked_arm(drive):
    """An arm that is driven against the dry friction of its hinge, whose limit is 0.1 N m."""
    model, arm = mbd.Model("braked arm"), mbd.Link("arm", mass=1.0, length=0.5, center=0.25, inertia=0.02)
    hinge = mbd.Revolute("hinge", model.ground.origin, arm.start, loss=mbd.Coulomb(0.1))
    model.connect(hinge)
    model.constrain(mbd.Bilateral("drive", hinge, drive))
    return model, "hinge.rate", "hinge.friction", 0.1


def dragged_block(drive):
    """A block that is driven over rough ground in the plane, whose limit is 0.4 of its weight."""
    model, block = mbd.Model("dragged block"), mbd.PointMass("block", 2.0)
    model.connect(mbd.Translation("flight", model.ground.origin, block.origin, axes="xy"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin), friction=0.4))
    model.constrain(mbd.Bilateral("drive", mbd.measure("flight.x"), drive))
    return model, "flight.x.rate", "foot.friction", 0.4 * 2.0 * 9.81


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("made", [braked_arm, dragged_block])
def test_friction_along_a_drive_slides_from_the_end_of_its_dwell(scheme, made):
    """Until then it carries nothing, as the drive holds the body; from then on it is all of its limit."""
    compared = 0
    for power, sign in ((3, 1.0), (4, -1.0)):
        model, rate, friction, limit = made(after_dwell(power, sign))
        for options in ({"dt": 1e-3}, {"dt": 7e-3}, {"tol": 1e-5}):
            if "tol" in options and getattr(scheme, "formulation", "") == "index3":
                continue
            run = mbd.simulate(model, mbd.assemble(model, project=False), scheme, until=0.12, **options)
            slides = [event.time for event in run.events if event.kind == "slipped"]
            assert slides == pytest.approx([DWELL], abs=1e-12), (power, options)
            moving = (run.t > DWELL) & (np.abs(run[rate]) > 1e-9)
            assert run[friction][moving] == pytest.approx(-sign * limit, rel=1e-9), (power, options)
            assert np.abs(run[friction][run.t < DWELL]).max() < 1e-9 * limit
            compared += int(moving.sum())
    assert compared > 100


def test_a_block_in_space_slides_along_its_drive():
    """Two drives lead the block over a plane: friction is against its way, from the first instant on."""
    model, block = mbd.Model("dragged block"), mbd.PointMass("block", 2.0)
    model.connect(mbd.Translation("flight", model.ground.origin, block.origin, axes="xyz"))
    model.constrain(
        mbd.Unilateral("foot", mbd.touchdown(block.origin), friction=0.4),
        mbd.Bilateral("ahead", mbd.measure("flight.x"), lambda t: 3.0 * t**3),
        mbd.Bilateral("aside", mbd.measure("flight.z"), lambda t: -4.0 * t**3),
    )
    for scheme in (mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()):
        run = mbd.simulate(model, mbd.assemble(model, project=False), scheme, dt=4e-3, until=0.1)
        later = run.t > 0.0
        limit = 0.4 * 2.0 * 9.81
        assert run["foot.friction.forward"][later] == pytest.approx(-0.6 * limit, rel=1e-6)
        assert run["foot.friction.sideways"][later] == pytest.approx(0.8 * limit, rel=1e-6)
