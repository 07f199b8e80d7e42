"""Small motions with rows on velocities, contacts and friction; right-hand sides, refusals, table and plot."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from tests.cases.sleighs import Sleigh, rolling_wheel
from tests.cases.small_motions import PLAIN, at_rest, moving, on_spring, pendulums
from tests.cases.wheels import RimlessWheel
from tests.equations.test_states import model as pulled


# rows on velocities, steady motions -------------------------------------------------------------------------------
@pytest.mark.parametrize("speed", [1.2, -0.8])
def test_a_sleigh_runs_straight_forward_and_turns_around_backward(speed):
    """ω decays with m a v/(I + m a²); place, heading and speed are free (Neimark & Fufaev 1972)."""
    sleigh = Sleigh()
    model = sleigh.model()
    found = mbd.linearize(model, sleigh.start(model, 0.3, speed, 0.0), backend=PLAIN)
    decay = sleigh.mass * sleigh.ahead * speed / (sleigh.inertia + sleigh.mass * sleigh.ahead**2)
    assert len(found.states) == 5 and found.is_equilibrium
    assert found.eigenvalues[-1] == pytest.approx(-decay, rel=1e-9)
    assert np.max(np.abs(found.eigenvalues[:-1])) < 1e-4 * abs(decay)
    assert ("grows" in str(found)) == (speed < 0.0)
    assert "4 eigenvalues 0" in str(found)


@pytest.mark.parametrize("held", ["row", "contact", "joint"])
def test_a_wheel_on_a_spring_rolls_with_the_inertia_of_its_turning(held):
    mass, radius, inertia, stiffness = 2.0, 0.3, 0.11, 70.0
    model = rolling_wheel(mass, radius, inertia, 0.0, 9.81, held)
    wheel = next(joint for joint in model.joints if joint.name in ("roll", "axle")).child
    model.apply(mbd.Spring("spring", model.ground.point(-2.0, radius, name="post"), wheel, stiffness, 2.0))
    closed = ["road"] if held == "contact" else []
    found = mbd.linearize(model, mbd.assemble(model, closed=closed, backend=PLAIN), backend=PLAIN)
    wanted = math.sqrt(stiffness / (mass + inertia / radius**2))
    assert found.modes[-1].frequency == pytest.approx(wanted, rel=1e-10)


def test_a_governor_swings_about_its_steady_motion():
    """A ball at the end of a rod on a free shaft, ω² L cos θ = g.

    Its angular momentum keeps the shaft: ω_n² = ω² sin² θ (1 + 4 m L² cos² θ/(I + m L² sin² θ)).
    """
    mass, length, shaft, tilt, g = 1.5, 0.6, 0.2, 0.7, 9.81
    model = mbd.Model("governor")
    axle = mbd.RigidBody("axle", 1.0, (shaft, shaft, shaft))
    ball = mbd.Link("ball", mass=mass, length=length, center=length)
    model.connect(
        mbd.Revolute("shaft", model.ground.origin, axle.origin, axis=(0.0, 1.0, 0.0)),
        mbd.Revolute("arm", axle.origin, ball.start),
    )
    w, sine, cosine = math.sqrt(g / (length * math.cos(tilt))), math.sin(tilt), math.cos(tilt)
    state = mbd.assemble(model, position={"arm.angle": tilt}, velocity={"shaft.angle": w}, backend=PLAIN)
    found = mbd.linearize(model, state, backend=PLAIN)
    ball_inertia = mass * length**2
    wanted = w * sine * math.sqrt(1 + 4 * ball_inertia * cosine**2 / (shaft + ball_inertia * sine**2))
    assert found.is_equilibrium and "in steady motion" in str(found)
    assert found.modes[-1].frequency == pytest.approx(wanted, rel=1e-10)
    assert np.max(np.abs(found.eigenvalues[:2])) < 1e-6


# contacts and friction --------------------------------------------------------------------------------------------
def test_a_foot_that_is_closed_in_the_state_is_a_pivot():
    """On one spoke a rimless wheel is an inverted pendulum."""
    wheel = RimlessWheel(inertia=0.3, slope=0.0)
    model = wheel.model()
    state = mbd.assemble(model, closed=["spoke 0"], backend=PLAIN)
    found = mbd.linearize(model, state, backend=PLAIN)
    w = math.sqrt(wheel.gravity / wheel.length / (1 + wheel.inertia))
    assert sorted(found.eigenvalues.real) == pytest.approx([-w, w], rel=1e-10)
    assert all("spoke 0" in row for row in found.rows) and len(found.rows) == 2
    free = mbd.linearize(model, mbd.assemble(model, position={"roll.y": 1.5}, backend=PLAIN), backend=PLAIN)
    assert len(free.states) == 6 and free.rows == ()


@pytest.mark.parametrize(("place", "speed", "states"), [(0.01, 0.0, 1), (0.01, 0.3, 2), (0.5, 0.0, 2)])
def test_dry_friction_holds_what_is_at_rest_and_can_be_held(place, speed, states):
    """5 N hold the spring at 0.01 m and not at 0.5 m; sliding, a constant force changes no frequency."""
    model = on_spring(mbd.Coulomb(5.0))
    state = mbd.assemble(
        model, position={"rail.displacement": place}, velocity={"rail.displacement": speed}, backend=PLAIN
    )
    found = mbd.linearize(model, state, backend=PLAIN)
    assert len(found.states) == states
    if states == 2:
        assert found.modes[0].frequency == pytest.approx(math.sqrt(20.0), rel=1e-12)
        assert found.drift[1] == pytest.approx(-20.0 * place - math.copysign(2.5, speed or -1.0), rel=1e-9)
    else:
        assert np.max(np.abs(found.eigenvalues)) < 1e-12


@pytest.mark.parametrize("speed", [0.5, -0.5, 0.0])
def test_a_foot_slides_against_its_motion_or_sets_off(speed):
    """On a slope of 0.3 rad with μ = 0.2 nothing sticks; the spring alone makes the frequency."""
    model = mbd.Model("block", gravity=mbd.on_slope(0.3))
    block = mbd.RigidBody("block", 2.0, (0.1, 0.1, 0.1))
    model.connect(mbd.Planar("slide", model.ground.origin, block.origin))
    model.constrain(mbd.Unilateral("sole", mbd.touchdown(block.origin), friction=0.2))
    model.apply(mbd.Spring("spring", model.ground.point(-1.0, 0.0, name="post"), block.origin, 30.0, 1.0))
    state = mbd.assemble(model, closed=["sole"], velocity={"slide.x": speed}, backend=PLAIN)
    found = mbd.linearize(model, state, backend=PLAIN)
    drag = 0.2 * math.cos(0.3) * math.copysign(1.0, speed)
    assert found.drift[3] == pytest.approx(9.81 * (math.sin(0.3) - drag), rel=1e-10)
    assert found.modes[-1].frequency == pytest.approx(math.sqrt(15.0), rel=1e-10)
    assert len(found.states) == 4 and found.rows == ("'sole' (normal)",)


def test_a_contact_that_would_pull_is_refused_by_name():
    wheel = RimlessWheel(inertia=0.3)
    model = wheel.model()
    state = wheel.start(model, speed=9.0)
    with pytest.raises(mbd.ModelError, match="'spoke 0' is closed in the state, but its force would pull"):
        mbd.linearize(model, state, backend=PLAIN)


# the right-hand sides ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize("cut", ["auto", "all"])
def test_solve_ivp_takes_the_motion_that_simulate_converges_to(cut):
    model, state = moving(cut)
    found = mbd.linearize(model, state)
    end = 0.5
    exact = solve_ivp(found.rhs, (0.0, end), found.y, rtol=1e-11, atol=1e-12).y[:, -1]
    errors = []
    for dt in (0.01, 0.005, 0.0025):
        final = mbd.simulate(model, state, mbd.GeneralizedAlpha(0.8), dt=dt, until=end).final
        errors.append(np.max(np.abs(np.concatenate([final.q, final.v]) - exact)))
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.6)
    assert errors[1] / errors[2] == pytest.approx(4.0, abs=0.6)
    assert errors[2] < 2e-3


def test_the_linear_motion_is_the_nonlinear_one_for_small_departures():
    model, state = moving()
    found = mbd.linearize(model, state)
    assert found.linear_rhs(0.0, found.x) == pytest.approx(found.rhs(0.0, found.y)[list(found.picked)])
    errors = []
    rest = at_rest(model, state)
    found = mbd.linearize(model, rest)
    for size in (0.02, 0.01):
        start = mbd.assemble(model, position={found.states[0]: found.x[0] + size}, backend=PLAIN)
        y = np.concatenate([start.q, start.v])
        exact = solve_ivp(found.rhs, (0.0, 0.4), y, rtol=1e-11, atol=1e-13).y[list(found.picked), -1]
        linear = solve_ivp(found.linear_rhs, (0.0, 0.4), found.x + np.array([size, 0.0]), rtol=1e-11, atol=1e-13).y[
            :, -1
        ]
        errors.append(np.max(np.abs(exact - linear)))
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.6)  # what is left out is quadratic


def test_first_order_states_belong_to_the_linear_motion():
    """A leg pulled by a muscle with a lag and held by a rod: differences of the motion itself."""
    model = pulled()
    values = {"hip.angle": 0.4}, {"hip.angle": 0.9}, 0.3
    state = mbd.assemble(model, position={**values[0], "muscle.activation": 0.3}, velocity=values[1], backend=PLAIN)
    found = mbd.linearize(model, state, backend=PLAIN)
    assert found.states[2] == "muscle.activation" and len(found.states) == 3

    def rate(x):
        places, speeds = {found.states[0]: x[0], found.states[2]: x[2]}, {found.states[1]: x[1]}
        nearby = mbd.assemble(model, position=places, velocity=speeds, backend=PLAIN)
        return found.rhs(0.0, np.concatenate([nearby.q, nearby.v, nearby.z]))[list(found.picked)]

    columns = [(rate(found.x + 1e-5 * unit) - rate(found.x - 1e-5 * unit)) / 2e-5 for unit in np.eye(3)]
    assert pytest.approx(np.array(columns).T, abs=1e-5 * np.max(np.abs(found.A))) == found.A
    assert found.A[2, 2] == pytest.approx(-5.0)  # activation forgets with its lag of 0.2 s


# what is refused --------------------------------------------------------------------------------------------------
def test_a_state_off_its_rows_is_refused_with_the_rows():
    model, state = moving()
    with pytest.raises(mbd.ModelError, match="is violated by .* mbd.assemble"):
        mbd.linearize(model, replace(state, q=state.q + 1e-3), backend=PLAIN)
    with pytest.raises(mbd.ModelError, match="in its velocity"):
        mbd.linearize(model, replace(state, v=state.v + np.array([0.1, 0.0, 0.0])), backend=PLAIN)


def test_a_state_of_another_model_is_refused():
    _, state = moving()
    with pytest.raises(mbd.ModelError, match="assemble it from this model"):
        mbd.linearize(on_spring(), state, backend=PLAIN)


def test_other_parameters_change_the_frequency():
    model = on_spring(stiffness=40.0)
    state = mbd.assemble(model, backend=PLAIN)
    found = mbd.linearize(model, state, parameters={"rail spring.stiffness": 160.0}, backend=PLAIN)
    assert found.modes[0].frequency == pytest.approx(math.sqrt(80.0), rel=1e-12)


# table and plot ---------------------------------------------------------------------------------------------------
def test_the_table_names_what_moves():
    model = pendulums([1.0, 1.0], [1.0, 1.0])
    text = str(mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN))
    assert "in equilibrium: 2 coordinates, no rows" in text
    assert "2.3972    0.381526     0.0000  first pin.angle, second pin.angle" in text
    assert "second pin.angle, −first pin.angle" in text


def test_modes_are_drawn_as_bars_of_their_shapes(tmp_path):
    model = pendulums([1.0, 1.0, 2.0], [1.0, 0.5, 0.7])
    found = mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN)
    figure = found.plot_modes(tmp_path / "modes.png")
    assert (tmp_path / "modes.png").stat().st_size > 5000
    assert len(figure.axes) == 3
    for axes, mode in zip(figure.axes, found.modes, strict=True):
        widths = [bar.get_width() for bar in axes.patches]
        assert widths == pytest.approx([part.real for part in mode.shape.values()])


def test_a_motion_that_is_prescribed_has_no_states():
    model = on_spring()
    model.constrain(mbd.Bilateral("drive", model.joints[0], value=lambda t: 0.1 * mbd.sin(3.0 * t)))
    found = mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN)
    assert (found.states, found.modes, found.A.shape) == ((), (), (0, 0))
    assert "no states: rows determine the motion" in str(found)
    assert found.drift == pytest.approx([0.3, 0.0])
    with pytest.raises(mbd.ModelError, match="nothing to draw"):
        found.plot_modes()


def test_accelerations_are_those_of_a_run():
    """Of a walker on its locked leg."""
    from examples import compass_gait as walk

    found = mbd.linearize(walk.model, walk.start)
    run = mbd.simulate(walk.model, walk.start, walk.integrator, dt=1e-4, until=1e-4)
    n = len(found.coordinates)
    for k, name in enumerate(found.coordinates):
        assert run[f"{name}.acceleration"][0] == pytest.approx(found.drift[n + k], abs=1e-9)
