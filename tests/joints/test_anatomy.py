"""Angles of joints of the body after ISB: they rebuild the orientation, both sides alike, and tell what is singular."""

import warnings
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

import mbd
from mbd.analysis.gait_report.curves import curves_of
from mbd.joints.anatomy import ANATOMY, angles_of, measured
from mbd.results.at_state import instant

MIRROR = np.diag([1.0, 1.0, -1.0])
ORIENTATIONS = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)
PALM_FORWARD = Rotation.from_euler("y", np.pi / 2.0)
SIGNS = {"knee": (-1, 1, 1), "back": (-1, 1, 1), "neck": (-1, 1, 1)}


def read(R, part):
    """The angles of a joint of the body by name."""
    mirrored = part.startswith("left")
    return {
        each.name: float(value)
        for angles, system in angles_of(part)
        for each, value in zip(angles, measured(R, system, mirrored), strict=False)
    }


def rebuilt(part, angles):
    """The rotation of the first three angles of a joint, by another library."""
    first = np.array(list(angles.values())[:3])
    kind = part.rpartition(" ")[2]
    if kind == "shoulder":
        R = Rotation.from_euler("YXY", first * (1.0, -1.0, 1.0))
    else:
        R = Rotation.from_euler("ZXY", first * SIGNS.get(kind, (1, 1, 1)))
    if kind in ("elbow", "wrist"):
        R = R * PALM_FORWARD.inv()
    matrix = (PALM_FORWARD * R if kind == "wrist" else R).as_matrix()
    return MIRROR @ matrix @ MIRROR if part.startswith("left") else matrix


@pytest.mark.parametrize("part", ANATOMY)
@given(ORIENTATIONS)
@settings(max_examples=12, deadline=None)
def test_angles_rebuild_the_orientation(part, q):
    R = Rotation.from_quat(q).as_matrix()
    assert rebuilt(part, read(R.tolist(), part)) == pytest.approx(R, abs=1e-7)


@pytest.mark.parametrize("kind", ["hip", "knee", "ankle", "shoulder", "elbow", "wrist"])
@given(ORIENTATIONS)
@settings(max_examples=12, deadline=None)
def test_mirrored_poses_have_equal_angles(kind, q):
    R = Rotation.from_quat(q).as_matrix()
    seen = (MIRROR @ R @ MIRROR).tolist()
    assert read(R.tolist(), f"right {kind}") == pytest.approx(read(seen, f"left {kind}"), abs=1e-12)


@pytest.mark.parametrize("side", ["left", "right"])
def test_signs_are_those_of_the_clinic(side):
    """What the far end of a segment does: forward, to the middle, toes inwards."""
    inwards = 1.0 if side == "left" else -1.0  # z is to the right

    def turned(axis, angle):
        return Rotation.from_euler(axis, angle).as_matrix()

    forward, inside = turned("z", 0.3), turned("x", -0.3 * inwards)
    toes_in = turned("y", -0.3 * inwards)
    assert (
        (forward @ (0, -1, 0))[0] > 0
        and (inside @ (0, -1, 0))[2] * inwards > 0
        and (toes_in @ (1, 0, 0))[2] * inwards > 0
    )
    for kind, names in (("hip", ("flexion", "adduction", "internal_rotation")), ("shoulder", ("flexion", "adduction"))):
        for R, name in zip((forward, inside, toes_in), names, strict=False):
            found = read(R.tolist(), f"{side} {kind}")
            assert {each: found[each] for each in names} == pytest.approx({**dict.fromkeys(names, 0.0), name: 0.3})
    assert read(forward.tolist(), f"{side} knee")["flexion"] == pytest.approx(-0.3)
    assert read(forward.tolist(), f"{side} ankle")["dorsiflexion"] == pytest.approx(0.3)
    assert read(inside.tolist(), f"{side} ankle")["inversion"] == pytest.approx(0.3)
    for raised, plane in ((turned("z", 0.8), 0.5 * np.pi), (turned("x", 0.8 * inwards), 0.0)):
        arm = read(raised.tolist(), f"{side} shoulder")
        assert (arm["elevation"], arm["plane_of_elevation"]) == pytest.approx((0.8, plane))


