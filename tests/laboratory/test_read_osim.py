"""Models of OpenSim in its three formats: places and mass matrix of an independent evaluation, words for all else."""

import pickle

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.laboratory.models.osim_functions import Linear, function_of, simm_spline
from mbd.laboratory.models.xml import read_xml
from tests.comparisons import at_least, compared

FORMATS = ("20303", "30000", "40000")
BODIES = {  # mass, center, inertia xx yy zz xy xz yz
    "pelvis": (11.0, (-0.07, 0.02, 0.01), (0.1, 0.09, 0.06, 0.002, -0.003, 0.001)),
    "femur": (9.0, (0.01, -0.17, 0.02), (0.13, 0.035, 0.14, 0.001, 0.002, -0.002)),
    "tibia": (3.7, (0.0, -0.19, 0.01), (0.05, 0.005, 0.051, 0.0, 0.0, 0.0)),
    "foot": (1.2, (0.06, -0.02, 0.0), (0.001, 0.004, 0.004, 0.0, 0.0002, 0.0)),
    "hand": (0.6, (0.02, 0.05, -0.01), (0.001, 0.0012, 0.0011, 0.0, 0.0, 0.0)),
    "tip": (0.2, (0.0, 0.03, 0.0), (0.0002, 0.0001, 0.0002, 0.0, 0.0, 0.0)),
}
AXIS = tuple(np.array([0.05, -0.04, 1.0]) / np.linalg.norm([0.05, -0.04, 1.0]))
KNOTS = np.linspace(-2.0, 1.0, 7)


def shift(q):
    """Of the knee along x, a cubic, which the spline through its points is."""
    return 0.01 - 0.02 * q + 0.004 * q**2 + 0.003 * q**3


def linear(slope, offset=0.0):
    return f"<LinearFunction name='f'><coefficients>{slope} {offset}</coefficients></LinearFunction>"


def constant(value):
    return f"<Constant><value>{value}</value></Constant>"


SPLINE = (
    f"<SimmSpline><x>{' '.join(map(repr, KNOTS.tolist()))}</x>"
    f"<y>{' '.join(map(repr, shift(KNOTS).tolist()))}</y></SimmSpline>"
)
SCALED = (
    "<MultiplierFunction><function><PolynomialFunction><coefficients>0.01 -0.02 0.005</coefficients>"
    "</PolynomialFunction></function><scale>-2</scale></MultiplierFunction>"
)
ROOT = {  # of a custom joint: axis, coordinate, function
    "rotation1": ((0, 0, 1), "pelvis_tilt", linear(1)),
    "rotation2": ((1, 0, 0), "pelvis_list", linear(-1, 0.2)),
    "rotation3": ((0, 1, 0), "", constant(0.3)),
    "translation1": ((1, 0, 0), "pelvis_tx", linear(1)),
    "translation2": ((0, 1, 0), "pelvis_ty", linear(1, 0.9)),
    "translation3": ((0, 0, 1), "", constant(0.05)),
}
KNEE = {
    "rotation1": (AXIS, "knee", linear(1)),
    "rotation2": ((0, 1, 0), "knee", linear(0.1, -0.02)),
    "rotation3": ((1, 0, 0), "", constant(0)),
    "translation1": ((1, 0, 0), "knee", SPLINE),
    "translation2": ((0, 1, 0), "knee", SCALED),
    "translation3": ((0, 0, 1), "", constant(-0.004)),
}
JOINTS = {  # kind, name, parent, place and turn in the parent, in the child, coordinates, transform
    "pelvis": ("CustomJoint", "root", "ground", (0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0),
               ("pelvis_tx", "pelvis_ty", "pelvis_tilt", "pelvis_list"), ROOT),
    "femur": ("GimbalJoint", "hip", "pelvis", (-0.07, -0.06, 0.08), (0.1, -0.2, 0.3), (0, 0.01, 0), (0.2, 0.1, -0.1),
              ("hip_x", "hip_y", "hip_z"), None),
    "tibia": ("CustomJoint", "knee_joint", "femur", (0, -0.4, 0), (0, 0, 0.1), (0.01, 0, 0.02), (0.05, 0, 0),
              ("knee",), KNEE),
    "foot": ("PinJoint", "ankle", "tibia", (0, -0.43, 0), (0.2, 0.1, 0), (0, 0.02, 0), (0.2, 0.1, 0),
             ("ankle_angle",), None),
    "hand": ("SliderJoint", "rail", "pelvis", (0.1, 0.3, 0), (0, 0.3, 0), (0, 0, 0.01), (0, 0.1, 0), ("reach",), None),
    "tip": ("WeldJoint", "flange", "hand", (0, 0.1, 0), (0, 0, 0.5), (0, 0, 0), (0.3, 0, 0), (), None),
}  # fmt: skip
COORDINATES = [name for joint in JOINTS.values() for name in joint[7]]


