"""A block on a table whose motion is prescribed slips where m |ẍ(t)| = F_s: a root of a known function."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import mbd

SCHEMES = (
    mbd.HHT(0.05),
    mbd.HHT(0.05, start="consistent"),
    mbd.HHT(0.3),
    mbd.GeneralizedAlpha(0.9),
    mbd.GeneralizedAlpha(0.0),
    mbd.Newmark(),
    mbd.HHT(0.05, formulation="index3"),
    mbd.RadauIIA(),
    mbd.RungeKutta853(),
)
DT = 0.0107
"""Step [s]: knots of the table, less than two steps apart, do not end steps."""


def shaken(seed, spatial, falls):
    """A table shaken ever harder, whose acceleration changes within a step; that acceleration and the limit [m/s²]."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("table")
    table, block = mbd.PointMass("table", 3.0), mbd.PointMass("block", rng.uniform(0.5, 2.0))
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin, axis=(1.0, 0.0, 0.0))
    flight = mbd.Translation("flight", model.ground.origin, block.origin, axes="xyz" if spatial else "xy")
    model.connect(rail, flight)
    t = 0.02 * np.arange(31)
    rough = rng.uniform(-1.0, 1.0, len(t)) * np.exp(8.0 * t) * 2e-5
    samples = mbd.Samples(t, rough, kind="spline", ends="clamped")
    acceleration = CubicSpline(t, rough, bc_type="clamped").derivative(2)
    model.constrain(mbd.Bilateral("drive", rail, value=samples))
    mu = rng.uniform(0.15, 0.4)
    law = mbd.Stribeck(mu, 0.7 * mu, 0.1) if falls else mu
    touch = mbd.touchdown(block.origin, mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin))
    model.constrain(mbd.Unilateral("foot", touch, friction=law))
    return model, acceleration, mu * 9.81


@pytest.mark.parametrize("seed", [2, 3, 7, 10, 15, 18])
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_a_block_slips_where_its_limit_is_reached(scheme, seed):
    model, acceleration, limit = shaken(seed, seed % 2 == 1, seed > 3)
    fine = np.linspace(0.0, 0.58, 29001)
    k = int(np.flatnonzero(np.abs(acceleration(fine)) > limit)[0])
    onset = brentq(lambda t: abs(acceleration(t)) - limit, fine[k - 1], fine[k], xtol=1e-14)
    row = DT * np.ceil(onset / DT)
    assert abs(acceleration(row)) > limit  # what is over within a step may be seen at neither of its ends
    run = mbd.simulate(model, mbd.assemble(model, {}, project=True), scheme, dt=DT, until=row + DT)
    slips = [event.time for event in run.events if event.kind == "slipped"]
    assert slips
    assert abs(slips[0] - onset) <= 1e-9