def test_the_trunk_bends_forward_to_the_right_and_turns_to_the_left():
    for axis, name, head in (("z", "flexion", -1.0), ("x", "lateral_bending", 1.0), ("y", "axial_rotation", 1.0)):
        found = read(Rotation.from_euler(axis, 0.4 * head).as_matrix().tolist(), "back")
        assert found[name] == pytest.approx(0.4)
        assert sum(map(abs, found.values())) == pytest.approx(0.4)


POSE = {"back.orientation": ("zxy", (-0.3, -0.2, -0.1))}
for side, sign in (("left", -1.0), ("right", 1.0)):
    POSE[f"{side} hip.orientation"] = ("zxy", (0.5, 0.2 * sign, -0.1 * sign))
    POSE |= {f"{side} elbow.angle": 0.7, f"{side} wrist.angle": 0.2, f"{side} ankle.second": 0.1 * sign}


@cache
def posed():
    """A person whose left and right pose mirror each other, at one instant."""
    who = mbd.human(70.0, 1.75)
    model = mbd.Model("person")
    model.connect(*who.joints)
    return instant(model, mbd.assemble(model, {**who.standing(knees=0.4), **POSE}, backend="python"))


@cache
def swing(cut="auto"):
    """A leg of a person whose pelvis is held, and its motion."""
    who = mbd.human(70.0, 1.75, floating=False).without("torso", "right leg")
    model = mbd.Model("leg", cut=cut)
    model.connect(mbd.Weld("stand", model.ground.origin, who.bodies["pelvis"].origin), *who.joints)
    position = {
        name: value for name, value in {**who.standing(knees=0.4), **POSE}.items() if name.startswith("left hip")
    }
    rates = {f"{joint.name}.{each.name}": 0.0 for joint in who.joints for each in joint.velocity_labels}
    start = mbd.assemble(model, {**position, "left knee.angle": -0.4}, {**rates, "left knee.angle.rate": 1.0})
    return mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.005, until=0.05)


def test_a_person_tells_the_angles_of_all_joints():
    run = posed()
    for side in ("left", "right"):
        hip = [run[f"{side} hip.{name}"][0] for name in ("flexion", "adduction", "internal_rotation")]
        assert hip == pytest.approx([0.5, 0.2, -0.1])
        assert run[f"{side} knee.flexion"] == pytest.approx(-run[f"{side} knee.angle"], abs=1e-12)
        assert run[f"{side} ankle.dorsiflexion"] == pytest.approx(run[f"{side} ankle.first"], abs=1e-12)
        assert run[f"{side} ankle.inversion"][0] == pytest.approx(0.1)
        assert [run[f"{side} {name}.flexion"][0] for name in ("elbow", "wrist")] == pytest.approx([0.7, 0.2])
    assert run["back.flexion"][0] == pytest.approx(0.3)
    assert "left hip.adduction" in run.names


def test_runs_tell_them_between_rows_and_from_files(tmp_path):
    run = swing()
    saved = mbd.load(run.save(tmp_path / "run.npz"))
    for name in ("left hip.flexion", "left ankle.inversion"):
        assert np.array_equal(saved[name], run[name])
        assert saved.at(0.0123)[name] == run.at(0.0123)[name]
    assert run.at(0.0123)["left knee.flexion"] == pytest.approx(-run.at(0.0123)["left knee.angle"], abs=1e-12)


@pytest.mark.slow
def test_joints_that_are_cut_tell_the_same_angles():
    tree, cut = swing(), swing("all")
    for name in ("left hip.flexion", "left hip.adduction", "left knee.flexion", "left ankle.inversion"):
        assert cut[name] == pytest.approx(tree[name], abs=1e-9)


