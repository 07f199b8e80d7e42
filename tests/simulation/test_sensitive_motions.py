"""Motions that make round-off larger than a tolerance: the best run counts, in doubt, and keeps what motions keep."""

import numpy as np
import pytest

import mbd


def test_a_racket_that_turns_over_for_long_keeps_energy_and_momentum():
    """Its orientation after a hundred turns over hangs on the last bit of the start; energy and momentum do not."""
    model = mbd.Model("racket", gravity=(0.0, 0.0, 0.0))
    inertia = np.array([1.0, 2.0, 3.0])
    body = mbd.RigidBody("racket", 1.0, tuple(inertia))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
    start = mbd.assemble(model, velocity={"ball.angular_velocity": (0.001, 5.0, 0.0)})
    with pytest.warns(mbd.MbdWarning, match="above tol = 1e-09: the motion is so sensitive that round-off alone"):
        run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=1000.0)
    assert run.success and run.time[-1] == 1000.0
    assert 3e-9 < run.stats["tolerance"]["estimated"] < 3e-5
    rates = run["ball.angular_velocity"]
    energy = 0.5 * rates**2 @ inertia
    assert np.ptp(energy) < 1e-9 * energy[0]
    w, u = run["ball.orientation"][:, :1], run["ball.orientation"][:, 1:]
    own = rates * inertia
    across = np.cross(u, own)
    momentum = own + 2.0 * w * across + 2.0 * np.cross(u, across)
    assert np.max(np.abs(momentum - momentum[0])) < 1e-9 * np.linalg.norm(momentum[0])
