"""Balls that roll without slip, however they have turned."""

import numpy as np
import pytest

import mbd
from mbd.equations.shapes import shapes_of

R, M, SPIN = 0.05, 0.5, 25.0


def ball_on(ground, cut="auto", word="bilateral", center=(0.0, 0.0, 0.0)):
    """A ball that floats over a plane, held there, or free to lift off; or with friction in place of rolling."""
    model = mbd.Model("ball", gravity=(0.0, 0.0, -9.81), cut=cut)
    body = mbd.RigidBody("ball", M, (0.4 * M * R**2,) * 3, center=center)
    model.connect(mbd.Free("fly", model.ground.origin, body.origin))
    touch = mbd.sphere_touchdown(body.origin, R, ground)
    if word == "friction":
        model.constrain(mbd.Unilateral("touch", touch, friction=3.0))
    elif word == "unilateral":
        model.constrain(mbd.Unilateral("touch", touch, friction=0.0))
        model.constrain(mbd.Rolling("grip", body.origin, R, ground, only_while="touch", ball=True))
    else:
        model.constrain(mbd.Bilateral("touch", touch), mbd.Rolling("grip", body.origin, R, ground, ball=True))
    return model


def moving(model, place, velocity, omega, **more):
    """Its start."""
    axes = list(enumerate("xyz"))
    rates = {"fly.angular_velocity.ground": tuple(omega), **{f"fly.{axis}": velocity[k] for k, axis in axes}}
    return mbd.assemble(model, {f"fly.{axis}": place[k] for k, axis in axes}, rates, **more)


def of_center(run):
    """Places of its center [m]."""
    return np.stack([run[f"fly.{axis}"] for axis in "xyz"], axis=-1)


def down_a_slope(scheme, cut, dt):
    """A run of 0.8 s down a slope of 0.35 rad, its normal, and the error of the place where it ends [m]."""
    n, down = np.array([np.sin(0.35), 0.0, np.cos(0.35)]), np.array([np.cos(0.35), 0.0, -np.sin(0.35)])
    v, p = -0.8 * down + np.array([0.0, 0.6, 0.0]), R * n
    model = ball_on(mbd.Plane(normal=tuple(n)), cut)
    run = mbd.simulate(model, moving(model, p, v, np.cross(n, v) / R + SPIN * n), scheme, dt=dt, until=0.8)
    place = p + v * 0.8 + 5.0 / 14.0 * 9.81 * np.sin(0.35) * 0.8**2 * down
    return run, n, np.linalg.norm(of_center(run)[-1] - place)


@pytest.mark.parametrize("cut", ["auto", "all"])
@pytest.mark.parametrize("scheme", [mbd.RungeKutta853(), mbd.RadauIIA()], ids=lambda scheme: type(scheme).__name__)
def test_a_ball_rolls_down_a_slope_at_five_sevenths_and_keeps_its_spin(scheme, cut):
    run, n, error = down_a_slope(scheme, cut, 2e-3)
    assert error < 1e-9
    assert run["fly.angular_velocity.ground"] @ n == pytest.approx(SPIN, abs=1e-8)
    grip = np.hypot(run["grip.forward.force"], run["grip.sideways.force"])
    assert grip == pytest.approx(2.0 / 7.0 * M * 9.81 * np.sin(0.35), rel=1e-7)


