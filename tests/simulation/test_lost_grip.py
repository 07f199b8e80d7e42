"""Eccentric hoops that roll fast: near flight rolling asks for more grip than friction can give, and they slip."""

import random
from math import pi

import numpy as np
import pytest

import mbd

SCHEMES = [
    mbd.Newmark(), mbd.HHT(0.05), mbd.HHT(0.1, formulation="index3"), mbd.GeneralizedAlpha(0.7), mbd.RadauIIA(),
    mbd.RungeKutta853(),
]  # fmt: skip
RADIUS = 0.3


def hoop(seed: int, mu: float | None = None) -> tuple[mbd.Model, mbd.State, float]:
    """A hoop with a lump, below its center at the start; it rolls, or has friction μ. The speed of flight in rad/s.

    The lump, m a distance e above the center, takes the weight (M + m) g off the road at ``ω² = (M + m) g / (m e)``.
    """
    rng = random.Random(seed)
    ring, lump, reach = rng.uniform(0.3, 0.8), rng.uniform(1.0, 3.0), rng.uniform(0.5, 0.95) * RADIUS
    flight = float(np.sqrt((ring + lump) * 9.81 / (lump * reach)))
    model = mbd.Model("hoop")
    tyre, weight = mbd.RigidBody("tyre", mass=ring, inertia=ring * RADIUS**2), mbd.PointMass("lump", lump)
    model.connect(
        mbd.Planar("place", model.ground.origin, tyre.origin), mbd.Weld("fixed", tyre.point(0.0, reach), weight.origin)
    )
    gap = mbd.touchdown(tyre.origin, mbd.Plane(offset=RADIUS))
    model.constrain(mbd.Unilateral("road", gap, friction=mu or 0.0))
    if mu is None:
        model.constrain(mbd.Rolling("grip", tyre.origin, radius=RADIUS, only_while="road"))
    turn = -4.0 * flight
    start = mbd.assemble(
        model, closed="road", position={"place.y": RADIUS, "place.angle": pi},
        velocity={"place.angle": turn, "place.x": -turn * RADIUS}, project=True,
    )  # fmt: skip
    return model, start, flight


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("seed", range(3))
def test_rolling_that_needs_grip_without_a_normal_force_is_named(seed, scheme):
    model, start, _ = hoop(seed)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.5, on_failure="return")
    assert not run.success
    assert "'grip' rolls while 'road' is closed, and needs" in run.message, run.message
    assert "it slips; give 'road' friction=mu" in run.message


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("seed", [0, 2])
def test_a_hoop_with_friction_slips_before_it_flies(seed, scheme):
    model, start, _ = hoop(seed, mu=0.7)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.3)
    flight = next(event for event in run.events if event.kind == "opened")
    assert abs(run.record.phase[flight.row - 1, 0]) == 1  # it slides
    assert np.all(np.abs(run["road.friction"]) <= 0.7 * run["road.force"] + 1e-6)
    open_ = run.record.closed[:, 0] == 0
    assert np.all(run["road.force"][open_] == 0.0)
