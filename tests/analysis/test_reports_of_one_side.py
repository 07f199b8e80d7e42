"""Reports of machines without left and right feet: a ball, a hopper on a spring, a wheel of spokes."""

import math

import pytest

import mbd


def rimless_wheel(spokes=8, until=6.0):
    """A wheel that rolls down a slope: step length 2 l sin α, the same as its stride."""
    model = mbd.Model("rimless wheel", gravity=mbd.on_slope(0.08))
    hub = mbd.RigidBody("hub", mass=1.0, inertia=0.3)
    model.connect(mbd.Planar("float", model.ground.origin, hub.origin))
    for k in range(spokes):
        angle = math.pi * (2.0 * k / spokes - 0.5)
        model.constrain(
            mbd.Unilateral(f"spoke {k}", mbd.touchdown(hub.point(math.cos(angle), math.sin(angle), name=f"tip {k}")))
        )
    speed = {"float.angle": -1.0, "float.x": 1.0, "float.y": 0.0}
    start = mbd.assemble(model, {"float.y": 1.0}, speed, closed=["spoke 0"])
    return mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=until)


def test_each_spoke_of_a_wheel_makes_a_stride():
    run = rimless_wheel()
    report, strikes = mbd.gait_report(run), [event for event in run.events if event.kind == "closed"]
    assert report.heads == ("quantity", "all") and len(report.walks[0].sides[0].strides) == len(strikes)
    assert report["stride length"]["all"] == pytest.approx(2.0 * math.sin(math.pi / 8.0), rel=1e-9)
    times = [0.0, *(event.time for event in strikes)]
    assert report["stride time"]["all"] == pytest.approx((times[-1] - times[0]) / len(strikes), rel=1e-12)
    assert report["cadence"]["all"] == pytest.approx(60.0 / report["stride time"]["all"], rel=0.1)


def test_a_body_that_hops_has_stance_and_swing(tmp_path):
    model = mbd.Model("hopper")
    body = mbd.PointMass("body", 2.0)
    model.connect(mbd.Translation("p", model.ground.origin, body.origin))
    model.constrain(mbd.Penalty("toe", mbd.touchdown(body.origin), 2000.0, 0.0))
    start = mbd.assemble(model, {"p.y": 0.1, "p.x": 0.0}, {"p.x": 0.5, "p.y": 0.0})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=2.0)
    report = mbd.gait_report(run)
    flight = 2.0 * math.sqrt(0.2 / 9.81)
    assert report["stride length"]["all"] == pytest.approx(0.5 * report["stride time"]["all"], rel=1e-9)
    assert report["swing"]["all"] == pytest.approx(100.0 * flight / report["stride time"]["all"], rel=1e-6)
    assert report["normal impulse"]["all"] == pytest.approx(2.0 * 9.81 * report["stride time"]["all"], rel=1e-6)
    own = mbd.gait_report(run, sides="toe")
    assert own["stance"]["toe"] == report["stance"]["all"] and own.heads == ("quantity", "toe")
    report.plot(tmp_path / "hopper.png")
    assert report.page(tmp_path / "hopper.html").exists() and report.to_csv(tmp_path / "hopper.csv").exists()
    both = mbd.gait_report(run, rimless_wheel())
    assert both.heads == ("quantity", "hopper: all", "rimless wheel: all")


def test_a_machine_without_feet_is_told_what_a_foot_is():
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
    model = mbd.Model("pendulum")
    model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start))
    swing = mbd.simulate(model, mbd.assemble(model), mbd.HHT(), dt=0.1, until=0.2, backend="python")
    with pytest.raises(mbd.TrajectoryError, match="a report needs a foot, a contact of a point of a body"):
        mbd.gait_report(swing)
