"""Impacts: momentum, complementarity, energy, restitution, and the rules that release contacts at one."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.hardcases.impacts import impact_figures
from tests.comparisons import at_least, compared
from tests.simulation.mechanisms import G, box, falling, kneed_walker, kneed_walker_start, run, two_balls


def impacts(trajectory):
    """(row before, row after) of every impact."""
    rows = sorted({event.row for event in trajectory.events if event.impulse.any()})
    return [(row - 1, row) for row in rows]


def check_impacts(model, trajectory, least=1):
    """Momentum, complementarity, energy and rows that hold, at every impact, from the stored rows."""
    pairs = impacts(trajectory)
    assert len(pairs) >= least
    broken = [figure for figure in impact_figures(model, trajectory) if not figure.passed]
    assert not broken
    kinetic = trajectory.energy.kinetic
    for before, after in pairs:
        told = sum(event.energy_loss for event in trajectory.events if event.row == after)
        assert told == pytest.approx(kinetic[before] - kinetic[after], rel=1e-9, abs=1e-12 * max(1.0, kinetic[before]))


same_box = cache(box)
"""One model for many motions: it is derived once."""

angles = st.floats(-1.2, 1.2)
speeds = st.floats(-3.0, 3.0)


@settings(max_examples=25)
@given(angle=angles, spin=speeds, forward=speeds, restitution=st.sampled_from([0.0, 0.3, 1.0]))
def test_a_frictionless_box_keeps_momentum_and_complements_at_every_impact(angle, spin, forward, restitution):
    model = same_box(0.0, restitution)
    position = {"place.y": 1.0, "place.angle": angle}
    velocity = {"place.x": forward, "place.y": 0.0, "place.angle": spin}
    trajectory = run(model, position, velocity, until=0.8)
    check_impacts(model, trajectory)


@at_least(8)
@settings(max_examples=15)
@given(angle=st.floats(0.05, 1.2), spin=speeds, forward=speeds)
def test_a_box_whose_corner_sticks_keeps_momentum_and_complements(angle, spin, forward):
    model = same_box(None, 0.0)
    position = {"place.y": 1.0, "place.angle": angle}
    velocity = {"place.x": forward, "place.y": 0.0, "place.angle": spin}
    trajectory = run(model, position, velocity, until=("left", 2.0), on_failure="return")
    if trajectory.success:  # a corner that sticks without limit may have no consistent forces afterwards
        check_impacts(model, trajectory)
        compared()
    else:
        assert "whatever its force" in trajectory.message


def test_heel_strike_and_knee_lock_of_a_walker_keep_momentum_and_complement():
    model = kneed_walker()
    trajectory = mbd.simulate(model, kneed_walker_start(model), mbd.HHT(0.05), dt=2e-3, until=2.0)
    check_impacts(model, trajectory, least=6)


def test_a_foot_opened_before_the_impact_takes_no_impulse_and_a_lock_opened_after_it_takes_part():
    model = kneed_walker()
    start = kneed_walker_start(model)
    trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.6)
    strike = next(event for event in trajectory.events if event.name == "right foot")
    instant = [(event.name, event.kind) for event in trajectory.events if event.row == strike.row]
    assert instant == [("left foot", "opened"), ("right foot", "closed"), ("left knee lock", "opened")]
    before, after = strike.row - 1, strike.row
    assert trajectory["left knee.rate"][after] == pytest.approx(0.0, abs=1e-12), "the lock held through the impact"
    assert trajectory["left shank.end.vy"][after] > 0.01, "the trailing foot was free to leave"
    assert trajectory["right shank.end.vy"][after] == pytest.approx(0.0, abs=1e-12)
    assert trajectory["left foot.force"][after] == 0.0 < trajectory["left foot.force"][before]


def test_a_knee_lock_that_opens_before_the_impact_bends_in_it():
    model = kneed_walker()
    model.constraints = [
        mbd.Unilateral(c.name, c.measure, release=mbd.When(c.release[0].other)) if "lock" in c.name else c
        for c in model.constraints
    ]
    trajectory = mbd.simulate(model, kneed_walker_start(model), mbd.HHT(0.05), dt=2e-3, until=0.6)
    strike = next(event for event in trajectory.events if event.name == "right foot")
    assert abs(trajectory["left knee.rate"][strike.row]) > 0.1


def test_a_contact_opens_as_a_penalty_contact_closes():
    model, a, b = two_balls()
    model.constrain(
        mbd.Penalty("A", mbd.height(a.origin), stiffness=1e4, damping=20.0),
        mbd.Unilateral("B", mbd.height(b.origin), release=mbd.When("A")),
    )
    trajectory = run(model, {"a.displacement": 0.5}, closed=["B"], until=0.5, dt=1e-3)
    assert [(e.name, e.kind) for e in trajectory.events[:2]] == [("A", "closed"), ("B", "opened")]
    assert trajectory["b.displacement"][-1] < -0.01


# forces after the impact --------------------------------------------------------------------------------------------
def test_a_lock_released_only_by_its_rule_may_pull():
    model, a, b = two_balls()
    model.constrain(
        mbd.Unilateral("A", mbd.height(a.origin)), mbd.Unilateral("B", mbd.height(b.origin), release=mbd.When("A"))
    )
    model.apply(mbd.Applied("lift", b.origin, force=(0.0, 30.0, 0.0)))
    trajectory = run(model, {"a.displacement": 0.5}, closed=["B"], until=0.4)
    assert trajectory["B.force"][0] == pytest.approx(G - 30.0)
    assert [(e.name, e.kind) for e in trajectory.events] == [("B", "opened"), ("A", "closed")]


def test_an_impact_on_a_moving_floor_takes_the_speed_of_the_floor():
    model, _body = falling()
    floor = mbd.measure(lambda y, t: y - 0.1 * mbd.sin(5.0 * t), "fall.displacement", "t")
    model.constrain(mbd.Unilateral("floor", floor))
    trajectory = run(model, {"fall.displacement": 0.3}, until=0.3, dt=1e-3)
    (_before, after), *_ = impacts(trajectory)
    t = trajectory.time[after]
    assert trajectory["fall.displacement"][after] == pytest.approx(0.1 * np.sin(5.0 * t), abs=1e-12)
    assert trajectory["fall.rate"][after] == pytest.approx(0.5 * np.cos(5.0 * t), abs=1e-12)
    assert trajectory["floor.gap"][after:].min() > -1e-12


# contacts of one point ----------------------------------------------------------------------------------------------


def test_two_contacts_of_one_point_share_the_blow_and_the_load():
    model, body = falling()
    model.constrain(*(mbd.Unilateral(name, mbd.height(body.origin)) for name in ("one", "two")))
    trajectory = run(model, {"fall.displacement": 1.0})
    assert sum(event.impulse[0] for event in trajectory.events) == pytest.approx(2.0 * np.sqrt(2 * G), rel=1e-9)
    assert trajectory["one.force"][-1] + trajectory["two.force"][-1] == pytest.approx(2.0 * G, rel=1e-9)
