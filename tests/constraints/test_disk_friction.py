"""Thin disks that slide and roll on a plane by the friction of their edge."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import mbd

MASS, R, G = 0.4, 0.04, 9.81
INERTIA = np.array([MASS * R * R / 4.0, MASS * R * R / 4.0, MASS * R * R / 2.0])
UP = np.array([0.0, 1.0, 0.0])
UNTIL = 0.05


def coin(name, *constraints):
    """A coin that floats, with what `constraints` make of its body."""
    model, body = mbd.Model(name), mbd.RigidBody("coin", MASS, tuple(INERTIA))
    model.connect(mbd.Free("coin's place", model.ground.origin, body.origin))
    model.constrain(*(make(body) for make in constraints))
    return model


def edge(friction):
    """The edge of the coin over level ground."""
    return lambda body: mbd.Unilateral("edge", mbd.disk_touchdown(body.origin, R, axis=(0, 0, 1)), friction=friction)


SLIDING, ROLLING = coin("sliding", edge(0.05)), coin("rolling", edge(None))
ROLLED = coin(
    "rolled",
    lambda body: mbd.Bilateral("edge", mbd.disk_touchdown(body.origin, R, axis=(0, 0, 1))),
    lambda body: mbd.Rolling("grip", body.origin, R, axis=(0, 0, 1)),
)


def arm(rotation):
    """From the center to the lowest point of the edge."""
    a = rotation[:, 2]
    return R * (a[1] * a - UP) / np.linalg.norm(np.cross(UP, a))


def sliding_rates(mu):
    """Newton's and Euler's equations of the coin whose lowest point slides on the plane."""

    def lift(q, v, w):
        return v[1] + np.cross(w, arm(Rotation.from_quat(q).as_matrix()))[1]

    def rates(_, y):
        q, v, w = y[3:7] / np.linalg.norm(y[3:7]), y[7:10], y[10:13]
        rotation = Rotation.from_quat(q).as_matrix()
        inertia, e = rotation @ np.diag(INERTIA) @ rotation.T, arm(rotation)
        slip = (v + np.cross(w, e)) * (1.0 - UP)
        pull = UP - mu * slip / np.linalg.norm(slip)
        turn = 0.5 * np.r_[w * q[3] + np.cross(w, q[:3]), -w @ q[:3]]
        bend = (lift(q + 1e-6 * turn, v, w) - lift(q - 1e-6 * turn, v, w)) / 2e-6
        free = -np.linalg.solve(inertia, np.cross(w, inertia @ w))
        pushed = np.linalg.solve(inertia, np.cross(e, pull))
        force = -(bend - G + np.cross(free, e)[1]) / (pull[1] / MASS + np.cross(pushed, e)[1])
        return np.r_[v, turn, force * pull / MASS - G * UP, free + force * pushed]

    return rates


def start(model, tilt, spin, forward=None):
    """A coin that leans and turns about the vertical, its edge on the ground: sliding forward, or rolling."""
    turned = Rotation.from_rotvec((tilt - math.pi / 2.0, 0.0, 0.0))
    rate = np.array([0.0, -spin, 0.5])
    velocity = -np.cross(rate, arm(turned.as_matrix()))
    if forward is not None:
        velocity[[0, 2]] = forward, 0.0
    state = mbd.assemble(
        model,
        position={"coin's place.y": R * math.sin(tilt), "coin's place.orientation": turned},
        velocity={"coin's place.angular_velocity.ground": rate}
        | {f"coin's place.{c}": v for c, v in zip("xyz", velocity, strict=True)},
    )
    return state, np.r_[0.0, R * math.sin(tilt), 0.0, turned.as_quat(), velocity, rate]


def place(run):
    """Where the center is at the end."""
    return np.array([run[f"coin's place.{c}"][-1] for c in "xyz"])


@pytest.mark.parametrize(("scheme", "order"), [(mbd.HHT(0.1), 2), (mbd.RadauIIA(), None), (mbd.RungeKutta853(), None)])
def test_a_sliding_coin_obeys_newton_and_euler(scheme, order):
    """Against an independent integration of the sliding coin, at the order of the scheme."""
    state, y = start(SLIDING, 0.6, 8.0, 0.3)
    known = solve_ivp(sliding_rates(0.05), (0.0, UNTIL), y, method="DOP853", rtol=1e-11, atol=1e-12).y[:3, -1]
    errors = [
        np.abs(place(mbd.simulate(SLIDING, state, scheme, dt=dt, until=UNTIL)) - known).max() for dt in (1e-3, 5e-4)
    ]
    if order is None:
        assert max(errors) < 1e-11
    else:
        assert abs(math.log2(errors[0] / errors[1]) - order) < 0.15


@given(st.floats(0.4, 1.4), st.floats(-8.0, 8.0))
def test_a_contact_without_slip_rolls_as_rolling_does(tilt, spin):
    """While it is closed, friction=None gives the motion of `Bilateral` and `Rolling`."""
    rolled, rolling = (
        mbd.simulate(model, start(model, tilt, spin)[0], mbd.RungeKutta853(), dt=2e-3, until=0.02)
        for model in (ROLLED, ROLLING)
    )
    assert np.abs(place(rolled) - place(rolling)).max() < 1e-12
    assert abs(rolling.energy.numerical).max() < 1e-12
