"""Balls on ground that moves with time: case j10, paddles, mats and waves."""

import numpy as np
import pytest
from scipy.optimize import brentq

import mbd
from tests.helpers import one_body
from tests.problems import case

J10 = case("j10-chatter-on-vibrating-table")
G, M = J10.definition["g"], J10.definition["m"]


def ball_on(ground, mass=M, gravity=(0.0, -G, 0.0), axes="y", **contact):
    """A point over a ground, with the contact 'table'."""
    model, ball = one_body(mbd.PointMass("ball", mass=mass), mbd.Translation, "flight", gravity=gravity, axes=axes)
    model.constrain(mbd.Unilateral("table", mbd.touchdown(ball.origin, ground), **contact))
    return model


def shaken(A, w, **contact):
    return ball_on(lambda t: A * mbd.sin(w * t), **contact)


# a table that goes up and down ----------------------------------------------------------------------------------------
def table_of_mass(A, w):
    """The table as a body that is driven, with the plane on it."""
    model = mbd.Model("driven table", gravity=(0.0, -G, 0.0))
    table, ball = mbd.PointMass("plate", mass=5.0), mbd.PointMass("ball", mass=M)
    drive = mbd.Prismatic("drive", model.ground.origin, table.origin, axis=(0, 1, 0))
    model.connect(drive, mbd.Translation("flight", model.ground.origin, ball.origin, axes="y"))
    model.constrain(
        mbd.Bilateral("shaker", drive, value=lambda t: A * mbd.sin(w * t)),
        mbd.Unilateral("table", mbd.touchdown(ball.origin, mbd.Plane(frame=table.origin))),
    )
    return model


@pytest.mark.parametrize("dt", [1e-3, 1e-4])
@pytest.mark.parametrize("build", [shaken, table_of_mass])
def test_it_lifts_off_when_the_table_falls_faster(build, dt):
    w = J10.definition["w"]
    model = build(1.25 * G / w**2, w)
    run = mbd.simulate(model, mbd.assemble(model, closed="table"), mbd.HHT(0.05), dt=dt, until=0.0105)
    (left,) = run.events
    assert left.kind == "opened"
    assert left.time == pytest.approx(J10["first lift-off time"].value, abs=J10["first lift-off time"].accuracy)


def bounces(A, w, e, height, count):
    """(time, velocity before, after) of a ball on a table z = A sin wt, in closed form between impacts."""
    t, y, v, found = 0.0, height, 0.0, []
    for _ in range(count):

        def gap(later, t=t, y=y, v=v):
            s = later - t
            return y + v * s - 0.5 * G * s * s - A * np.sin(w * later)

        first = t + 1e-6
        while gap(first + 1e-4) > 0.0:
            first += 1e-4
        hit = brentq(gap, first, first + 1e-4, xtol=1e-15)
        before, table = v - G * (hit - t), A * w * np.cos(w * hit)
        t, y, v = hit, A * np.sin(w * hit), (1.0 + e) * table - e * before
        found.append((hit, before, v))
    return found


@pytest.mark.parametrize("e", [0.6, 1.0])
def test_a_paddle_gives_the_ball_what_the_relative_velocity_says(e):
    A, w, height = 0.05, 12.0, 0.4
    model = shaken(A, w, restitution=e, friction=0.0)
    start = mbd.assemble(model, position={"flight.y": height})
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.85)
    closings = [event for event in run.events if event.kind == "closed"]
    assert len(closings) >= 2
    lost = given = 0.0
    for event, (time, before, after) in zip(closings, bounces(A, w, e, height, len(closings)), strict=True):
        assert event.time == pytest.approx(time, abs=1e-8)
        assert run["flight.rate"][event.row - 1 : event.row + 1] == pytest.approx([before, after], abs=1e-7)
        table = A * w * np.cos(w * time)
        loss = 0.5 * M * ((before - table) ** 2 - (after - table) ** 2)
        assert event.energy_loss == pytest.approx(loss, abs=1e-7)
        lost, given = lost + loss, given + M * (after - before) * table
    energy = run.energy
    assert sum(part.energy[-1] for part in energy.of("impact")) == pytest.approx(-lost, abs=1e-6)
    assert energy.sums["drives at impacts"] == pytest.approx(given, abs=1e-6)
    assert abs(energy.sums["numerical"]) < 1e-6


