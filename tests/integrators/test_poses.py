"""Singular configurations, passed by schemes of high order between two of their stages."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.hardcases.singular_poses import equal_slider_crank
from tests.cases.linkages import four_bars, rod, upright
from tests.integrators.flat_parallelograms import T, pendulum_like, wanted

SCHEMES = (mbd.RungeKutta853(), mbd.RadauIIA())
ALLOWED = {8: 1e-7, 5: 1e-6}
"""Change of energy over all, by the order of the scheme, of a slider-crank in steps of 10 ms [-]."""


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("beyond", [-1e-2, -1e-4, 1e-3, 1e-1])
def test_cranks_that_turn_back_next_to_a_flat_pose_do_so(scheme, beyond):
    model, single = four_bars(1), pendulum_like(1)
    speed = np.sqrt(2.0 * 2.0 * 9.81 / (5.0 / 3.0) * (1.0 - np.cos(0.5 * np.pi + beyond)))
    start = upright(model, 1, angle=0.0, speed=speed)
    alone = mbd.assemble(single, position={"base 0.angle": 0.0}, velocity={"base 0.angle": speed})
    exact = mbd.simulate(single, alone, mbd.RungeKutta853(), dt=2e-3, until=2.0)
    for dt in (2e-3, 1.1e-2):
        run = mbd.simulate(model, start, scheme, dt=dt, until=2.0)
        error = abs(run["base 0.angle"][-1] - exact["base 0.angle"][-1])
        assert error < 1e-8 + (3.0 * dt) ** scheme.order()


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_loops_that_are_flat_one_after_the_other(scheme):
    """Two parallelograms that have nothing to do with each other, the second a little behind the first."""
    for late in (1e-3, 2e-2, 0.2):
        model, place, speed = mbd.Model("two"), {}, {}
        for k in range(2):
            one, other, bar = (rod(f"{name} {k}") for name in ("one", "other", "bar"))
            model.connect(
                mbd.Revolute(f"a{k}", model.ground.point(0.0, 3.0 * k, name=f"a{k}"), one.start),
                mbd.Revolute(f"d{k}", model.ground.point(1.0, 3.0 * k, name=f"d{k}"), other.start),
                mbd.Revolute(f"b{k}", one.end, bar.start),
                mbd.Revolute(f"c{k}", bar.end, other.end),
            )
            angle = np.pi + late * k
            place |= {f"a{k}.angle": angle, f"d{k}.angle": angle, f"b{k}.angle": 0.5 * np.pi - angle}
            speed[f"a{k}.angle"] = -3.0
        start = mbd.assemble(model, position=place, velocity=speed)
        run = mbd.simulate(model, start, scheme, dt=1.3e-2, until=T)
        for k in range(2):
            assert abs(run[f"a{k}.angle"][-1] - wanted(1, np.pi + late * k)["base 0.angle"][-1]) < 1e-6


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_a_slider_crank_goes_on_past_the_pivot(scheme):
    model, start = equal_slider_crank()
    for dt in (1e-2, 1e-3):
        run = mbd.simulate(model, start, scheme, dt=dt, until=1.0)
        ways = run["guide.displacement"]
        assert np.min(ways) < -0.5 and np.ptp(run.energy.total) < ALLOWED[scheme.order()] * run.energy.total[0]
