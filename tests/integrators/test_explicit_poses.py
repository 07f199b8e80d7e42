"""Explicit steps of order 8 over singular configurations: between their stages, or with a named error."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.kernel.schemes import runge_kutta
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from tests.cases.linkages import four_bars, upright
from tests.integrators.flat_parallelograms import T, flat, pendulum_like, started, wanted

SCHEME = mbd.RungeKutta853()


def error_and_skew(count, **how):
    model, start = started(count)
    run = mbd.simulate(model, start, SCHEME, until=T, **how)
    away = abs(run["base 0.angle"][-1] - wanted(count)["base 0.angle"][-1])
    return away, np.max(np.abs(run["base 0.angle"] - run[f"base {count}.angle"]))


@pytest.mark.covering
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("dt", np.geomspace(4e-4, 5e-2, 10).tolist())
def test_flat_poses_are_passed_whatever_the_step(count, dt):
    error, skew = error_and_skew(count, dt=dt)
    assert error < 2e-9 + (5.0 * dt) ** 8 and skew < 1e-10


@pytest.mark.sampled(2)
@pytest.mark.parametrize("share", [0.0, *EIGHTH_ORDER.nodes[[1, 5, 9, 10]].tolist()])
def test_a_pose_that_would_fall_on_a_stage_is_passed(share):
    first = flat(2)[0]
    for steps in (40, 211):  # the pose at that share of a step of the grid
        error, skew = error_and_skew(2, dt=first / (steps + share))
        assert error < 1e-9 and skew < 1e-10


def test_no_step_ends_next_to_a_pose():
    model, start = started(2)
    for dt in (3e-2, 7e-3, 2e-3):
        run = mbd.simulate(model, start, SCHEME, dt=dt, until=T)
        away = np.min(np.abs(run.time[:, None] - flat(2)), axis=0)
        assert np.all(away > 0.9 * runge_kutta.SCHEME.abilities.middle * dt)
        assert run.stats["shortened"] >= len(flat(2))


@pytest.mark.parametrize("tol", [1e-5, 1e-7, 1e-9])
def test_steps_that_follow_a_tolerance_pass_flat_poses(tol):
    error, skew = error_and_skew(1, tol=tol)
    assert error < 3.0 * tol and skew < 1e-9


def test_energy_and_rows_hold_at_and_between_all_rows():
    model, start = started(2)
    run = mbd.simulate(model, start, SCHEME, dt=5e-3, until=T)
    assert np.ptp(run.energy.total) < 1e-9 and run.violation.length < 1e-12 and run.violation.rate < 1e-10
    for instant in flat(2):
        near = run.at(instant + 5e-3 * np.linspace(-0.4, 0.4, 41))
        exact = wanted(2).at(instant + 5e-3 * np.linspace(-0.4, 0.4, 41))
        for name, limit in (("base 0.angle", 1e-8), ("base 0.angle.rate", 1e-6)):
            np.testing.assert_allclose(near[name], exact[name], rtol=0, atol=limit)


def test_steps_too_fine_to_pass_say_so():
    """So near to the pose round-off of the joints makes more of velocities than any motion."""
    model = four_bars(1)
    start = upright(model, 1, angle=0.5 * np.pi + 1e-6, speed=-3.0)
    run = mbd.simulate(model, start, SCHEME, dt=1e-8, until=1e-6, on_failure="return")
    assert not run.success
    for word in ("singular configuration", "'right 0'", "mbd.GeneralizedAlpha", "mbd.RadauIIA"):
        assert word in run.message


@pytest.mark.slow
def test_the_plain_twin_takes_the_same_steps():
    model, start = started(1)
    until = flat(1)[0] + 0.05
    runs = [mbd.simulate(model, start, SCHEME, dt=2e-2, until=until, backend=b) for b in ("python", "llvm")]
    np.testing.assert_allclose(runs[0].time, runs[1].time, rtol=0, atol=1e-9)
    np.testing.assert_allclose(runs[0]["base 0.angle"], runs[1]["base 0.angle"], rtol=0, atol=1e-10)


def test_a_longer_run_has_the_same_rows():
    model, start = started(1)
    long = mbd.simulate(model, start, SCHEME, dt=2e-2, until=2.0)
    short = mbd.simulate(model, start, SCHEME, dt=2e-2, until=1.0)
    np.testing.assert_array_equal(short.time[:-1], long.time[: len(short.time) - 1])
    np.testing.assert_array_equal(short["base 0.angle"][:-1], long["base 0.angle"][: len(short.time) - 1])


def test_a_start_from_rest_is_no_pose():
    """What round-off makes of velocities is judged by those at the pose, not by those at rest."""
    model, single = four_bars(1), pendulum_like(1)
    start = upright(model, 1, angle=2.0, speed=0.0)
    alone = mbd.assemble(single, position={"base 0.angle": 2.0})
    for how in ({"dt": 4e-3}, {"tol": 1e-7}):
        run = mbd.simulate(model, start, SCHEME, until=2.0, **how)
        exact = mbd.simulate(single, alone, SCHEME, dt=1e-3, until=2.0)
        assert run["base 0.angle"][-1] == pytest.approx(exact["base 0.angle"][-1], abs=2e-7)
