"""Runs as a laboratory records them: markers with errors of a known size, plates that carry the weight."""

import numpy as np
import pytest

import mbd


def stool():
    """A body that stands and slides on three feet in space."""
    model = mbd.Model("stool")
    seat = mbd.RigidBody("seat", 4.0, (0.1, 0.12, 0.1), center=(0.0, 0.3, 0.0))
    model.connect(mbd.Free("base", model.ground.origin, seat.origin))
    places = ((0.2, 0.0), (-0.1, 0.15), (-0.1, -0.15))
    feet = [seat.point(x, 0.0, z, name=f"foot {k}") for k, (x, z) in enumerate(places)]
    for k, foot in enumerate(feet):
        model.constrain(mbd.Unilateral(f"touch {k}", mbd.touchdown(foot), friction=0.2))
    closed = [f"touch {k}" for k in range(3)]
    start = mbd.assemble(model, velocity={"base.x": 0.9, "base.z": -0.4}, closed=closed)
    return model, seat, mbd.simulate(model, start, dt=1e-3, until=0.1)


def test_plates_carry_what_acts_from_outside_and_markers_scatter_as_asked():
    _, seat, run = stool()
    found = mbd.film(run, {"TOP": seat.center, "FOOT": "seat.foot 0"}, rate=50.0, scatter=0.002, seed=3)
    assert found.time == pytest.approx(np.arange(6) / 50.0)
    seen = run.at(found.time)
    assert sum(plate.force for plate in found.plates) == pytest.approx(seen["external force"], abs=1e-9)
    assert sum(plate.moment for plate in found.plates) == pytest.approx(seen["external moment"], abs=1e-9)
    again = mbd.film(run, [seat.center, "seat.foot 0"], rate=50.0, scatter=0.002, seed=3)
    assert np.array_equal(again["seat.foot 0"], found["FOOT"])
    many = mbd.film(run, {"TOP": seat.center}, rate=20000.0, scatter=0.002)
    assert np.std(many["TOP"] - run.at(many.time)["seat.center"]) == pytest.approx(0.002, rel=0.05)
    assert mbd.film(run, ["seat.center"])["seat.center"] == pytest.approx(run.at(np.arange(11) / 100.0)["seat.center"])


@pytest.mark.parametrize(
    ("what", "sentence"),
    [
        ({"markers": {}}, "markers of film are points by name"),
        ({"markers": ["seat.top"]}, "seat.top"),
        ({"markers": ["seat.center"], "rate": 0.0}, "rate of film is a number > 0"),
        ({"markers": ["seat.center"], "scatter": -1.0}, "scatter of film is a number ≥ 0"),
    ],
)
def test_what_cannot_be_filmed_is_named(what, sentence):
    _, _, run = stool()
    with pytest.raises(mbd.ModelError, match=sentence):
        mbd.film(run, **what)
    with pytest.raises(mbd.ModelError, match="a run of mbd.simulate"):
        mbd.film("walk.trc", ["seat.center"])


@pytest.mark.parametrize(
    ("ground", "sentence"),
    [
        (mbd.Plane((0.2, 1.0, 0.0)), "a force of -3.85 N along x, and 0 N acts from outside"),
        (lambda x: 0.1 * x, "a force of 1.95 N along x"),
        (mbd.Plane((0.0, 1.0, 0.0), 0.15), "a moment of .* N m along z"),
    ],
    ids=["slope", "hill", "step"],
)
def test_plates_that_would_carry_something_else_are_in_doubt(ground, sentence):
    """A block that stands on a slope, and one that slides on a step."""
    model, block = mbd.Model("block"), mbd.PointMass("block", 2.0)
    model.connect(mbd.Translation("air", model.ground.origin, block.origin))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin, ground), friction=0.8))
    velocity = {"air.x": 1.0} if isinstance(ground, mbd.Plane) and ground.offset else {}
    start = mbd.assemble(model, {"air.x": 0.3}, velocity, closed="foot")
    run = mbd.simulate(model, start, dt=1e-3, until=0.1)
    with pytest.warns(mbd.MbdWarning, match=sentence):
        mbd.film(run, ["block.origin"])
