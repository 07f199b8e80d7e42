"""A mass that bounces along a hill is never below it: a gap that rises, falls and rises again in one step is seen."""

import numpy as np
import pytest

import mbd

SCHEMES = [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.7, formulation="index3"), mbd.RungeKutta853()]


def hopping(restitution):
    model, ball = mbd.Model("hopping"), mbd.PointMass("ball", 1.3)
    model.connect(mbd.Translation("flight", model.ground.origin, ball.origin))
    hill = mbd.touchdown(ball.origin, lambda x: 0.25 * mbd.sin(3.0 * x))
    model.constrain(mbd.Unilateral("foot", hill, friction=0.0, restitution=restitution))
    return model


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_bounces_that_die_out_where_a_slope_falls_away_leave_nothing_below_it(scheme):
    """The last bounces happen where g̈ = −g − H″ ẋ² becomes positive, up the slope, fast."""
    one, other, rng = hopping(0.2), hopping(0.5), np.random.default_rng(5)
    for k in range(60):
        model = (one, other)[k % 2]
        x, speed = np.arcsin(rng.uniform(0.1, 0.3)) / 3.0, rng.uniform(3.5, 4.0)
        rise = 0.75 * np.cos(3.0 * x) * speed
        start = mbd.assemble(
            model,
            {"flight.x": x, "flight.y": 0.25 * np.sin(3.0 * x) + rng.uniform(0.0, 2e-4)},
            {"flight.x": speed, "flight.y": rise - rng.uniform(1e-3, 2e-2)},
        )
        run = mbd.simulate(model, start, scheme, dt=rng.uniform(2e-3, 1.2e-2), until=0.1, contact="events")
        assert np.min(run["foot.gap"]) >= -1e-9, (start, run.settings["dt"])
