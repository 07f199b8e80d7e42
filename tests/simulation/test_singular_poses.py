"""Singular configurations for an instant are passed on the branch of the motion, with the order of the scheme."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import mbd
from mbd.kernel.singular.step_pairs import LONG_PART, SHORT_PART
from tests.simulation.singular_linkages import Passage, four_bars, kite, platform, slider_crank, stopped

MECHANISMS = {
    "one four-bar": lambda: four_bars(1),
    "two four-bars": lambda: four_bars(2),
    "ten four-bars": lambda: four_bars(10, until=1.0),
    "slider-crank": lambda: slider_crank(1.0),
    "small slider-crank": lambda: slider_crank(0.1, turn=11.0),
    "parallelogram": lambda: platform((0.0, 1.3)),
    "long parallelogram": lambda: platform((0.0, 0.4), length=1.7, turn=4.0),
    "three cranks, redundant": lambda: platform((0.0, 1.3, 0.6)),
    "row on velocities": lambda: platform((0.0, 1.0), with_belt=True),
    "contacts closed": stopped,
    "kite": kite,
}
SCHEMES = [
    mbd.HHT(0.05), mbd.GeneralizedAlpha(0.9), mbd.GeneralizedAlpha(0.8), mbd.GeneralizedAlpha(0.5), mbd.Newmark(),
    mbd.RadauIIA(),
]  # fmt: skip
CLOSE = 1e-9
"""How far a run may be off its branch [m, rad]."""


@functools.lru_cache
def passage(name: str) -> tuple[Passage, float]:
    """A mechanism, and where its motion on one coordinate ends."""
    found = MECHANISMS[name]()
    return found, found.end()


def judge(name: str, scheme: mbd.Integrator, steps: tuple[float, ...], floor: float) -> None:
    """Every dt stays on the branch; the error falls as dt² from the first dt on, down to a floor.

    HHT's third order can cancel the second at the first dt: there 0.5 dt² is taken instead.
    """
    found, exact = passage(name)
    first = 0.0
    for dt in steps:
        run = mbd.simulate(*found.start, scheme, dt=dt, until=found.until, store=max(1, round(0.001 / dt)))
        error = abs(run[found.angle][-1] - exact)
        first = first or max(error, 0.5 * dt**2)
        assert found.off(run) < CLOSE, dt
        assert error < 1.5 * first * (dt / steps[0]) ** 2 + floor, (dt, error)
        assert run.violation.length < CLOSE
        assert 0 < run.stats["singular_steps"] + run.stats["shortened"] < 100
        assert any("singular configuration" in note for note in run.stats["notes"])


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("name", MECHANISMS)
def test_singular_poses_are_passed_on_the_branch_with_order_two(name, scheme):
    judge(name, scheme, (1e-2, 5e-3, 2.3e-3, 1e-3, 5e-4, 2.5e-4), 2e-9)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("name", MECHANISMS)
def test_singular_poses_are_passed_with_order_two_down_to_round_off(name, scheme):
    judge(name, scheme, (1e-3, 1.25e-4, 6e-5, 3e-5, 1e-5), 2e-8)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("dt", [1e-3, 2.5e-4, 6e-5])
def test_nothing_is_kicked_next_to_a_singular_pose(dt, scheme):
    found, _ = passage("slider-crank")
    run = mbd.simulate(*found.start, scheme, dt=dt, until=0.6)
    near = np.abs(run["main.angle"] - np.pi) < 40.0 * np.max(np.diff(run.time))
    steps = np.diff(run.time[near])
    slopes = np.diff(run["main.angle.rate"][near]) / steps
    bends = np.abs(2.0 * np.diff(slopes) / (steps[1:] + steps[:-1])) * dt**2  # of steps that may be uneven
    assert np.max(bends) < 20.0 * dt**2 + 1e-14 / dt**2  # the second slope of the rate is 8 rad/s³


def test_a_step_that_would_end_next_to_the_pose_is_shortened():
    found, exact = passage("slider-crank")
    whole = mbd.simulate(*found.start, mbd.Newmark(), dt=1e-4, until=0.5)
    instant = float(np.interp(np.pi, whole["main.angle"], whole.time))
    for place in 1e-3, 0.0, -1e-3:
        dt = instant / (5000.0 + place)
        run = mbd.simulate(*found.start, mbd.GeneralizedAlpha(0.8), dt=dt, until=found.until)
        assert run.stats["shortened"] >= 1
        assert abs(run["main.angle"][-1] - exact) < 10.0 * dt**2
        assert any("too close to a singular configuration" in note for note in run.stats["notes"])


def test_a_crank_that_turns_back_at_the_pose_stays_on_its_branch():
    for turn in np.linspace(6.2, 6.3, 11):
        found = platform((0.0, 1.3), turn=float(turn))
        run = mbd.simulate(*found.start, mbd.HHT(0.05), dt=1e-3, until=1.5)
        assert found.off(run) < CLOSE
        assert run.energy.drift < 1e-4


def test_a_motion_away_from_singular_poses_is_left_alone():
    found = slider_crank(1.0, turn=0.5)
    run = mbd.simulate(*found.start, mbd.HHT(0.05), dt=1e-3, until=0.1)
    assert run.stats["singular_steps"] == 0
    assert run.stats["restarts"] == 1
    assert not run.stats["notes"]


@pytest.mark.parametrize("dt", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_steps_too_large_for_a_light_mass_open_no_joint(dt, scheme):
    model = mbd.Model("a heavy mass below a light one", cut="all")
    upper, lower = mbd.Link("upper", 1e-3, 1.0, 1.0), mbd.Link("lower", 1e3, 1.0, 1.0)
    model.connect(
        mbd.Revolute("shoulder", model.ground.origin, upper.start), mbd.Revolute("elbow", upper.end, lower.start)
    )
    start = mbd.assemble(model, position={"upper floating.angle": 0.3, "lower floating.angle": 0.4})
    run = mbd.simulate(model, start, scheme, dt=dt, until=0.5, on_failure="return")
    assert run.violation.length < 1e-10
    if run.success:
        assert np.max(run.energy.total) - run.energy.total[0] < 1e-3 * 2e3 * 9.81 * 2.0


@pytest.mark.parametrize("scheme", [mbd.Newmark(), mbd.GeneralizedAlpha(0.9)], ids=repr)
@pytest.mark.parametrize("name", ["one four-bar", "two four-bars", "parallelogram"])
def test_the_error_over_dt_squared_does_not_depend_on_where_the_grid_meets_the_poses(name, scheme):
    found, exact = passage(name)
    sizes, shortened = [], 0
    for dt in (1.03e-3, 1e-3, 9.1e-4, 8.7e-4, 7.7e-4, 7e-4, 6.1e-4, 5e-4):
        run = mbd.simulate(*found.start, scheme, dt=dt, until=found.until)
        sizes.append((run[found.angle][-1] - exact) / dt**2)
        shortened += run.stats["shortened"]
    assert shortened > 0
    assert np.ptp(sizes) < 0.02 * abs(np.mean(sizes))


def test_a_pair_of_steps_lasts_half_a_step_less_and_errs_like_whole_steps():
    assert abs(LONG_PART + SHORT_PART - 1.5) < 1e-15
    assert abs(LONG_PART**3 + SHORT_PART**3 - 1.5) < 1e-15


def paired_run(**settings):
    """Two pairs of uneven steps, before the first flat pose and before the next but one."""
    return mbd.simulate(*passage("one four-bar")[0].start, mbd.HHT(0.05), dt=5e-4, **settings)


def test_steps_of_a_pair_have_their_sizes_and_whole_ones_follow():
    run = paired_run(until=2.0)
    sizes = np.diff(run.time) / 5e-4
    (first, *_), short = np.flatnonzero(np.abs(sizes - 1.0) > 1e-6), run.stats["shortened"]
    np.testing.assert_allclose(sizes[first - 1 : first + 3], [1.0, SHORT_PART, LONG_PART, 1.0], rtol=1e-9)
    assert short >= 1


@pytest.mark.parametrize("after", [0, 1, 2])
def test_a_run_that_is_cut_at_a_pair_goes_on_as_if_it_were_whole(after):
    whole = paired_run(until=1.0)
    first = int(np.flatnonzero(np.abs(np.diff(whole.time) / 5e-4 - 1.0) > 1e-6)[0])
    begun = paired_run(until=float(whole.time[first + after]))
    rest = mbd.simulate(passage("one four-bar")[0].start[0], begun.final, mbd.HHT(0.05), dt=5e-4, until=1.0)
    np.testing.assert_array_equal(np.concatenate([begun.record.q, rest.record.q[1:]]), whole.record.q)
    np.testing.assert_array_equal(np.concatenate([begun.record.v, rest.record.v[1:]]), whole.record.v)


def test_a_run_that_ends_within_a_pair_ends_there():
    whole = paired_run(until=1.0)
    first = int(np.flatnonzero(np.abs(np.diff(whole.time) / 5e-4 - 1.0) > 1e-6)[0])
    for part in (0.2, 0.6, 1.2):
        end = float(whole.time[first]) + part * 5e-4
        run = paired_run(until=end)
        assert run.success and run.time[-1] == end
        assert run["base 0.angle"][-1] == pytest.approx(float(whole.at(end)["base 0.angle"]), abs=1e-9)
