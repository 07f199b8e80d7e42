"""The summary of a run says what it came to by rules, each tried on motions that are known."""

import numpy as np
import pytest

import mbd
from mbd.analysis.ending import ending
from mbd.cli import Script
from tests.helpers import one_body


def standing(tilt: float) -> mbd.Trajectory:
    """A rod on end on the floor, which falls over from a tilt."""
    model = mbd.Model("rod")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=1.0 / 12.0)
    model.connect(mbd.Planar("place", model.ground.origin, rod.end))
    model.constrain(
        mbd.Unilateral("foot", mbd.touchdown(rod.end)), mbd.Unilateral("head", mbd.touchdown(rod.start)),
    )  # fmt: skip
    start = mbd.assemble(model, closed=["foot"], position={"place.angle": tilt})
    return mbd.simulate(model, start, dt=1e-2, until=2.0, backend="python")


def sliding(mass: float, until: float) -> mbd.Trajectory:
    """A block that dry friction brings to rest after v/(μ g)."""
    model, block = one_body(mbd.PointMass("block", mass=mass), mbd.Translation, "place")
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(block.origin), friction=0.5))
    start = mbd.assemble(model, closed=["floor"], velocity={"place.x.rate": 1.0})
    return mbd.simulate(model, start, dt=1e-2, until=until, backend="python")


@pytest.mark.parametrize("mass", [0.1, 30.0])
def test_a_block_comes_to_rest_and_not_before(mass):
    stop = 1.0 / (0.5 * 9.81)
    assert any(text.startswith("came to rest") for text in ending(sliding(mass, 2.0 * stop)))
    assert ending(sliding(mass, 0.9 * stop)) == ["in motion", "closed at the end: floor"]


def test_a_pendulum_at_its_turning_point_is_not_at_rest():
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=1.0 / 12.0)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    model.constrain(mbd.Unilateral("bob", mbd.touchdown(rod.end, ground=mbd.Plane(offset=-2.0))))
    period = 2.0 * np.pi * np.sqrt((1.0 / 3.0) / (9.81 * 0.5)) * 1.0159  # amplitude 0.5 rad
    start = mbd.assemble(model, position={"pin.angle": 0.5})
    run = mbd.simulate(model, start, dt=5e-3, until=5.0 * period, backend="python")
    assert run.energy.kinetic[-1] < 1e-3 * run.energy.kinetic.max() and ending(run) == ["in motion"]
    still = mbd.simulate(model, mbd.assemble(model), dt=5e-2, until=0.5, backend="python")
    assert ending(still) == ["at rest throughout"]


def test_a_rod_on_end_falls_and_a_hanging_one_does_not():
    found = ending(standing(0.05))
    fall = next(text for text in found if text.startswith("fell"))
    assert "'rod.start' on top" in fall and any("head" in text for text in found)
    run = standing(0.05)
    height = run["rod.start.y"] - run["rod.end.y"]
    when = run.time[np.argmax(np.abs(height) < 0.5 * height[0])]
    assert f"t = {when:.4g} s" in fall
    assert not any(text.startswith("fell") for text in ending(standing(0.0)))


@pytest.mark.parametrize("inclination", [0.0, 0.3])
def test_two_blocks_at_one_height_but_for_round_off_have_none_to_fall_from(inclination):
    model = mbd.Model("blocks", gravity=mbd.on_slope(inclination))
    blocks = [mbd.PointMass(name, mass=1.0) for name in ("one", "two")]
    for k, block in enumerate(blocks):
        model.connect(mbd.Translation(f"place {k}", model.ground.origin, block.origin))
        model.constrain(mbd.Unilateral(f"floor {k}", mbd.touchdown(block.origin), friction=0.5))
    start = mbd.assemble(
        model, position={"place 0.y": -1e-17}, velocity={"place 0.x.rate": 1.0}, closed=["floor 0", "floor 1"]
    )
    run = mbd.simulate(model, start, dt=1e-2, until=0.2, backend="python")
    assert not any(text.startswith("fell") for text in ending(run))


def test_walkers_walk():
    run = Script.load("compass-gait").run(None, {})
    (walks, closed) = ending(run)
    assert walks.startswith("walks: 10 steps at 0.729") and closed == "closed at the end: left foot"
    text = run.summary()
    assert text.startswith("compass gait: reached t = 8 s") and repr(text) == str(text)
    for words in ("HHT(alpha=0.05), dt = 0.001", "8009 rows", "20: 5 × left foot opened", "numerical", "steps"):
        assert words in text


def test_files_give_the_same_summary_and_failures_say_so(tmp_path):
    run = standing(0.05)
    assert mbd.load(run.save(tmp_path / "rod")).summary() == run.summary()
    model, mass = one_body(mbd.PointMass("mass", mass=1.0), mbd.Translation, "place")
    model.apply(mbd.Applied("pull", mass.origin, force=lambda t: (mbd.sqrt(0.1 - t), 0.0)))
    failed = mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=1.0, on_failure="return", backend="python")
    assert failed.summary().startswith(f"mass: failed: {failed.message}") and ending(failed) == ["in motion"]
