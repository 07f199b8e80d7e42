"""Explicit schemes slide in space: straight, where errors across vanish, and from the onset on, which is stiff."""

import warnings

import numpy as np
import pytest

import mbd

G = 9.81


def thrown_block(seed):
    """A block on a level floor, thrown along one of its axes or across: it stops after v²/(2 μ g)."""
    rng = np.random.default_rng(seed)
    friction, speed, size = rng.uniform(0.1, 0.9), 10.0 ** rng.uniform(-1.0, 1.0), 10.0 ** rng.uniform(-3.0, 3.0)
    angle = [0.0, 0.5 * np.pi, np.pi, rng.uniform(0.0, 2.0 * np.pi)][seed % 4]
    model = mbd.Model("block", gravity=(0.0, -G, 0.0))
    block = mbd.PointMass("block", size)
    model.connect(mbd.Translation("slide", model.ground.origin, block.origin, axes="xyz"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin), friction=friction))
    velocity = {"slide.x": speed * [1.0, 0.0, -1.0, np.cos(angle)][seed % 4]}
    velocity["slide.z"] = speed * [0.0, 1.0, 0.0, np.sin(angle)][seed % 4]
    start = mbd.assemble(model, velocity=velocity, closed="foot")
    return model, start, speed / (friction * G), 0.5 * speed**2 / (friction * G)


@pytest.mark.parametrize("scheme", [mbd.RungeKutta4(), mbd.RungeKutta853()], ids=repr)
@pytest.mark.parametrize("step", [{"tol": 1e-4}, {"tol": 1e-8}, {"dt": 2e-3}])
def test_a_block_slides_straight_in_space_until_it_stops(scheme, step):
    for seed in range(8):
        model, start, stop, distance = thrown_block(seed)
        run = mbd.simulate(model, start, scheme, until=1.2 * stop, **step)
        (stuck,) = run.events
        assert stuck.time == pytest.approx(stop, rel=1e-6), seed
        assert np.hypot(run["slide.x"][-1], run["slide.z"][-1]) == pytest.approx(distance, rel=1e-5), seed


@pytest.mark.parametrize("backend", ["llvm", "python"])
@pytest.mark.parametrize("scheme", [mbd.RungeKutta4(), mbd.RungeKutta853()], ids=repr)
def test_a_disk_that_friction_cannot_hold_slips_from_the_start(scheme, backend):
    for seed in range(4 if backend == "llvm" else 1):
        rng = np.random.default_rng(seed)
        mass, radius, slope = np.exp(rng.normal()), rng.uniform(0.1, 1.0), rng.uniform(0.2, 0.9)
        friction = rng.choice([0.5, 0.9, 0.99, 0.999] if backend == "llvm" else [0.5]) * np.tan(slope) / 3.0
        model = mbd.Model("disk", gravity=(G * np.sin(slope), 0.0, -G * np.cos(slope)))
        J = mass * radius**2
        disk = mbd.RigidBody("disk", mass, (0.25 * J, 0.5 * J, 0.25 * J))
        model.connect(mbd.Free("free", model.ground.origin, disk.origin))
        touch = mbd.disk_touchdown(disk.origin, radius, (0, 1, 0), mbd.Plane(normal=(0, 0, 1.0)))
        model.constrain(mbd.Unilateral("rim", touch, friction=friction))
        start = mbd.assemble(model, position={"free.z": radius}, closed="rim")
        forward = G * (np.sin(slope) - friction * np.cos(slope))
        turning = 2.0 * friction * G * np.cos(slope) / radius
        with warnings.catch_warnings():
            warnings.simplefilter("error", mbd.MbdWarning)
            run = mbd.simulate(model, start, scheme, dt=float(rng.choice([1e-2, 2e-3])), until=0.1, backend=backend)
        slip = run["free.x.rate"] - radius * run["free.angular_velocity.y"]
        np.testing.assert_allclose(slip[1:], (forward - radius * turning) * run.time[1:], rtol=1e-6)
        assert not [note for note in run.stats["notes"] if "not resolved by" in note]
