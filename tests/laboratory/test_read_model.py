"""Robots from URDF: equations of an independent Newton–Euler and of Pinocchio, words for all that the file says."""

import math
import re
from importlib import metadata

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from tests.laboratory.newton_euler import inertia_of, inverse

ROBOT = """<?xml version="1.0"?>
<robot name="arm">
  <link name="stand"/>
  <link name="upper">
    <inertial><origin xyz="0.1 0 0.2" rpy="0.3 -0.2 0.5"/><mass value="2.0"/>
      <inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.001" ixz="-0.002" iyz="0.0005"/></inertial>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
  </link>
  <link name="slide.r"><inertial><mass value="0.7"/><inertia ixx="0.01" iyy="0.01" izz="0.01"/></inertial></link>
  <link name="tool"><inertial><origin xyz="0 0.1 0"/><mass value="0.4"/>
    <inertia ixx="0.002" iyy="0.003" izz="0.004"/></inertial></link>
  <link name="wheel"><inertial><mass value="0.3"/><inertia ixx="0.001" iyy="0.001" izz="0.0015"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="stand"/><child link="upper"/>
    <origin xyz="0 0.1 0.5" rpy="0.1 0.2 -0.3"/><axis xyz="0 2 1"/>
    <limit lower="-1" upper="1.5" effort="10" velocity="3"/><dynamics damping="0.4" friction="0.1"/></joint>
  <joint name="rail" type="prismatic"><parent link="upper"/><child link="slide.r"/>
    <origin xyz="0.3 0 0"/><axis xyz="0 0 1"/><limit lower="0" upper="0.2" effort="1" velocity="1"/></joint>
  <joint name="flange" type="fixed"><parent link="slide.r"/><child link="tool"/><origin rpy="0 1.57 0"/></joint>
  <joint name="spin" type="continuous"><parent link="tool"/><child link="wheel"/><axis xyz="1 0 0"/>
    <mimic joint="shoulder" multiplier="-2" offset="0.1"/></joint>
  <transmission name="drive"/>
</robot>
"""


def written(folder, text):
    path = folder / "robot.urdf"
    path.write_text(text)
    return path


def test_a_robot_has_the_equations_of_an_independent_newton_euler(tmp_path):
    found = mbd.read_model(written(tmp_path, ROBOT), stops=False, losses=False)
    model = found.model
    model.constraints.clear()  # the tree alone
    rng = np.random.default_rng(0)
    names = {"shoulder.angle": 1, "rail.displacement": 1, "spin.angle": 1}
    motion = {"time": [0.0]}
    states = ({}, {}, {})
    for joint in found.joints.values():
        for state in states:
            state[joint.name] = rng.normal(size=len(joint.labels))
    for name in names:
        owner = name.partition(".")[0]
        values = [state[owner] for state in states]
        motion |= {name: values[0], f"{name}.rate": values[1], f"{name}.acceleration": values[2]}
    moments = mbd.inverse_dynamics(model, motion)
    masses = {body.name: inertia_of(body) for body in found.bodies.values()}
    for state in states:
        state["base"] = np.zeros(0)
    expected = inverse([*model.joints], masses, np.array([0.0, -9.81, 0.0]), *states)
    for owner, kind in (("shoulder", "moment"), ("rail", "force"), ("spin", "moment")):
        assert moments[f"{owner}.{kind}"][0] == pytest.approx(expected[owner][0], abs=1e-12)


