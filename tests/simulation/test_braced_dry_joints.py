"""Dry joints of what is braced in a carriage: beyond their limits, without sliding, whatever the carriage does."""

import math
import random

import numpy as np
import pytest

import mbd

SCHEMES = [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(), mbd.RungeKutta4(), mbd.RungeKutta853()]


def braced(seed: int, cut: str, speed: float) -> tuple[mbd.Model, mbd.State]:
    """Two bars from a steady carriage to a foot on its deck; dry friction in their pin bears part of a load."""
    draw = random.Random(seed).uniform
    model = mbd.Model("braced", **({"cut": cut} if cut else {}))
    carriage = mbd.RigidBody("carriage", mass=1.0, inertia=1.0)
    lengths, angles = (draw(0.3, 2.0), draw(0.3, 2.0)), (draw(-2.0, 2.0), draw(0.5, 2.5))
    bars = [
        mbd.RigidBody(name, draw(0.1, 5.0), 10.0 ** draw(-3.0, 0.0), center=(0.0, -draw(0.2, 1.0) * length))
        for name, length in zip(("first", "second"), lengths, strict=True)
    ]
    height = -lengths[0] * math.cos(angles[0]) - lengths[1] * math.cos(angles[0] + angles[1])
    rail = mbd.Prismatic("rail", model.ground.origin, carriage.origin, axis=(math.cos(seed), math.sin(seed), 0.0))
    pin = mbd.Revolute("pin", bars[0].point(0.0, -lengths[0]), bars[1].origin, loss=mbd.Coulomb(draw(0.1, 2.0)))
    model.connect(
        rail,
        mbd.Revolute("hip", carriage.origin, bars[0].origin),
        pin,
    )
    floor = mbd.touchdown(bars[1].point(0.0, -lengths[1]), mbd.Plane(offset=height, frame=carriage.origin))
    model.constrain(mbd.Bilateral("drive", rail, value=lambda t: speed * t), mbd.Unilateral("foot", floor))
    model.apply(mbd.Motor("load", pin, torque=draw(3.0, 20.0)))
    return model, mbd.assemble(model, dict(zip(("hip.angle", "pin.angle"), angles, strict=True)), closed="foot")


@pytest.mark.parametrize("seeds", [range(17, 36, 3), pytest.param(range(17, 36), marks=pytest.mark.slow)])
@pytest.mark.parametrize("cut", ["", "all"])
def test_a_steady_carriage_changes_no_force_and_no_friction(cut, seeds):
    """Galileo: what is braced in a carriage at steady speed bears the forces that it bears at rest, without events."""
    compared = 0
    for seed in seeds:
        scheme = SCHEMES[seed % len(SCHEMES)]
        still = mbd.simulate(*braced(seed, cut, 0.0), scheme, dt=1e-2, until=1.0)
        if still.events:  # the foot leaves the deck
            continue
        speed = random.Random(seed).choice([1.0, -3.0, 20.0])
        moving = mbd.simulate(*braced(seed, cut, speed), scheme, dt=1e-2, until=1.0)
        assert not moving.events, seed
        for name in ("pin.friction", "hip.reaction_force", "foot.force"):
            expected, found = (run.at([0.1, 0.55, 1.0])[name] for run in (still, moving))
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-7 * np.max(np.abs(expected)))
            compared += found.size
    assert compared > 8 * len(seeds)
