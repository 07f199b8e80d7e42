"""A loss of a ball joint acts against its angular velocity, whatever the axes of its frames."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mbd
from mbd.joints.base import Joint
from mbd.joints.reversed import Reversed

LOSSES = {
    "quadratic": mbd.Quadratic(0.3),
    "coulomb smoothed": mbd.Coulomb(0.4, smoothing=0.05),
    "tabulated": mbd.Tabulated([-4.0, 0.0, 4.0], [-2.0, 0.0, 2.0]),
    "sum": mbd.Quadratic(0.2) + mbd.Viscous(0.1) + mbd.AffineFriction(0.4, -0.05, smoothing=0.1),
}


def ball(loss, turn):
    """A body on a ball joint whose child frame is turned, in motion."""
    model = mbd.Model("ball", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("body", 1.0, (0.1, 0.2, 0.15), center=(0.3, 0.1, -0.2))
    frame = replace(body.point(0.0, 0.1, 0.0), rotation=tuple(map(tuple, turn.as_matrix().tolist())))
    model.connect(mbd.Spherical("hip", model.ground.origin, frame, loss=loss))
    speed = turn.inv().apply([1.0, 2.0, -3.0])
    velocity = {f"hip.angular_velocity.{axis}": part for axis, part in zip("xyz", speed.tolist(), strict=True)}
    return model, mbd.assemble(model, {"hip.orientation": turn}, velocity)


@pytest.mark.parametrize("name", LOSSES)
def test_the_axes_of_the_joint_change_nothing(name):
    ends = []
    for turn in (Rotation.identity(), Rotation.from_rotvec([0.4, -1.1, 0.7])):
        model, start = ball(LOSSES[name], turn)
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.5)
        ends.append([run.final[f"body.origin.{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(ends[1], ends[0], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("loss", [*LOSSES.values(), mbd.Coulomb(0.3)], ids=[*LOSSES, "sticking"])
def test_which_body_is_named_first_and_what_is_cut_change_nothing(loss):
    ends, speed = [], np.array([1.0, 2.0, -0.7])
    for child_first, cut in itertools.product((False, True), ("auto", "all")):
        model = mbd.Model("arm", cut=cut)
        upper = mbd.RigidBody("upper", 1.5, (0.2, 0.3, 0.25), center=(0.1, -0.3, 0.05))
        lower = mbd.RigidBody("lower", 1.0, (0.1, 0.15, 0.12), center=(0.0, -0.2, 0.1))
        frames = [upper.point(0.0, -0.6), lower.point(0.05, 0.1)]
        if child_first:
            frames.reverse()
        model.connect(
            mbd.Revolute("shoulder", model.ground.origin, upper.origin, axis=(1.0, 0.2, 0.0)),
            mbd.Spherical("elbow", *frames, loss=loss),
        )
        seen = tuple(-speed if child_first else speed)
        start = mbd.assemble(model, {"shoulder.angle": 0.4}, {"shoulder.angle": 0.8, "elbow.angular_velocity": seen})
        run = mbd.simulate(model, start, mbd.RadauIIA(), dt=5e-3, until=0.3)
        ends.append([run[f"lower.center.{axis}"][-1] for axis in "xyz"])
    np.testing.assert_allclose(ends[1:], [ends[0]] * 3, rtol=0.0, atol=1e-7)


def test_a_joint_seen_from_its_child_answers_all_that_the_joint_does():
    promised = {name for name in vars(Joint) if not name.startswith("_")}
    assert promised - set(vars(Reversed)) == {"validate"}


def test_the_torque_is_that_of_the_whole_speed():
    model, start = ball(mbd.Quadratic(0.3), Rotation.identity())
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=0.01, until=0.2)
    omega = np.array([run[f"hip.angular_velocity.{axis}"] for axis in "xyz"])
    torque = np.array([run[f"hip loss.angular_velocity.{axis}.torque"] for axis in "xyz"])
    np.testing.assert_allclose(torque, -0.3 * np.linalg.norm(omega, axis=0) * omega, rtol=1e-12)
    assert math.isclose(run.energy.total[-1] - run.energy.total[0], run.energy.parts[0].energy[-1], abs_tol=1e-6)


def test_at_rest_it_is_none_and_losses_by_label_keep_their_axis():
    model, start = ball(mbd.Quadratic(0.3), Rotation.identity())
    still = mbd.assemble(model, {"hip.orientation": (1.0, 0.0, 0.0, 0.0)})
    run = mbd.simulate(model, still, mbd.HHT(), dt=1e-3, until=0.1)
    assert np.isfinite(run.final.q).all()
    model, start = ball({"angular_velocity.y": mbd.Quadratic(0.3)}, Rotation.identity())
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=0.05)
    rate = run["hip.angular_velocity.y"]
    np.testing.assert_allclose(run["hip loss.angular_velocity.y.torque"], -0.3 * np.abs(rate) * rate, rtol=1e-12)


@pytest.mark.parametrize("space", [False, True])
def test_friction_of_one_kind_that_sticks_and_that_is_smooth_keep_their_numbers(space):
    """In a sum for a contact, in any order, and where a run changes the second of them."""
    ends = []
    dry, smooth = mbd.Coulomb(0.1), mbd.Coulomb(0.2, smoothing=1e-3)
    for loss, name in (dry + smooth, "coulomb 2"), (smooth + dry, "coulomb"):
        model, body = mbd.Model("slide"), mbd.PointMass("body", 1.0)
        model.connect(mbd.Translation("at", model.ground.origin, body.origin, **({"axes": "xyz"} if space else {})))
        model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=loss))
        start = mbd.assemble(model, closed=["foot"], velocity={"at.x": 2.0})
        changed = {f"foot friction.{name}.torque": 0.4}
        run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-2, until=0.2, parameters=changed)
        ends.append(run.final["at.x.rate"])
    np.testing.assert_allclose(ends, 2.0 - 0.5 * 9.81 * 0.2, rtol=1e-5)


@pytest.mark.parametrize(
    "loss",
    [
        mbd.Valves(mbd.Quadratic(1.0), mbd.Quadratic(2.0)),
        mbd.Valves(mbd.Viscous(1.0), mbd.Viscous(1.0)),  # whose sides parameters may tell apart
        mbd.Tabulated([-4.0, 0.0, 4.0], [-2.0, 0.0, 3.0]),
        mbd.Viscous(0.1) + mbd.Valves(mbd.Viscous(1.0), mbd.Viscous(2.0)),
    ],
    ids=["valves", "valves that begin alike", "tabulated", "sum"],
)
def test_a_loss_that_differs_by_direction_is_refused_by_name(loss):
    """A speed in space has no sign: what the loss is at negative rates was left out without a word."""
    with pytest.raises(mbd.ModelError, match="'hip loss': .*differs by the sign of a rate"):
        ball(loss, Rotation.identity())
