"""Bodies without inertia whose moments have no arm at the start: their balance has no size of its own there."""

import numpy as np
import pytest

import mbd


@pytest.mark.parametrize("seed", range(8))
def test_what_lies_on_a_point_that_sets_off_follows_it(seed: int) -> None:
    """A block sticks to a table, a point on a rail, all at the origin and at rest; ``F = (M + m) a(t)`` drives both.

    Mechanics: the table moves by A t³, so that accelerations begin at zero; the rail holds three rotations without
    inertia, whose moments come from forces alone.
    """
    rng = np.random.default_rng(seed)
    heavy, light, size, dt = (
        rng.uniform(1.0, 5.0),
        rng.uniform(0.5, 2.0),
        10.0 ** rng.uniform(-2, 1.5),
        10.0 ** rng.uniform(-6, -3),
    )
    model = mbd.Model("table", cut="all")
    table, block = mbd.PointMass("table", heavy), mbd.PointMass("block", light)
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin, axis=(1.0, 0.0, 0.0))
    model.connect(rail, mbd.Translation("flight", model.ground.origin, block.origin, axes="xyz"))
    model.constrain(
        mbd.Bilateral("drive", rail, lambda t: size * t * t * t),
        mbd.Unilateral("foot", mbd.touchdown(block.origin, mbd.Plane((0.0, 1.0, 0.0), frame=table.origin))),
    )
    zeros = {"rail.displacement": 0.0, "flight.x": 0.0, "flight.y": 0.0, "flight.z": 0.0}
    start = mbd.assemble(model, position=zeros, project=False)
    for options in ({"dt": dt}, {"tol": 10.0 ** rng.uniform(-7, -3)}):
        run = mbd.simulate(model, start, mbd.RadauIIA(), until=20.0 * dt, **options)
        moved = size * run.time**3
        np.testing.assert_allclose(run["flight.x"], moved, rtol=0, atol=1e-9 * moved[-1] + 1e-16)
        np.testing.assert_allclose(
            run["drive.force"],
            (heavy + light) * 6.0 * size * run.time,
            rtol=0,
            atol=1e-9 * 120.0 * size * dt * heavy + 1e-12,
        )
        assert np.all(np.abs(run["flight.z"]) <= 1e-16)