OPENSIM = {
    -0.5: -0.03970728193810403, 0.05: 0.003878241113666709, 0.4: 0.025047905797646652, 1.2: 0.02650866074920496,
    1.5: 0.015907027146493787,
}  # fmt: skip
"""Values of the spline of a knee, by OpenSim 4.6."""


def triple(values):
    return " ".join(map(repr, map(float, values)))


def transform_of(axes, version):
    text = "<SpatialTransform>"
    for name, (axis, coordinate, function) in axes.items():
        inside = function if version == "40000" else f"<function>{function}</function>"
        text += (
            f"\n<TransformAxis name='{name}'><coordinates>{coordinate}</coordinates><axis>{triple(axis)}</axis>"
            f"{inside}</TransformAxis>"
        )
    return text + "\n</SpatialTransform>"


def document(version, joints=JOINTS, coordinate=lambda name: "", constraints="", more=""):
    """A file in a format, one element a line."""
    listed, bodies = "", "" if version == "40000" else "<Body name='ground'><mass>0</mass></Body>\n"
    for body, (kind, name, parent, at, turn, place, twist, names, axes) in joints.items():
        mass, center, inertia = BODIES[body]
        written = "".join(
            f"\n<Coordinate name='{each}'><default_value>0.1</default_value>"
            f"<range>-1.5 0.9</range>{coordinate(each)}</Coordinate>"
            for each in names
        )
        transform = transform_of(axes, version) if axes else ""
        if version == "40000":
            home = "/ground" if parent == "ground" else f"/bodyset/{parent}"
            listed += f"""<{kind} name='{name}'><socket_parent_frame>{parent}_offset</socket_parent_frame>
<socket_child_frame>{body}_offset</socket_child_frame>
<coordinates>{written}</coordinates>
<frames>
<PhysicalOffsetFrame name='{parent}_offset'><socket_parent>{home}</socket_parent><translation>{triple(at)}</translation>
<orientation>{triple(turn)}</orientation></PhysicalOffsetFrame>
<PhysicalOffsetFrame name='{body}_offset'><socket_parent>/bodyset/{body}</socket_parent>
<translation>{triple(place)}</translation>
<orientation>{triple(twist)}</orientation></PhysicalOffsetFrame>
</frames>
{transform}</{kind}>
"""
            tensor, joint = f"<inertia>{' '.join(map(str, inertia))}</inertia>", ""
        else:
            axes_of = ("xx", "yy", "zz", "xy", "xz", "yz")
            tensor = "".join(f"<inertia_{k}>{v}</inertia_{k}>" for k, v in zip(axes_of, inertia, strict=True))
            joint = f"""<Joint><{kind} name='{name}'><parent_body>{parent}</parent_body>
<location_in_parent>{triple(at)}</location_in_parent><orientation_in_parent>{triple(turn)}</orientation_in_parent>
<location>{triple(place)}</location><orientation>{triple(twist)}</orientation>
<CoordinateSet><objects>{written}</objects></CoordinateSet>
{transform}<reverse>false</reverse></{kind}></Joint>
"""
        bodies += f"""<Body name='{body}'><mass>{mass}</mass><mass_center>{triple(center)}</mass_center>{tensor}
{joint}</Body>
"""
    sets = f"<JointSet><objects>{listed}</objects></JointSet>" if version == "40000" else ""
    on = "<socket_parent_frame>/bodyset/foot</socket_parent_frame>" if version == "40000" else "<body>foot</body>"
    return f"""<?xml version="1.0" encoding="UTF-8" ?>
<OpenSimDocument Version="{version}">
<Model name="leg"><gravity>0 -9.80665 0</gravity><length_units>meters</length_units>
<BodySet><objects>
{bodies}</objects></BodySet>
{sets}
<ConstraintSet><objects>{constraints}</objects></ConstraintSet>
<MarkerSet><objects><Marker name="R.Heel">{on}<location>-0.05 -0.04 0.01</location></Marker></objects></MarkerSet>
<ForceSet><objects><Thelen2003Muscle name="soleus"/><Thelen2003Muscle name="vasti"/></objects></ForceSet>{more}
</Model></OpenSimDocument>
"""


