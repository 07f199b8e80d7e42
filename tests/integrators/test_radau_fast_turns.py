"""Bodies that turn by a radian in a step: one Newton matrix does not do for all stages, each takes its own masses."""

from typing import Any

import numpy as np
import pytest

import mbd


def rolling(table: float, speed: float, pivot: float, radius: float) -> tuple[Any, Any]:
    """A ball that rolls on a table that turns, from 0.1 m beside its axis."""
    model = mbd.Model("turntable", gravity=(0.0, 0.0, -9.81))
    ball, disk = mbd.RigidBody("ball", **mbd.sphere(0.5, radius).body), mbd.RigidBody("table", 1.0, (1.0, 1.0, 1.0))
    axle = mbd.Revolute("axle", model.ground.origin, disk.origin, axis=(0.0, 0.0, 1.0))
    model.connect(mbd.Free("fly", model.ground.origin, ball.origin), axle)
    top = mbd.Plane(normal=(0.0, 0.0, 1.0), frame=disk.origin)
    model.constrain(
        mbd.Bilateral("drive", axle, value=lambda t: table * t),
        mbd.Bilateral("touch", mbd.sphere_touchdown(ball.origin, radius, top)),
        mbd.Rolling("grip", ball.origin, radius, top, ball=True),
    )
    return model, mbd.assemble(
        model, position={"fly.z": radius, "fly.x": 0.1},
        velocity={"fly.x": speed, "fly.y": 0.0, "fly.angular_velocity.z": pivot},
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
def test_a_ball_on_a_turntable_goes_in_circles_in_steps_of_a_radian(seed: int) -> None:
    """``v̇ = (2/7) Ω × v`` of a homogeneous ball (Earnshaw 1844), whatever its spin."""
    rng = np.random.default_rng(seed)
    table, speed, pivot = rng.uniform(2.0, 4.0), rng.uniform(1.5, 2.5), rng.choice([0.0, 20.0])
    model, start = rolling(table, speed, pivot, 0.05)
    rate = 2.0 / 7.0 * table
    off = {}
    for dt in (2.5e-3, 5e-3, 1e-2):  # the ball turns by up to 0.6 rad, 1.2 rad, and 2.4 rad, in a step
        run = mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=3.0)
        x = 0.1 + speed / rate * np.sin(rate * run.time)
        y = speed / rate * (1.0 - np.cos(rate * run.time))
        off[dt] = max(float(np.max(np.abs(run["fly.x"] - x))), float(np.max(np.abs(run["fly.y"] - y))))
        assert run.violation.rate < 1e-9 and (dt == 1e-2 or run.stats["shortened"] == 0), (table, speed, pivot, dt)
    assert off[2.5e-3] < max(off[5e-3] / 16.0, 1e-8), (table, speed, pivot, off)
    assert off[2.5e-3] < 2e-6 and off[1e-2] < 1e-4, (table, speed, pivot, off)
