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


def test_an_undamped_stop_returns_the_ball_after_half_a_period():
    k, mass, speed = 2e3, 2.0, 3.0
    model = rubber(gravity=False, stiffness=k)
    trajectory = run(model, {"fall.displacement": 0.3}, {"fall.displacement": -speed}, dt=1e-3, until=0.5)
    closed, opened = trajectory.events
    assert (closed.kind, opened.kind) == ("closed", "opened")
    assert closed.time == pytest.approx(0.1, abs=1e-12)
    assert opened.time - closed.time == pytest.approx(np.pi * np.sqrt(mass / k), rel=2e-4)
    assert trajectory["fall.rate"][-1] == pytest.approx(speed, rel=1e-3)
    assert trajectory["floor.force"].max() == pytest.approx(speed * np.sqrt(k * mass), rel=1e-3)
    assert closed.impulse.size == 0 or not closed.impulse.any(), "a force law needs no impulse"


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


def test_kelvin_and_voigts_stop_gives_the_restitution_of_its_damping_ratio():
    """Release on gap: e = exp(−π ζ/√(1−ζ²)) without gravity."""
    k, mass, zeta = 5e3, 2.0, 0.3
    model = rubber(gravity=False, stiffness=k, damping=2 * zeta * np.sqrt(k * mass))
    trajectory = run(model, {"fall.displacement": 0.1}, {"fall.displacement": -1.0}, dt=2e-4, until=0.3)
    assert trajectory["fall.rate"][-1] == pytest.approx(np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rel=1e-3)


def test_stiffer_and_stiffer_stops_approach_the_rigid_one():
    """Critically damped rubber of growing stiffness against a plastic floor: the gap of motion shrinks like 1/√k."""
    body_drops = {"fall.displacement": 0.2}
    distances = []
    for k in (1e4, 1e6, 1e8):
        model = rubber(stiffness=k, damping=2 * np.sqrt(2.0 * k), release="pull")
        trajectory = run(model, body_drops, dt=2e-5, until=0.6)
        distances.append(-trajectory["fall.displacement"].min())
        assert trajectory["floor.force"][-1] == pytest.approx(2 * G, rel=1e-6)
    assert distances[0] / distances[1] == pytest.approx(10.0, rel=0.1)
    assert distances[1] / distances[2] == pytest.approx(10.0, rel=0.1)


def test_a_run_continued_inside_a_stop_goes_on_in_it():
    model = rubber(stiffness=2e3)
    start = {"fall.displacement": 0.2}
    whole = run(model, start, dt=1e-3, until=0.5)
    middle = 0.5 * (whole.events[0].time + whole.events[1].time)
    first = run(model, start, dt=1e-3, until=middle)
    assert first.final.mode.closed == {"floor"}
    second = mbd.simulate(model, first.final, mbd.HHT(0.05), dt=1e-3, until=0.5)
    assert second["fall.displacement"][-1] == pytest.approx(whole["fall.displacement"][-1], abs=1e-5)
    assert [event.kind for event in first.events + second.events] == [event.kind for event in whole.events]
