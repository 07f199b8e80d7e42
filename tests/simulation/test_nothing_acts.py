"""Motions in which no force acts: rows on rates are all that a step has to hold, and their multipliers are zero."""

import numpy as np
import pytest

import mbd

SCHEMES = (mbd.Newmark(), mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8, formulation="index3"), mbd.RadauIIA(),
           mbd.RadauIIA(tolerance=1e-12), mbd.RungeKutta853())  # fmt: skip


def coupled(mass, inertia, share):
    """Two free bodies in a plane whose rates of turning keep a ratio."""
    model = mbd.Model("two free bodies", gravity=(0.0, 0.0, 0.0))
    for name, m, j in zip("ab", mass, inertia, strict=True):
        body = mbd.RigidBody(name, float(m), float(j))
        model.connect(mbd.Planar(f"j{name}", model.ground.origin, body.origin))
    rates = ("ja.angle.rate", "jb.angle.rate")
    model.constrain(mbd.Nonholonomic("row", lambda u, w: u - share * w, arguments=rates, unit="rad"))
    return model


@pytest.mark.parametrize("seed", [0, 1, 9, 24, None])
def test_rows_on_rates_are_held_where_nothing_acts(seed):
    if seed is None:
        model, speed = coupled((1.0, 2.0), (0.05, 0.3), 0.3), 0.7
    else:
        chance = np.random.default_rng(seed)
        model = coupled(chance.uniform(0.3, 3.0, 2), chance.uniform(0.03, 0.5, 2), float(chance.uniform(0.1, 2.0)))
        speed = float(chance.uniform(-2.0, 2.0))
    start = mbd.assemble(model, velocity={"ja.angle": speed, "ja.x": 0.4, "jb.y": -0.3})
    for scheme in SCHEMES:
        for dt in (1e-3, 3.3e-3):
            run = mbd.simulate(model, start, scheme, dt=dt, until=1.0)
            np.testing.assert_allclose(run.final.v, start.v, atol=1e-11)
            np.testing.assert_allclose(run.final.q, start.q + start.v, atol=1e-11)
