"""Users' events whose measure passes zero and comes back within a step."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, strategies as st

import mbd
from tests.simulation.mechanisms import G

LEVEL = 0.2
SCHEMES = [
    mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.HHT(0.05, formulation="index3"), mbd.RadauIIA(), mbd.RungeKutta853(),
]  # fmt: skip


@cache
def thrown(up, direction, another=False):
    """A ball thrown along (up = 1) or against y, with gravity the other way, and an event at a height of 0.2 m."""
    model, body = mbd.Model("thrown", gravity=(0.0, -G * up, 0.0)), mbd.PointMass("ball", mass=1.3)
    model.connect(mbd.Prismatic("rail", model.ground.origin, body.origin, axis="y"))
    height = mbd.measure(lambda place: place[1] - up * LEVEL, body.origin)
    model.constrain(mbd.Event("level", height, direction=direction))
    if another:
        model.constrain(mbd.Event("other", mbd.measure(lambda t: t - 0.15, "t")))
    return model


def run_over(up, direction, depth, scheme, **how):
    """A throw whose highest place is `depth` above the level; the instants of its events, and those of the parabola."""
    speed = np.sqrt(2.0 * G * (LEVEL + depth))
    model = thrown(up, direction)
    run = mbd.simulate(model, mbd.assemble(model, velocity={"rail.displacement": up * speed}), scheme, **how)
    top, half = speed / G, np.sqrt(2.0 * max(depth, 0.0) / G)
    crossings = [(top - half, up), (top + half, -up)] if depth > 0.0 else []
    return [event.time for event in run.events], [time for time, way in crossings if direction in (0, way)]


@given(
    up=st.sampled_from([1, -1]),
    direction=st.sampled_from([0, 1, -1]),
    depth=st.floats(-7.0, -2.0).map(lambda power: 10.0**power),
    sign=st.sampled_from([1.0, 1.0, -1.0]),
    scheme=st.sampled_from(SCHEMES),
    dt=st.floats(0.02, 0.15),
)
def test_every_crossing_is_an_event_however_long_the_step(up, direction, depth, sign, scheme, dt):
    """Also the second one alone, of an event in its direction; a measure that turns before zero crosses nothing."""
    found, expected = run_over(up, direction, sign * depth, scheme, dt=dt, until=0.45)
    assert len(found) == len(expected)
    np.testing.assert_allclose(found, expected, atol=1e-7)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("lead", [-1e-3, 1e-3])
def test_another_event_before_or_between_the_crossings_takes_none_of_them(direction, lead):
    """The other event ends a step `lead` before or behind the first crossing."""
    model = thrown(1, direction, another=True)
    time = 0.15 - lead
    speed = (LEVEL + 0.5 * G * time**2) / time  # the level is passed at `time`, then the top, then the level again
    start = mbd.assemble(model, velocity={"rail.displacement": speed})
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=0.4, until=0.4)
    expected = time if direction > 0 else 2.0 * speed / G - time
    assert sorted(event.name for event in run.events) == ["level", "other"]
    (found,) = [event.time for event in run.events if event.name == "level"]
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("scheme", [mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
@pytest.mark.parametrize(("direction", "sides"), [(0, (-1, 1)), (1, (-1,)), (-1, (1,))])
def test_long_steps_see_a_swing_that_just_passes_a_mark(scheme, direction, sides):
    """``x = −cos 2πt``, noted above 0.999 m: for 14 ms of each second, in steps of 0.09 s.

    `RadauIIA` damps it by (ω dt)⁵/7200, which takes 1e-4 m in two turns, and moves the crossings by 0.4 ms.
    """
    model, body = mbd.Model("oscillator", gravity=(0, 0, 0)), mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=(2 * np.pi) ** 2))
    mark = mbd.measure(lambda x: x - 0.999, "slide.displacement")
    model.constrain(mbd.Event("mark", mark, direction=direction))
    start = mbd.assemble(model, {"slide.displacement": -1.0})
    found = [event.time for event in mbd.simulate(model, start, scheme, dt=0.09, until=2.0).events]
    half = np.arccos(0.999) / (2 * np.pi)
    expected = sorted(k + 0.5 + side * half for k in range(2) for side in sides)
    assert len(found) == len(expected)
    np.testing.assert_allclose(found, expected, atol=5e-4)