def written(folder, text):
    path = folder / "leg.osim"
    path.write_text(text)
    return path


# an independent evaluation, which takes complex numbers -------------------------------------------------------------
def turned(axis, angle):
    x, y, z = np.asarray(axis, dtype=float)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def euler(angles):
    return turned((1, 0, 0), angles[0]) @ turned((0, 1, 0), angles[1]) @ turned((0, 0, 1), angles[2])


def motion_of(body, q):
    """Rotation and place of the child's joint frame in the parent's."""
    x, y, z = np.eye(3)
    if body == "pelvis":
        R = turned(z, q["pelvis_tilt"]) @ turned(x, 0.2 - q["pelvis_list"]) @ turned(y, 0.3)
        return R, np.array([q["pelvis_tx"], q["pelvis_ty"] + 0.9, 0.05])
    if body == "femur":
        return euler([q["hip_x"], q["hip_y"], q["hip_z"]]), np.zeros(3)
    if body == "tibia":
        angle = q["knee"]
        R = turned(AXIS, angle) @ turned(y, 0.1 * angle - 0.02)
        return R, np.array([shift(angle), -2.0 * (0.01 * angle**2 - 0.02 * angle + 0.005), -0.004])
    if body == "foot":
        return turned(z, q["ankle_angle"]), np.zeros(3)
    return np.eye(3), x * q["reach"] if body == "hand" else np.zeros(3)


def bodies_at(q):
    """Rotation and place of each body."""
    found = {"ground": (np.eye(3), np.zeros(3))}
    for body, (_, _, parent, at, turn, place, twist, _, _) in JOINTS.items():
        R, p = found[parent]
        p, R = p + R @ np.array(at), R @ euler(turn)
        J, j = motion_of(body, q)
        p, R = p + R @ j, R @ J @ euler(twist).T
        found[body] = (R, p - R @ np.array(place))
    return found


def mass_matrix(q):
    """Σ m Jᵀ J + Wᵀ I W, columns by complex steps, which round nothing off."""
    columns = []
    for name in COORDINATES:
        moved = bodies_at({**q, name: q[name] + 1e-30j})
        columns.append(moved)
    M, here = np.zeros((len(COORDINATES),) * 2), bodies_at(q)
    for body, (m, center, inertia) in BODIES.items():
        xx, yy, zz, xy, xz, yz = inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        J, W = [], []
        for moved in columns:
            R, p = moved[body]
            J.append((p + R @ np.array(center)).imag / 1e-30)
            spin = here[body][0].T @ R.imag / 1e-30  # in body axes
            W.append([spin[2, 1], spin[0, 2], spin[1, 0]])
        J, W = np.array(J), np.array(W)
        M += m * J @ J.T + W @ tensor @ W.T
    return M


