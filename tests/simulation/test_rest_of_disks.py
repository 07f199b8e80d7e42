"""A disk that slides to rest while its friction turns and loads it, and one that falls flat: every row is true."""

import functools

import numpy as np
import pytest

import mbd
from tests.fuzz.scenes import scene
from tests.fuzz.structures import SPACE
from tests.fuzz.verdict import run_of

RADIUS = 0.168


@functools.cache
def leaning():
    """A leaning disk over a tilted plane that runs, thrown onto it: friction loads its edge, and turns as it slows."""
    model = mbd.Model("disk", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("body", 1.12, (0.0089, 0.0089, 0.0118))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    plane = mbd.Plane((-0.1311, 0.98443, -0.11712), 0.0, velocity=(0.6, 0.0, -0.4))
    touch = mbd.disk_touchdown(body.origin, RADIUS, (0, 0, 1), plane)
    model.constrain(mbd.Unilateral("edge", touch, friction=0.7))
    start = mbd.assemble(
        model,
        {"float.y": 0.1811, "float.orientation": (np.cos(0.1031), np.sin(0.1031), 0.0, 0.0)},
        {"float.x": 4.73, "float.y": -2.36, "float.z": 1.23, "float.angular_velocity": (0.33, -0.71, -12.4)},
    )
    return model, start


def slid(scheme, **how):
    run = mbd.simulate(*leaning(), scheme, until=0.05, **how)
    return run, next(event.time for event in run.events if event.kind == "stuck")


@pytest.mark.parametrize(
    "scheme", [mbd.GeneralizedAlpha(0.0), mbd.HHT(0.05), mbd.Newmark(), mbd.RadauIIA()], ids=lambda s: type(s).__name__
)
def test_a_disk_whose_friction_turns_and_loads_it_comes_to_rest(scheme):
    _, exact = slid(mbd.RungeKutta853(), tol=1e-9)
    run, stop = slid(scheme, dt=1.7e-3)
    finer, nearer = slid(scheme, dt=4.25e-4)
    assert abs(nearer - exact) < 0.5 * abs(stop - exact) < 5e-5
    assert [event.kind for event in run.events] == [event.kind for event in finer.events]
    assert len(run) < 100  # its steps become shorter as it slows, each half as long, and then there are none
    (part,) = [part for part in run.energy.parts if part.name == "edge friction"]
    assert np.max(np.diff(part.energy)) < 1e-12  # friction takes energy in every step, however uneven they are


def test_a_disk_that_falls_flat_ends_without_a_row_beyond_it():
    model = mbd.Model("flat", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("body", 1.45, (0.0174, 0.0174, 0.0193))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    touch = mbd.disk_touchdown(body.origin, 0.229, (0, 0, 1))
    model.constrain(mbd.Unilateral("edge", touch, restitution=0.4, friction=1.16))
    start = mbd.assemble(model, {"float.y": 0.27, "float.orientation": (np.cos(0.272), np.sin(0.272), 0.0, 0.0)})
    run = mbd.simulate(model, start, mbd.Newmark(0.3025, 0.6), dt=6.3e-3, until=0.6, on_failure="return")
    assert not run.success
    assert "'edge'" in run.message
    jumps = np.abs(np.diff(run["float.angular_velocity.x"]))[np.diff(run.time) > 0.0]
    assert np.max(jumps) < 1.0  # the edge that touches changes side: its velocity row is another one there


@pytest.mark.parametrize("tilt", [0.0, 1e-12])
@pytest.mark.parametrize(
    "scheme", [mbd.GeneralizedAlpha(0.5), mbd.HHT(0.05), mbd.Newmark(), mbd.RadauIIA()], ids=lambda s: type(s).__name__
)
def test_forces_balance_after_a_start_in_which_a_disk_lies_flat(scheme, tilt):
    """There the terms of its force have no limit, and any residual of the steps after it passed beside them."""
    model = mbd.Model("disk", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("body", 1.0, (0.013, 0.013, 0.016))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    model.constrain(mbd.Penalty("mat", mbd.disk_touchdown(body.origin, 0.22, "z"), stiffness=6500.0, damping=20.0))
    flat = {"float.y": -0.0013, "float.orientation": ((1, 0, 0), -0.5 * np.pi + tilt)}
    start = mbd.assemble(model, flat, {"float.angular_velocity": (-6.8, 1.66, 0.0)}, closed="mat")
    run = mbd.simulate(model, start, scheme, dt=2e-4, until=1e-3)
    unbalanced = run["float.y.acceleration"] + 9.81 - run["mat.force"]
    assert np.max(np.abs(unbalanced[1:])) < 2e-4 * np.max(run["mat.force"])  # 100 times the forces themselves


def test_a_mat_that_would_pull_presses_again_only_where_its_force_does():
    """A disk leaves as that force comes to zero, whatever sign round-off has, and presses with its other edge."""
    made = scene(SPACE + 1_003_213)
    kinds = [[event.kind for event in run_of(made, backend=backend).events] for backend in ("auto", "python")]
    assert kinds == [["closed", "opened"] * 3 + ["closed"]] * 2


@pytest.mark.parametrize("tol", [4.2e-8, 1.3e-7])
def test_a_disk_rolls_over_almost_flat_with_every_tolerance(tol):
    """Its edge runs around fast there: a correction that is good by luck makes the next one look like round-off."""
    run = run_of(scene(7441502), tol=tol)
    assert run.success, run.message
    assert run.stats["tolerance"]["estimated"] <= tol
