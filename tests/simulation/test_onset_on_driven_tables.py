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
EARLIEST = 0.12
"""When the block sticks at the latest [s]: a table may begin too fast for it."""


def swung(seed):
    """A block on a table that a spline leads to a sudden halt; its acceleration there jumps to and fro, knot by knot.

    Returns the model, the acceleration of the table over time, the largest one at which the block sticks [m/s²], and
    when the spline ends [s].
    """
    rng = np.random.default_rng(seed)
    model = mbd.Model("table")
    table, block = mbd.PointMass("table", 3.0), mbd.PointMass("block", rng.uniform(0.5, 2.0))
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin, axis=(1.0, 0.0, 0.0))
    flight = mbd.Translation("flight", model.ground.origin, block.origin, axes="xyz" if seed % 2 else "xy")
    model.connect(rail, flight)
    t = 0.02 * np.arange(rng.integers(40, 46))  # so many knots that steps do not end at them
    w = rng.uniform(4.0, 8.0)
    values = rng.uniform(0.05, 0.15) * np.sin(w * t)
    acceleration = CubicSpline(t, values, bc_type="clamped").derivative(2)
    model.constrain(mbd.Bilateral("drive", rail, value=mbd.Samples(t, values, kind="spline", ends="clamped")))
    at_knots = np.abs(acceleration(t))
    limit = rng.uniform(1.2 * np.max(at_knots[6:-7]), 0.9 * np.max(at_knots[6:]))
    mu = limit / 9.81
    law = mu if seed % 4 < 2 else mbd.Stribeck(mu, 0.85 * mu, 0.09)
    touch = mbd.touchdown(block.origin, mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin))
    model.constrain(mbd.Unilateral("foot", touch, friction=law))
    return model, acceleration, limit, t[-1]


@pytest.mark.parametrize("seed", [0, 3, 6, 27, 28, 47])
def test_a_block_slips_where_its_limit_is_reached(seed):
    """Multipliers of steps that are long for the table lag: in a row just after the onset they are too small."""
    model, acceleration, limit, end = swung(seed)
    fine = np.linspace(EARLIEST, end, 20001)
    k = int(np.flatnonzero(np.abs(acceleration(fine)) > limit)[0])
    onset = brentq(lambda t: abs(acceleration(t)) - limit, fine[k - 1], fine[k], xtol=1e-14)
    dt = (onset + seed % 3 * 1.5e-4 + 1e-4) / int(onset / 0.0104)
    assert abs(acceleration(dt * np.ceil(onset / dt))) > limit
    start = mbd.assemble(model, {}, project=True)
    for scheme in SCHEMES:
        run = mbd.simulate(model, start, scheme, dt=dt, until=end)
        slips = [event.time for event in run.events if event.kind == "slipped" and event.time > EARLIEST]
        assert slips, scheme
        assert abs(slips[0] - onset) <= 1e-9, scheme
