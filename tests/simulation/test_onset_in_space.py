"""As sliding begins or turns around in space: friction at rows is that which moves the body; steps do not multiply."""

import numpy as np
import pytest

import mbd

G, MU, NORMAL = 9.81, 0.49685, (-0.1311, 0.98443, -0.11712)
LEAN = (np.cos(0.10309), np.sin(0.10309), 0.0, 0.0)


def test_an_uneven_ball_that_rolls_and_slips_takes_steps_of_dt():
    model = mbd.Model("ball", gravity=(0.0, -G, 0.0))
    ball = mbd.RigidBody("ball", 0.5, (3e-4, 2.5e-4, 2.8e-4), center=(-0.008291, -0.01994, 0.018938))
    model.connect(mbd.Free("free", model.ground.origin, ball.origin))
    model.constrain(mbd.Unilateral("touch", mbd.sphere_touchdown(ball.origin, 0.05), friction=0.2492))
    rates = {"free.x": 0.78342, "free.z": 0.17033, "free.angular_velocity": (-1.14761, 10.93108, -18.78616)}
    start = mbd.assemble(model, {"free.y": 0.05}, rates, project=True)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=5e-4, until=0.56)
    assert len(run) < 1300  # a friction over its own size counted with the terms that it is made of: two million rows


def disk():
    """A leaning disk over a tilted plane that runs."""
    model = mbd.Model("disk", gravity=(0.0, -G, 0.0))
    body = mbd.RigidBody("body", 1.908, (0.00563, 0.00563, 0.01092))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    plane = mbd.Plane(NORMAL, 0.0, velocity=(0.6, 0.0, -0.4))
    touch = mbd.disk_touchdown(body.origin, 0.16767, (0, 0, 1), plane)
    model.constrain(mbd.Unilateral("edge", touch, friction=MU))
    return model


def forces(run):
    """Contact force in ground axes, (rows, 3)."""
    normal = np.array(NORMAL) / np.linalg.norm(NORMAL)
    flat = 1.0 - normal[2] ** 2
    sideways = np.array([-normal[2] * normal[0], -normal[2] * normal[1], flat]) / np.sqrt(flat)
    parts = ("force", normal), ("friction.forward", np.cross(normal, sideways)), ("friction.sideways", sideways)
    return sum(run[f"edge.{name}"][:, None] * direction for name, direction in parts)


@pytest.mark.parametrize("scheme", [mbd.GeneralizedAlpha(0.9), mbd.HHT(0.05)], ids=lambda s: type(s).__name__)
def test_friction_as_sliding_begins_is_that_which_moves_the_disk(scheme):
    model = disk()
    start = mbd.assemble(model, {"float.y": 0.1811, "float.orientation": LEAN}, project=True)
    for how in {"tol": 4.8e-5}, {"dt": 1e-4}:
        run = mbd.simulate(model, start, scheme, until=0.2, **how)
        assert [event.kind for event in run.events][-1] == "slipped"
        a = np.stack([run[f"float.{axis}.acceleration"] for axis in "xyz"], axis=1) + np.array([0.0, G, 0.0])
        off = np.linalg.norm(1.908 * a - forces(run), axis=1)
        assert np.max(off) < 1e-5 * np.max(run["edge.force"])  # 2e-4 where γ over its size counted as large


def test_what_nearly_rests_and_turns_around_slides_on():
    model = disk()
    start = mbd.assemble(model, {"float.y": 0.18112, "float.orientation": LEAN}, project=True)
    run = mbd.simulate(model, start, mbd.HHT(0.3), dt=1.152e-2, until=0.33)
    pushes = run["edge.force"]
    size = np.linalg.norm(np.stack([run["edge.friction.forward"], run["edge.friction.sideways"]]), axis=0)
    slides = (run.time > run.events[2].time) & (pushes > 0.0)
    np.testing.assert_allclose(size[slides], MU * pushes[slides], rtol=1e-9)
    assert [event.kind for event in run.events] == ["closed", "stuck", "slipped"]
    turn = np.unwrap(np.arctan2(run["edge.friction.sideways"][slides], run["edge.friction.forward"][slides]))
    assert np.max(np.abs(np.diff(turn))) < 0.6  # it turned to another direction at once where a rest was made up
