"""Impacts: momentum, complementarity, energy, restitution, and the rules that release contacts at one."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.kernel.contact.active_set import ActiveSetManager
from tests.comparisons import at_least, compared
from tests.simulation.mechanisms import G, box, falling, kneed_walker, kneed_walker_start, point, run, two_balls


def impacts(trajectory):
    """(row before, row after) of every impact."""
    rows = sorted({event.row for event in trajectory.events if event.impulse.any()})
    return [(row - 1, row) for row in rows]


def check_impact(model, trajectory, before, after):
    """M (v⁺ − v⁻) is made by impulses of rows alone, and rows and impulses complement each other."""
    mechanism, record = mechanism_of(model), trajectory.record
    manager = ActiveSetManager(mechanism.equations)
    assert record.time[before] == record.time[after]
    np.testing.assert_array_equal(record.q[before], record.q[after])
    anchors = trajectory.columns.anchors[after]
    parameters = mechanism.parameters()
    left, right = (
        mechanism.acceleration_terms(record.time[k], record.q[k], record.v[k], parameters, anchors)
        for k in (before, after)
    )
    change = record.v[after] - record.v[before]
    instant = [event for event in trajectory.events if event.row == after]
    struck = {event.name: event for event in instant if event.kind == "closed"}
    closed = {c.name for c, flag in zip(manager.contacts, record.closed[after], strict=True) if flag}
    # contacts that took part: closed after it, struck, or held through it and opened after it
    through = closed | set(struck)
    rules = {c.name: c for c in manager.contacts}
    for event in instant:
        if event.kind == "opened" and any(late for _, late in rules[event.name].when):
            through.add(event.name)
    rows = [k for k, row in enumerate(mechanism.equations.rows) if row.contact < 0 or row.owner in through]
    B = left.B[rows]
    impulse, *_ = np.linalg.lstsq(B.T, left.M @ change, rcond=None)
    size = max(1.0, np.abs(left.M @ change).max())
    np.testing.assert_allclose(B.T @ impulse, left.M @ change, rtol=0, atol=1e-12 * size, err_msg="momentum")
    speed = max(1.0, np.abs(record.v[before]).max())
    by_row = dict(zip(rows, impulse, strict=True))
    for name in through:
        contact = rules[name]
        normal = contact.rows[0]
        slow, fast = left.rate[normal], right.rate[normal]
        wanted = fast + contact.restitution * slow if name in struck else fast
        if contact.opens_on == "pull":
            assert by_row[normal] > -1e-12 * size, "an impulse pushes"
            assert wanted > -1e-12 * speed, "no approach is left"
            assert abs(by_row[normal] * wanted) < 1e-12 * size * speed
        else:
            assert abs(wanted) < 1e-12 * speed
        for k in contact.rows[1:]:
            assert abs(right.rate[k]) < 1e-12 * speed, "a sticking foot stays"
        if name in struck:
            np.testing.assert_allclose(
                [by_row[k] for k in contact.rows], struck[name].impulse, rtol=0, atol=1e-9 * size
            )
    loss = trajectory.energy.kinetic[before] - trajectory.energy.kinetic[after]
    assert loss > -1e-12 * max(1.0, trajectory.energy.kinetic[before])
    reported = sum(event.energy_loss for event in instant)
    assert reported == pytest.approx(loss, rel=1e-9, abs=1e-12 * max(1.0, trajectory.energy.kinetic[before]))


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
    pairs = impacts(trajectory)
    assert pairs
    for before, after in pairs:
        if trajectory.record.time[after] - trajectory.record.time[before - 1] > 1e-5:  # not yet rattling to rest
            check_impact(model, trajectory, before, after)


@at_least(8)
@settings(max_examples=15)
@given(angle=st.floats(0.05, 1.2), spin=speeds, forward=speeds)
def test_a_box_whose_corner_sticks_keeps_momentum_and_complements(angle, spin, forward):
    model = same_box(None, 0.0)
    position = {"place.y": 1.0, "place.angle": angle}
    velocity = {"place.x": forward, "place.y": 0.0, "place.angle": spin}
    trajectory = run(model, position, velocity, until=("left", 2.0), on_failure="return")
    if trajectory.success:  # a corner that sticks without limit may have no consistent forces afterwards
        check_impact(model, trajectory, *impacts(trajectory)[0])
        compared()
    else:
        assert "whatever its force" in trajectory.message


def test_heel_strike_and_knee_lock_of_a_walker_keep_momentum_and_complement():
    model = kneed_walker()
    trajectory = mbd.simulate(model, kneed_walker_start(model), mbd.HHT(0.05), dt=2e-3, until=2.0)
    pairs = impacts(trajectory)
    assert len(pairs) >= 6
    for before, after in pairs:
        check_impact(model, trajectory, before, after)


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
def test_a_contact_whose_force_would_pull_opens_at_that_instant():
    model, body = point()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    model.apply(mbd.Applied("lift", body.origin, force=(0.0, lambda t: 20.0 * t, 0.0)))
    trajectory = run(model, closed=["floor"], dt=0.01)
    (event,) = trajectory.events
    assert event.kind == "opened" and event.time == pytest.approx(G / 20.0, abs=1e-12)
    assert trajectory["floor.force"].min() >= 0.0
    height = 20.0 / 6.0 * (1.0 - G / 20.0) ** 3
    assert trajectory["place.y"][-1] == pytest.approx(height, rel=1e-3)


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
