"""Contacts by a force law: exact where the law is linear, no energy from nowhere, located on both sides."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import G, falling, run


def rubber(gravity=True, **law):
    model, body = falling()
    if not gravity:
        model.gravity = (0.0, 0.0, 0.0)
    model.constrain(mbd.Penalty("floor", mbd.height(body.origin), **law))
    return model


def test_the_error_of_a_bounce_on_rubber_is_of_second_order():
    errors = []
    for dt in (2e-3, 1e-3, 5e-4, 2.5e-4):
        model = rubber(gravity=False, stiffness=2e3)
        trajectory = run(model, {"fall.displacement": 0.3}, {"fall.displacement": -3.0}, dt=dt, until=0.4)
        leave = 0.1 + np.pi * np.sqrt(1e-3)
        errors.append(abs(trajectory["fall.displacement"][-1] - 3.0 * (0.4 - leave)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 1.8) & (orders < 2.2))


def test_an_undamped_stop_keeps_energy_over_many_bounces():
    model = rubber(stiffness=5e3)
    trajectory = run(model, {"fall.displacement": 0.2}, integrator=mbd.Newmark(), dt=5e-4, until=5.0)
    assert len(trajectory.events) > 20
    speeds = trajectory["fall.rate"][[event.row for event in trajectory.events]]
    np.testing.assert_allclose(np.abs(speeds), np.sqrt(0.4 * G), rtol=1e-4)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("release", ["gap", "pull"])
def test_a_damped_stop_only_takes_energy_and_lets_the_ball_rest(exponent, release):
    model = rubber(stiffness=2e4, damping=40.0, exponent=exponent, release=release)
    trajectory = run(model, {"fall.displacement": 0.1}, dt=5e-4, until=2.0)
    force = trajectory["floor.force"]
    assert force[-1] == pytest.approx(2 * G, rel=1e-2)
    if release == "pull":
        assert force.min() > -1e-9, "it never attracts"
    speeds = np.abs(trajectory["fall.rate"][[event.row for event in trajectory.events]])
    assert np.all(np.diff(speeds[: min(len(speeds), 8)]) < 1e-6)


def test_release_on_gap_may_pull_just_before_it_opens_and_release_on_pull_opens_earlier():
    times = {}
    for release in ("gap", "pull"):
        model = rubber(gravity=False, stiffness=1e3, damping=20.0, release=release)
        trajectory = run(model, {"fall.displacement": 0.1}, {"fall.displacement": -1.0}, dt=2e-4, until=0.5)
        times[release] = trajectory.events[1].time
        row = trajectory.events[1].row - 1
        if release == "gap":
            assert trajectory["floor.force"].min() < -1.0
            assert trajectory["floor.gap"][row] == pytest.approx(0.0, abs=1e-12)
        else:
            assert trajectory["floor.force"][row] == pytest.approx(0.0, abs=1e-6)
            assert trajectory["floor.gap"][row] < -1e-4
    assert times["pull"] < times["gap"]