def test_turns_may_be_quaternions_as_in_version_1_2(tmp_path):
    """Those of scipy, with the real part last: the same robot."""
    from scipy.spatial.transform import Rotation

    def turned(found):
        angles = [float(part) for part in found[1].split()]
        x, y, z, w = Rotation.from_euler("xyz", angles).as_quat()
        return f'quat_xyzw="{x!r} {y!r} {z!r} {w!r}"'.replace("np.float64(", "").replace(")", "")

    text = re.sub('rpy="([^"]*)"', turned, ROBOT)
    assert "rpy" not in text
    first, second = (mbd.read_model(written(tmp_path, each)) for each in (ROBOT, text))
    for name in ("shoulder", "rail"):
        a, b = (np.array(found.joints[name].parent.rotation or np.eye(3)) for found in (first, second))
        assert a == pytest.approx(b, abs=1e-14)
    for name, body in first.bodies.items():
        if hasattr(body, "inertia"):
            assert second.bodies[name].inertia == pytest.approx(body.inertia, abs=1e-14)
    with pytest.raises(mbd.ModelError, match="has both rpy and quat_xyzw"):
        mbd.read_model(written(tmp_path, ROBOT.replace('rpy="0.1', 'quat_xyzw="0 0 0 1" rpy="0.1')))
    with pytest.raises(mbd.ModelError, match="quat_xyzw must have the length 1"):
        mbd.read_model(written(tmp_path, ROBOT.replace('rpy="0.1 0.2 -0.3"', 'quat_xyzw="0 0 1 1"')))


def test_what_the_file_says_is_in_the_model(tmp_path):
    found = mbd.read_model(written(tmp_path, ROBOT))
    model = found.model
    assert found.joints["shoulder"].axis == pytest.approx((0.0, 2 / math.sqrt(5), 1 / math.sqrt(5)))
    assert list(found.bodies) == ["stand", "upper", "slide_r", "tool", "wheel"]
    assert {each.name for each in model.constraints} == {
        "shoulder lower stop", "shoulder upper stop", "rail lower stop", "rail upper stop", "spin mimic",
    }  # fmt: skip
    assert any(name.startswith("shoulder loss") for name in model.parameters)
    start = mbd.assemble(model, position={"shoulder.angle": 0.3, "rail.displacement": 0.1})
    assert start["spin.angle"] == pytest.approx(-0.5)
    assert start["upper.origin"] == pytest.approx([0.0, 0.5, -0.1])  # z of the file is up, y to the left
    text = str(found.report)
    for words in (
        "3 revolute" if False else "1 revolute",
        "limits of 2 joints as stops",
        "1 shapes <visual>",
        "1 <transmission>",
    ):
        assert words in text
    assert "largest efforts and velocities of 2 joints" in text


def test_a_stop_holds_and_a_robot_can_float(tmp_path):
    found = mbd.read_model(written(tmp_path, ROBOT), losses=False)
    start = mbd.assemble(found.model, position={"shoulder.angle": 1.4, "rail.displacement": 0.1})
    run = mbd.simulate(found.model, start, dt=2e-3, until=0.5)
    assert run["shoulder.angle"].max() < 1.5 + 1e-6 and run["rail.displacement"].min() > -1e-6
    floating = mbd.read_model(written(tmp_path, ROBOT), base="floating")
    assert any(
        name == "base.orientation.w"
        for name in mbd.assemble(
            floating.model, open=["shoulder lower stop", "shoulder upper stop", "rail lower stop", "rail upper stop"]
        ).names
    )


def test_a_model_pickles(tmp_path):
    import pickle

    found = mbd.read_model(written(tmp_path, ROBOT))
    again = pickle.loads(pickle.dumps(found.model))
    assert [joint.name for joint in again.joints] == [joint.name for joint in found.model.joints]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<robot", "<robut", "no XML here"),
        ('<robot name="arm">', "<model>", "no XML here"),
        ('type="prismatic"', 'type="helical"', "line 16: <joint> 'rail' is of the type 'helical'"),
        ('<child link="tool"/>', '<child link="tol"/>', "names the link 'tol', which the file lacks"),
        ('value="2.0"', 'value="two"', "line 5: <mass> value must be a number, got 'two'"),
        ('value="2.0"', 'value="-2.0"', "has the negative mass"),
        ('value="2.0"', 'value="1e999"', "value must be a number"),
        ('<axis xyz="0 2 1"/>', '<axis xyz="0 0 0"/>', "has the axis 0 0 0"),
        ('<axis xyz="0 2 1"/>', '<axis xyz="0 2"/>', "xyz must be 3 numbers"),
        ('mimic joint="shoulder"', 'mimic joint="elbow"', "names the joint 'elbow'"),
        (
            'ixx="0.002" iyy="0.003" izz="0.004"',
            'ixx="0.002" iyy="0.003" izz="0.4"',
            "moments of inertia of 'tool'.*repair=True",
        ),
        ('<link name="stand"/>', '<link name="stand"/><link name="loose"/>', "one link without a joint to a parent"),
        ('<link name="stand"/>', '<link name="stand"/><link name="stand"/>', "that of another link"),
        ('<?xml version="1.0"?>', '<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "b">]>', "entities are not read"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path, old, new, words):
    assert old in ROBOT
    with pytest.raises(mbd.ModelError, match=words):
        mbd.read_model(written(tmp_path, ROBOT.replace(old, new, 1)))