def reduced_mass(found, state):
    """The mass matrix of the coordinates of the file: what rows determine is taken out."""
    mechanism = mechanism_of(found.model, "python")
    equations = mechanism.equations
    terms = mechanism.acceleration_terms(
        0.0, state.q, np.zeros(equations.n_v), mechanism.parameters(), np.zeros(equations.n_anchors)
    )
    names = [*equations.velocity_names]
    own = [names.index(f"{found.joints[name].coordinate_names[0]}.rate") for name in COORDINATES]
    rest = [k for k in range(len(names)) if k not in own]
    T = np.zeros((len(names), len(own)))
    T[own, range(len(own))] = 1.0
    T[rest] = -np.linalg.solve(terms.B[:, rest], terms.B[:, own])
    return T.T @ terms.M @ T


@pytest.mark.parametrize("version", FORMATS)
def test_a_file_has_the_places_and_the_mass_matrix_of_an_independent_evaluation(tmp_path, version):
    found = mbd.read_model(written(tmp_path, document(version)))
    assert [each.name for each in found.model.constraints] == [
        "knee_joint translation1 function", "knee_joint translation2 function", "knee_joint rotation2 function",
    ]  # fmt: skip
    rng = np.random.default_rng(int(version))
    for _ in range(2):
        q = dict(zip(COORDINATES, rng.uniform(-0.9, 0.9, len(COORDINATES)), strict=True))
        state = mbd.assemble(found.model, {found.joints[name].coordinate_names[0]: q[name] for name in COORDINATES})
        for body, (R, p) in bodies_at(q).items():
            if body != "ground":
                assert state[f"{body}.origin"] == pytest.approx(p, abs=1e-12)
                assert state[f"{body}.center"] == pytest.approx(p + R @ np.array(BODIES[body][1]), abs=1e-12)
        R, p = bodies_at(q)["foot"]
        assert state["R_Heel"] == pytest.approx(p + R @ [-0.05, -0.04, 0.01], abs=1e-12)
        expected = mass_matrix(q)
        assert np.abs(reduced_mass(found, state) - expected).max() < 1e-12 * np.abs(expected).max()
    assert "muscles without a <GeometryPath>: 'soleus', 'vasti'" in str(found.report)
    assert found.posture["knee.angle"] == 0.1
    assert mbd.assemble(found.model, found.posture)["hip_x.angle"] == 0.1


def test_the_spline_is_that_of_opensim():
    x = np.array([0, 0.174533, 0.349066, 0.523599, 0.698132, 0.872665, 1.0472, 1.22173])
    y = np.array([0, 0.0126809, 0.0226969, 0.0296054, 0.0332049, 0.0335354, 0.0308779, 0.0257548])
    curve = simm_spline(x, y)
    for place, value in OPENSIM.items():  # SimmSpline.calcValue of opensim 4.6
        assert curve(place) == pytest.approx(value, abs=1e-15)
    three = simm_spline(np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 9.0]))
    assert three(2.0) == pytest.approx(4.0) and three(4.0) == pytest.approx(15.0) and three(-1.0) == pytest.approx(0.0)
    assert simm_spline(np.array([0.0, 2.0]), np.array([1.0, 5.0]))(5.0) == pytest.approx(11.0)


def test_a_polynomial_of_several_coordinates_is_that_of_opensim(tmp_path):
    text = """<o><MultivariatePolynomialFunction><coefficients>1 2 3 5 7 11 13 17 19 23</coefficients>
<dimension>2</dimension><order>3</order></MultivariatePolynomialFunction></o>"""

    def function(text, arguments=2):
        path = tmp_path / "f.xml"
        path.write_text(text)
        return function_of(read_xml(path, []), arguments, "a motion")

    assert function(text)(0.3, 0.2) == pytest.approx(6.969, abs=1e-14)  # of a joint by OpenSim 4.6
    assert function(text).scaled(-2.0)(0.3, 0.2) == pytest.approx(-13.938, abs=1e-13)
    for old, new in (("<dimension>2", "<dimension>3"), ("<order>3", "<order>99"), (" 23<", "<")):
        with pytest.raises(mbd.ModelError, match="MultivariatePolynomialFunction|coefficients"):
            function(text.replace(old, new))
    line = "<o><PiecewiseLinearFunction><x>-1 0 2</x><y>3 1 -3</y></PiecewiseLinearFunction></o>"
    assert function(line, 1)(0.7) == pytest.approx(-0.4, abs=1e-15)
    assert isinstance(function(line, 1), Linear)
    assert not isinstance(function(line.replace("-3", "-4"), 1), Linear)


