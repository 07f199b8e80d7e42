"""Case d5 and others in the words of examples: turns of a coin, how fast it must roll to stay up, a kick in space."""

import warnings

import numpy as np
import pytest

import mbd
from mbd.cli import Script
from tests.problems import case

D5 = case("d5-disk-steady-turn")
COIN = Script.load("rolling-coin").names
R, RK = COIN["R"], mbd.RungeKutta853()


def test_a_coin_turns_steadily_with_the_published_spin_on_the_published_circle():
    lean, turn, spin = (COIN[name] for name in ("lean", "turn", "spin"))
    assert abs(spin) == pytest.approx(abs(D5["spin rate phidot needed"].value), rel=1e-14)
    start = COIN["rolling"](lean, turn, spin)
    run = mbd.simulate(COIN["model"], start, RK, tol=1e-11, until=2.0 * np.pi / turn)
    assert np.ptp(run["float.y"]) < 1e-10  # its lean stays
    x, z = run.at(np.array([0.0, 0.5, 1.0]) * run.t[-1])["float.x"], run["float.z"]
    across = np.hypot(x[1] - x[0], run.at(0.5 * run.t[-1])["float.z"] - z[0])
    circle = D5["radius of the contact circle"].value
    assert across / 2.0 + R * np.sin(lean) == pytest.approx(circle, abs=1e-9)  # the center is nearer to the middle
    assert (x[2], z[-1]) == pytest.approx((x[0], z[0]), abs=1e-9)


@pytest.mark.parametrize(("factor", "stays"), [(0.97, False), (1.03, True)])
def test_an_upright_coin_stays_up_only_above_the_critical_speed(factor, stays):
    speed = factor * D5["critical upright speed"].value
    start = COIN["rolling"](0.0, 0.0, -speed / R, fall=1e-3)
    run = mbd.simulate(COIN["model"], start, RK, tol=1e-9, until=6.0)
    lean = np.arccos(np.clip(run["float.y"] / R, -1.0, 1.0))
    assert bool(lean.max() < 5e-3) is stays


def test_what_an_amputee_does_in_space_is_free_of_outside():
    """Nothing but friction in the left leg changes the energy, nothing the motion of the center of mass."""
    names = Script.load("amputee-in-space").names
    run = mbd.simulate(names["model"], names["start"], RK, tol=1e-8, until=0.5)
    bodies = [body for body in names["model"].bodies.values() if body.name != "ground"]
    for axis in "xyz":
        momentum = sum(body.mass * run[f"{body.name}.center.v{axis}"] for body in bodies)
        assert np.ptp(momentum) < 1e-6
    assert sum(body.mass for body in bodies) == pytest.approx(70.0 * (1.0 - 0.0481 - 0.0129) + 1.8, abs=0.02)
    lost = {part.name: float(part.energy[-1]) for part in run.energy.parts}
    assert lost["left knee loss"] < -0.5 > -1.5
    assert run["trunk.rotation_vector"][-1] == pytest.approx([0.0, -0.179, 0.107], abs=0.02)


def test_a_motion_that_changes_in_axes_that_turn_along_is_told_as_eigenvalues_are_asked_for():
    with pytest.warns(mbd.MbdWarning, match="'float' turns, and the derivatives change along its motion"):
        mbd.linearize(COIN["model"], COIN["rolling"](0.0, 0.0, -3.0))
    model = mbd.Model("sleeping top", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("body", 1.0, (0.1, 0.05, 0.1), center=(0.0, 0.3, 0.0))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
    with warnings.catch_warnings():
        warnings.simplefilter("error", mbd.MbdWarning)
        mbd.linearize(model, mbd.assemble(model, velocity={"ball.angular_velocity.y": 60.0}))
        mbd.linearize(COIN["model"], COIN["rolling"](0.0, 0.0, 0.0))
