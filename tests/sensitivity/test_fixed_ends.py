"""Derivatives at a given time, where steps after an event would end there by themselves and move with its instant."""

import warnings

import pytest
from hypothesis import given, settings, strategies as st

import mbd

SCHEMES = [mbd.HHT(0.05), mbd.HHT(formulation="index3"), mbd.RungeKutta853(), mbd.RungeKutta4(), mbd.RadauIIA()]


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
@settings(max_examples=8)
@given(before=st.integers(1, 6), after=st.integers(1, 6), speed=st.sampled_from([0.5, 1.0, 2.0]), at_most=st.booleans())
def test_the_end_at_a_given_time_does_not_move_with_an_event(scheme, before, after, speed, at_most):
    """Uniform motion past an event, with binary fractions for which the grid of steps meets the end to the bit."""
    dt = 0.0625
    model = mbd.Model("slider", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Translation("slide", model.ground.origin, body.origin))
    place = before * dt * speed
    model.constrain(mbd.Event("passes", mbd.measure(lambda x: x - place, "slide.x", unit="m")))
    start = mbd.assemble(model, velocity={"slide.x": speed, "slide.y": 0.3})
    end = (before + after) * dt
    if at_most:
        model.constrain(mbd.Event("leaves", mbd.measure(lambda x: x - 100.0, "slide.x", unit="m")))
    until = ("leaves", end) if at_most else end
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = mbd.sensitivities(
            model, start, scheme, dt=dt, until=until, wrt=["slide.x", "slide.x.rate"], of=["slide.x", "slide.y", "time"]
        )
    expected = {"slide.x": (1.0, end), "slide.y": (0.0, 0.0), "time": (0.0, 0.0)}
    for name, (of_place, of_speed) in expected.items():
        assert found[name, "slide.x"] == pytest.approx(of_place, abs=1e-12)
        assert found[name, "slide.x.rate"] == pytest.approx(of_speed, abs=1e-12)
