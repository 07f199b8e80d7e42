"""Sweeps and batches keep vectors, quaternions and Euler angles by their one name."""

import numpy as np
import pytest

import mbd

NAMES = ("tip.euler.zxy", "tip.angular_velocity", "tip.orientation", "top.center", "kinetic_energy")


def test_a_vector_by_name_is_kept_by_its_components():
    """Each is what the single run has at its end, in a sweep and in a batch."""
    model, body = mbd.Model("top"), mbd.RigidBody("top", 0.7, (0.004, 0.003, 0.002), center=(0.0, 0.0, 0.12))
    model.connect(mbd.Spherical("tip", model.ground.origin, body.origin))
    start = mbd.assemble(
        model,
        position={"tip.orientation": ("xyz", (-1.2, 0.1, 0.3))},
        velocity={"tip.angular_velocity": (0.3, 0.2, 40.0)},
    )
    scheme, masses = mbd.RungeKutta853(), [0.6, 0.7]
    sweep = mbd.sweep(model, {"top.mass": masses}, start, NAMES, integrator=scheme, dt=2e-3, until=0.05)
    batch = mbd.batch(model, start, scheme, 2e-3, until=0.05, parameters={"top.mass": masses}, results=NAMES)
    run = mbd.simulate(model, start, scheme, dt=2e-3, until=0.05)
    endings = {3: "xyz", 4: "wxyz"}
    for name in NAMES:
        end = np.atleast_1d(run[name][-1])
        parts = "123" if "euler" in name else endings.get(end.size)
        titles = [name] if parts is None else [f"{name}.{part}" for part in parts]
        assert [sweep.results[title][1] for title in titles] == end.tolist()
        assert [batch.results[title][1] for title in titles] == end.tolist()
    with pytest.raises(mbd.UnknownNameError, match="no result named 'tip.eulr.zxy'"):
        mbd.sweep(model, {"top.mass": masses}, start, ["tip.eulr.zxy"], integrator=scheme, dt=2e-3, until=0.05)