@pytest.mark.parametrize("version", FORMATS)
def test_a_coordinate_that_no_motion_is_by_itself_has_a_joint_of_its_own(tmp_path, version):
    """The wrist of an arm, whose angles are splines of its coordinates; here half a coordinate."""
    root = ROOT | {"rotation1": ((0, 0, 2), "pelvis_tilt", linear(0.5))}
    joints = JOINTS | {"pelvis": (*JOINTS["pelvis"][:-1], root)}
    found = mbd.read_model(written(tmp_path, document(version, joints)))
    assert "by itself, of joints without mass: 'pelvis_tilt'" in str(found.report)
    assert "axis of rotation1 of joint 'root' has the length 2; only its direction is used" in str(found.report)
    q = dict(zip(COORDINATES, np.random.default_rng(3).uniform(-0.9, 0.9, len(COORDINATES)), strict=True))
    state = mbd.assemble(found.model, {found.joints[name].coordinate_names[0]: q[name] for name in COORDINATES})
    half = {**q, "pelvis_tilt": 0.5 * q["pelvis_tilt"]}
    for body, (_, p) in bodies_at(half).items():
        if body != "ground":
            assert state[f"{body}.origin"] == pytest.approx(p, abs=1e-12)
    scale = np.where(np.array(COORDINATES) == "pelvis_tilt", 0.5, 1.0)
    expected = mass_matrix(half) * scale * scale[:, None]
    assert np.abs(reduced_mass(found, state) - expected).max() < 1e-12 * np.abs(expected).max()
    run = mbd.simulate(found.model, state, tol=1e-6, until=0.1)
    assert run["root rotation1.angle"] == pytest.approx(0.5 * run["pelvis_tilt.angle"], abs=1e-9)
    # nothing follows from it
    still = ROOT | {"rotation1": ((0, 0, 1), "", constant(0.1))}
    alone = document(version, JOINTS | {"pelvis": (*JOINTS["pelvis"][:-1], still)})
    report = str(mbd.read_model(written(tmp_path, alone)).report)
    assert "coordinate 'pelvis_tilt', of which no motion is a function" in report


COUPLER = """<CoordinateCouplerConstraint name="toe"><{off}>{value}</{off}>
<coupled_coordinates_function>
<LinearFunction><coefficients>0.5 -0.25 0.1</coefficients></LinearFunction>
</coupled_coordinates_function>
<independent_coordinate_names>hip_x knee</independent_coordinate_names>
<dependent_coordinate_name>ankle_angle</dependent_coordinate_name><scale_factor>2</scale_factor></CoordinateCouplerConstraint>
<PointOnLineConstraint name="loop"/>"""


