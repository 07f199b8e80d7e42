"""Friction of penalty contacts: opposite to sliding in the plane of contact; it dissipates, slows, creeps at rest."""

from functools import lru_cache

import numpy as np
import pytest

import mbd
from mbd.constraints.penalty import CREEP_SPEED

G, MASS, MU = 9.81, 2.0, 0.3
UP = mbd.Plane(normal=(0.0, 0.0, 1.0))


@lru_cache(maxsize=8)
def pressed(slope=0.0, ground=UP, spatial=True, **law):
    """A mass on a mat that falls along x."""
    model = mbd.Model("pressed", gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)))
    ball = mbd.PointMass("ball", MASS)
    model.connect(mbd.Translation("slide", model.ground.origin, ball.origin, axes="xyz" if spatial else "xz"))
    how = {"stiffness": 2e4, "damping": 200.0, "release": "pull", "friction": MU} | law
    model.constrain(mbd.Penalty("mat", mbd.touchdown(ball.origin, ground), **how))
    return model


def slid(model, speed, depth=None, slope=0.0, values=None, **how):
    stiffness = (values or {}).get("mat.stiffness", 2e4)
    low = -MASS * G * np.cos(slope) / stiffness if depth is None else -depth
    x, y = speed
    velocity = {"slide.x": x} if y is None else {"slide.x": x, "slide.y": y}
    start = mbd.assemble(model, position={"slide.z": low}, velocity=velocity, closed="mat", parameters=values)
    return mbd.simulate(model, start, mbd.RadauIIA(), **{"dt": 2e-3, "until": 0.8, "parameters": values} | how)


def test_it_slows_along_a_line_dissipates_and_comes_to_the_place_of_rigid_friction_as_it_gets_stiffer():
    place = np.array([0.8, 0.6]) * 1.5**2 / (2.0 * MU * G)
    errors = []
    for stiffness, damping, creep in ((2e4, 400.0, 1e-2), (2e6, 4e3, 1e-3)):
        values = {"mat.stiffness": stiffness, "mat.damping": damping, "mat.creep": creep}
        run = slid(pressed(), (1.2, 0.9), depth=0.0, values=values, dt=1e-3)  # the weight presses it in
        errors.append(np.max(np.abs(np.array([run["slide.x"][-1], run["slide.y"][-1]]) - place)))
        assert np.max(np.diff(run.energy["total"])) < 1e-9
        gamma = np.array([run["slide.x.rate"], run["slide.y.rate"]])
        force = np.array([run["mat.friction.forward"], run["mat.friction.sideways"]])
        law = -MU * run["mat.force"] * gamma / np.sqrt(np.sum(gamma**2, axis=0) + creep**2)
        assert np.allclose(force, law, atol=1e-9)
        assert np.max(np.abs(0.6 * gamma[0] - 0.8 * gamma[1])) < 1e-12
    assert errors[1] < 0.11 * errors[0] < 2e-3


@pytest.mark.parametrize("load", [0.5, 0.95])
def test_under_a_load_below_the_limit_it_creeps_as_the_law_says(load):
    slope = np.arctan(load * MU)
    run = slid(pressed(slope), (0.0, 0.0), slope=slope)
    assert run["slide.x.rate"][-1] == pytest.approx(CREEP_SPEED * load / np.sqrt(1.0 - load**2), rel=1e-6)
    assert abs(run["slide.y"][-1]) < 1e-15


def test_in_a_plane_it_is_that_of_space():
    one, other = slid(pressed(), (1.0, 0.0), until=0.3), slid(pressed(spatial=False), (1.0, None), until=0.3)
    assert np.allclose(one["slide.x"], other["slide.x"], atol=1e-14)
    assert np.allclose(one["mat.friction.forward"], other["mat.friction.forward"], atol=1e-12)


def test_a_ball_on_a_mat_slides_then_rolls():
    """As on a rigid plane: v = v₀ − 2/7 u₀, but for what it creeps."""
    model, mass, radius = mbd.Model("ball", gravity=(0.0, 0.0, -G)), 0.17, 0.028575
    body = mbd.RigidBody("ball", mass, (0.4 * mass * radius**2,) * 3)
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    cloth = mbd.sphere_touchdown(body.origin, radius, UP)
    model.constrain(mbd.Penalty("cloth", cloth, 2e4, damping=20.0, friction=0.2, creep=1e-4))
    start = mbd.assemble(
        model, position={"float.z": radius - mass * G / 2e4}, closed="cloth",
        velocity={"float.x.rate": 1.5, "float.angular_velocity": (20.0, -30.0, 45.0)},
    )  # fmt: skip
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.5)
    assert [run["float.x.rate"][-1], run["float.y.rate"][-1]] == pytest.approx([0.8265, -0.16328571428571428], abs=1e-4)


def test_on_a_height_function_it_acts_along_the_surface_of_now():
    """In a bowl of soft walls: friction has no part along the normal, and takes what the energy loses."""
    model = mbd.Model("bowl", gravity=(0.0, -G, 0.0))
    ball = mbd.PointMass("ball", MASS)
    model.connect(mbd.Translation("slide", model.ground.origin, ball.origin, axes="xyz"))
    bowl = mbd.touchdown(ball.origin, lambda x, z: 0.5 * (x * x + z * z))
    model.constrain(mbd.Penalty("mat", bowl, 5e4, friction=0.2))
    start = mbd.assemble(
        model, position={"slide.x": 0.4, "slide.y": 0.08 - 3e-4}, velocity={"slide.z": 1.0}, closed="mat"
    )
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=2e-3, until=0.5)
    lost = run.energy["total"][-1] - run.energy["total"][0]
    assert lost < -0.2
    assert run.energy["mat friction"][-1] + run.energy["mat"][-1] == pytest.approx(lost, abs=1e-6)
    assert np.all(np.diff(run.energy["mat friction"]) <= 1e-12)
    x, z = run["slide.x"], run["slide.z"]
    u, w = run["slide.x.rate"], run["slide.z.rate"]
    v = x * u + z * w  # along the surface, into which it does not go much deeper
    along = np.sqrt(u * u + v * v + w * w)
    pull = np.hypot(run["mat.friction.forward"], run["mat.friction.sideways"])
    assert pull == pytest.approx(0.2 * run["mat.force"] * along / np.sqrt(along**2 + CREEP_SPEED**2), rel=2e-2)


def test_what_makes_no_sense_is_refused_by_name_and_what_is_absent_leaves_nothing():
    ball = mbd.PointMass("ball", MASS)
    for law, told in (({"friction": -0.1}, "friction -0.1"), ({"friction": 0.1, "creep": 0.0}, "creep 0")):
        assert any(told in fault for fault in pressed(**law).check())
    model = mbd.Model("height")
    model.connect(mbd.Translation("slide", model.ground.origin, ball.origin, axes="xyz"))
    model.constrain(mbd.Penalty("mat", mbd.height(ball.origin), 1e4, friction=0.3))
    assert any("no direction to slide in; use mbd.touchdown" in fault for fault in model.check())
    assert "mat.mu" not in pressed(friction=0.0).parameters
    assert pressed().without("mat friction").constraints[0].friction == 0.0
