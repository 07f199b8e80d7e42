"""Loops that constraints of OpenSim close, and a patella, all of whose motions follow from the knee by a coupler."""

import numpy as np
import pytest

import mbd

BODY = """<Body name="{0}"><mass>1.5</mass><mass_center>0 -0.2 0</mass_center>
<inertia>0.02 0.01 0.02 0 0 0</inertia></Body>"""


def offset(joint, name, body, place):
    home = "/ground" if body == "ground" else f"/bodyset/{body}"
    return (
        f'<PhysicalOffsetFrame name="{name}"><socket_parent>{home}</socket_parent><translation>{place}</translation>'
        "<orientation>0 0 0</orientation></PhysicalOffsetFrame>"
    )


def pin(name, parent, place, child, at="0 0 0"):
    frames = offset(name, "a", parent, place) + offset(name, "b", child, at)
    return f"""<PinJoint name="{name} pin"><socket_parent_frame>a</socket_parent_frame>
<socket_child_frame>b</socket_child_frame><coordinates><Coordinate name="{name}"/></coordinates>
<frames>{frames}</frames></PinJoint>"""


def file(folder, bodies, joints, constraints):
    path = folder / "loop.osim"
    path.write_text(f"""<OpenSimDocument Version="40000"><Model name="loop"><gravity>0 -9.81 0</gravity>
<BodySet><objects>{"".join(BODY.format(name) for name in bodies)}</objects></BodySet>
<JointSet><objects>{joints}</objects></JointSet>
<ConstraintSet><objects>{constraints}</objects></ConstraintSet></Model></OpenSimDocument>""")
    return path


FOUR_BAR = (
    pin("crank", "ground", "0 0 0", "one") + pin("coupler", "one", "0 -0.4 0", "two")
    + pin("rocker", "ground", "0.5 0 0", "three")
)  # fmt: skip


@pytest.mark.parametrize("kind", ["PointConstraint", "WeldConstraint"])
def test_a_loop_is_closed(kind, tmp_path):
    if kind == "PointConstraint":
        closing = """<PointConstraint name="pin"><socket_body_1>/bodyset/two</socket_body_1>
<socket_body_2>/bodyset/three</socket_body_2><location_body_1>0 -0.5 0</location_body_1>
<location_body_2>0 -0.4 0</location_body_2></PointConstraint>"""
    else:  # the last bar is turned by the weld, so that it carries the third pin
        closing = f"""<WeldConstraint name="weld"><socket_frame1>c</socket_frame1>
<socket_frame2>/bodyset/three</socket_frame2><frames>{offset("", "c", "tip", "0 0 0")}</frames></WeldConstraint>"""
    bodies, joints = ["one", "two", "three"], FOUR_BAR
    if kind == "WeldConstraint":
        bodies, joints = [*bodies, "tip"], FOUR_BAR + pin("end", "two", "0 -0.5 0", "tip", "0 -0.4 0")
    found = mbd.read_model(file(tmp_path, bodies, joints, closing))
    assert "constraints that close loops, as joints" in str(found.report)
    state = mbd.assemble(found.model, {"crank.angle": 0.2})
    two, three = found.bodies["two"].point(0.0, -0.5), found.bodies["three"].point(0.0, -0.4)
    mbd.Marker("P", two.body, two.offset)
    mbd.Marker("Q", three.body, three.offset)
    state = mbd.assemble(found.model, {"crank.angle": 0.2})
    np.testing.assert_allclose(state["P"], state["Q"], atol=1e-10)
    assert mbd.mobility(found.model).dof == 1
    run = mbd.simulate(found.model, state, dt=2e-3, until=0.1)
    assert np.abs(run["P"] - run["Q"]).max() < 1e-8


PATELLA = f"""<CustomJoint name="kneecap"><socket_parent_frame>a</socket_parent_frame>
<socket_child_frame>b</socket_child_frame><coordinates><Coordinate name="beta"/></coordinates>
<frames>{offset("", "a", "one", "0 0 0")}{offset("", "b", "two", "0 0 0")}</frames><SpatialTransform>
<TransformAxis name="rotation1"><coordinates>beta</coordinates><axis>0 0 1</axis>
<SimmSpline><x>-2 -1 0 1</x><y>-1.2 -0.7 0 0.4</y></SimmSpline></TransformAxis>
<TransformAxis name="rotation2"><axis>0 1 0</axis><Constant><value>0</value></Constant></TransformAxis>
<TransformAxis name="rotation3"><axis>1 0 0</axis><Constant><value>0</value></Constant></TransformAxis>
<TransformAxis name="translation1"><coordinates>beta</coordinates><axis>1 0 0</axis>
<PolynomialFunction><coefficients>0.01 0.02 0.05</coefficients></PolynomialFunction></TransformAxis>
<TransformAxis name="translation2"><coordinates>beta</coordinates><axis>0 1 0</axis>
<LinearFunction><coefficients>0.02 -0.4</coefficients></LinearFunction></TransformAxis>
<TransformAxis name="translation3"><axis>0 0 1</axis><Constant><value>0</value></Constant></TransformAxis>
</SpatialTransform></CustomJoint>"""
COUPLER = """<CoordinateCouplerConstraint name="beta"><coupled_coordinates_function><LinearFunction>
<coefficients>1 0.1</coefficients></LinearFunction></coupled_coordinates_function>
<independent_coordinate_names>knee</independent_coordinate_names>
<dependent_coordinate_name>beta</dependent_coordinate_name></CoordinateCouplerConstraint>"""


def test_a_patella_follows_the_knee(tmp_path):
    """Its coordinate is no motion by itself; the coupler makes it knee + 0.1."""
    joints = pin("hip", "ground", "0 0 0", "one") + pin("knee", "one", "0 -0.4 0", "three") + PATELLA
    found = mbd.read_model(file(tmp_path, ["one", "two", "three"], joints, COUPLER))
    for knee in -1.1, 0.3:
        state = mbd.assemble(found.model, {"hip.angle": 0.0, "knee.angle": knee})
        beta = knee + 0.1
        place = [0.01 * beta**2 + 0.02 * beta + 0.05, 0.02 * beta - 0.4, 0.0]
        np.testing.assert_allclose(state["two.origin"], place, atol=1e-10)
    assert mbd.mobility(found.model).dof == 2
    alone = mbd.read_model(file(tmp_path, ["one", "two", "three"], joints, ""))  # without it beta moves by itself
    place = [0.01 * 0.3**2 + 0.02 * 0.3 + 0.05, 0.02 * 0.3 - 0.4, 0.0]
    own = alone.joints["beta"].coordinate_names[0]
    state = mbd.assemble(alone.model, {"hip.angle": 0.0, "knee.angle": 0.2, own: 0.3})
    np.testing.assert_allclose(state["two.origin"], place, atol=1e-10)
    assert mbd.mobility(alone.model).dof == 3


def test_a_body_that_is_held_to_itself_is_named(tmp_path):
    closing = """<PointConstraint name="pin"><socket_body_1>/bodyset/two</socket_body_1>
<socket_body_2>/bodyset/two</socket_body_2><location_body_1>0 0 0</location_body_1>
<location_body_2>0 0 0</location_body_2></PointConstraint>"""
    with pytest.raises(mbd.ModelError, match="holds a body to itself"):
        mbd.read_model(file(tmp_path, ["one", "two", "three"], FOUR_BAR, closing))