@pytest.mark.parametrize("version", ["30000", "40000"])
def test_couplers_locks_and_clamps(tmp_path, version):
    def extra(name):
        return {"hip_y": "<locked>true</locked>", "knee": "<clamped>true</clamped>"}.get(
            name, "<locked> false </locked>"
        )

    on, off = (
        (("isDisabled", "false"), ("isDisabled", "true"))
        if version == "30000"
        else (("isEnforced", "true"), ("isEnforced", "false"))
    )
    text = document(version, coordinate=extra, constraints=COUPLER.format(off=on[0], value=on[1]))
    found = mbd.read_model(written(tmp_path, text), stops=True)
    names = {each.name for each in found.model.constraints}
    assert {"toe", "hip_y lock", "knee lower stop", "knee upper stop"} < names
    state = mbd.assemble(found.model, found.posture | {"hip_x.angle": 0.4, "knee.angle": -0.3})
    assert state["ankle_angle.angle"] == pytest.approx(2.0 * (0.5 * 0.4 + 0.25 * 0.3 + 0.1))
    assert state["hip_y.angle"] == pytest.approx(0.1)
    assert "ankle_angle.angle" not in found.posture and "hip_y.angle" not in found.posture
    assert "<PointOnLineConstraint> 'loop'" in str(found.report)
    run = mbd.simulate(found.model, state, dt=1e-3, until=0.05)
    assert run["hip_y.angle"] == pytest.approx(0.1 + 0.0 * run.t, abs=1e-9)
    again = pickle.loads(pickle.dumps(found.model))
    assert [joint.name for joint in again.joints] == [joint.name for joint in found.model.joints]
    # switched off, or not asked for
    text = document(version, coordinate=extra, constraints=COUPLER.format(off=off[0], value=off[1]))
    found = mbd.read_model(written(tmp_path, text))
    assert not {"toe", "knee lower stop"} & {each.name for each in found.model.constraints}
    assert "'toe', which is switched off" in str(found.report) and "ranges of clamped coordinates" in str(found.report)


def test_a_range_that_is_none_is_left_out_and_told(tmp_path):
    for wrong in ("<range>0.9 -1.5</range>", ""):
        text = document("40000", coordinate=lambda name: "<clamped>true</clamped>" if name == "knee" else "")
        at = text.index("<range>", text.index("<Coordinate name='knee'>"))
        text = text[:at] + text[at:].replace("<range>-1.5 0.9</range>", wrong, 1)
        found = mbd.read_model(written(tmp_path, text), stops=True)
        assert not [each for each in found.model.constraints if "stop" in each.name]
        assert "whose lower end is not below the upper one: 'knee'" in str(found.report)


@pytest.mark.parametrize("version", ["30000", "40000"])
def test_balls_and_free_bodies_turn_by_quaternions_unless_locked(tmp_path, version):
    zero = (0, 0, 0)
    joints = {
        "pelvis": ("FreeJoint", "root", "ground", (0.1, 0, 0), (0.2, 0, 0), zero, zero,
                   ("rx", "ry", "rz", "tx", "ty", "tz"), None),
        "femur": ("BallJoint", "hip", "pelvis", (0, -0.1, 0), zero, (0, 0.1, 0), zero, ("hx", "hy", "hz"), None),
        "foot": ("WeldJoint", "heel", "femur", zero, zero, zero, zero, (), None),
    }  # fmt: skip
    found = mbd.read_model(written(tmp_path, document(version, joints)))
    assert [type(joint).__name__ for joint in found.joints.values()] == ["Free", "Spherical", "Weld"]
    state = mbd.assemble(found.model, found.posture)
    R = turned((1, 0, 0), 0.2)
    p, R = np.array([0.1, 0, 0]) + R @ [0.1, 0.1, 0.1], R @ euler([0.1, 0.1, 0.1])
    assert state["pelvis.origin"] == pytest.approx(p, abs=1e-12)
    p, R = p + R @ [0, -0.1, 0], R @ euler([0.1, 0.1, 0.1])
    assert state["femur.origin"] == pytest.approx(p - R @ [0, 0.1, 0], abs=1e-12)
    chain = mbd.read_model(
        written(
            tmp_path, document(version, joints, lambda name: "<locked>true</locked>" if name in ("hy", "tz") else "")
        )
    )
    assert [*chain.joints] == ["tx", "ty", "tz", "rx", "ry", "rz", "hx", "hy", "hz", "heel"]
    locked = mbd.assemble(chain.model, chain.posture)
    assert locked["femur.center"] == pytest.approx(state["femur.center"], abs=1e-12)


