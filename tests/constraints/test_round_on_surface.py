"""Balls and disks on height functions: gaps against a search, motions against equations by hand."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import mbd

G, MASS, RADIUS = 9.81, 0.5, 0.1
MOMENT = 0.4 * MASS * RADIUS**2
UP = np.array([0.0, 1.0, 0.0])


def waves(x, z, t=0.0):
    return 0.25 * mbd.sin(2.0 * x + 0.4) * mbd.cos(1.5 * z) + 0.3 * z + 0.05 * mbd.sin(3.0 * t)


def bowl(x, z):
    return 0.8 * x * x + 0.6 * z * z + 0.1 * x


def ball_on(ground, friction=None, contact=mbd.Unilateral, **law):
    model = mbd.Model("ball")
    ball = mbd.RigidBody("ball", MASS, (MOMENT,) * 3)
    model.connect(mbd.Free("float", model.ground.origin, ball.origin))
    law |= {} if contact is mbd.Penalty else {"friction": friction}
    model.constrain(contact("touch", mbd.sphere_touchdown(ball.origin, RADIUS, ground), **law))
    return model


def disk_on(ground, friction=None):
    model = mbd.Model("disk")
    disk = mbd.RigidBody("disk", MASS, (0.25 * MASS * RADIUS**2,) * 2 + (0.5 * MASS * RADIUS**2,))
    model.connect(mbd.Free("float", model.ground.origin, disk.origin))
    model.constrain(mbd.Unilateral("touch", mbd.disk_touchdown(disk.origin, RADIUS, "z", ground), friction=friction))
    return model


@pytest.mark.parametrize("seed", range(6))
def test_a_ball_touches_where_it_comes_to_rest_when_let_down(seed):
    x, z = np.random.default_rng(seed).uniform(-1.0, 1.0, 2)
    start = mbd.assemble(ball_on(waves), {"float.x": x, "float.z": z}, closed="touch")

    def height(s):
        return -float(waves(x + s[0], z + s[1])) - np.sqrt(max(RADIUS**2 - s @ s, 0.0))

    found = minimize(height, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-16})
    assert start["float.y"] == pytest.approx(-found.fun, abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_a_leaning_disk_touches_with_the_point_of_its_edge_that_is_lowest(seed):
    chance = np.random.default_rng(seed)
    x, z = chance.uniform(-1.0, 1.0, 2)
    turn = Rotation.from_euler("YXZ", [chance.uniform(-3.0, 3.0), chance.uniform(-0.8, 0.8), chance.uniform(-3.0, 3.0)])
    start = mbd.assemble(disk_on(waves), {"float.x": x, "float.z": z, "float.orientation": turn}, closed="touch")
    u, w = turn.as_matrix()[:, 0], turn.as_matrix()[:, 1]

    def height(angle):
        arm = RADIUS * (np.cos(angle[0]) * u + np.sin(angle[0]) * w)
        return float(arm[1] - waves(x + arm[0], z + arm[2]))

    best = min(minimize(height, [a], method="BFGS", options={"gtol": 1e-11}).fun for a in (0.0, 2.0, 4.0))
    assert start["float.y"] == pytest.approx(-best, abs=1e-11)


def place_and_normal(s):
    """Of the center over a place of the bowl, and their derivatives by the place."""

    def at(x, z):
        slope = np.array([-1.6 * x - 0.1, 1.0, -1.2 * z])
        n = slope / np.linalg.norm(slope)
        return np.concatenate([np.array([x, bowl(x, z), z]) + RADIUS * n, n])

    step = 1e-5
    moves = np.eye(2) * step
    slopes = [(8 * (at(*(s + d)) - at(*(s - d))) - (at(*(s + 2 * d)) - at(*(s - 2 * d)))) / (12 * step) for d in moves]
    return at(*s), np.column_stack(slopes)


def by_hand(slips, friction, s0, v0, spin0, until):
    """(places, velocities, spins) of a ball in the bowl that rolls, or slips everywhere, at a time (DOP853)."""

    def rates(_, state):
        s, v, spin = state[:2], state[2:5], state[5:]
        (n, turns), move = (lambda p, d: ((p[3:], d[3:]), d[:3]))(*place_and_normal(s))
        flow = np.linalg.lstsq(move, v, rcond=None)[0]
        swing = turns @ flow
        gravity = -G * UP
        if slips:
            push = MASS * (-swing @ v - n @ gravity)
            gamma = v + np.cross(spin, -RADIUS * n)
            force = push * n - friction * push * gamma / np.linalg.norm(gamma)
            return np.concatenate([flow, gravity + force / MASS, np.cross(-RADIUS * n, force) / MOMENT])
        turning, k = RADIUS * np.cross(spin, swing), MASS * RADIUS**2 / MOMENT
        along = lambda a: a - n * (n @ a)  # noqa: E731
        a = (k * along(gravity) + along(turning)) / (1.0 + k) + n * (n @ turning)
        return np.concatenate([flow, a, np.cross(-RADIUS * n, MASS * (a - gravity)) / MOMENT])

    start = np.concatenate([s0, v0, spin0])
    end = solve_ivp(rates, (0.0, until), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return np.concatenate([place_and_normal(end[:2])[0][:3], end[2:]])


def read(run):
    values = [run[f"float.{axis}"][-1] for axis in "xyz"] + [run[f"float.{axis}.rate"][-1] for axis in "xyz"]
    return np.array([*values, *run["float.angular_velocity.ground"][-1]])


SCHEMES = [(mbd.RungeKutta853(), 5e-3, 1e-8), (mbd.RadauIIA(), 5e-3, 1e-7), (mbd.GeneralizedAlpha(0.9), 1e-3, 2e-4)]


@pytest.mark.parametrize(("scheme", "dt", "bound"), SCHEMES, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("friction", [None, 0.05], ids=["rolls", "slips"])
def test_a_ball_in_a_bowl_moves_as_newton_and_euler_say(friction, scheme, dt, bound):
    s = np.array([0.25, 0.1])
    place, _ = place_and_normal(s)
    center, n = place[:3], place[3:]
    spin = np.array([3.0, 4.0, -2.0])
    v = RADIUS * np.cross(spin, n)
    if friction is not None:
        v = v + 3.0 * np.cross(n, [1.0, 0.2, 0.5])
    speed = dict(zip(("float.x", "float.y", "float.z"), v, strict=True))
    position = dict(zip(("float.x", "float.y", "float.z"), center, strict=True))
    model = ball_on(bowl, friction)
    start = mbd.assemble(
        model, position, {**speed, "float.angular_velocity": tuple(spin)}, closed="touch", project=True
    )
    run = mbd.simulate(model, start, scheme, dt=dt, until=0.2)
    assert run.events == []
    exact = by_hand(friction is not None, friction, s, v, spin, 0.2)
    assert np.max(np.abs(read(run) - exact) / np.maximum(1.0, np.abs(exact))) < bound


@pytest.mark.parametrize("kind", [ball_on, disk_on])
def test_on_an_even_slope_it_is_as_on_the_plane(kind):
    plane = mbd.Plane((-0.3, 1.0, 0.2), 0.0)
    ends = []
    for ground in plane, lambda x, z: 0.3 * x - 0.2 * z:
        model = kind(ground, 0.3)
        position = {"float.x": 0.1, "float.orientation": ("xyz", (0.3, 0.2, 0.1)), "float.y": 0.2}
        start = mbd.assemble(model, position, {"float.y": -1.0, "float.angular_velocity": (1.0, -6.0, 2.0)})
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=0.12)
        assert [event.kind for event in run.events] == ["closed", "stuck", "slipped"][: len(run.events)]
        ends.append(read(run))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-10)


@pytest.mark.parametrize("kind", [ball_on, disk_on])
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_energy_goes_only_where_friction_and_impacts_take_it(kind, friction):
    model = kind(lambda x, z: waves(x, z), friction)
    position = {"float.x": 0.2, "float.y": 0.6, "float.orientation": ("xyz", (0.2, 0.1, 0.3))}
    start = mbd.assemble(model, position, {"float.x": 0.5, "float.z": 0.3, "float.angular_velocity": (2.0, 1.0, -9.0)})
    for scheme, dt in (mbd.RungeKutta853(), 4e-3), (mbd.RadauIIA(), 1e-3):
        run = mbd.simulate(model, start, scheme, dt=dt, until=0.35)
        assert run.events
        assert np.max(np.abs(run.energy.numerical)) < 1e-6
        assert np.min(run["touch.gap"]) > -1e-9


def test_ground_that_rises_and_falls_carries_the_ball_along():
    model = ball_on(lambda x, z, t: 0.1 * x * x + 0.02 * mbd.sin(6.0 * t), None)
    start = mbd.assemble(model, {"float.x": 0.4}, closed="touch")
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=5e-3, until=1.0)
    assert run.events == []
    assert np.max(np.abs(run["touch.gap"])) < 1e-10
    assert np.ptp(run["float.y"]) > 0.03
    assert np.max(np.abs(run.energy.numerical)) < 1e-9


def test_a_valley_that_is_narrower_than_the_ball_ends_the_run_by_name():
    model = ball_on(lambda x, z: 12.0 * x * x, 0.3)
    start = mbd.assemble(model, {"float.x": 0.35, "float.y": 2.6}, {"float.x": -1.5})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=5e-3, until=1.0, on_failure="return")
    assert not run.success
    assert "'touch'" in run.message
    assert "narrower" in run.message


CUP = 0.5


def cup(x, z):
    return CUP - mbd.sqrt(CUP * CUP - x * x - z * z)


def in_a_cup(as_function, **law):
    """A ball in the lower half of a hollow ball, which is a height function, or a `Ball`."""
    model, ball = mbd.Model("cup"), mbd.RigidBody("ball", 0.2, (2e-4, 2.2e-4, 1.8e-4), center=(0.005, -0.003, 0.002))
    model.connect(mbd.Free("float", model.ground.origin, ball.origin))
    ground = cup if as_function else mbd.Ball(model.ground.point(0.0, CUP, 0.0), CUP, hollow=True)
    model.constrain(mbd.Unilateral("touch", mbd.sphere_touchdown(ball.origin, 0.05, ground), **law))
    return model


@pytest.mark.parametrize("scheme", [mbd.RungeKutta853(), mbd.RadauIIA(), mbd.HHT()], ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("friction", [0.0, 0.15])
@pytest.mark.parametrize("place", [(0.0, 0.0), (0.1, 0.05), (0.2, 0.1), (-0.05, 0.27)])
def test_a_height_function_is_the_hollow_ball_that_it_describes_however_steep(scheme, friction, place):
    """The round-off of the place of contact, which Newton's method finds, does not grow with its iterations."""
    ends = []
    reach = CUP - 0.05
    for as_function in (True, False):
        model = in_a_cup(as_function, friction=friction, spin_friction=0.01)
        position = {"float.x": place[0], "float.z": place[1], "float.y": CUP - np.sqrt(reach**2 - np.dot(place, place))}
        velocity = {"float.x": 0.3, "float.z": -0.2, "float.angular_velocity": (1.0, 3.0, -2.0)}
        start = mbd.assemble(model, position, velocity, closed="touch", project=True)
        run = mbd.simulate(model, start, scheme, dt=2e-3, until=0.3)
        names = ("float.x", "float.y", "float.z", "float.angular_velocity")
        ends.append(
            (
                np.concatenate([np.atleast_1d(run[name][-1]) for name in names]),
                [(event.name, event.kind) for event in run.events],
                [event.time for event in run.events],
            )
        )
        assert run["touch spin friction.power"].max() < 1e-12
    assert ends[0][1] == ends[1][1] and ("touch spin", "stuck") in ends[0][1]
    np.testing.assert_allclose(ends[0][2], ends[1][2], atol=1e-7)
    np.testing.assert_allclose(ends[0][0], ends[1][0], rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("place", [(0.1, 0.05), (0.2, 0.1), (-0.05, 0.27)])
def test_spin_friction_of_a_disk_in_a_cup_only_takes(place):
    model, disk = mbd.Model("disk"), mbd.RigidBody("disk", 0.2, (1e-4, 1e-4, 2e-4))
    model.connect(mbd.Free("float", model.ground.origin, disk.origin))
    touch = mbd.disk_touchdown(disk.origin, 0.05, (0, 0, 1), cup)
    model.constrain(mbd.Unilateral("touch", touch, friction=0.2, spin_friction=0.01))
    position = {"float.x": place[0], "float.z": place[1], "float.orientation": ("xyz", (0.2, 0.3, 0.1))}
    start = mbd.assemble(model, position, {"float.angular_velocity": (1.0, 4.0, 2.0)}, closed="touch", project=True)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2.5e-4, until=0.2)
    assert run["touch spin friction.power"].max() < 1e-12 and run["touch friction.power"].max() < 1e-12
    assert abs(run.energy.numerical).max() < 1e-9