@pytest.mark.parametrize("cut", ["auto", "all"])
def test_a_ball_that_rolls_keeps_the_order_of_the_scheme(cut):
    errors = [down_a_slope(mbd.GeneralizedAlpha(0.8), cut, dt)[2] for dt in (2e-3, 1e-3)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_a_ball_on_a_turntable_runs_in_a_circle_at_two_sevenths_of_its_rate():
    """R. Weltner, Stable circular orbits of freely moving balls on rotating discs, Am. J. Phys. 47 (1979) 984."""
    rate, model = 3.0, mbd.Model("turntable", gravity=(0.0, 0.0, -9.81))
    table, ball = mbd.RigidBody("table", 1.0, (1.0, 1.0, 1.0)), mbd.RigidBody("ball", M, (0.4 * M * R**2,) * 3)
    axle = mbd.Revolute("axle", model.ground.origin, table.origin)
    model.connect(axle, mbd.Free("fly", model.ground.origin, ball.origin))
    sheet = mbd.Plane(normal=(0, 0, 1), frame=table.origin)
    model.constrain(
        mbd.Bilateral("drive", axle, value=lambda t: rate * t),
        mbd.Bilateral("touch", mbd.sphere_touchdown(ball.origin, R, sheet)),
        mbd.Rolling("grip", ball.origin, R, sheet, ball=True),
    )
    n, p, v = np.array([0.0, 0.0, 1.0]), np.array([0.3, 0.0, R]), np.array([0.1, 0.5, 0.0])
    slip = v - rate * np.cross(n, p)
    run = mbd.simulate(model, moving(model, p, v, np.cross(n, slip) / R), mbd.RungeKutta853(), dt=0.02, until=2.0)
    turned = 2.0 / 7.0 * rate * run.t
    z = p[0] + 1j * p[1] + (v[0] + 1j * v[1]) * (np.exp(1j * turned) - 1.0) / (2j / 7.0 * rate)
    assert run["fly.x"] + 1j * run["fly.y"] == pytest.approx(z, abs=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_a_loaded_ball_rolls_as_one_that_friction_holds(seed):
    rng = np.random.default_rng(seed)
    n = np.array([0.2, -0.1, 1.0]) / np.linalg.norm([0.2, -0.1, 1.0])
    omega, ends = rng.normal(size=3), []
    for word in "bilateral", "unilateral", "friction":
        model = ball_on(mbd.Plane(normal=tuple(n)), word=word, center=tuple(0.01 * np.array([1.0, -0.5, 0.3])))
        closed = () if word == "bilateral" else ("touch",)
        start = moving(model, R * n, R * np.cross(omega, n), omega, closed=closed)
        ends.append(of_center(mbd.simulate(model, start, mbd.RungeKutta853(), dt=5e-3, until=0.3))[-1])
    assert ends[1] == pytest.approx(ends[0], abs=1e-10)
    assert ends[2] == pytest.approx(ends[0], abs=1e-10)


def test_a_ball_that_lands_where_it_rolls_keeps_its_moment_about_the_touching_point():
    model = ball_on(mbd.Plane(normal=(0, 0, 1)), word="unilateral")
    n, v, omega = np.array([0.0, 0.0, 1.0]), np.array([1.5, -0.4, 0.0]), np.array([10.0, -30.0, 7.0])
    run = mbd.simulate(model, moving(model, (0.0, 0.0, R + 0.1), v, omega), mbd.RadauIIA(), dt=5e-3, until=0.3)
    assert [event.kind for event in run.events] == ["closed"]
    rolling = (5.0 * v + 2.0 * R * np.cross(omega, n)) / 7.0
    assert [run[f"fly.{axis}.rate"][-1] for axis in "xyz"] == pytest.approx(rolling, abs=1e-9)
    assert run["fly.angular_velocity.ground"][-1][2] == pytest.approx(7.0, abs=1e-9)


def test_a_ball_needs_no_axis_and_is_drawn_as_one():
    body = mbd.RigidBody("ball", M, (1.0, 1.0, 1.0))
    with pytest.raises(mbd.ModelError, match=r"Rolling 'grip' is a ball, which needs no axis="):
        mbd.Rolling("grip", body.origin, R, axis=(0, 0, 1), ball=True)
    model = ball_on(mbd.Plane(normal=(0, 0, 1)))
    kinds = [shape.kind for shape in shapes_of(model)]
    assert "wheel" not in kinds
    assert "ball" in kinds
