"""The first view of a spatial run: sides apart, stops as cones, and the page's numbers."""

import numpy as np
import pytest

import mbd
from mbd.view.camera import FIRST, camera
from mbd.view.geometry import first_view
from mbd.view.page import content
from mbd.view.scene import scene


def standing(heading, hip=0.12, swing=0.5):
    """A pelvis with two legs, one ahead of the other, that looks in a direction."""
    model = mbd.Model("stand")
    pelvis = mbd.RigidBody("pelvis", mass=10.0, inertia=(0.1, 0.1, 0.1))
    model.connect(mbd.Free("base", model.ground.origin, pelvis.origin))
    for name, z in (("left", -hip), ("right", hip)):
        leg = mbd.Link(f"{name} leg", mass=4.0, length=0.9, center=0.4, inertia=(0.2, 0.01, 0.2))
        model.connect(mbd.Revolute(f"{name} hip", pelvis.point(0.0, 0.0, z, name=f"{name} socket"), leg.start))
    position = {
        "base.y": 1.0, "base.orientation": ((0, 1, 0), heading), "left hip.angle": swing, "right hip.angle": -swing,
    }  # fmt: skip
    return mbd.simulate(model, mbd.assemble(model, position=position), dt=1e-3, until=0.1)


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.0, 3.0])
def test_a_walker_comes_to_the_right_and_toward_the_viewer_with_its_sides_apart(heading):
    run = standing(heading)
    yaw, pitch = first_view(scene(run, 20))
    eye = camera(yaw, pitch)
    forward = np.array([np.cos(heading), 0.0, -np.sin(heading)])
    assert eye[0] @ forward > 0.3 and eye[2] @ forward > 0.3
    turned = (yaw + heading + np.deg2rad(55.0) + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(turned) < np.deg2rad(11.0)


def test_without_sides_the_view_is_the_usual_one():
    model = mbd.Model("top")
    body = mbd.RigidBody("body", mass=1.0, inertia=(0.1, 0.2, 0.1))
    joint = mbd.Spherical("tip", model.ground.origin, body.point(0.0, 0.4))
    model.connect(joint)
    model.constrain(mbd.Unilateral("cone", mbd.cone(joint, 0.6)))
    run = mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=0.05)
    picture = scene(run, 5)
    assert first_view(picture) == FIRST
    (stop,) = picture.stops  # the body hangs below the tip, and so does the cone
    np.testing.assert_allclose(stop.axis, np.tile([0.0, -1.0, 0.0], (len(stop.axis), 1)), atol=1e-12)
    assert content(run, picture)["cones"][0]["angle"] == 0.6