def test_moments_that_no_body_has_are_repaired_on_request(tmp_path):
    text = ROBOT.replace('ixx="0.002" iyy="0.003" izz="0.004"', 'ixx="0.002" iyy="0.003" izz="0.4"')
    found = mbd.read_model(written(tmp_path, text), repair=True)
    moments = np.sort([found.bodies["tool"].fields()[f"inertia.{axis}"] for axis in ("xx", "yy", "zz")])
    assert moments[2] == pytest.approx(moments[0] + moments[1], rel=1e-9)
    assert "moments of inertia made possible: 'tool'" in str(found.report)
    assert found.model.check() == []


def test_a_billion_laughs_are_refused(tmp_path):
    text = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]><robot name="&b;"/>'
    with pytest.raises(mbd.ModelError, match="entities are not read"):
        mbd.read_model(written(tmp_path, text))
    with pytest.raises(mbd.ModelError, match="nested too deep"):
        mbd.read_model(written(tmp_path, "<robot>" + "<a>" * 1000))


def robots():
    """The files of the package example-robot-data, where it is installed (BSD-3, never copied here)."""
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        return []
    return [file for file in files if file.name.endswith(".urdf")]


@pytest.mark.slow
@pytest.mark.parametrize("file", robots(), ids=lambda file: file.name)
def test_a_public_robot_has_the_mass_matrix_and_bias_of_pinocchio(file):
    pinocchio = pytest.importorskip("pinocchio")
    path = file.locate()
    try:
        found = mbd.read_model(path, stops=False, losses=False)
    except mbd.ModelError as error:
        if "repair=True" not in str(error) and "has no links" not in str(error):
            raise
        pytest.skip(str(error))
    found.model.constraints.clear()
    if found.report.approximated or not found.model.joints:
        pytest.skip(f"not the same robot: {found.report.approximated}")
    try:
        mechanism = mechanism_of(found.model, "python")
    except mbd.ModelError as error:
        if "neither mass nor inertia" not in str(error):
            raise
        pytest.skip("a joint moves links without mass")
    if not mechanism.equations.n_v:
        pytest.skip("nothing moves")
    theirs = pinocchio.buildModelFromUrdf(str(path))
    data, equations = theirs.createData(), mechanism.equations
    rng = np.random.default_rng(0)
    q, v = 0.5 * rng.normal(size=equations.n_v), rng.normal(size=equations.n_v)
    their_q, their_v, order = pinocchio.neutral(theirs), np.zeros(theirs.nv), []
    known = {" ".join(name.replace(".", "_").split()): name for name in theirs.names}
    for k, name in enumerate(equations.velocity_names):
        joint = theirs.joints[theirs.getJointId(known[name.removesuffix(".rate").rpartition(".")[0]])]
        order.append(joint.idx_v)
        values = (math.cos(q[k]), math.sin(q[k])) if joint.nq == 2 else (q[k],)
        their_q[joint.idx_q : joint.idx_q + joint.nq] = values
        their_v[joint.idx_v] = v[k]
    M = pinocchio.crba(theirs, data, their_q)
    M = (np.triu(M) + np.triu(M, 1).T)[np.ix_(order, order)]
    h = pinocchio.nonLinearEffects(theirs, data, their_q, their_v)[order]
    terms = mechanism.acceleration_terms(0.0, q, v, mechanism.parameters(), np.zeros(equations.n_anchors))
    assert np.abs(terms.M - M).max() < 1e-9 * np.abs(M).max()
    assert terms.f == pytest.approx(h, abs=1e-9 * max(1.0, np.abs(h).max()))
