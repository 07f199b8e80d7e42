"""Steps over singular configurations: explicit ones pass between stages, those of Radau IIA with order 5."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.kernel.schemes import radau, runge_kutta
from mbd.kernel.schemes.collocation import RADAU
from mbd.kernel.schemes.dormand_prince import EIGHTH_ORDER
from tests.cases.linkages import four_bars, upright
from tests.integrators.flat_parallelograms import T, flat, pendulum_like, started, wanted
from tests.simulation.wild import wild_scene

EXPLICIT, IMPLICIT = mbd.RungeKutta853(), mbd.RadauIIA()


@dataclass(frozen=True)
class Passing:
    """A scheme that passes poses.

    middle : part of a step from a pose within which none ends; error, error_at_stage : largest, by the step
    skew : of the two cranks; steps, stages : that are tried, stages as parts of a step
    """

    scheme: Any
    middle: float
    error: Callable[[float], float]
    error_at_stage: Callable[[float], float]
    skew: float
    steps: tuple[float, ...]
    stages: tuple[float, ...]


PASSING = {
    "explicit": Passing(
        EXPLICIT, runge_kutta.SCHEME.abilities.middle, lambda dt: 2e-9 + (5.0 * dt) ** 8, lambda dt: 1e-9,
        1e-10,
        tuple(np.geomspace(4e-4, 5e-2, 10).tolist()), (0.0, *EIGHTH_ORDER.nodes[[1, 5, 9, 10]].tolist()),
    ),
    "RadauIIA": Passing(
        IMPLICIT, radau.SCHEME.abilities.middle, *2 * (lambda dt: 1e-10 + (2.5 * dt) ** 5,), 1e-11,
        tuple(np.geomspace(3e-4, 5e-2, 8).tolist()), (0.0, *RADAU.c.tolist(), 0.99, 0.01),
    ),
}  # fmt: skip
EVERY = pytest.mark.parametrize("passing", PASSING.values(), ids=PASSING)


def ran(scheme, count, until=T, **how):
    model, start = started(count)
    return mbd.simulate(model, start, scheme, until=until, **how)


def error_and_skew(scheme, count, **how):
    run = ran(scheme, count, **how)
    away = abs(run["base 0.angle"][-1] - wanted(count)["base 0.angle"][-1])
    return away, np.max(np.abs(run["base 0.angle"] - run[f"base {count}.angle"]))


def each(field):
    """Every scheme with every one of its numbers."""
    pairs = [(passing, number) for passing in PASSING.values() for number in getattr(passing, field)]
    names = [f"{name} {number:.4g}" for name, passing in PASSING.items() for number in getattr(passing, field)]
    return pytest.mark.parametrize(("passing", field), pairs, ids=names)


@pytest.mark.covering
@pytest.mark.parametrize("count", [1, 3])
@each("steps")
def test_flat_poses_are_passed_whatever_the_step(passing, steps, count):
    error, skew = error_and_skew(passing.scheme, count, dt=steps)
    assert error < passing.error(steps) and skew < passing.skew


@each("stages")
def test_a_pose_that_would_fall_on_a_stage_is_passed(passing, stages):
    first = flat(2)[0]
    for steps in (40, 211):  # the pose at that share of a step of the grid
        dt = first / (steps + stages)
        error, skew = error_and_skew(passing.scheme, 2, dt=dt)
        assert error < passing.error_at_stage(dt) and skew < passing.skew


@EVERY
def test_no_step_ends_next_to_a_pose(passing):
    for dt in (3e-2, 7e-3, 2e-3):
        run = ran(passing.scheme, 2, dt=dt)
        away = np.min(np.abs(run.time[:, None] - flat(2)), axis=0)
        assert np.all(away > 0.9 * passing.middle * dt)
        assert run.stats["shortened"] >= len(flat(2))
        assert told_sizes(run) == [f"{run.stats['shortened']} steps got another size, as one would have come too close"]


def told_sizes(run):
    """The notes on steps of another size than dt, without where that was."""
    said = ("steps got another size", "steps were shortened", "steps were halved")
    return [note.partition(" to a singular")[0] for note in run.stats["notes"] if any(each in note for each in said)]


def test_steps_at_which_newtons_method_failed_are_told_apart():
    run = wild_scene(28).run()
    assert told_sizes(run) == [
        f"{run.stats['shortened']} steps were shortened where Newton's method failed, or forces changed too much, "
        "at the full dt"
    ]


@pytest.mark.parametrize("tol", [1e-5, 1e-7, 1e-9])
@EVERY
def test_steps_that_follow_a_tolerance_pass_flat_poses(passing, tol):
    error, skew = error_and_skew(passing.scheme, 1, tol=tol)
    assert error < 3.0 * tol and skew < 1e-9


@EVERY
def test_a_longer_run_has_the_same_rows(passing):
    long, short = (ran(passing.scheme, 1, dt=2e-2, until=until) for until in (2.0, 1.0))
    np.testing.assert_array_equal(short.time[:-1], long.time[: len(short.time) - 1])
    np.testing.assert_array_equal(short["base 0.angle"][:-1], long["base 0.angle"][: len(short.time) - 1])


@EVERY
def test_a_start_from_rest_is_no_pose(passing):
    """What round-off makes of velocities is judged by those at the pose, not by those at rest."""
    model, single = four_bars(1), pendulum_like(1)
    start = upright(model, 1, angle=2.0, speed=0.0)
    alone = mbd.assemble(single, position={"base 0.angle": 2.0})
    exact = mbd.simulate(single, alone, EXPLICIT, dt=1e-3, until=2.0)
    for how in ({"dt": 4e-3}, {"tol": 1e-7}):
        run = mbd.simulate(model, start, passing.scheme, until=2.0, **how)
        assert run["base 0.angle"][-1] == pytest.approx(exact["base 0.angle"][-1], abs=2e-7)


# explicit steps alone ------------------------------------------------------------------------------------------------
def test_energy_and_rows_hold_at_and_between_all_rows():
    run = ran(EXPLICIT, 2, dt=5e-3)
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
    run = mbd.simulate(model, start, EXPLICIT, dt=1e-8, until=1e-6, on_failure="return")
    assert not run.success
    for word in ("singular configuration", "'right 0'", "mbd.GeneralizedAlpha", "mbd.RadauIIA"):
        assert word in run.message


# Radau IIA alone ------------------------------------------------------------------------------------------------------
def test_errors_fall_with_order_five_over_flat_poses():
    found = np.array([error_and_skew(IMPLICIT, 2, dt=0.04 / 2**k)[0] for k in range(4)])
    np.testing.assert_allclose(np.log2(found[:-1] / found[1:]), 5.0, atol=0.15)


def test_energy_and_rows_hold_at_all_rows_and_multipliers_beside_poses():
    run = ran(IMPLICIT, 1, dt=4e-3)
    assert np.ptp(run.energy.total) < 1e-8 and run.violation.length < 1e-12 and run.violation.rate < 1e-10
    exact = wanted(1).at(run.time)
    np.testing.assert_allclose(run["base 0.angle.rate"], exact["base 0.angle.rate"], rtol=0, atol=1e-8)
    bends = run["base 0.angle.acceleration"] - exact["base 0.angle.acceleration"]
    np.testing.assert_allclose(bends, 0.0, rtol=0, atol=1e-7)


@pytest.mark.parametrize("dt", [6e-5, 1e-5])
def test_fine_steps_pass_with_a_longer_one_also_where_a_guard_is_watched(dt):
    until = flat(1)[0] + 0.02
    exact = wanted(1).at(until)["base 0.angle"]
    guarded = four_bars(1)
    guarded.constrain(mbd.Event("high", mbd.measure(lambda p: p[1] - 0.05, guarded.bodies["crank 0"].end)))
    for model, events in ((four_bars(1), 0), (guarded, 1)):
        run = mbd.simulate(model, upright(model, 1, speed=-3.0), IMPLICIT, dt=dt, until=until)
        assert abs(run["base 0.angle"][-1] - exact) < 1e-10
        assert len(run.events) == events
        longest = np.max(np.diff(run.time))
        assert 2.0 * dt < longest < 5e-3


@pytest.mark.parametrize("loss", [0.0, 50.0])
def test_stiff_springs_do_not_hinder(loss):
    """ω dt is 20 to 260 at the hinge of the weight: no explicit step could be that long; round-off of rows meets it."""
    ends = []
    for dt in (1.6e-2, 8e-3, 4e-3, 1e-3):
        model = four_bars(1)
        weight = mbd.Link("weight", mass=0.5, length=0.1, center=0.05, inertia=1e-3)
        middle = model.bodies["coupler 0"].point(0.5, 0.0, name="middle")
        damper = mbd.Viscous(loss) if loss else None
        model.connect(mbd.Revolute("hinge", middle, weight.start, stiffness=5e5, loss=damper))
        run = mbd.simulate(model, upright(model, 1, speed=-3.0), IMPLICIT, dt=dt, until=2.0)
        assert np.max(np.abs(run["base 0.angle"] - run["base 1.angle"])) < 1e-11
        assert run.stats["shortened"] < 20
        ends.append(run["base 0.angle"][-1])
    errors = np.abs(np.array(ends[:3]) - ends[3])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 5.0, atol=0.2)
