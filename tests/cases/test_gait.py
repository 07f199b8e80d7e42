"""Cases f2, f2b, f3, f3b: passive walkers from their published fixed points and beside them, and as they fall."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.gaits import Walker, slope_angles
from tests.cases.schemes import WITH_ROWS, name_of
from tests.cases.walkers import compass, kneed, standing, strikes
from tests.helpers import assert_second_order
from tests.problems import Case, case

Build = Callable[..., mbd.Model]


class Gait:
    """A walker, its published gait and the same walker by hand."""

    def __init__(self, name: str, build: Build, knees: bool, foot_meets_ground: bool = False) -> None:
        self.reference: Case = case(name)
        sizes = self.reference.definition
        self.slope: float = sizes["slope"]
        self.model = build(sizes)
        self.by_hand = Walker(sizes, knees, foot_meets_ground)
        self.fixed = np.asarray(self.reference["fixed point"].value)
        self.period = float(self.reference["step period"].value)
        self.knees = knees
        self.stance_foot = f"left {'shank' if knees else 'leg'}.end.x"

    def walk(self, state: np.ndarray, scheme: NewmarkFamily, dt: float, until: float, store: int = 1) -> mbd.Trajectory:
        start = standing(self.model, state, self.slope)
        return mbd.simulate(self.model, start, scheme, dt=dt, until=until, store=store)


GAITS = {
    "compass": lambda: Gait("f2-compass-gait-3deg", compass, knees=False),
    "compass, g = 9.80665": lambda: Gait("f2b-compass-gait-3deg-g980665", compass, knees=False),
    "kneed": lambda: Gait("f3-kneed-walker-chen", kneed, knees=True, foot_meets_ground=True),
    "kneed, human": lambda: Gait("f3b-kneed-walker-human", lambda sizes: kneed(sizes, late=True), knees=True),
}
"""The human walker's foot would scuff by a millimetre just before its knee locks."""
each_gait = pytest.mark.parametrize("name", GAITS)
each_scheme = pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)


@pytest.mark.covering
@each_gait
@each_scheme
def test_period_length_and_states_around_the_strike_are_of_second_order(scheme: NewmarkFamily, name: str) -> None:
    gait = GAITS[name]()
    before, length = gait.reference["state just before"].value, gait.reference["step length"].value

    def errors(dt: float) -> list[float]:
        run = gait.walk(gait.fixed, scheme, dt, 1.1 * gait.period)
        (strike,) = strikes(run, gait.slope)
        ends = [strike.after - gait.fixed, strike.before - before]
        found = [float(np.linalg.norm(end)) for end in ends]
        found += [strike.time - gait.period, strike.place - run[gait.stance_foot][0] - length]
        if gait.knees:
            assert strike.knee is not None
            found.append(strike.knee - gait.reference["knee strike time"].value)
        return found

    assert_second_order(errors, 2e-3)


# started elsewhere ------------------------------------------------------------------------------------------------
WALKING = [
    ("compass", (1.0, 1.0, 0.9)), ("compass", (0.9, 0.9, 0.9)), ("compass", (1.0, 1.1, 1.0)),
    ("compass, g = 9.80665", (0.9, 1.0, 1.0)), ("compass, g = 9.80665", (1.0, 1.0, 1.1)),
    ("kneed", (0.9, 1.0, 1.0)), ("kneed", (1.1, 1.0, 1.0)), ("kneed", (1.1, 1.1, 1.1)), ("kneed", (0.9, 0.9, 0.9)),
    ("kneed, human", (1.0, 1.1, 1.0)), ("kneed, human", (1.0, 1.0, 0.9)), ("kneed, human", (1.0, 1.0, 1.1)),
]  # fmt: skip
"""Shares of the published angles from the slope's normal, stance rate and swing rate from which the gait recovers."""

FALLING = [
    ("compass", (1.1, 1.0, 1.0)), ("compass", (1.0, 0.9, 1.0)), ("compass", (1.1, 0.9, 1.0)),
    ("compass, g = 9.80665", (0.9, 1.1, 1.0)),
    ("kneed, human", (0.9, 1.0, 1.0)), ("kneed, human", (1.1, 1.0, 1.0)), ("kneed, human", (1.0, 0.9, 1.0)),
    ("kneed, human", (0.9, 0.9, 0.9)),
]  # fmt: skip

STUMBLING = [(1.0, 0.9, 1.0), (0.9, 1.1, 1.0), (1.1, 0.9, 1.0)]


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("name", "shares"), WALKING)
def test_three_steps_from_another_start_are_those_of_an_explicit_method(
    name: str, shares: tuple[float, float, float]
) -> None:
    gait = GAITS[name]()
    state = slope_angles(gait.fixed, gait.slope, shares)
    expected = gait.by_hand.walk(state, 3)

    def errors(dt: float) -> list[float]:
        found = strikes(gait.walk(state, mbd.GeneralizedAlpha(0.9), dt, expected[-1].time + 0.02), gait.slope)
        assert len(found) == 3
        off = [
            np.append(mine.after, mine.time) - np.append(its.state, its.time)
            for mine, its in zip(found, expected, strict=True)
        ]
        return [float(np.linalg.norm(off))]

    assert_second_order(errors, 5e-4)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("name", "shares"), FALLING)
def test_a_walk_too_far_from_its_gait_ends_with_a_fall_that_has_a_name_and_a_time(
    name: str, shares: tuple[float, float, float]
) -> None:
    gait = GAITS[name]()
    state = slope_angles(gait.fixed, gait.slope, shares)
    expected = gait.by_hand.walk(state, 8)
    assert expected[-1].end == "fall"

    def errors(dt: float) -> list[float]:
        run = gait.walk(state, mbd.HHT(), dt, expected[-1].time + 1.0)
        assert run.success and run.status == 1
        assert run.message.startswith("ended by 'fall'")
        found = [strike.time for strike in strikes(run, gait.slope)] + [run.time[-1]]
        assert len(found) == len(expected)
        return [float(np.linalg.norm(np.array(found) - [step.time for step in expected]))]

    assert_second_order(errors, 2.5e-4)


@pytest.mark.parametrize("shares", STUMBLING)
def test_a_kneed_walker_stumbles_when_its_bent_leg_comes_down_early(shares: tuple[float, float, float]) -> None:
    gait = GAITS["kneed"]()
    state = slope_angles(gait.fixed, gait.slope, shares)
    expected = gait.by_hand.walk(state, 8)
    assert expected[-1].end == "stumble"

    def errors(dt: float) -> list[float]:
        run = gait.walk(state, mbd.HHT(), dt, expected[-1].time + 0.01)
        found = [event for event in run.events if event.kind == "closed" and event.name.endswith("foot")]
        assert len(found) == len(expected)
        knee = run.at(found[-1].time)[f"{found[-1].name.split()[0]} knee.angle"]
        assert knee < -0.05
        return [float(np.linalg.norm([event.time - step.time for event, step in zip(found, expected, strict=True)]))]

    assert_second_order(errors, 2.5e-4)


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.GeneralizedAlpha(0.9)], ids=repr)
def test_legs_that_pass_each_other_do_not_strike_whatever_the_step(scheme: mbd.Integrator) -> None:
    """The gap of the trailing foot and its condition vanish together, at any place of a step."""
    name, shares = FALLING[2]
    gait = GAITS[name]()
    state = slope_angles(gait.fixed, gait.slope, shares)
    for dt in [6.25e-5, 3.125e-5, *np.geomspace(1e-4, 2e-3, 40)]:
        assert not strikes(gait.walk(state, scheme, dt, 1.0), gait.slope)
