"""Arrows of forces: with the weight they make up what moves the mechanism, whichever words hold it."""

import numpy as np
import pytest

import mbd
from mbd.view.scene import scene

UP = (0, 1, 0)


def wheel(held, normal, velocity=(0.0, 0.0, 0.0)):
    """A disk that rolls, on words of every kind."""
    gravity = tuple(-9.81 * part for part in np.asarray(normal) / np.linalg.norm(normal) + [0.1, 0.05, -0.03])
    model = mbd.Model("wheel", gravity=gravity)
    disk = mbd.RigidBody("disk", 2.0, (0.01, 0.01, 0.02))
    model.connect(mbd.Free("float", model.ground.origin, disk.origin))
    ground = mbd.Plane(normal, velocity=velocity)
    edge = mbd.disk_touchdown(disk.origin, 0.15, (0.1, 0.2, 1.0), ground)
    if held == "rolls":
        model.constrain(
            mbd.Bilateral("edge", edge), mbd.Rolling("grip", disk.origin, 0.15, ground, axis=(0.1, 0.2, 1.0))
        )
    elif held == "dunes":
        edge = mbd.disk_touchdown(disk.origin, 0.15, (0.1, 0.2, 1.0), lambda x, z: 0.1 * mbd.sin(x + z))
        model.constrain(mbd.Unilateral("edge", edge, friction=0.3))
    else:
        model.constrain(mbd.Unilateral("edge", edge, friction=0.3))
    return model


@pytest.mark.parametrize("velocity", [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0)], ids=["at rest", "a belt"])
@pytest.mark.parametrize(
    ("held", "normal"),
    [*((held, normal) for held in ("rolls", "slides") for normal in (UP, (0, 0, 1), (0, 0, -1), (0.3, 0.8, -0.4))),
     ("dunes", UP)],
)  # fmt: skip
def test_arrows_and_weight_are_mass_times_acceleration(held, normal, velocity):
    model = wheel(held, normal, velocity)
    turn = ("xyz", (1.2, 0.3, 0.4)) if abs(normal[2]) > 0.9 else ("xyz", (0.3, 0.2, 0.1))
    closed = [] if held == "rolls" else "edge"
    start = mbd.assemble(
        model, {"float.orientation": turn}, {"float.angular_velocity.z": 2.0}, closed=closed, project=True
    )
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=0.02)
    picture = scene(run, 10)
    (push,) = picture.pushes
    a = picture.instants.read(run, [f"float.{axis}.acceleration" for axis in "xyz"])
    weight = 2.0 * np.array([run.parameters[f"gravity.{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(push.force @ picture.turn, 2.0 * a - weight, atol=1e-8)
    if held != "dunes":
        moved = push.place @ picture.turn - picture.instants.time[:, None] * np.asarray(velocity)
        lift = moved @ (np.asarray(normal) / np.linalg.norm(normal))
        np.testing.assert_allclose(lift, lift[0], atol=1e-8)
