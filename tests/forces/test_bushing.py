"""A bushing: the oscillator that it makes, in space and in the plane, and a stiff one that is a weld."""

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
    ({"stiffness": -1.0, "rotational_damping": (0, -2, 0)}, "(?s)4 faults.*stiffness.x -1.*damping.y -2"),
])  # fmt: skip
def test_wrong_values_are_refused_when_it_is_made(given, fault):
    one, two = (mbd.RigidBody(name, 1.0, (1.0, 1.0, 1.0)) for name in ("one", "two"))
    with pytest.raises(mbd.ModelError, match=fault):
        mbd.Bushing("mount", one.origin, two.origin, **given)


def test_its_force_and_torque_move_both_bodies_by_newton_and_euler():
    """What b gets at its origin a gives there: seen from each body alone, for any stiffness and damping."""
    model = mbd.Model("two in flight", gravity=(0.0, 0.0, 0.0))
    moments = {"one": np.array([0.3, 0.4, 0.5]), "two": np.array([0.2, 0.1, 0.25])}
    bodies = {name: mbd.RigidBody(name, 2.0, tuple(each)) for name, each in moments.items()}
    for name, body in bodies.items():
        model.connect(mbd.Free(f"float {name}", model.ground.origin, body.origin))
    a = bodies["one"].point(0.1, -0.3, 0.2).turned(0.7, axis=(1, 0, 0))
    b = bodies["two"].point(-0.2, 0.1, 0.3, name="b").turned(-0.4, axis=(1, 1, 0))
    springs = {"stiffness": (30.0, 50.0, 80.0), "rotational_stiffness": (1.0, 4.0, 9.0)}
    model.apply(mbd.Bushing("mount", a, b, damping=(1.0, 2.0, 0.5), rotational_damping=(0.1, 0.4, 0.2), **springs))
    start = mbd.assemble(
        model,
        {"float one.orientation": ((1, 2, 3), 0.7), "float two.orientation": ((-1, 1, 0), 1.3), "float two.x": 0.3},
        {"float one.angular_velocity": (1.0, 2.0, -1.0), "float two.angular_velocity": (0.5, 0.0, 3.0)},
    )
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=0.1, backend="python")
    force, torque = run["mount.force"], run["mount.torque"]
    for sign, name in (-1.0, "one"), (1.0, "two"):
        joint = f"float {name}"
        a_c = np.column_stack([run[f"{joint}.{axis}.acceleration"] for axis in "xyz"])
        np.testing.assert_allclose(2.0 * a_c, sign * force, rtol=1e-9, atol=1e-9)
        omega = run[f"{joint}.angular_velocity"]
        alpha = np.column_stack([run[f"{joint}.angular_velocity.{axis}.acceleration"] for axis in "xyz"])
        rate = moments[name] * alpha + np.cross(omega, moments[name] * omega)  # in the axes of the body
        arm = run["two.b"] - run[f"{name}.center"]
        w, *u = run[f"{joint}.orientation"].T
        turned = [_turned(np.array([w[k], u[0][k], u[1][k], u[2][k]]), rate[k]) for k in range(len(rate))]
        np.testing.assert_allclose(turned, sign * (torque + np.cross(arm, force)), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(run["mount.force.a"], axis=1), np.linalg.norm(force, axis=1), rtol=1e-12)
    units = run.to_dataframe(["mount.force", "mount.torque.a"]).attrs["units"]
    assert (units["mount.force.x"], units["mount.torque.a.z"]) == ("N", "N m")


def _turned(q, vector):
    """R(q) vector."""
    w, u = q[0], q[1:]
    return vector + 2.0 * np.cross(u, np.cross(u, vector) + w * vector)


def test_at_rest_it_carries_the_weight_along_its_own_axes():
    model = mbd.Model("shelf")
    board = mbd.RigidBody("board", 2.0, (0.3, 0.4, 0.5), center=(0.5, 0.0, 0.0))
    model.connect(mbd.Planar("float", model.ground.origin, board.origin))
    wall, clamp = (body.origin.turned(0.5 * np.pi) for body in (model.ground, board))
    model.apply(mbd.Bushing("mount", wall, clamp, 1e6, 1e6, 1e3, 1e3))
    run = mbd.simulate(model, mbd.assemble(model), mbd.RadauIIA(), dt=0.05, until=1.0)
    np.testing.assert_allclose(run["mount.force"][-1], [0.0, 2.0 * 9.81, 0.0], atol=1e-6)
    np.testing.assert_allclose(run["mount.force.a"][-1], [2.0 * 9.81, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(run["mount.torque"][-1], [0.0, 0.0, 9.81], rtol=1e-4)


def test_a_controller_reads_its_force_and_a_law_of_the_motion_cannot():
    model, read = held(True, stiffness=200.0, rotational_stiffness=10.0), []

    def update(time, values, state):
        read.append(values["mount.force.a.x"])
        return {"push.force.x": 0.5 * values["mount.force.x"]}

    body = model.joints[0].child
    model.apply(mbd.Applied("push", body, force=(0.0, 0.0, 0.0)))
    reads = ["mount.force.x", "mount.force.a.x", "push.force.x"]
    model.apply(mbd.Controller("half", update, period=0.01, reads=reads, writes=["push.force.x"]))
    run = mbd.simulate(model, mbd.assemble(model, {"float.x": 0.1}), dt=0.01, until=0.02, backend="python")
    assert read[0] == pytest.approx(-20.0) and run["push.force.x"][-1] == pytest.approx(0.5 * read[-1])
    model.apply(mbd.Applied("echo", body, force=lambda x: (x, 0.0), arguments=("mount.force.x",)))
    with pytest.raises(mbd.ModelError, match="'mount.force.x' is a result of the motion.*let a mbd.Controller read it"):
        mbd.assemble(model)
