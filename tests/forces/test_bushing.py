"""A bushing: the oscillator that it makes, in space and in the plane, and a stiff one that is a weld."""

from __future__ import annotations

import numpy as np
import pytest

import mbd


def held(flat, **how):
    """A body held by a bushing alone, about its center."""
    model = mbd.Model("held", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 2.0, (0.3, 0.4, 0.5))
    model.connect((mbd.Planar if flat else mbd.Free)("float", model.ground.origin, body.origin))
    model.apply(mbd.Bushing("mount", model.ground.origin, body.origin, **how))
    return model


def test_a_body_on_a_bushing_has_six_frequencies():
    model = held(False, stiffness=(200.0, 300.0, 400.0), rotational_stiffness=(30.0, 20.0, 10.0))
    found = mbd.linearize(model, mbd.assemble(model)).frequencies
    expected = np.sqrt([100.0, 150.0, 200.0, 100.0, 50.0, 20.0])
    np.testing.assert_allclose(np.sort(found)[::2], np.sort(expected), rtol=1e-9)


def test_in_the_plane_it_is_two_springs_and_one_about_z():
    model = held(True, stiffness=200.0, rotational_stiffness=10.0, damping=4.0, rotational_damping=0.5)
    start = mbd.assemble(model, {"float.x": 0.1, "float.angle": 0.2})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=1.0)
    for name, first, k, c, m in (("x", 0.1, 200.0, 4.0, 2.0), ("angle", 0.2, 10.0, 0.5, 0.5)):
        decay, rate = c / (2 * m), np.sqrt(k / m - (c / (2 * m)) ** 2)
        t = run.time
        exact = first * np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
        np.testing.assert_allclose(run[f"float.{name}"], exact, atol=1e-9)
    assert np.max(np.abs(run.energy.numerical)) < 1e-9
    np.testing.assert_allclose(run["mount.rotation_vector.z"], run["float.angle"], atol=1e-14)


def test_in_space_it_keeps_energy_and_is_seen_from_either_side_alike_where_it_is_isotropic():
    ends = []
    for swap in (False, True):
        model = mbd.Model("two")
        one, two = (mbd.RigidBody(name, 1.0, (0.02, 0.03, 0.04), center=(0.0, -0.1, 0.05)) for name in ("one", "two"))
        model.connect(mbd.Universal("cross", model.ground.origin, one.origin))
        model.connect(mbd.Free("float", model.ground.origin, two.origin))
        frames = (one.point(0.0, -0.3, 0.0), two.origin)
        a, b = frames[::-1] if swap else frames
        model.apply(mbd.Bushing("mount", a, b, rotational_stiffness=5.0, rotational_damping=0.05))
        model.apply(mbd.Spring("spring", *frames, stiffness=300.0))
        start = mbd.assemble(model, {"float.y": -0.3, "float.orientation": ((1, 2, 3), 0.7)}, {"cross.first": 2.0})
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.5)
        assert np.max(np.abs(run.energy.numerical)) < 1e-7
        ends.append(np.concatenate([run["one.center"][-1], run["two.center"][-1], run["float.angular_velocity"][-1]]))
    np.testing.assert_allclose(*ends, atol=1e-8)


@pytest.mark.parametrize(("given", "fault"), [
    ({"stiffness": (1.0, 2.0, -3.0)}, "stiffness.z -3 is negative"),
    ({"damping": "x"}, "damping of 'mount' must be a number"),
    ({"stiffness": (1, 2, 3, 4)}, "three components"),
    ({"rotational_stiffness": (1.0, 2.0)}, "three along x, y, z; got two"),
])  # fmt: skip
def test_wrong_values_are_refused(given, fault):
    with pytest.raises(mbd.ModelError, match=fault):
        mbd.assemble(held(False, **given))
