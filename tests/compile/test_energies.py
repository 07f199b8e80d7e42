"""Energies at many states: the same by numpy and by machine code."""

import numpy as np
import pytest

import mbd
from mbd.compile.energies import MIN_CALLS, MIN_STATES
from mbd.compile.mechanisms import mechanism_of
from mbd.results.stored_states import StoredStates


def scene(spatial):
    model = mbd.Model("bodies", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("first", 1.3, (0.02, 0.03, 0.04), center=(0.1, -0.2, 0.05))
    first = body if spatial else mbd.Link("first", 1.3, 0.4, 0.2)
    second = mbd.RigidBody("second", 0.7, (0.01, 0.02, 0.015) if spatial else 0.02)
    joint = mbd.Spherical if spatial else mbd.Revolute
    model.connect(joint("hip", model.ground.origin, body.origin if spatial else first.start))
    tip = first.point(0.0, -0.4, 0.1 if spatial else 0.0)
    model.connect(mbd.Revolute("knee", tip, second.point(0.0, 0.3, 0.0), stiffness=3.0, loss=mbd.Viscous(0.1)))
    speed = {"hip.angular_velocity": (0.4, 1.1, -0.6)} if spatial else {"hip.angle": 1.4}
    return model, mbd.assemble(model, {"knee.angle": 0.4}, {**speed, "knee.angle": -2.0})


@pytest.mark.parametrize("spatial", [False, True])
def test_machine_code_and_numpy_agree(spatial):
    model, start = scene(spatial)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.5)
    mechanism, record = mechanism_of(model), run.record
    energies = mechanism.energies
    inputs = StoredStates.inputs(record.rows(np.zeros((len(record.time), mechanism.layout.n_anchors))))
    energies.calls = 0
    plain = energies(inputs, record.parameters)
    energies.calls = MIN_CALLS
    machine = energies(inputs, record.parameters)
    several = energies(inputs, np.tile(record.parameters, (len(record.time), 1)))
    assert len(record.time) <= MIN_STATES
    for a, b, c in zip(plain, machine, several, strict=True):
        np.testing.assert_allclose(b, a, rtol=0.0, atol=1e-14 * np.max(np.abs(a)))
        np.testing.assert_array_equal(b, c)


def test_the_plain_twin_has_no_machine_code():
    model, start = scene(False)
    mechanism = mechanism_of(model, "python")
    energies, inputs = mechanism.energies, {"t": np.zeros(1), "q": start.q[None], "v": start.v[None]}
    energies.calls = MIN_CALLS
    assert energies(inputs | {"z": np.zeros((1, 0))}, mechanism.parameters())[0] > 0.0
