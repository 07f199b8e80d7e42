"""Spring legs without mass: time on the ground, derivatives, and ends by name; gaits on them are in `tests/gait`."""

import math

import pytest

import mbd

MASS, STIFFNESS, LENGTH, G = 80.0, 20e3, 1.0, 9.81


def runner(angle: float) -> tuple[mbd.Model, mbd.State]:
    """A point mass on a spring leg, at its apex."""
    model, body = mbd.Model("runner"), mbd.PointMass("body", MASS)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    model.constrain(mbd.SpringLeg("leg", body.origin, STIFFNESS, LENGTH, angle))
    model.constrain(mbd.Event("apex", mbd.measure("place.y.rate"), direction=-1))
    return model, mbd.assemble(model, {"place.y": 1.0}, {"place.x": 5.0, "place.y": 0.0})


def test_it_hops_in_place_on_an_upright_leg():
    """Time on the ground of ``m ÿ = k (l − y) − m g`` from the speed of a fall of 0.2 m."""
    model, body = mbd.Model("hopper"), mbd.PointMass("body", MASS)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    model.constrain(mbd.SpringLeg("leg", body.origin, STIFFNESS, LENGTH, 0.5 * math.pi))
    start = mbd.assemble(model, {"place.y": 1.2}, {"place.x": 0.0, "place.y": 0.0})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=5e-3, until=1.0)
    down, up = (event.time for event in run.events[:2])
    w, v = math.sqrt(STIFFNESS / MASS), math.sqrt(2.0 * G * 0.2)
    assert down == pytest.approx(v / G, abs=1e-12)
    assert up - down == pytest.approx((math.pi + 2.0 * math.atan(G / (w * v))) / w, abs=1e-10)


def test_derivatives_of_a_run_are_those_of_differences():
    model, start = runner(math.radians(68.0))
    how = {"integrator": mbd.RungeKutta853(), "dt": 5e-3, "until": 0.5}
    by = mbd.sensitivities(model, start, wrt=["leg.touchdown_angle", "leg.stiffness"], of=["place.y"], **how)
    for name, value, step in (("leg.touchdown_angle", math.radians(68.0), 1e-5), ("leg.stiffness", STIFFNESS, 1.0)):
        ends = [
            mbd.simulate(model, start, **how, parameters={name: value + side * step})["place.y"][-1]
            for side in (1, -1)
        ]  # fmt: skip
        assert by["place.y", name] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-5)


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [("stiffness", 0.0, "does not push"), ("length", -1.0, "is not positive"), ("touchdown_angle", 4.0, "0 and π")],
)
def test_numbers_without_a_meaning_are_refused_by_name(field, value, told):
    given = {"stiffness": 1e4, "length": 1.0, "touchdown_angle": 1.2} | {field: value}
    with pytest.raises(mbd.ModelError, match=rf"SpringLeg 'leg': {field}.*{told}"):
        mbd.SpringLeg("leg", mbd.PointMass("body", 1.0).origin, **given)


def test_a_runner_who_falls_ends_by_name_as_the_hip_comes_down_to_the_ground():
    model, body = mbd.Model("runner"), mbd.PointMass("body", MASS)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    model.constrain(mbd.SpringLeg("leg", body.origin, STIFFNESS, LENGTH, math.radians(68.0)))
    slow = mbd.assemble(model, {"place.y": 1.0}, {"place.x": 0.3, "place.y": 0.0})
    with pytest.raises(mbd.SimulationError, match="'leg' is not finite: its hip has come down to the ground") as caught:
        mbd.simulate(model, slow, mbd.RungeKutta853(), dt=0.01, until=2.0)
    assert 0.0 <= caught.value.run["place.y"][-1] < 0.1
