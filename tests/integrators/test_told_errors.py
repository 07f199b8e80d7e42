"""Runs of fixed steps that estimate their errors tell of them where these are not small."""

import numpy as np
import pytest

import mbd


def two_links() -> mbd.Model:
    """A double pendulum."""
    model = mbd.Model("two links")
    one, two = (mbd.Link(name, mass=1.0, length=0.5, center=0.25, inertia=0.02) for name in ("one", "two"))
    model.connect(mbd.Revolute("hip", model.ground.origin, one.start), mbd.Revolute("knee", one.end, two.start))
    return model


def pulled_block(rng: np.random.Generator) -> mbd.Model:
    """A block on a table that begins to move under it, with a friction that falls as sliding sets in."""
    model, size, rate = mbd.Model("table"), rng.uniform(0.1, 0.3), rng.uniform(10.0, 20.0)
    table, block = mbd.PointMass("table", 3.0), mbd.PointMass("block", 1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin, axis=(1.0, 0.0, 0.0))
    model.connect(rail, mbd.Translation("flight", model.ground.origin, block.origin, axes="xy"))
    static = rng.uniform(0.4, 0.9)
    law = mbd.Stribeck(static, static * rng.uniform(0.4, 0.8), rng.uniform(0.05, 0.2))
    top = mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin)
    model.constrain(
        mbd.Bilateral("drive", rail, value=lambda t: size * mbd.sin(rate * t)),
        mbd.Unilateral("foot", mbd.touchdown(block.origin, top), friction=law),
    )
    return model


def off_and_told(model: mbd.Model, start: mbd.State, dt: float, until: float) -> tuple[float, float, bool]:
    """Error of the last velocities of RadauIIA, what it estimates, and whether a note says so."""
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=until)
    fine = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=until)
    noted = any("estimated errors of velocities" in str(note) for note in run.stats["notes"])
    return float(np.max(np.abs(run.final.v - fine.final.v))), float(run.stats["local_errors"]), noted


@pytest.mark.parametrize("seed", range(5))
def test_radau_estimates_no_less_than_it_errs_and_with_its_own_order(seed: int) -> None:
    """An estimate of order 3 alone would be a thousand times too large in steps that are short for the motion."""
    rng, model = np.random.default_rng(seed), two_links()
    place = {"hip.angle": rng.uniform(-1.5, 1.5), "knee.angle": rng.uniform(-1.0, 1.0)}
    start = mbd.assemble(model, position=place, velocity={"hip.angle": rng.uniform(-2.0, 2.0)})
    long, short = (off_and_told(model, start, dt, 1.0) for dt in (0.02, 0.01))
    for off, told, noted in (long, short):
        assert off < told < 1e4 * off and noted == (told > 1e-4), (off, told)
    assert long[1] > 16.0 * short[1], (long, short)


@pytest.mark.parametrize("seed", range(8))
def test_radau_tells_where_a_step_passes_the_onset_of_sliding(seed: int) -> None:
    """Forces fall in a tenth of the step: what errs by more than 5·10⁻⁴ m/s has a note."""
    model = pulled_block(np.random.default_rng(seed))
    start = mbd.assemble(model, position={"rail.displacement": 0.0}, velocity={"flight.x": 0.0}, project=True)
    off, told, noted = off_and_told(model, start, 0.02, 0.1)
    assert noted == (told > 1e-4) and (noted or off < 5e-4), (off, told)
