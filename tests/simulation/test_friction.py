"""Dry friction: its laws along runs, and scenes whose motion is known."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mbd
from tests.helpers import assert_second_order
from tests.simulation.frictions import block, brick, check_friction, driven, rod
from tests.simulation.mechanisms import G, pendulum, run

same_brick, same_block, same_rod = cache(brick), cache(block), cache(rod)
SCHEMES = {
    "hht": mbd.HHT(0.05), "generalized alpha": mbd.GeneralizedAlpha(0.8), "newmark": mbd.Newmark(),
    "hht index 3": mbd.HHT(0.05, formulation="index3"),
}  # fmt: skip
every_scheme = pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)


# a block on a slope -------------------------------------------------------------------------------------------------
@every_scheme
@pytest.mark.parametrize(
    ("slope", "uphill", "kind"),
    [(0.1, 0.0, ""), (0.29, 0.0, ""), (0.4, 0.0, ""), (0.2, 2.0, "stuck"), (0.6, 2.0, "slipped")],
)
def test_a_block_on_a_slope_stays_slides_down_or_comes_back_as_the_angle_of_friction_says(slope, uphill, kind, scheme):
    """At rest, or pushed uphill: it stops where its speed is used up, and stays below the angle of friction."""
    model = same_block(0.3, slope)
    trajectory = run(model, velocity={"place.x": -uphill}, closed=["foot"], until=1.5, dt=0.01, integrator=scheme)
    assert [(event.kind, event.name) for event in trajectory.events] == ([(kind, "foot")] if kind else [])
    stop = uphill / (G * (np.sin(slope) + 0.3 * np.cos(slope)))
    down = max(G * (np.sin(slope) - 0.3 * np.cos(slope)), 0.0)
    rising = trajectory.time <= stop * (1.0 + 1e-9)
    assert trajectory.events == [] or trajectory.events[0].time == pytest.approx(stop, rel=1e-12)
    top, late = -0.5 * uphill * stop, trajectory.time[~rising] - stop
    np.testing.assert_allclose(trajectory["place.x"][~rising], top + 0.5 * down * late**2, rtol=1e-9, atol=1e-11)
    drag = -0.3 * trajectory["foot.force"] if down else np.full(len(trajectory), -2.0 * G * np.sin(slope))
    np.testing.assert_allclose(trajectory["foot.friction"][~rising], drag[~rising], rtol=1e-9)
    check_friction(model, trajectory)


def test_the_coefficient_of_friction_is_a_parameter_of_the_run():
    model = same_block(0.3, 0.25)
    assert model.parameters["foot.mu"] == 0.3
    start = mbd.assemble(model, closed=["foot"])
    held, sliding = (mbd.simulate(model, start, dt=0.01, until=1.0, parameters={"foot.mu": mu}) for mu in (0.3, 0.2))
    assert held["place.x"][-1] == 0.0
    assert sliding["place.x"][-1] == pytest.approx(0.5 * G * (np.sin(0.25) - 0.2 * np.cos(0.25)), rel=1e-9)
    assert sliding.stats["notes"] == []


def test_the_loss_of_friction_is_the_force_times_the_way():
    """The column of the ledger is −μ p ∫|v| dt, and what is left over falls with the square of the step."""
    model = same_block(0.3, 0.0)
    for dt in 0.02, 0.01:
        trajectory = run(model, velocity={"place.x": 2.0}, closed=["foot"], dt=dt)
        way = trajectory["place.x"][-1]
        assert trajectory.energy["foot friction"][-1] == pytest.approx(-0.3 * 2.0 * G * way, rel=1e-12)
        assert np.abs(trajectory.energy.numerical).max() < 1e-12  # quadratic motion: no error at all

    def left_over(dt):
        return run(pendulum(mbd.Coulomb(0.4)), {"hinge.angle": 1.0}, dt=dt, until=2.0).energy.numerical[-1]

    assert_second_order(left_over, 8e-3)


# stick and slip -----------------------------------------------------------------------------------------------------
def stick_slip(until, force=3.0, k=20.0):
    """(instant, place, kind) of every change of the driven mass, event by event with DOP853."""

    def pull(t, x):
        return 4.0 * np.sin(3.0 * t) - k * x

    def away(t, x, sign):
        return sign * pull(t, x) - force

    found, t, x, v = [], 0.0, 0.0, 0.0
    while True:
        grid = np.linspace(t, until, 20001)
        sign, first = 0.0, np.inf
        for trial in (1.0, -1.0):  # it rests until the pull exceeds the friction
            beyond = np.flatnonzero(away(grid, x, trial) > 0.0)
            if len(beyond) and grid[beyond[0]] < first:
                sign, first = trial, grid[beyond[0]]
        if sign == 0.0:
            return found
        if first > grid[1]:
            t = brentq(away, first - grid[1] + grid[0], first, args=(x, sign), xtol=1e-14)
        found.append((t, x, "slipped"))

        def stop(t, y):
            return y[1]

        stop.terminal, stop.direction = True, -sign
        while True:
            solved = solve_ivp(
                lambda t, y, s=sign: [y[1], pull(t, y[0]) - s * force], (t, until), [x, v + sign * 1e-300], "DOP853",
                events=stop, rtol=1e-12, atol=1e-14, first_step=1e-4,
            )  # fmt: skip
            t, x, v = solved.t[-1], solved.y[0, -1], 0.0
            if solved.status == 0:
                return found
            if abs(pull(t, x)) <= force:
                found.append((t, x, "stuck"))
                break
            sign = -sign
            stop.direction = -sign
            found.append((t, x, "slipped"))


def test_a_driven_mass_sticks_and_slips_at_the_instants_of_an_event_by_event_solution():
    expected = stick_slip(3.0)
    assert [kind for *_, kind in expected].count("stuck") >= 2
    model = driven()

    def error(dt):
        trajectory = mbd.simulate(model, mbd.assemble(model), mbd.HHT(0.05), dt=dt, until=3.0)
        assert [event.kind for event in trajectory.events] == [kind for *_, kind in expected]
        place = [trajectory["rail.displacement"][event.row] for event in trajectory.events]
        found = np.array([[event.time for event in trajectory.events], place])
        check_friction(model, trajectory)
        return np.linalg.norm(found - np.array([[t, x] for t, x, _ in expected]).T, axis=1)

    assert_second_order(error, 0.01)


def test_smoothed_friction_tends_to_the_set_valued_one():
    exact = run(pendulum(mbd.Coulomb(0.4)), {"hinge.angle": 1.0}, dt=5e-4, until=2.0)
    gaps = []
    for smoothing in 0.3, 0.1, 0.03:
        smooth = run(pendulum(mbd.Coulomb(0.4, smoothing)), {"hinge.angle": 1.0}, dt=5e-4, until=2.0)
        gaps.append(np.abs(smooth.at([2.0])["hinge.angle"] - exact.at([2.0])["hinge.angle"])[0])
    assert gaps[0] > 1.5 * gaps[1] > 2.25 * gaps[2] > 0.0


# bodies that slide, tip, stand --------------------------------------------------------------------------------------
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 1, 0, 2)])
def test_a_box_slides_on_two_feet_and_both_stop_at_once(order):
    model = same_brick(0.3, order=order)
    trajectory = run(model, {"place.y": 0.15}, {"place.x": 2.0}, closed=["left", "right"])
    stop = 2.0 / (0.3 * G)
    assert {(e.kind, e.name) for e in trajectory.events} == {("stuck", "left"), ("stuck", "right")}
    assert all(event.time == pytest.approx(stop, rel=1e-10) for event in trajectory.events)
    assert trajectory["place.x"][-1] == pytest.approx(stop, rel=1e-10)
    loads = trajectory["left.force"][1], trajectory["right.force"][1]
    brake = 0.3 * 2.0 * G * 0.15 / 0.5  # friction times its lever presses the leading foot
    np.testing.assert_allclose(loads, [G - brake, G + brake], rtol=1e-9)
    check_friction(model, trajectory)


def test_a_tall_box_tips_over_where_it_would_slide_if_it_were_flat():
    """It tips before it slides where μ exceeds width over height, and the corner it turns about sticks."""
    flat, tall = same_brick(0.8, slope=0.75), same_brick(0.8, slope=0.75, height=0.4)
    low, high = (
        run(model, {"place.y": height}, closed=["left", "right"], until=0.3)
        for model, height in ((flat, 0.15), (tall, 0.4))
    )
    assert abs(low["place.angle"]).max() < 1e-9 < low["place.x"][-1]
    assert ("opened", "left") in [(e.kind, e.name) for e in high.events]
    assert high["place.angle"][-1] < -0.1
    check_friction(tall, high)


@settings(max_examples=25)
@given(
    mu=st.sampled_from([0.1, 0.5, 1.5]), restitution=st.sampled_from([0.0, 0.4, 1.0]),
    law=st.sampled_from(["newton", "poisson", "sequential"]), angle=st.floats(-3.0, 3.0), forward=st.floats(-3.0, 3.0),
    spin=st.floats(-4.0, 4.0),
)  # fmt: skip
def test_a_thrown_box_keeps_the_laws_of_friction_and_never_gains_energy(mu, restitution, law, angle, forward, spin):
    model = same_brick(mu, restitution)
    trajectory = run(
        model, {"place.y": 0.5, "place.angle": angle}, {"place.x": forward, "place.angle": spin}, until=0.7, impact=law
    )
    check_friction(model, trajectory)
    energy = trajectory.energy.kinetic + trajectory.energy.potential
    jumps = np.diff(energy)[np.diff(trajectory.time) == 0.0]
    assert np.all(jumps < 1e-9 * energy[0])
    assert energy.max() - energy[0] < 2e-3 * energy[0]


def test_a_foot_closes_while_another_sticks():
    """A rod stands on its tip that sticks, falls, and its other end strikes."""
    model = same_rod(0.8)
    body = model.bodies["rod"]
    if len(model.constraints) == 1:
        model.constrain(mbd.Unilateral("end", mbd.touchdown(body.point(0.5, 0.0)), friction=0.8))
    start = {"place.y": 0.5 * np.sin(0.5), "place.angle": 0.5, "place.x": 0.0}
    trajectory = run(model, start, closed=["tip"], until=1.0)
    closing = next(event for event in trajectory.events if event.name == "end")
    assert closing.kind == "closed"
    assert trajectory["tip.force"][-1] + trajectory["end.force"][-1] == pytest.approx(G, rel=1e-9)
    check_friction(model, trajectory)


def test_a_sliding_contact_that_is_lifted_opens_and_its_friction_ends():
    model = block(0.4)
    model.apply(mbd.Applied("lift", model.bodies["block"].origin, force=(0.0, lambda t: 40.0 * t, 0.0)))
    trajectory = run(model, velocity={"place.x": 5.0}, closed=["foot"])
    (event,) = trajectory.events
    assert event.kind == "opened"
    assert event.time == pytest.approx(2.0 * G / 40.0, abs=1e-12)
    assert trajectory["foot.friction"][event.row :].max() == 0.0 == trajectory["foot.force"][event.row]
    check_friction(model, trajectory)


def test_a_start_that_touches_and_slides_closes_without_a_blow():
    trajectory = run(block(0.3), velocity={"place.x": 1.0}, until=0.2)
    assert [(event.kind, event.time) for event in trajectory.events] == [("closed", 0.0)]
    assert trajectory["place.x.rate"][-1] == pytest.approx(1.0 - 0.3 * G * 0.2, rel=1e-10)


# where no force is consistent ---------------------------------------------------------------------------------------
def test_a_rod_that_jams_as_its_tip_strikes_ends_with_the_name_of_the_contact():
    position, velocity = {"place.y": 0.5 * np.sin(1.0) + 1e-3, "place.angle": 1.0}, {"place.x": -8.0}
    trajectory = run(same_jam(), position, velocity, until=0.5, dt=1e-3, on_failure="return")
    assert trajectory.success or "Painlevé: no consistent contact force at 'tip'" in trajectory.message
    assert np.isfinite(trajectory["tip.force"]).all() and trajectory["tip.force"].min() >= 0.0
    energy = trajectory.energy.kinetic + trajectory.energy.potential
    assert energy.max() < energy[0] * (1 + 1e-9)


@cache
def same_jam():
    return rod(1.6)


@pytest.mark.parametrize("spin", [0.0, -1.0, -2.0, -4.0, -6.0])
def test_a_rod_that_slides_towards_the_jam_has_finite_forces_that_push(spin):
    """It is started beside the jam and turns into it: it sticks, lifts off or ends by name, but never by a number."""
    angle = 1.35
    position = {"place.y": 0.5 * np.sin(angle), "place.angle": angle}
    velocity = {
        "place.x": -3.0 - 0.5 * spin * np.sin(angle), "place.y": 0.5 * spin * np.cos(angle), "place.angle": spin,
    }  # fmt: skip
    trajectory = run(same_jam(), position, velocity, closed=["tip"], until=0.5, dt=1e-3, on_failure="return")
    assert trajectory.success or "Painlevé" in trajectory.message
    force = trajectory["tip.force"]
    assert np.isfinite(force).all() and force.min() >= 0.0
    energy = trajectory.energy.kinetic + trajectory.energy.potential
    assert energy.max() < energy[0] * (1 + 1e-3)
