"""Laws of derivatives, on random scenes with impacts: equal to differences, linear in directions, a chain over cuts."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from mbd.testing.mechanisms import random_scene
from tests.sensitivity.scenes import judged
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

SCHEMES = (
    mbd.HHT(alpha=0.05, tolerance=1e-12), mbd.GeneralizedAlpha(0.8, tolerance=1e-12), mbd.RungeKutta853(),
    mbd.HHT(alpha=0.05, formulation="index3", tolerance=1e-12), mbd.Newmark(tolerance=1e-12),
    mbd.RadauIIA(tolerance=1e-12), mbd.RungeKutta4(),
)  # fmt: skip
NAMES = ["left hip.angle", "right hip.angle.rate", "right thigh.mass"]
WALKER = kneed_walker()
START = kneed_walker_start(WALKER)


def assert_as_differences(seed: int, scheme: object) -> None:
    """To 1e-8 of the largest, or to what two quotients differ by where that is more; twice, as rates may have kinks."""
    found = judged(random_scene(seed, bodies=2), scheme)
    if not isinstance(found, str):
        far, noise = found
        assert np.all(far <= np.maximum(1e-8, 2.0 * noise)), (far, noise)


@given(seed=st.integers(0, 100), place=st.sampled_from(range(3)))
@settings(max_examples=3, deadline=None)
def test_derivatives_of_scenes_are_limits_of_differences(seed, place):
    assert_as_differences(seed, SCHEMES[place])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200))
def test_derivatives_of_many_scenes_are_limits_of_differences(seed):
    assert_as_differences(seed, SCHEMES[seed % len(SCHEMES)])


@pytest.mark.parametrize("scheme", [SCHEMES[0], SCHEMES[2]], ids=repr)
def test_derivatives_are_linear_in_the_direction(scheme):
    run = mbd.simulate(WALKER, START, scheme, dt=0.01, until="right foot")
    one, two = {"right thigh.mass": 1.0, "gravity.x": 0.5}, {"left shank.length": 2.0, "gravity.x": -1.0}
    both = {name: 3.0 * one.get(name, 0.0) - two.get(name, 0.0) for name in {**one, **two}}
    state, time = final_state_derivative(run, [("one", one), ("two", two), ("both", both)])
    found = np.vstack([state, time])
    assert found[:, 2] == pytest.approx(3.0 * found[:, 0] - found[:, 1], rel=1e-11, abs=1e-10)


def test_derivatives_of_parts_of_a_run_make_a_chain():
    """Cut at an event, the derivative of the whole is the product of those of its parts, the end held in time.

    The second part begins as much later as the first ends, which takes ``ẏ δt`` from its end.
    """
    scheme, names = mbd.RungeKutta853(), [*START.names, *START.velocity_names]
    whole = mbd.simulate(WALKER, START, scheme, dt=0.01, until=0.5)
    first = mbd.simulate(WALKER, START, scheme, dt=0.01, until="right knee lock")
    second = mbd.simulate(WALKER, replace(first.final, memory=None), scheme, dt=0.01, until=0.5)
    assert second.final.q == pytest.approx(whole.final.q, abs=1e-12)
    (a, t), (b, _) = final_state_derivative(first, names), final_state_derivative(second, names)
    c, _ = final_state_derivative(whole, names)
    last = second.record
    found = b @ a - np.outer(np.concatenate([last.v[-1], last.a[-1]]), t)
    assert found == pytest.approx(c, abs=1e-8 * np.max(np.abs(c)))


@pytest.mark.parametrize("scheme", [mbd.RungeKutta853(), mbd.RungeKutta4(), mbd.RadauIIA(), mbd.HHT()], ids=repr)
@pytest.mark.parametrize("place", [0.3, 0.45])
def test_a_contact_watched_from_a_place_on_has_no_part_in_derivatives_before_it_closes(place, scheme):
    """Nor where the step at which it begins ends there to the bit: x and y at the end move with those at the start."""
    model, body = mbd.Model("shelf", gravity=(1.0, 0.0, 0.0)), mbd.PointMass("body", 1.0)
    model.connect(mbd.Translation("slide", model.ground.origin, body.origin))
    beside = mbd.measure(lambda point: point[0] - place, body.origin)
    model.constrain(mbd.Unilateral("shelf", mbd.touchdown(body.origin), only_while=beside))
    start = mbd.assemble(model, {"slide.x": 0.0, "slide.y": -0.2}, {"slide.x": 1.0, "slide.y": 0.7})
    names = ["slide.x", "slide.y"]
    found = mbd.sensitivities(model, start, scheme, dt=0.11, until=0.661, wrt=names, of=names)
    np.testing.assert_allclose(found.matrix, np.eye(2), atol=1e-12)


@pytest.mark.parametrize("dt", [1e-2, 2e-2])
def test_masses_that_fall_beside_a_walker_change_none_of_its_derivatives(dt):
    """RadauIIA finds derivatives of few unknowns from one system of all stages, those of many by corrections."""
    names = ["left hip.angle", "right hip.angle.rate", "left thigh.mass", "right shank.length", "gravity.x"]
    found = []
    for masses in (0, 20):
        model = kneed_walker()
        for k in range(masses):
            mass = mbd.PointMass(f"mass {k}", mass=1.0)
            model.connect(mbd.Translation(f"fall {k}", model.ground.origin, mass.origin))
        start = kneed_walker_start(model)
        of = [*START.names, *START.velocity_names, "time"]
        run = mbd.sensitivities(model, start, mbd.RadauIIA(), dt=dt, until="right foot", wrt=names, of=of)
        found.append(run.matrix)
    assert np.abs(found[0]).max() > 1.0
    assert np.allclose(*found, rtol=1e-9, atol=1e-9)
