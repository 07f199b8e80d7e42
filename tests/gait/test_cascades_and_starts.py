"""Starts anywhere in a walk, cascades of doublings, and errors of special points that hold what they promise."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mbd
from tests.cases.walkers import compass, standing
from tests.gait.test_branches import cycle_of
from tests.gait.walkers import simplest
from tests.problems import case

MIRROR = ("left", "right")


@cache
def walking() -> tuple[mbd.Model, mbd.State, mbd.Trajectory]:
    """The compass walker of the case f2, its start, and some of its steps."""
    reference = case("f2-compass-gait-3deg")
    sizes, state = reference.definition, np.round(reference["fixed point"].value, 3)
    model = compass(sizes)
    start = standing(model, state, sizes["slope"])
    return model, start, mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=3.0)


def test_a_gait_is_found_from_any_instant_of_a_walk():
    """Before, as and after the feet pass each other; at any time on the clock, which `longest` does not count."""
    model, start, run = walking()
    wanted = mbd.limit_cycle(model, start, section="right foot", mirror=MIRROR)
    random = np.random.default_rng(23)
    passing = run.time[np.argmin(np.abs(run["left hip.angle"] - run["right hip.angle"]))]
    for time in (*random.uniform(0.0, 3.0, 5), passing, passing - 0.05, passing + 0.05):
        state = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=float(time)).final
        state = replace(state, time=float(random.choice([state.time, 29.9, 1e4])))
        gait = mbd.limit_cycle(model, state, section="right foot", mirror=MIRROR)
        assert abs(gait.largest_multiplier - wanted.largest_multiplier) < 1e-9, time
        assert abs(gait.period - wanted.period) < 1e-9, time


def test_a_search_for_gaits_of_two_strides_survives_tries_that_fall():
    model, _, _ = walking()
    found = mbd.find_gait(
        model, {"left hip.angle": (0.1, 0.4), "right hip.angle": -0.27},
        {"left hip.angle": (-2.5, -0.3), "right hip.angle": (-0.6, 0.2)}, closed="left foot", open="right foot",
        section="right foot", mirror=MIRROR, strides=2, tries=4, seed=1,
    )  # fmt: skip
    assert found.tries and not any("ValueError" in str(each.outcome) for each in found.tries)


@pytest.mark.parametrize("levels", [2, pytest.param(5, marks=pytest.mark.slow)])
def test_doublings_are_followed_one_after_the_other(levels):
    """1 → 2 → 4 → …, each beginning where the one before is left; their intervals shrink by Feigenbaum's 4.669."""
    model, start = simplest()
    gait, found = mbd.limit_cycle(model, start, section="heel strike"), []
    for level in range(levels):
        branch = mbd.branch(gait, "gamma", 0.0195)
        found.append(branch.points("doubling")[0])
        gait = branch.switch(found[-1])
        assert gait.strides == 2 ** (level + 1) and gait.stability == "stable"
        assert gait.parameters["gamma"] > found[-1].value
    names = ("slope of period doubling 1 -> 2 steps", "slope of period doubling 2 -> 4 steps")
    for name, point in zip(names, found, strict=False):
        assert abs(point.value - case("k3-simplest-walker-cascade")[name].value) < 5e-10  # feet of 1e-9 of the hip
    values = [point.value for point in found]
    ratios = np.diff(values)[:-1] / np.diff(values)[1:]
    assert np.all(np.abs(ratios[1:] - 4.669) < 0.1)


def test_errors_of_special_points_hold_the_points():
    """Folds at p = 0 and doublings at p = 1 of x' = p + x − x² in scaled coordinates."""
    for k in np.random.default_rng(15).uniform(0.3, 0.9, 1):
        gait = cycle_of("p + x - x**2", f"{k}*y + 0.2*x", 0.09, 0.3, 0.06 / (1.0 - k))
        fold = mbd.branch(gait, "scale", -0.5, steps=10, step=0.1).points("fold")[0]
        assert abs(fold.value) <= fold.error + 1e-15 and fold.error < 1e-9
        gait = cycle_of("p + x - x**2", f"{k}*y + 0.2*x", 0.9, 0.9**0.5, 0.2 * 0.9**0.5 / (1.0 - k))
        doubling = mbd.branch(gait, "scale", 1.1, step=0.1).points("doubling")[0]
        assert abs(doubling.value - 1.0) <= doubling.error + 1e-15 and doubling.error < 1e-9


def test_special_points_far_from_the_points_of_a_branch_solve_their_equations():
    """x' = p − x² doubles at 3/4, 5/4 and 1.368098939391258, the last between points that lie far apart."""
    gait = cycle_of("p - x**2", "0.2*y", 0.5, 0.366, 0.0)
    for right, to in ((0.75, 1.0), (1.25, 1.4005), (1.368098939391258, 1.4005)):
        branch = mbd.branch(gait, "scale", to)
        (point,) = [each for each in branch.points("doubling") if abs(each.value - right) < 0.01]
        assert abs(point.value - right) <= point.error + 1e-15 and point.error < 1e-11
        gait = branch.switch(point) if gait.strides < 4 else gait