@pytest.mark.parametrize("version", FORMATS)
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<OpenSimDocument", "<Document", "no XML here"),
        ('Version="', 'Version="1', "is of the format '1.....'; 20303, 30000 and 40000"),
        ("<length_units>meters", "<length_units>inches", "has lengths in 'inches'"),
        ("<mass>9.0</mass>", "<mass>heavy</mass>", "line .*<mass> mass must be a number, got 'heavy'"),
        ("<mass>9.0</mass>", "<mass>-9</mass>", "<Body> 'femur' has the negative mass"),
        ("<mass>9.0</mass>", "", "<Body> 'femur' needs <mass>"),
        ("<Body name='tip'>", "<Body name='hand'>", "that of another body"),
        ("name='hip'", "name=''", "has no name"),
        ("<Coordinate name='hip_y'>", "<Coordinate name='knee'>", "another coordinate"),
        (
            "<coordinates>pelvis_tilt<",
            "<coordinates>hip_x<",
            "'rotation1' of joint 'root' names the coordinate 'hip_x'",
        ),
        ("<axis>0.0 0.0 1.0<", "<axis>0.0 0.0 0.0<", "'rotation1' of joint 'root' needs an axis, got one without"),
        (
            "SimmSpline>",
            "GCVSpline>",
            "<GCVSpline> is the function of translation1 of joint 'knee_joint', which cannot",
        ),
        ("TransformAxis name='rotation2'", "TransformAxis name='turn'", "needs a <SpatialTransform> with"),
        ("<SimmSpline><x>-2.0", "<SimmSpline><x>0.5", "needs at least two points with increasing x"),
        ("GimbalJoint", "EllipsoidJoint", "is a joint that cannot be stated exactly"),
        ('<?xml version="1.0" encoding="UTF-8" ?>', '<!DOCTYPE r [<!ENTITY a "b">]>', "entities are not read"),
        ("<location>-0.05 -0.04 0.01", "<location>-0.05 -0.04", "location must be 3 numbers"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, version, old, new, words):
    text = document(version)
    assert old in text
    count = -1 if old in ("SimmSpline>", "GimbalJoint", "<OpenSimDocument") else 1
    with pytest.raises(mbd.ModelError, match=words):
        mbd.read_model(written(tmp_path, text.replace(old, new, count)))


def test_comments_that_xml_forbids_are_skipped_and_told(tmp_path):
    text = document("30000", more="\n<!--\n<!--Probes -- of the model.-->\n<Thelen::Probe/>")
    found = mbd.read_model(written(tmp_path, text))
    line = text[: text.index("<!--")].count("\n") + 1
    assert f"leg.osim, line {line}: a comment that XML forbids was skipped" in str(found.report)


def test_a_circle_of_joints_is_named(tmp_path):
    kind, name, _, *rest = JOINTS["femur"]
    circle = JOINTS | {"femur": (kind, name, "foot", *rest)}
    for version in ("30000", "40000"):
        with pytest.raises(mbd.ModelError, match="no way from the ground reaches: 'hip', 'knee_joint', 'ankle'"):
            mbd.read_model(written(tmp_path, document(version, circle)))
    with pytest.raises(mbd.ModelError, match="names the body 'hips'"):
        mbd.read_model(written(tmp_path, document("40000").replace("/bodyset/pelvis<", "/bodyset/hips<", 1)))


@pytest.mark.parametrize("version", ["30000", "40000"])
@at_least(5)
def test_a_file_without_one_of_its_lines_gives_the_same_numbers_or_a_named_error(tmp_path, version):
    text = document(version)
    lines, q = text.splitlines(), dict.fromkeys(COORDINATES, 0.1)
    expected = bodies_at(q)
    for k in range(len(lines)):
        try:
            found = mbd.read_model(written(tmp_path, "\n".join(lines[:k] + lines[k + 1 :])))
        except mbd.ModelError:
            continue
        compared()
        assert set(found.bodies) == set(BODIES), lines[k]
        assert set(COORDINATES) <= set(found.joints), lines[k]
        state = mbd.assemble(found.model, found.posture)
        for body in BODIES:
            assert state[f"{body}.origin"] == pytest.approx(expected[body][1], abs=1e-12), lines[k]