def test_an_angle_near_its_singularity_is_in_doubt_and_the_others_are_not():
    run = posed()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run["left shoulder.elevation"][0] == pytest.approx(0.0, abs=1e-12)
        assert run["left shoulder.flexion"][0] == pytest.approx(0.0, abs=1e-12)
    with pytest.warns(
        mbd.MbdWarning, match=r"'left shoulder.plane_of_elevation' is undetermined where 'left shoulder.e"
    ):
        run["left shoulder.plane_of_elevation"]


def test_joints_of_ones_own_are_joints_of_the_body_when_they_say_so():
    model = mbd.Model("leg")
    thigh, shank = (mbd.Link(name, mass=1.0, length=0.4, center=0.2, inertia=0.01) for name in ("thigh", "shank"))
    model.connect(
        mbd.Revolute("hip", model.ground.origin, thigh.start, anatomy="right hip"),
        mbd.Revolute("knee", thigh.end, shank.start, anatomy="right knee"),
    )
    model.constrain(mbd.Event("bent", mbd.measure("knee.flexion", unit="rad"), direction=1))
    start = mbd.assemble(model, {"knee.angle": 0.1}, {"knee.angle.rate": -3.0})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.05)
    assert run["knee.flexion"] == pytest.approx(-run["knee.angle"], abs=1e-12)
    assert run.events[0].name == "bent"
    with pytest.raises(mbd.ModelError, match=r"anatomy of 'hip': no joint of the body named 'right hop'; did you mean"):
        mbd.Revolute("hip", model.ground.origin, thigh.start, anatomy="right hop")


def test_a_report_of_a_gait_takes_the_angles_that_move_with_moments_of_their_sense():
    stride = SimpleNamespace(begin=0.0, end=0.05, duration=0.05)
    side = SimpleNamespace(name="left", contacts=(), strides=[stride])
    curves = {curve.title: curve for curve in curves_of(swing(), [side], None)}
    assert {"hip flexion angle", "hip adduction angle", "knee flexion angle", "knee flexion moment"} <= set(curves)
    assert "knee angle" not in curves
    assert "knee adduction angle" not in curves
    assert curves["knee flexion angle"].mean[0] == pytest.approx(np.degrees(0.4))


def test_rates_of_angles_are_their_derivatives_and_may_be_started_with():
    model = mbd.Model("arm")
    arm = mbd.Link("arm", 2.0, 0.3, 0.13, (0.012, 0.002, 0.012))
    model.connect(mbd.Spherical("shoulder", model.ground.origin, arm.start, anatomy="left shoulder"))
    start = mbd.assemble(
        model, {"shoulder.flexion": 0.4, "shoulder.adduction": -0.5},
        {"shoulder.flexion": 1.0, "shoulder.euler.yxy.2.rate": -0.3},
    )  # fmt: skip
    assert start["shoulder.flexion.rate"] == pytest.approx(1.0, abs=1e-12)
    assert start["shoulder.euler.yxy.2.rate"] == pytest.approx(-0.3, abs=1e-12)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.2, backend="python")
    h, at = 1e-4, np.array([0.055, 0.125])
    for name in "shoulder.flexion", "shoulder.elevation", "shoulder.plane_of_elevation", "shoulder.euler.zxy.3":
        before, after = run.at(at - h)[name], run.at(at + h)[name]
        np.testing.assert_allclose(run.at(at)[f"{name}.rate"], (after - before) / (2.0 * h), rtol=1e-6, atol=1e-7)
    assert not any(name.endswith("flexion.rate") for name in run.names)
    assert run.to_dataframe(["shoulder.flexion.rate"]).attrs["units"]["shoulder.flexion.rate"] == "rad/s"
    with pytest.raises(mbd.ModelError, match=r"turns freely take mbd\.Applied .*'shoulder\.euler\.zxy\.1'"):
        mbd.Motor("drive", model.joints[0], torque=1.0)