def test_the_table_does_the_work_that_lifts_a_mass():
    """Up by 0.2 m in a second along a smooth ramp; the ledger names the table."""
    model = ball_on(lambda t: 0.1 * (1.0 - mbd.cos(np.pi * t)))
    run = mbd.simulate(model, mbd.assemble(model, closed="table"), mbd.HHT(0.05), dt=1e-3, until=1.0)
    assert not run.events
    assert run.energy.sums["table"] == pytest.approx(M * G * 0.2, rel=1e-5)
    assert abs(run.energy.sums["numerical"]) < 1e-5


def test_a_plane_that_rises_evenly_is_a_lift():
    rising = ball_on(mbd.Plane(velocity=(0.0, 0.5)), restitution=0.5, friction=0.0)
    still = ball_on(None, restitution=0.5, friction=0.0)
    up = mbd.simulate(rising, mbd.assemble(rising, position={"flight.y": 0.5}), dt=1e-3, until=0.8)
    down = mbd.assemble(still, position={"flight.y": 0.5}, velocity={"flight.y": -0.5})
    rest = mbd.simulate(still, down, dt=1e-3, until=0.8)
    assert [event.time for event in up.events] == pytest.approx([event.time for event in rest.events], abs=1e-9)
    np.testing.assert_allclose(up["flight.y"][-1] - 0.4, rest["flight.y"][-1], rtol=0, atol=1e-9)


def test_a_mat_on_the_table_is_charged_apart_from_the_table():
    model, ball = one_body(mbd.PointMass("ball", mass=M), mbd.Translation, "flight", title="mat", axes="y")
    pad = mbd.touchdown(ball.origin, lambda t: 0.02 * mbd.sin(20.0 * t))
    model.constrain(mbd.Penalty("mat", pad, stiffness=5e3, damping=20.0, release="pull"))
    run = mbd.simulate(model, mbd.assemble(model, position={"flight.y": 0.1}), mbd.HHT(0.0), dt=2e-4, until=1.0)
    energy = run.energy
    assert np.max(energy["mat"]) < 1e-3, "a mat that only takes"
    assert abs(energy.sums["surface of mat"]) > 0.1
    assert np.max(np.abs(energy.numerical)) < 2e-4


def test_a_point_that_sticks_on_a_wave_rides_it_and_feels_its_slope():
    """The material of the ground goes straight up and down: x stays, y = H(x, t), and the force is m (g + H_tt)."""
    A, k, w = 0.05, 2.0, 6.0
    model = ball_on(lambda x, t: A * mbd.sin(k * x - w * t), axes="xy")
    start = mbd.assemble(model, closed="table", position={"flight.x": 0.3})
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=1e-3, until=2.0)
    assert not run.events
    phase = 0.3 * k - w * run.time
    np.testing.assert_allclose(run["flight.x"], 0.3, rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["flight.y"], A * np.sin(phase), rtol=0, atol=1e-12)
    weight, slope = M * (G - A * w**2 * np.sin(phase)), A * k * np.cos(phase)
    size = np.sqrt(1.0 + slope**2)
    np.testing.assert_allclose(run["table.force"], weight / size, rtol=0, atol=2e-3)
    np.testing.assert_allclose(np.ravel(run["table.friction"]), weight * slope / size, rtol=0, atol=2e-3)
    assert abs(run.energy.sums["numerical"]) < 1e-4


@pytest.mark.parametrize(("axes", "friction"), [("xy", mbd.Stribeck(0.4, 0.2, 0.5) + mbd.Viscous(0.05)), ("xyz", 0.3)])
def test_the_ledger_closes_on_ground_that_tilts_as_feet_slide_over_it(axes, friction):
    """Friction acts along the slope of now, which is not that where the foot came down."""
    model, point = one_body(mbd.PointMass("foot", M), mbd.Translation, "place", axes=axes)
    hill = {"xy": lambda x, t: 0.3 * x * mbd.sin(3.0 * t), "xyz": lambda x, z, t: 0.3 * (x + z * t) * mbd.sin(3.0 * t)}
    model.constrain(mbd.Unilateral("slope", mbd.touchdown(point.origin, hill[axes]), friction=friction))
    start = mbd.assemble(model, velocity={f"place.{axis}": 3.0 for axis in axes[::2]}, closed="slope")
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=1.2)
    assert run.energy.sums["slope friction"] < -1.0 < 1.0 < np.max(np.abs(run.energy["slope"]))
    assert np.max(np.abs(run.energy.numerical)) < 1e-9
