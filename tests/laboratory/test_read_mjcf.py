"""Models of MuJoCo: equations of its own engine, words for joints, losses, limits and couplings."""

import pickle
from importlib import metadata

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.topology.plan import plan

mujoco = pytest.importorskip("mujoco")

TEXT = """<mujoco model="toy">
  <option gravity="0.3 0 -9.81"/>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="trunk" pos="0 0 1"><freejoint name="root"/>
      <inertial pos="0.05 0.02 0.1" quat="0.9 0.1 0.3 0.2" mass="5" diaginertia="0.2 0.25 0.3"/>
      <body name="upper" pos="0.1 -0.1 0" quat="0.8 0.2 -0.4 0.3">
        <joint name="shoulder" type="ball" damping="0.2"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.04" mass="1.5"/>
        <body name="fore" pos="0 0 -0.3">
          <joint name="elbow.r" axis="0 1 0.2" pos="0.01 0 0.02" range="-90 10" ref="5" stiffness="3" springref="-20"
            frictionloss="0.1"/>
          <joint name="pro" axis="0 0 1" armature="0.02"/>
          <joint name="rail" type="slide" axis="1 1 0"/>
          <geom type="box" size="0.03 0.05 0.1" pos="0 0.02 -0.1" mass="0.8"/>
        </body>
      </body>
    </body>
    <body name="wheel" pos="1 0 0"><joint name="spin" axis="0 1 0"/>
      <geom type="cylinder" size="0.2 0.02" mass="2"/></body>
    <body name="hand" pos="1 1 0"><joint name="turn" axis="0 1 0"/><geom type="sphere" size="0.1" mass="1"/></body>
  </worldbody>
  <equality><joint joint1="turn" joint2="spin" polycoef="0 -2 0.5 0 0"/></equality>
  <actuator><motor joint="spin"/></actuator>
</mujoco>
"""


def apart(path):
    """Largest differences of mass matrix and bias from MuJoCo's at a random state, over their largest entries."""
    found = mbd.read_model(path, stops=False, losses=False)
    found.model.constraints.clear()
    mechanism = mechanism_of(found.model, "python")
    equations, source = mechanism.equations, mujoco.MjModel.from_xml_path(str(path))
    data, rng = mujoco.MjData(source), np.random.default_rng(0)
    whole, v = equations.configuration, rng.normal(size=equations.n_v)
    q = whole.compose(np.array(whole.defaults), 0.4 * rng.normal(size=equations.n_v))
    numbers = {}
    for k in range(source.njnt):
        name = mujoco.mj_id2name(source, mujoco.mjtObj.mjOBJ_JOINT, k)
        numbers[" ".join(name.replace(".", "_").split()) if name else k] = k
    order, iq, iv = np.zeros(equations.n_v, dtype=int), 0, 0
    for joint in (each for each in plan(found.model).edges if each.freedoms):
        k = numbers[joint.name] if joint.name in numbers else numbers[int(joint.name.split()[-1])]
        n_q, n_v, at_q, at_v = len(joint.labels), len(joint.freedoms), source.jnt_qposadr[k], source.jnt_dofadr[k]
        data.qpos[at_q : at_q + n_q] = q[iq : iq + n_q] + (source.qpos0[at_q] if n_q == 1 else 0.0)
        data.qvel[at_v : at_v + n_v] = v[iv : iv + n_v]
        order[iv : iv + n_v] = range(at_v, at_v + n_v)
        iq, iv = iq + n_q, iv + n_v
    mujoco.mj_forward(source, data)
    M = np.zeros((source.nv, source.nv))
    mujoco.mj_fullM(source, data, M)
    several = np.isin(source.jnt_type[source.dof_jntid], (0, 1))  # of these joints armature is left out
    M = (M - np.diag(np.where(several, source.dof_armature, 0.0)))[np.ix_(order, order)]
    h = data.qfrc_bias[order]
    terms = mechanism.acceleration_terms(0.0, q, v, mechanism.parameters(), np.zeros(equations.n_anchors))
    return np.abs(terms.M - M).max() / np.abs(M).max(), np.abs(terms.f - h).max() / max(1.0, np.abs(h).max())


