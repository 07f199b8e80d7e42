"""Friction against the spin of a contact about its normal: a moment within a limit, which sticks and slips."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd

G, MASS, INERTIA, RHO = 9.81, 2.0, 0.03, 0.02


@lru_cache(maxsize=8)
def pivot(friction, point=False, restitution=0.0):
    """A body on a ball of its own, or on three feet in a row one under the other, which turns about y."""
    model = mbd.Model("pivot")
    body = mbd.RigidBody("body", MASS, (INERTIA, INERTIA, INERTIA))
    if point:
        model.connect(mbd.Cylindrical("float", model.ground.origin, body.origin, axis=(0.0, 1.0, 0.0)))
        foot = mbd.touchdown(body.point(0.0, -0.05, 0.0))
    else:
        model.connect(mbd.Free("float", model.ground.origin, body.origin))
        foot = mbd.sphere_touchdown(body.origin, 0.05)
    model.constrain(mbd.Unilateral("foot", foot, friction=friction, spin_friction=RHO, restitution=restitution))
    return model


@pytest.mark.parametrize("friction", [None, 0.0, 0.3])
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()])
def test_a_pivot_slows_down_and_stops(scheme, friction):
    """ω' = −ρ p/I."""
    model = pivot(friction)
    speed = {"float.angular_velocity.y": 6.0}
    start = mbd.assemble(model, position={"float.y": 0.05}, velocity=speed, closed="foot")
    run = mbd.simulate(model, start, scheme, dt=1e-2, until=0.6)
    rate = RHO * MASS * G / INERTIA
    assert [(event.kind, event.name) for event in run.events] == [("stuck", "foot spin")]
    assert run.events[0].time == pytest.approx(6.0 / rate, abs=1e-11)
    assert run["float.angular_velocity.y"] == pytest.approx(np.maximum(6.0 - rate * run.time, 0.0), abs=1e-11)
    assert run["foot.spin.torque"][0] == pytest.approx(-RHO * MASS * G, rel=1e-12)
    assert run.energy["foot spin friction"][-1] == pytest.approx(-0.5 * INERTIA * 36.0, rel=1e-12)


def test_it_sticks_until_a_moment_is_beyond_its_limit():
    model = pivot(None)
    model = model.without()
    body = model.bodies["body"]
    twist = mbd.Applied("twist", body.origin, torque=(0.0, lambda t: 1.0 * t, 0.0))
    model.apply(twist)
    start = mbd.assemble(model, position={"float.y": 0.05}, closed="foot")
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=5e-3, until=0.6)
    slips = RHO * MASS * G
    assert [(event.kind, event.name) for event in run.events] == [("slipped", "foot spin")]
    assert run.events[0].time == pytest.approx(slips, abs=1e-10)
    spun = 0.5 * (0.6 - slips) ** 2 / INERTIA
    assert run["float.angular_velocity.y"][-1] == pytest.approx(spun, abs=1e-9)


@settings(max_examples=6)
@given(spin=st.floats(-3.0, 3.0), fall=st.floats(0.5, 2.0), restitution=st.sampled_from([0.0, 0.5]))
def test_an_impact_takes_spin_within_the_same_limit(spin, fall, restitution):
    model = pivot(0.0, restitution=restitution)
    speed = {"float.angular_velocity.y": spin, "float.y.rate": -fall}
    start = mbd.assemble(model, position={"float.y": 0.0505}, velocity=speed)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=1.2e-3)
    (blow,) = [event for event in run.events if event.kind == "closed"]
    push = blow.impulse[0]
    taken = min(RHO * push, INERTIA * abs(spin))
    left = abs(spin) - taken / INERTIA
    after = run.at(blow.time)["float.angular_velocity.y"]
    assert after == pytest.approx(np.sign(spin) * left, abs=1e-9)
    assert abs(run.energy.numerical[-1]) < 1e-7
    parts = {(each.part, each.unit) for each in run.impulses}
    assert spin == 0.0 or ("spin", "N m s") in parts


def test_it_is_one_law_with_friction_of_the_point_and_goes_without_either():
    model = pivot(None, point=True)
    start = mbd.assemble(model, position={"float.displacement": 0.05}, velocity={"float.angle": 2.0}, closed="foot")
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-2, until=0.1)
    assert run["float.angle.rate"][-1] == pytest.approx(2.0 - 0.1 * RHO * MASS * G / INERTIA, abs=1e-10)
    bare = pivot(0.3).without("foot friction", "foot spin friction").constraints[0]
    assert (bare.friction, bare.spin_friction) == (0.0, 0.0)
    assert pivot(0.3).parameters["foot.mu_spin"] == RHO


def test_where_nothing_spins_it_is_refused_by_name():
    body = mbd.RigidBody("body", 1.0, 1.0)
    model = mbd.Model("flat")
    model.connect(mbd.Planar("float", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), spin_friction=0.1))
    with pytest.raises(mbd.ModelError, match="'foot', row 'spin' holds no velocity"):
        mbd.assemble(model)
    assert "spin_friction -1 m is negative" in str(
        mbd.Unilateral("foot", mbd.touchdown(body.origin), spin_friction=-1.0).faults()
    )
    faults = mbd.Unilateral("foot", mbd.height(body.origin), spin_friction=0.1).faults()
    assert any("has no spin about a normal" in fault for fault in faults)


@pytest.mark.parametrize("speed", [20.0, 45.0])
def test_the_rest_of_a_fast_spin_is_rest_to_the_last_bit(speed):
    """What is left of it would be as large as all other velocities, beside which steps after it are judged."""
    model = pivot(0.0)
    start = mbd.assemble(model, position={"float.y": 0.05}, velocity={"float.angular_velocity.y": speed}, closed="foot")
    stop = speed * INERTIA / (RHO * MASS * G)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-2, until=stop + 0.1)
    assert [event.time for event in run.events] == [pytest.approx(stop, abs=1e-9)]
    assert run["float.angular_velocity.y"][-1] == pytest.approx(0.0, abs=1e-30)
