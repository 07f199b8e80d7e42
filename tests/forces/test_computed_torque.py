"""M and h as arguments of laws: with them the motion is that of the law alone."""

import math
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.errors import MbdError


def arm(law: Any, arguments: Any) -> tuple[mbd.Model, mbd.State]:
    """Two links with a drive on each joint; `law` gives both torques."""
    model = mbd.Model("arm")
    upper = mbd.Link("upper", mass=2.0, length=0.4, center=0.15, inertia=0.03)
    lower = mbd.Link("lower", mass=1.0, length=0.3, center=0.12, inertia=0.01)
    joints = mbd.Revolute("shoulder", model.ground.origin, upper.start), mbd.Revolute("elbow", upper.end, lower.start)
    model.connect(*joints)
    for k, joint in enumerate(joints):
        model.apply(mbd.Motor(f"{joint.name} drive", joint, torque=lambda *x, k=k: law(*x)[k], arguments=arguments))
    return model, mbd.assemble(model, {"shoulder.angle": 0.7, "elbow.angle": -0.4}, {"elbow.rate": 1.0})


def test_computed_torque_makes_errors_those_of_a_linear_oscillator() -> None:
    def law(M: Any, h: Any, q1: Any, q2: Any, v1: Any, v2: Any, t: Any) -> Any:
        goal = 0.5 * mbd.sin(2.0 * t), 1.0 * mbd.cos(t)
        speed = 1.0 * mbd.cos(2.0 * t), -1.0 * mbd.sin(t)
        push = -2.0 * mbd.sin(2.0 * t), -1.0 * mbd.cos(t)
        u = [
            a - 40.0 * (q - g) - 4.0 * (v - s)
            for a, q, g, v, s in zip(push, (q1, q2), goal, (v1, v2), speed, strict=True)
        ]
        return [M[k][0] * u[0] + M[k][1] * u[1] + h[k] for k in range(2)]

    names = ["shoulder.angle", "elbow.angle", "shoulder.rate", "elbow.rate", "t"]
    joints = ("shoulder", "elbow")
    model, start = arm(law, [mbd.mass_matrix(*joints), mbd.bias_forces(*joints), *names])
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=2.0)
    w = math.sqrt(36.0)  # e" + 4 e' + 40 e = 0
    for name, goal, begun in (
        ("shoulder.angle", 0.5 * np.sin(2.0 * run.time), (0.7, -1.0)),
        ("elbow.angle", np.cos(run.time), (-1.4, 1.0)),
    ):
        e0, v0 = begun
        e = np.exp(-2.0 * run.time) * (e0 * np.cos(w * run.time) + (v0 + 2.0 * e0) / w * np.sin(w * run.time))
        np.testing.assert_allclose(run[name] - goal, e, atol=1e-10)
    hht = mbd.simulate(model, start, mbd.HHT(alpha=0.0), dt=1e-3, until=1.0)
    np.testing.assert_allclose(hht.final["elbow.angle"], run.at(1.0)["elbow.angle"], atol=1e-4)


def test_a_part_of_the_mass_matrix_has_others_as_if_held_and_wrong_names_are_errors() -> None:
    model, _ = arm(lambda M, h: [M[0][0] * 0.0 + h[0], 0.0], [mbd.mass_matrix("elbow"), mbd.bias_forces("shoulder")])
    run = mbd.simulate(model, mbd.assemble(model, {"elbow.angle": 0.3}), mbd.RungeKutta853(), dt=0.01, until=0.1)
    assert run.success
    with pytest.raises(MbdError, match="no coordinate of the tree named 'elbw'"):
        arm(lambda M: [M[0][0], 0.0], [mbd.mass_matrix("elbw")])
    with pytest.raises(MbdError, match="mass_matrix needs names of coordinates"):
        mbd.mass_matrix()