def test_sites_are_markers_of_a_file_that_mujoco_saved(tmp_path):
    """From a film of the sites of its own kinematics through to the moments of its own inverse dynamics."""
    text = TEXT.replace('<joint name="shoulder"', '<site name="SHO" pos="0.02 0.03 -0.1"/><joint name="shoulder"')
    text = text.replace('<joint name="elbow.r"', '<site name="FORE" pos="0 0.03 -0.1"/><joint name="elbow.r"')
    text = text.replace('<joint name="turn"', '<site name="A" pos="0.1 0.05 0"/><site name="B" pos="0 0 0.2"/>'
                        '<joint name="turn"')  # fmt: skip
    text = text.replace('-9.81"/>', '-9.81"><flag constraint="disable"/></option>')
    source = mujoco.MjModel.from_xml_string(text)
    mujoco.mj_saveLastXML(str(tmp_path / "saved.xml"), source)
    found = mbd.read_model(tmp_path / "saved.xml", stops=False)
    assert "4 sites as markers" in str(found.report)
    data, time = mujoco.MjData(source), np.arange(60) / 100.0
    hand = int(source.jnt_qposadr[mujoco.mj_name2id(source, mujoco.mjtObj.mjOBJ_JOINT, "turn")])
    speed = int(source.jnt_dofadr[mujoco.mj_name2id(source, mujoco.mjtObj.mjOBJ_JOINT, "turn")])
    angle, moments, seen = 0.4 * np.sin(5.0 * time), [], {"A": [], "B": []}
    for k in range(len(time)):
        data.qpos[hand], data.qvel[speed] = angle[k], 2.0 * np.cos(5.0 * time[k])
        data.qacc[:] = 0.0
        data.qacc[speed] = -10.0 * np.sin(5.0 * time[k])
        mujoco.mj_fwdPosition(source, data)
        mujoco.mj_inverse(source, data)
        moments.append(data.qfrc_inverse[speed])
        for name, places in seen.items():
            x, y, z = data.site(name).xpos
            places.append((x, z, -y))
    # of the hand alone, whose motion the sites on it tell
    alone = mbd.Model("hand", gravity=found.model.gravity)
    alone.connect(found.joints["turn"])
    motion = mbd.inverse_kinematics(alone, mbd.Recording(time, {name: np.array(p) for name, p in seen.items()}))
    assert motion["turn.angle"] == pytest.approx(angle, abs=1e-9)
    given = mbd.inverse_dynamics(alone, motion)["turn.moment"]
    assert given[6:-6] == pytest.approx(np.array(moments)[6:-6], abs=2e-4)


def test_a_model_has_the_mass_matrix_and_bias_of_mujoco(tmp_path):
    path = tmp_path / "toy.xml"
    path.write_text(TEXT)
    assert max(apart(path)) < 1e-12


def test_what_the_file_says_is_in_the_model_or_in_the_report(tmp_path):
    path = tmp_path / "toy.xml"
    path.write_text(TEXT)
    found = mbd.read_model(path)
    assert found.model.gravity == pytest.approx((0.3, -9.81, 0.0))
    assert found.joints["elbow_r"].stiffness == pytest.approx(3.0)
    assert found.joints["elbow_r"].rest == pytest.approx(np.radians(-25.0))
    assert {each.name for each in found.model.constraints} >= {
        "elbow_r lower stop",
        "elbow_r upper stop",
        "turn coupling",
    }
    start = mbd.assemble(found.model, position={"spin.angle": 0.2, "root.z": 1.0})
    assert start["turn.angle"] == pytest.approx(-2.0 * 0.2 + 0.5 * 0.04)
    assert start["trunk.origin"] == pytest.approx([0.0, 1.0, 0.0])  # z of the file is up, y to the left
    text = str(found.report)
    for words in (
        "5 bodies and 7 joints (1 free, 1 ball, 1 slide, 4 hinge)", "soft limits of 1 joints are rigid stops",
        "counted from the posture of the file: 'elbow_r'", "1 soft equations between joints", "armature", "1 actuators",
    ):  # fmt: skip
        assert words in text
    assert len(pickle.loads(pickle.dumps(found.model)).joints) == len(found.model.joints)
    run = mbd.simulate(found.model, start, dt=2e-3, until=0.1)
    assert run.success


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<mujoco><worldbody>", "no model that MuJoCo compiles"),
        ("", "no model"),
    ],
)
def test_what_mujoco_refuses_is_named(tmp_path, text, words):
    path = tmp_path / "toy.xml"
    path.write_text(text)
    with pytest.raises(mbd.ModelError, match=f"toy.xml is {words}"):
        mbd.read_model(path)


def test_the_base_of_a_file_that_says_it_is_not_asked(tmp_path):
    path = tmp_path / "toy.xml"
    path.write_text(TEXT)
    with pytest.raises(mbd.ModelError, match="says itself how its bodies float"):
        mbd.read_model(path, base="floating")


def assets():
    """The models of the package gymnasium, where it is installed (MIT, never copied here)."""
    try:
        files = metadata.files("gymnasium") or []
    except metadata.PackageNotFoundError:
        return []
    return [file for file in files if file.name.endswith(".xml")]


@pytest.mark.slow
@pytest.mark.parametrize("file", assets(), ids=lambda file: file.name)
def test_a_public_model_has_the_mass_matrix_and_bias_of_mujoco(file):
    assert max(apart(file.locate())) < 1e-9
