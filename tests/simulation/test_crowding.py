"""Instants are located however many contacts there are; a pile goes on in non-smooth steps, however it is cut."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mbd
from mbd.kernel.codes import NO_IMPACT
from mbd.kernel.events import handling as kernel_events
from tests.simulation.mechanisms import G, kneed_walker, kneed_walker_start

DT = 2e-3


def bouncing(heights, restitution):
    """Balls that fall beside each other, each on a floor of its own."""
    model = mbd.Model("balls apart")
    for k in range(len(heights)):
        ball = mbd.PointMass(f"ball {k}", mass=1.0 + 0.01 * k)
        model.connect(mbd.Prismatic(f"fall {k}", model.ground.origin, ball.origin, axis=(0, 1, 0)))
        model.constrain(mbd.Unilateral(f"floor {k}", mbd.height(ball.origin), restitution=restitution))
    return model, {f"fall {k}.displacement": float(height) for k, height in enumerate(heights)}


def flight(height, restitution, time):
    """Height and speed of one ball, exactly [m, m/s]."""
    begin, speed = 0.0, 0.0
    while True:
        wait = (speed + np.sqrt(speed * speed + 2.0 * G * height)) / G
        if begin + wait > time:
            t = time - begin
            return height + speed * t - 0.5 * G * t * t, speed - G * t
        begin, speed, height = begin + wait, restitution * (G * wait - speed), 0.0


@pytest.mark.parametrize(("count", "restitution"), [(17, 0.6), (40, 0.75)])
def test_balls_that_bounce_apart_are_located_however_many_they_are(count, restitution):
    heights = np.random.default_rng(count).uniform(0.5, 1.0, count)
    model, position = bouncing(heights, restitution)
    run = mbd.simulate(model, mbd.assemble(model, position=position), dt=DT, until=1.2)
    exact = np.array([flight(height, restitution, run.time[-1]) for height in heights])
    assert len(run.events) > 2 * count and run.settings["contact"] == "events" and not run.stats["notes"]
    np.testing.assert_allclose(run.record.q[-1], exact[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.record.v[-1], exact[:, 1], rtol=0, atol=1e-8)


def test_balls_that_strike_all_at_once_until_they_rest_are_located():
    """As many impacts within one step as there are balls, again and again; none goes through another contact."""
    model, position = bouncing(np.full(40, 0.3), 0.8)
    run = mbd.simulate(model, mbd.assemble(model, position=position), dt=DT, until=3.0)
    assert run.settings["contact"] == "events" and len(run.events) > 40 * 40
    np.testing.assert_allclose(run["floor 39.force"][-1], 1.39 * G, rtol=1e-9)


def test_a_wheel_with_many_spokes_is_located():
    """Twenty contacts of one body, of which two are closed at an instant."""
    count, model = 20, mbd.Model("spokes", gravity=mbd.on_slope(0.08))
    wheel = mbd.RigidBody("wheel", mass=1.0, inertia=0.05)
    model.connect(mbd.Planar("road", model.ground.origin, wheel.origin))
    for k in range(count):
        angle = 2.0 * np.pi * k / count
        tip = mbd.touchdown(wheel.point(np.sin(angle), -np.cos(angle)))
        model.constrain(mbd.Unilateral(f"spoke {k}", tip))
    start = mbd.assemble(model, closed=["spoke 0"], position={"road.angle": 0.0}, velocity={"road.angle": -1.0})
    run = mbd.simulate(model, start, dt=DT, until=2.0)
    assert run.settings["contact"] == "events" and sum(event.kind == "closed" for event in run.events) > 4


@cache
def stack(count=4, tilt=0.02):
    """Boxes dropped on each other, tilted by turns."""
    model, below, position = mbd.Model("stack"), mbd.Plane(), {}
    for k in range(count):
        body = mbd.RigidBody(f"box {k}", mass=1.0 + 0.1 * k, inertia=0.02)
        model.connect(mbd.Planar(f"p{k}", model.ground.origin, body.origin))
        for name, x in ("left", -0.2), ("right", 0.2):
            foot = mbd.touchdown(body.point(x, -0.1), below)
            model.constrain(mbd.Unilateral(f"{name} {k}", foot, friction=0.5, restitution=0.3))
        below = mbd.Plane(offset=0.1, frame=body.origin)
        position |= {f"p{k}.y": 0.12 + 0.22 * k, f"p{k}.angle": tilt * (-1) ** k}
    return model, mbd.assemble(model, position=position)


def test_a_stack_goes_on_in_non_smooth_steps_once_its_blows_crowd():
    model, start = stack()
    run = mbd.simulate(model, start, dt=DT, until=0.8)
    since = run.settings["nonsmooth_since"]
    assert run.settings["contact"] == "nonsmooth" and 0.08 < since < 0.2
    assert any(f"until t = {since:.6g} s" in note and "size of dt" in note for note in run.stats["notes"])
    assert f"until t = {since:.6g} s" in str(run)
    located = mbd.simulate(model, start, dt=DT, until=0.08, contact="events")
    assert [e.time for e in located.events] == [e.time for e in run.events if e.time <= 0.08]
    assert min(run[f"{contact.name}.gap"].min() for contact in model.constraints) > -1e-8
    assert np.abs(run.record.v[-1]).max() < 1e-9
    weight = sum(1.0 + 0.1 * k for k in range(4)) * G
    assert run["left 0.force"][-1] + run["right 0.force"][-1] == pytest.approx(weight, rel=1e-6)


def pieces(model, start, cuts, **more):
    """The end of a run made in pieces, and what its last piece was."""
    for until in cuts:
        run = mbd.simulate(model, start, dt=DT, until=until, **more)
        start = run.final
    return run


def same(one, other):
    for name in ("q", "v"):
        np.testing.assert_array_equal(getattr(one.final, name), getattr(other.final, name))
    assert one.settings["contact"] == other.settings["contact"]
    assert one.settings.get("nonsmooth_since") == other.settings.get("nonsmooth_since")


def cuts_of(run, *times):
    """Ends of whole steps of a run near some times, and its end."""
    events = {event.time for event in run.events}
    ends = np.array([time for time in run.time if time not in events])
    return (*(float(ends[np.searchsorted(ends, time)]) for time in times), float(run.time[-1]))


def test_a_stack_cut_before_or_after_its_blows_crowd_moves_the_same():
    model, start = stack()
    whole = mbd.simulate(model, start, dt=DT, until=0.3)
    since = whole.settings["nonsmooth_since"]
    for times in (0.1,), (since - 1.5 * DT,), (since + 1e-9,), (0.1, 0.2):
        same(pieces(model, start, cuts_of(whole, *times)), whole)


def test_who_forces_located_instants_after_the_crowd_gets_them():
    model, start = stack()
    crowded = mbd.simulate(model, start, dt=DT, until=0.5)
    assert crowded.settings["contact"] == "nonsmooth"
    assert mbd.simulate(model, crowded.final, dt=DT, until=0.52, contact="events").settings["contact"] == "events"
    stepped = mbd.simulate(model, crowded.final, dt=DT, until=0.52, contact="nonsmooth")
    np.testing.assert_array_equal(mbd.simulate(model, crowded.final, dt=DT, until=0.52).final.q, stepped.final.q)


def test_where_no_impulses_are_found_the_run_goes_on_from_before_that_blow(monkeypatch):
    """A failure put in by hand from 0.5 s on, in the plain twin, while two more balls lie on the floor."""
    found = kernel_events.switch
    monkeypatch.setattr(kernel_events, "switch", lambda K: NO_IMPACT if K.strategy == 0 and K.time > 0.5 else found(K))
    heights = [0.5, 0.7, 0.0, 0.0]
    model, position = bouncing(heights, 0.6)
    start = mbd.assemble(model, position=position, closed=[word.name for word in model.constraints][2:])
    run = mbd.simulate(model, start, dt=DT, until=1.2, backend="python")
    since = run.settings["nonsmooth_since"]
    assert 0.5 < since < 0.8 and any("locating could not go on" in note for note in run.stats["notes"])
    assert np.abs(run.record.q[-1] - [flight(h, 0.6, 1.2)[0] if h else 0.0 for h in heights]).max() < 10.0 * DT
    same(pieces(model, start, cuts_of(run, 0.4, since - 1.5 * DT, since + DT, 0.9), backend="python"), run)
    with pytest.raises(mbd.SimulationError, match="no forces or impulses"):
        mbd.simulate(model, start, dt=DT, until=1.2, backend="python", contact="events")


@pytest.mark.parametrize("integrator", [mbd.HHT(0.05), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("begin", [-64.0, -1.0, 64.0])
def test_instants_do_not_crowd_because_the_clock_is_below_zero(integrator, begin):
    """No impact was counted before the first one, whatever the time; a walker makes the same steps at any time."""
    walker = kneed_walker()
    start = kneed_walker_start(walker)
    usual, other = (
        mbd.simulate(walker, replace(start, time=time), integrator, dt=4e-3, until=time + 2.0) for time in (0.0, begin)
    )
    assert [(event.kind, event.name) for event in other.events] == [(event.kind, event.name) for event in usual.events]
    assert len(other) == len(usual) and len(usual.events) > 10
    np.testing.assert_allclose([event.time - begin for event in other.events], [event.time for event in usual.events])
    np.testing.assert_allclose(other.final.v, usual.final.v, rtol=1e-9, atol=1e-9)
