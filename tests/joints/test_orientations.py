"""Starts and results of joints that turn freely: every form of an orientation, every frame of an angular velocity."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mbd
from mbd.joints.euler import SEQUENCES, euler_angles, from_euler
from mbd.joints.quaternions import rotation_of
from mbd.results.at_state import instant
from mbd.results.columns import ModelColumns
from tests.helpers import one_body

TURN = Rotation.from_rotvec([0.4, -0.7, 0.3])
W = float(TURN.as_quat()[3])


@cache
def floating():
    """A body that floats, and one on a ball joint of it, whose parent frame is turned."""
    model = mbd.Model("floating", gravity=(0.0, 0.0, -9.81))
    trunk = mbd.RigidBody("trunk", 2.0, (0.3, 0.4, 0.5, 0.01, 0.02, 0.03), center=(0.1, 0.2, 0.05))
    arm = mbd.RigidBody("arm", 1.0, (0.2, 0.3, 0.4, 0.01, 0.0, 0.02), center=(0.1, -0.3, 0.2))
    model.connect(mbd.Free("float", model.ground.origin, trunk.origin))
    model.connect(mbd.Spherical("ball", trunk.point(0.2, -0.3, 0.1).turned(0.4, (1, 2, 3)), arm.origin))
    return model


def forms(turn):
    """The same orientation in every form."""
    x, y, z, w = turn.as_quat()
    vector = turn.as_rotvec()
    return {
        "quaternion": (w, x, y, z), "array": np.array([w, x, y, z]), "rounded": np.round([w, x, y, z], 7),
        "rotation": turn, "matrix": turn.as_matrix(), "lists": turn.as_matrix().tolist(),
        "axis and angle": (vector, np.linalg.norm(vector)), "zxy": ("zxy", turn.as_euler("ZXY")),
        "scipy's ZXZ": ("ZXZ", turn.as_euler("ZXZ").tolist()),
    }  # fmt: skip


@pytest.mark.parametrize("form", forms(TURN))
def test_every_form_of_an_orientation_is_the_same_start(form):
    start = mbd.assemble(floating(), {"ball.orientation": forms(TURN)[form], "float.x": 0.3})
    x, y, z, w = start["ball.orientation"][[1, 2, 3, 0]]
    off = (Rotation.from_quat([x, y, z, w]) * TURN.inv()).magnitude()
    assert off < (1e-6 if form == "rounded" else 1e-15)
    assert start["ball.orientation"] @ start["ball.orientation"] == pytest.approx(1.0, abs=4e-16)
    assert start["float.x"] == 0.3


@pytest.mark.parametrize(("value", "said"), [
    ((1.0, 0.1, 0.0, 0.0), r"quaternion of length 1, got .* of length 1\.0049.*the nearest is \(0\.995"),
    ((0.0, 0.0, 0.0, 0.0), "quaternion of length 1"), ((np.nan, 0.0, 0.0, 1.0), "give a unit quaternion"),
    (np.diag([1.0, 1.0, -1.0]), "this one reflects"), (2.0 * np.eye(3), "R Rᵀ is off 1 by 3"),
    (0.3, "give a unit quaternion"), ((1, 2, 3), "give a unit quaternion"), ("zxy", "give a unit quaternion"),
    (("zzy", (0.1, 0.2, 0.3)), "no sequence of Euler angles; there are xyx"), (("zxy", (0.1, 0.2)), "three angles"),
    (("zxy", (0.1, None, 0.3)), "angle about 'x' must be a number"), (((0, 0, 0), 0.3), "axis of position"),
    (Rotation.random(2, random_state=1), "holds 2"), ([[1, 2], [3]], "must be an orientation"),
])  # fmt: skip
def test_what_is_no_orientation_is_refused_by_name(value, said):
    with pytest.raises(mbd.ModelError, match=f"'ball.orientation'.*{said}|{said}.*'ball.orientation'"):
        mbd.assemble(floating(), {"ball.orientation": value})


def test_parts_that_are_given_twice_are_refused():
    with pytest.raises(mbd.ModelError, match=r"'ball.orientation.w' is given twice"):
        mbd.assemble(floating(), {"ball.orientation.w": 1.0, "ball.orientation": (1, 0, 0, 0)})


def test_wrong_names_of_orientations_are_answered_with_the_right_ones():
    with pytest.raises(
        mbd.ModelError, match=r"no orientation named 'ball.orientaton'; did you mean 'ball.orientation'"
    ):
        mbd.assemble(floating(), {"ball.orientaton": (1.0, 0.0, 0.0, 0.0)})
    with pytest.raises(mbd.ModelError, match=r"'ball.euler.zxy' is read off .* give \{'ball.orientation': \('zxy'"):
        mbd.assemble(floating(), {"ball.euler.zxy": (0.1, 0.2, 0.3)})


def test_a_start_at_the_singularity_of_its_angles_is_right_and_said_to_be_singular():
    angles = (0.3, np.pi / 2, 0.5)
    with pytest.warns(mbd.MbdWarning, match="singularity of that sequence"):
        start = mbd.assemble(floating(), {"ball.orientation": ("zxy", angles)})
    R = np.array(rotation_of(start["ball.orientation"]))
    np.testing.assert_allclose(R, Rotation.from_euler("ZXY", angles).as_matrix(), atol=1e-15)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_euler_angles_are_those_of_scipy_and_give_the_rotation_at_singularities_too(sequence):
    rng = np.random.default_rng(4)
    for turn in Rotation.random(10, random_state=5):
        found = euler_angles(turn.as_matrix().tolist(), sequence)
        np.testing.assert_allclose(found, turn.as_euler(sequence.upper()), atol=1e-12)
    for second in (0.0, np.pi) if sequence[0] == sequence[2] else (np.pi / 2, -np.pi / 2):
        R = np.array(rotation_of(from_euler(sequence, [rng.uniform(-3, 3), second, rng.uniform(-3, 3)])))
        found = euler_angles(R.tolist(), sequence)
        assert found[2] == 0.0
        np.testing.assert_allclose(rotation_of(from_euler(sequence, found)), R, atol=1e-7)


@cache
def flown():
    """A run of the floating bodies."""
    start = mbd.assemble(
        floating(), {"ball.orientation": TURN, "float.orientation": ((1, 0, 2), 0.6)},
        {"float.angular_velocity": (0.5, -1.0, 2.0), "ball.angular_velocity": (1.0, 2.0, -1.0), "float.z": 3.0},
    )  # fmt: skip
    return mbd.simulate(floating(), start, mbd.RungeKutta853(), dt=0.02, until=0.4)


def test_results_of_a_joint_that_turns_freely(tmp_path):
    run = flown()
    q = run["ball.orientation"]
    assert q.shape == (len(run.time), 4)
    turn = Rotation.from_quat(q[:, [1, 2, 3, 0]])
    np.testing.assert_allclose(run["ball.euler.zxy"], turn.as_euler("ZXY"), atol=1e-12)
    np.testing.assert_allclose(run["ball.rotation_vector"], turn.as_rotvec(), atol=1e-12)
    own = np.array(run["ball.angular_velocity"])
    np.testing.assert_allclose(run["ball.angular_velocity.parent"], turn.apply(own), atol=1e-12)
    trunk = Rotation.from_quat(run["float.orientation"][:, [1, 2, 3, 0]])
    whole = trunk * Rotation.from_rotvec(0.4 * np.array([1, 2, 3]) / np.sqrt(14.0)) * turn
    np.testing.assert_allclose(run["ball.angular_velocity.ground"], whole.apply(own), atol=1e-12)
    np.testing.assert_allclose(run["float.reaction_force"], 0.0, atol=1e-12)
    np.testing.assert_allclose(run["float.reaction_torque"], 0.0, atol=1e-12)
    np.testing.assert_allclose(run["ball.reaction_torque"], 0.0, atol=1e-12)
    between = run.at([0.111, 0.222])
    loaded = mbd.load(run.save(tmp_path / "run"))
    for name in ("ball.euler.zxy", "ball.orientation", "ball.angular_velocity.ground", "float.rotation_vector"):
        np.testing.assert_allclose(loaded[name], run[name], atol=1e-15)
        np.testing.assert_allclose(loaded.at([0.111, 0.222])[name], between[name], atol=1e-15)


def test_momentum_of_a_floating_body_is_that_of_a_throw():
    run = flown()
    place = (2.0 * run["trunk.center"] + run["arm.center"]) / 3.0
    slope = (2.0 * run["trunk.center.vz"][0] + run["arm.center.vz"][0]) / 3.0
    np.testing.assert_allclose(place[:, 2], place[0, 2] + slope * run.time - 0.5 * 9.81 * run.time**2, atol=1e-12)
    assert np.ptp(run.energy.numerical) < 1e-11


@pytest.mark.parametrize("frame", ["", ".parent", ".ground"])
def test_a_start_names_an_angular_velocity_in_any_frame(frame):
    given = {"ball.orientation": TURN, "float.orientation": ((1, 0, 2), 0.6)}
    start = mbd.assemble(floating(), given, {f"ball.angular_velocity{frame}": (1.0, 2.0, -1.0)})
    run = mbd.simulate(floating(), start, mbd.RungeKutta853(), dt=0.01, until=0.0)
    np.testing.assert_allclose(run[f"ball.angular_velocity{frame}"][0], (1.0, 2.0, -1.0), atol=1e-12)


def chain(cut):
    """A chain in space of every kind of turning joint, with losses and a spring."""
    model, turn = mbd.Model("chain", gravity=(0.5, -9.81, 1.0), cut=cut), (0.1, -0.2, 0.05)
    bodies = [
        mbd.RigidBody(f"body {k}", 1.0 + 0.3 * k, (0.05, 0.06, 0.03, 0.004, 0.002, 0.001), turn) for k in range(3)
    ]
    ends = [model.ground.origin, *(body.point(0.1, -0.5, 0.1, name="end") for body in bodies)]
    model.connect(mbd.Spherical("first", ends[0], bodies[0].origin, loss=mbd.Viscous(0.02)))
    model.connect(mbd.Revolute("second", ends[1], bodies[1].origin, axis=(1, 2, 3), loss=mbd.Viscous(0.01)))
    model.connect(mbd.Spherical("third", ends[2], bodies[2].origin, stiffness=2.0))
    return model


@pytest.mark.parametrize("cut", ["all", pytest.param(("first", "third"), marks=pytest.mark.slow),
                                 pytest.param(("second",), marks=pytest.mark.slow)])  # fmt: skip
def test_joints_that_are_cut_move_as_those_of_the_tree(cut):
    rows = []
    for way in ("auto", cut):
        model = chain(way)
        start = mbd.assemble(
            model, {"first.orientation": TURN, "second.angle": 0.5, "third.orientation": ((1, 2, 3), 0.4)},
            {"first.angular_velocity": (1, 2, -1), "second.angle": 0.7, "third.angular_velocity": (0, 0.5, 2)},
        )  # fmt: skip
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.2)
        assert np.ptp(run.energy.numerical) < 1e-9
        names = ("body 2.end", "third.reaction_force", "first.angular_velocity.ground", "first.reaction_force")
        rows.append(np.concatenate([run[name][-1] for name in names]))
        turned = run["third.orientation"][-1]
        rows[-1] = np.concatenate([rows[-1], turned * np.sign(turned[0])])
    np.testing.assert_allclose(*rows, atol=2e-9)


def test_the_friction_of_a_pin_in_space_is_that_in_the_plane():
    angles = []
    for spatial in (False, True):
        model = mbd.Model("pendulum")
        rod = mbd.RigidBody("rod", 1.0, (0.1, 0.02, 0.1), center=(0, -0.5, 0))
        model.connect(mbd.Revolute("pin", model.ground.origin, rod.origin, loss=mbd.PinFriction(0.2, 0.05)))
        if spatial:
            other = mbd.RigidBody("other", 1.0, (0.1, 0.02, 0.1))
            model.connect(mbd.Revolute("beside", model.ground.origin, other.origin, axis=(1, 0, 0)))
        run = mbd.simulate(model, mbd.assemble(model, {"pin.angle": 1.0}), mbd.RadauIIA(), dt=0.02, until=0.5)
        angles.append(run["pin.angle"])
    np.testing.assert_allclose(*angles, atol=1e-10)


def test_results_have_units_and_words_and_their_own_axes_in_tables():
    from mbd.results.tables import long_name
    from mbd.results.units import unit

    run = flown()
    units = {name: unit(f"ball.{name}", run.facts) for name in (
        "orientation.x", "angular_velocity.x", "angular_velocity.ground.y", "euler.zxy.2", "rotation_vector.z",
        "angular_velocity.y.acceleration",
    )}  # fmt: skip
    assert list(units.values()) == ["", "rad/s", "rad/s", "rad", "rad", "rad/s²"]
    assert long_name("ball.angular_velocity.parent.x") == "angular velocity of ball about x in axes of the parent"
    assert long_name("ball.euler.zxy.3") == "third angle of ball about zxy"
    pytest.importorskip("xarray")
    table = run.to_xarray(["ball.orientation", "ball.euler.zxy", "arm.center"])
    assert table["ball.orientation"].dims == ("time", "part")
    assert [*table["part"].values] == ["w", "x", "y", "z"]
    assert table["ball.euler.zxy"].dims == ("time", "turn")
    assert table["arm.center"].dims == ("time", "axis")


def test_angles_near_their_singularity_are_in_doubt():
    run = flown()
    straight = mbd.simulate(floating(), mbd.assemble(floating()), mbd.RungeKutta853(), dt=0.01, until=0.02)
    with pytest.warns(mbd.MbdWarning, match=r"'float.euler.zxz': its second angle comes to .* of 'zxz'"):
        found = straight["float.euler.zxz"]
    assert found.shape == (3, 3)
    assert run["float.euler.zxy"].shape == (len(run.time), 3)


def test_words_for_rotations_that_are_not_there_are_answered_in_one_sentence():
    model, _ = one_body(mbd.RigidBody("body", 1.0, (0.1, 0.2, 0.25)), mbd.Free, "float", title="ball")
    for position, velocity, said in (
        ({}, {"float.omega": (1, 2, 3)}, r"^velocity: no rate named 'float.omega'; [^\n]*$"),
        ({"float.position": (1, 2, 3)}, {}, r"^position: no coordinate named 'float.position'; [^\n]*$"),
        (
            {},
            {"float.angular_velocity": (1, 2)},
            "'float.angular_velocity' takes one finite number, or three as a vector, not 2",
        ),
        ({}, {"float.orientation": (1, 0, 0, 0)}, "its rate is 'float.angular_velocity', three numbers"),
    ):
        with pytest.raises(mbd.ModelError, match=said):
            mbd.assemble(model, position, velocity, backend="python")
    for form in (("zxy", (30, 20, 10)), ((0, 0, 1), 90)):
        with pytest.warns(mbd.MbdWarning, match="rad is more than a turn; angles are in radians"):
            mbd.assemble(model, {"float.orientation": form}, backend="python")
    run = instant(model, mbd.assemble(model, backend="python"))
    with pytest.raises(
        mbd.UnknownNameError, match="'zzx' is no sequence; there are 'float.euler.zxy' and others: xyx, "
    ):
        run["float.euler.zzx"]
    flat = mbd.Model("flat")
    flat.connect(mbd.Planar("slide", flat.ground.origin, mbd.RigidBody("plate", 1.0, 0.1).origin))
    with pytest.raises(
        mbd.ModelError, match="no orientation named 'slide.orientation'; the model has no joint that turns"
    ):
        mbd.assemble(flat, {"slide.orientation": (1, 0, 0, 0)}, backend="python")
    cross = mbd.Model("cross")
    cross.connect(mbd.Universal("cross", cross.ground.origin, mbd.RigidBody("plate", 1.0, 0.1).origin))
    assert "'cross' turns it out of the plane x–y" in cross.check()[0]


def test_parts_of_an_orientation_are_evaluated_together_and_each_is_as_if_read_alone(monkeypatch):
    model, _ = one_body(mbd.RigidBody("body", 1.0, (0.1, 0.2, 0.3), center=(0.0, -0.2, 0.1)), mbd.Spherical, "ball")
    start = mbd.assemble(model, velocity={"ball.angular_velocity": (0.3, 2.0, 1.0)})
    run = mbd.simulate(model, start, dt=0.01, until=0.2)
    names = [f"ball.orientation.{part}" for part in "wxyz"]
    whole = ModelColumns(run.record, run.record.equations).at_rows(names)
    asked, evaluate = [], ModelColumns.evaluate
    monkeypatch.setattr(ModelColumns, "evaluate", lambda self, *given: (asked.append(given), evaluate(self, *given))[1])
    for name, values in zip(reversed(names), reversed(whole), strict=True):
        np.testing.assert_array_equal(run[name], values)
    assert len(asked) == 1
    np.testing.assert_array_equal(run["ball.orientation"], np.stack(whole, axis=1))
