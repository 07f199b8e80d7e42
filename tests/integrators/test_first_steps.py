"""First steps that are longer than what dies away in them: their error is estimated at two places."""

import numpy as np
import pytest

import mbd


def block_on_a_table(speed: float, jerk: float) -> tuple[mbd.Model, mbd.State]:
    """A block that the friction of a table carries along, whose acceleration begins at 100 m/s² and changes."""
    model = mbd.Model("table")
    table, block = mbd.PointMass("table", 3.0), mbd.PointMass("block", 1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin, axis=(1.0, 0.0, 0.0))
    model.connect(rail)
    model.connect(mbd.Translation("flight", model.ground.origin, block.origin, axes="xy"))
    model.constrain(mbd.Bilateral("drive", rail, value=lambda t: t * t * (50.0 - jerk * t)))
    plane = mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin)
    law = mbd.Stribeck(static=0.9, kinetic=0.6, speed=speed)
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin, plane), friction=law))
    return model, mbd.assemble(model, position={"rail.displacement": 0.0, "flight.x": 0.0, "flight.y": 0.0})


@pytest.mark.parametrize("speed", [0.05, 0.1])
def test_a_transient_within_the_first_step_is_seen(speed: float) -> None:
    """The estimate of Hairer & Wanner (eq. IV.8.20) is one number, which vanishes by chance for a step of some length:
    shortened until they are allowed, steps end there.
    """
    model, start = block_on_a_table(speed, 20.0)
    fine = mbd.simulate(model, start, until=1.0, tol=1e-10, integrator=mbd.RungeKutta853())
    for tol in np.logspace(-5.5, -4.0, 7):
        run = mbd.simulate(model, start, until=1.0, tol=float(tol), integrator=mbd.RadauIIA())
        assert abs(run["flight.x"][-1] - fine["flight.x"][-1]) <= 2.0 * tol
