"""Stops of a ball joint: a cone of directions and limits of twist, by rows and by springs; what is refused."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mbd

LIMITS = (0.9, 0.5, -0.4)


@cache
def shoulder(law: str, cut: str = "auto"):
    """A heavy arm on a ball joint, whose direction stays in a cone and whose twist between two stops."""
    model = mbd.Model("shoulder", gravity=(2.0, -9.81, 1.0), cut=cut)
    arm = mbd.RigidBody("arm", 2.0, (0.05, 0.01, 0.05), center=(0.0, -0.3, 0.02))
    ball = mbd.Spherical("ball", model.ground.origin, arm.origin, loss=mbd.Viscous(0.02))
    model.connect(ball)
    tilt, more, less = LIMITS
    stops = {"tilt": mbd.cone(ball, tilt), "outward": mbd.twist(ball, more), "inward": mbd.twist(ball, less)}
    for name, measure in stops.items():
        model.constrain(
            mbd.Unilateral(name, measure, restitution=0.3)
            if law == "rows"
            else mbd.Penalty(name, measure, stiffness=2e3, damping=1.0, release="pull")
        )
    start = {"ball.orientation": ("yzx", (0.1, 0.4, 0.2))}
    return model, mbd.assemble(model, start, {"ball.angular_velocity": (4.0, 4.0, -3.0)})


def turned(run):
    """(tilt, twist about y) of the arm by scipy's rotations."""
    q = np.array(run["ball.orientation"])
    turn = Rotation.from_quat(q[:, [1, 2, 3, 0]])
    tilt = np.arccos(np.clip(turn.apply([0.0, 1.0, 0.0])[:, 1], -1.0, 1.0))
    twist = 2.0 * np.arctan2(q[:, 2], q[:, 0])
    return tilt, (twist + np.pi) % (2.0 * np.pi) - np.pi


@pytest.mark.parametrize("law", ["rows", "springs"])
def test_a_shoulder_stays_within_its_cone_and_its_twist(law):
    run = mbd.simulate(*shoulder(law), mbd.RadauIIA() if law == "rows" else mbd.HHT(0.05), dt=2e-3, until=1.0)
    assert {event.name for event in run.events if event.kind == "closed"} >= {"tilt", "outward"}
    tilt, twist = turned(run)
    allowed = 1e-8 if law == "rows" else 0.08
    assert tilt.max() < LIMITS[0] + allowed
    assert LIMITS[2] - allowed < twist.min() < twist.max() < LIMITS[1] + allowed
    np.testing.assert_allclose(run["tilt.gap"], LIMITS[0] - tilt, atol=1e-7)
    np.testing.assert_allclose(run["outward.gap"], LIMITS[1] - twist, atol=1e-12)
    np.testing.assert_allclose(run["inward.gap"], twist - LIMITS[2], atol=1e-12)
    assert np.max(np.abs(run.energy.numerical)) < 1e-2


@pytest.mark.slow
def test_stops_of_a_cut_joint_are_those_of_the_tree():
    runs = [mbd.simulate(*shoulder("rows", cut), mbd.RadauIIA(), dt=2e-3, until=0.5) for cut in ("auto", "all")]
    assert [event.name for event in runs[0].events] == [event.name for event in runs[1].events]
    np.testing.assert_allclose(*[run.at(0.45)["arm.center"] for run in runs], atol=1e-6)


def test_what_is_no_limit_is_refused():
    ground, arm = mbd.Model("m").ground, mbd.RigidBody("arm", 1.0, (1.0, 1.0, 1.0))
    ball = mbd.Spherical("ball", ground.origin, arm.origin)
    slide = mbd.Prismatic("slide", ground.origin, arm.origin)
    for make, fault in (
        (lambda: mbd.cone(ball, 4.0), "'ball' must be above 0 and below π"),
        (lambda: mbd.cone(arm, 1.0), "such as an mbd.Spherical"),
        (lambda: mbd.twist(ball, 0.0), "within ±π"), (lambda: mbd.twist(slide, 0.3), "'slide' does not turn"),
        (lambda: mbd.cone(ball, 1.0, (0, 0, 0)), "axis of the cone of 'ball'"),
    ):  # fmt: skip
        with pytest.raises(mbd.ModelError, match=fault):
            make()


def test_a_twist_is_known_next_to_half_a_turn():
    model, _ = shoulder("rows")
    for w in (1e-3, 1e-5, 1e-8):
        for p in (0.3, -1e-2):
            rest = np.sqrt(1.0 - w * w - p * p)
            quaternion = (w, 0.6 * rest, p, 0.8 * rest)
            start = mbd.assemble(model, {"ball.orientation": quaternion}, open=["tilt", "outward", "inward"])
            run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-9, until=1e-9)
            twist = 2.0 * np.arctan2(p, w) if p > 0.0 else 2.0 * np.arctan2(-p, -w)
            twist -= 2.0 * np.pi * np.round(twist / (2.0 * np.pi))
            assert run["outward.gap"][0] == pytest.approx(LIMITS[1] - twist, abs=1e-15 / (p * p))


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize(("stop", "rate", "dt"), [(3.0, 3.0, 0.05), (3.1, 8.0, 0.05), (2.9, 7.0, 0.1)])
def test_a_step_over_a_stop_and_half_a_turn_meets_it_or_ends_the_run_by_name(stop, rate, dt, contact):
    """The gap is positive before and after it, unless a step ends between; with a smaller step the stop is met."""
    model = mbd.Model("twisting", gravity=(0.0, 0.0, 0.0))
    top = mbd.RigidBody("top", 1.0, (0.1, 0.1, 0.05))
    hip = mbd.Spherical("hip", model.ground.origin, top.origin)
    model.connect(hip)
    model.constrain(mbd.Unilateral("stop", mbd.twist(hip, stop)))
    start = mbd.assemble(model, {}, {"hip.angular_velocity.y": rate})
    for scheme in (mbd.HHT(), mbd.RungeKutta853()):
        run = mbd.simulate(model, start, scheme, dt=dt, until=2.0, contact=contact, on_failure="return")
        if not [event for event in run.events if event.kind == "closed"]:
            assert "the angle of 'stop' jumps past zero, as a twist does at half a turn" in run.message
            assert abs(run.time[-1] - stop / rate) <= dt
        fine = mbd.simulate(model, start, scheme, dt=0.01, until=0.5 + stop / rate, contact=contact)
        assert fine.success and fine.events[0].kind == "closed"


def test_a_twist_that_jumps_past_its_stop_at_half_a_turn_ends_the_run_by_name():
    model = mbd.Model("twisting", gravity=(0.0, 0.0, 0.0))
    top = mbd.RigidBody("top", 1.0, (0.1, 0.1, 0.05))
    hip = mbd.Spherical("hip", model.ground.origin, top.origin)
    model.connect(hip)
    model.constrain(mbd.Unilateral("stop", mbd.twist(hip, -2.0)))
    start = mbd.assemble(model, {}, {"hip.angular_velocity.y": 3.0})
    for scheme in (mbd.HHT(), mbd.RadauIIA(), mbd.RungeKutta853()):
        for contact in ("events", "nonsmooth"):
            run = mbd.simulate(model, start, scheme, dt=0.01, until=2.0, contact=contact, on_failure="return")
            assert run.stats["steps"] > 90
            assert "the angle of 'stop' jumps past zero, as a twist does at half a turn" in run.message
