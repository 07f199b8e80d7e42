"""Muscles of OpenSim's files: paths of points that stay, move, and join in a part of a range; numbers and words."""

import math
from itertools import pairwise

import numpy as np
import pytest

import mbd
from mbd.laboratory.models.osim_functions import simm_spline
from tests.laboratory.test_read_osim import FORMATS, document, written


def body_of(version, name):
    return (
        f"<socket_parent_frame>/bodyset/{name}</socket_parent_frame>" if version == "40000" else f"<body>{name}</body>"
    )


def named(version, owner, name):
    """The coordinate of a point: its path in the format 40000, its name before."""
    path = f"/jointset/knee_joint/{name}"
    return f"<socket_{owner}>{path}</socket_{owner}>" if version == "40000" else f"<{owner}>{name}</{owner}>"


def muscles(version, kind="Thelen2003Muscle", wrap="", more=""):
    functions = {
        "x": "<SimmSpline><x>-2 -1 0 1</x><y>0.04 0.03 0.05 0.04</y></SimmSpline>",
        "y": "<LinearFunction><coefficients>0.02 -0.3</coefficients></LinearFunction>",
        "z": "<Constant><value>0.01</value></Constant>",
    }
    moving = "".join(
        f"<{axis}_location>{function}</{axis}_location>{named(version, f'{axis}_coordinate', 'knee')}"
        for axis, function in functions.items()
    )
    return f"""<ForceSet><objects><{kind} name="vasti">
<max_isometric_force>5000</max_isometric_force><optimal_fiber_length>0.09</optimal_fiber_length>
<tendon_slack_length>0.13</tendon_slack_length><pennation_angle_at_optimal>0.05</pennation_angle_at_optimal>{more}
<GeometryPath><PathPointSet><objects>
<PathPoint name="1">{body_of(version, "femur")}<location>0.03 -0.2 0.02</location></PathPoint>
<ConditionalPathPoint name="2">{body_of(version, "femur")}<location>0.04 -0.35 0.01</location>
{named(version, "coordinate", "knee")}<range>-2 0.2</range></ConditionalPathPoint>
<MovingPathPoint name="3">{body_of(version, "femur")}{moving}</MovingPathPoint>
<PathPoint name="4">{body_of(version, "tibia")}<location>0.04 -0.08 0</location></PathPoint>
</objects></PathPointSet>{wrap}</GeometryPath></{kind}></objects></ForceSet>"""


def with_muscle(version, text):
    whole = document(version)
    a, b = whole.index("<ForceSet>"), whole.index("</ForceSet>") + len("</ForceSet>")
    return whole[:a] + text + whole[b:]


def around(name, reach="-1 -1"):
    return f"""<PathWrapSet><objects><PathWrap name='w'><wrap_object>{name}</wrap_object>
<range>{reach}</range></PathWrap></objects></PathWrapSet>"""


def with_surfaces(text, surfaces, body="femur"):
    """The document with surfaces in a body."""
    start = text.index(f"<Body name='{body}'>") + len(f"<Body name='{body}'>")
    return f"{text[:start]}<WrapObjectSet><objects>{surfaces}</objects></WrapObjectSet>{text[start:]}"


SPHERE = """<WrapSphere name="knob"><xyz_body_rotation>0.1 0.2 0.3</xyz_body_rotation>
<translation>0.01 -0.4 0</translation>
<quadrant>all</quadrant><radius>0.03</radius></WrapSphere>"""
ROD = """<WrapCylinder name="rod"><xyz_body_rotation>0.1 0.2 0.3</xyz_body_rotation>
<translation>0.02 -0.39 0</translation>
<quadrant>+x</quadrant><radius>0.025</radius><length>0.2</length></WrapCylinder>"""


EGG = """<WrapEllipsoid name="egg"><xyz_body_rotation>0.1 0.2 0.3</xyz_body_rotation>
<translation>0.01 -0.4 0</translation>
<quadrant>-y</quadrant><dimensions>0.03 0.02 0.025</dimensions></WrapEllipsoid>"""


@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        (EGG, ("WrappingEllipsoid", (0.03, 0.02, 0.025), (0.0, -1.0, 0.0))),
        (SPHERE.replace("all", "+z").replace("knob", "egg"), ("WrappingEllipsoid", (0.03,) * 3, (0.0, 0.0, 1.0))),
        (ROD.replace("rod", "egg"), ("WrappingCylinder", 0.2, (1.0, 0.0, 0.0))),
    ],
)
def test_surfaces_have_their_sizes_and_sides(surface, expected, tmp_path):
    text = with_muscle("40000", muscles("40000", wrap=around("egg", "3 4")))
    found = mbd.read_model(written(tmp_path, with_surfaces(text, surface)))
    (own,) = [point for point in found.muscles["vasti"].path.points if "Wrapping" in type(point).__name__]
    sizes = own.length if expected[0] == "WrappingCylinder" else own.radii
    assert (type(own).__name__, sizes, own.side) == expected
    planes = any("around ellipsoids lie in planes" in line for line in found.report.approximated)
    assert planes is (expected[0] == "WrappingEllipsoid")
    assert any("a point within a surface" in line for line in found.report.approximated)


def test_a_surface_bends_a_piece_of_its_own_body_in_every_posture(tmp_path):
    """A ball of the thigh on the line between two points of the thigh: longer by the same length at all angles."""
    ball = SPHERE.replace("0.01 -0.4 0<", "0.037 -0.275 0.015<").replace("0.03</radius>", "0.02</radius>")
    lengths = []
    for wrap in around("knob"), "":
        text = with_muscle("40000", muscles("40000", wrap=wrap))
        found = mbd.read_model(written(tmp_path, with_surfaces(text, ball)))
        found.model.apply(found.muscles["vasti"])
        poses = [found.posture | {"knee.angle": knee} for knee in (-0.9, -0.4, 0.1)]
        lengths.append([mbd.assemble(found.model, pose)["vasti.length"] for pose in poses])
    more = np.subtract(*lengths)
    (first, last), r = np.array([[0.03, -0.2, 0.02], [0.04, -0.35, 0.01]]) - (0.037, -0.275, 0.015), 0.02
    a, b = np.linalg.norm(first), np.linalg.norm(last)
    turn = math.acos(first @ last / (a * b)) - math.acos(r / a) - math.acos(r / b)
    bent = math.sqrt(a * a - r * r) + math.sqrt(b * b - r * r) + r * turn - np.linalg.norm(first - last)
    assert more == pytest.approx([bent] * 3, abs=1e-12)


def test_a_surface_bends_the_piece_of_a_path_that_is_nearest_by_joints(tmp_path):
    """One of the shank, of which no piece at the hip may take hold, whatever its range."""
    text = with_muscle("40000", muscles("40000", wrap=around("rod")))
    for body in "femur", "tibia":
        found = mbd.read_model(written(tmp_path, with_surfaces(text, ROD, body)))
        path = found.muscles["vasti"].path.points
        bodies = [(point.frame if hasattr(point, "frame") else point).body.name for point in path]
        kinds = ["Wrapping" in type(point).__name__ for point in path]
        for k in (k for k, wraps in enumerate(kinds) if wraps):
            beside = {bodies[k - 1], bodies[k + 1]}
            assert body in beside and beside != {body}


@pytest.mark.parametrize("version", FORMATS)
@pytest.mark.parametrize(("name", "surface"), [("knob", SPHERE), ("rod", ROD)])
def test_a_path_goes_around_the_surfaces_of_bodies(version, name, surface, tmp_path):
    """The same path by words of our own."""
    text = with_muscle(version, muscles(version, wrap=around(name, "3 4")))
    found = mbd.read_model(written(tmp_path, with_surfaces(text, surface)))
    path = found.muscles["vasti"].path.points
    assert [isinstance(point, mbd.WrappingSphere | mbd.WrappingCylinder) for point in path] == [False] * 3 + [
        True,
        False,
    ]
    femur = found.bodies["femur"]
    frame = femur.point(0.01, -0.4, 0.0) if name == "knob" else femur.point(0.02, -0.39, 0.0)
    for k, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
        frame = frame.turned(0.1 * (k + 1), axis)
    own = mbd.WrappingSphere(frame, 0.03) if name == "knob" else mbd.WrappingCylinder(frame, 0.025, (1, 0, 0), 0.2)
    rigid = {"tendon": "rigid", "activation_time": 0.0, "deactivation_time": 0.0}
    paths = {"theirs": path, "ours": (*path[:3], own, path[4]), "straight": (*path[:3], path[4])}
    muscles_of = [mbd.Muscle(name, points, 1.0, 0.1, 0.1, **rigid) for name, points in paths.items()]
    found.model.apply(*muscles_of)
    bent = 0
    for knee in -1.3, -0.9, -0.2:
        state = mbd.assemble(found.model, found.posture | {"knee.angle": knee})
        assert state["theirs.length"] == pytest.approx(state["ours.length"], abs=1e-14)
        bent += state["theirs.length"] > state["straight.length"] + 1e-5
    assert bent


def test_surfaces_that_paths_name_must_be_there(tmp_path):
    text = with_muscle("40000", muscles("40000", wrap=around("rod")))
    with pytest.raises(mbd.ModelError, match="names the surface 'rod', which no body has"):
        mbd.read_model(written(tmp_path, text))
    with pytest.raises(mbd.ModelError, match="needs a radius above 0 m"):
        mbd.read_model(written(tmp_path, with_surfaces(text, ROD.replace("0.025", "-1"))))
    off = ROD.replace("<quadrant>", "<active>false</active><quadrant>")
    found = mbd.read_model(written(tmp_path, with_surfaces(text, off)))
    assert not any("Wrapping" in type(point).__name__ for point in found.muscles["vasti"].path.points)
    odd = mbd.read_model(written(tmp_path, with_surfaces(text, ROD.replace("+x", "z"))))
    assert any("not on its side 'z'" in line for line in odd.report.approximated)
    egg = "<WrapEllipsoid name='rod'><dimensions>0.1 0 0.1</dimensions></WrapEllipsoid>"
    with pytest.raises(mbd.ModelError, match="needs a radius above 0 m, got 0"):
        mbd.read_model(written(tmp_path, with_surfaces(text, egg)))


@pytest.mark.parametrize("version", FORMATS)
def test_a_path_has_the_length_of_its_points(version, tmp_path):
    found = mbd.read_model(written(tmp_path, with_muscle(version, muscles(version))))
    muscle = found.muscles["vasti"]
    assert (muscle.max_force, muscle.fiber_length, muscle.tendon_length, muscle.pennation) == (5000, 0.09, 0.13, 0.05)
    assert any("curves of De Groote" in line for line in found.report.approximated)
    femur, tibia = found.bodies["femur"], found.bodies["tibia"]
    first, second, last = femur.point(0.03, -0.2, 0.02), femur.point(0.04, -0.35, 0.01), tibia.point(0.04, -0.08, 0.0)
    found.model.apply(muscle)
    spline = simm_spline(np.array([-2.0, -1, 0, 1]), np.array([0.04, 0.03, 0.05, 0.04]))
    for knee in -1.3, 0.4:
        state = mbd.assemble(found.model, found.posture | {"knee.angle": knee})
        moving = femur.point(spline(knee), 0.02 * knee - 0.3, 0.01, name=f"moving {round(100 * knee)}")
        places = {}
        for k, frame in enumerate((first, second, moving, last)):
            x, y, z = frame.offset
            mark = mbd.Marker(f"mark {round(100 * knee)} {k}", frame.body, (x, y, z))
            places[k] = mbd.assemble(found.model, found.posture | {"knee.angle": knee})[mark.full_name]
        order = (0, 1, 2, 3) if knee < 0.2 else (0, 2, 3)
        length = sum(np.linalg.norm(places[b] - places[a]) for a, b in pairwise(order))
        assert state["vasti.length"] == pytest.approx(length, abs=1e-14)


def test_a_point_that_is_on_the_path_at_one_angle_alone_is_left_out(tmp_path):
    text = with_muscle("40000", muscles("40000")).replace("<range>-2 0.2</range>", "<range>0.1 0.1</range>")
    found = mbd.read_model(written(tmp_path, text))
    assert len(found.muscles["vasti"].path.points) == 3
    assert any("point '2' of muscle 'vasti'" in line for line in found.report.left_out)


def test_what_is_not_kept_is_said(tmp_path):
    text = with_muscle("40000", muscles("40000", "DeGrooteFregly2016Muscle", around("ring", "1 2")))
    found = mbd.read_model(written(tmp_path, with_surfaces(text, "<WrapTorus name='ring'/>")))
    assert any("around <WrapTorus> go straight" in line for line in found.report.approximated)
    assert found.muscles["vasti"].damping == 0.0
    assert "1 muscles" in " ".join(found.report.understood)
    off = muscles("40000", more="<appliesForce>false</appliesForce>")
    found = mbd.read_model(written(tmp_path, with_muscle("40000", off)))
    assert not found.muscles
    assert any("switched off" in line for line in found.report.left_out)
    undamped = muscles("40000", "Millard2012EquilibriumMuscle", more="<fiber_damping>0</fiber_damping>")
    millard = mbd.read_model(written(tmp_path, with_muscle("40000", undamped)))
    assert millard.muscles["vasti"].curves == "millard"
    assert any("has no damping" in line for line in millard.report.approximated)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "/bodyset/tibia</socket_parent_frame><location>0.04",
            "/bodyset/fibula</socket_parent_frame><location>0.04",
            "fibula",
        ),
        ("<location>0.04 -0.08 0</location>", "<location>0.04 -0.08</location>", "location must be 3 numbers"),
        ("knee_joint/knee</socket_coordinate>", "knee_joint/neck</socket_coordinate>", "coordinate 'neck'"),
        ("<max_isometric_force>5000", "<max_isometric_force>-5", "max_force -5 N"),
        (
            "<SimmSpline><x>-2 -1 0 1</x><y>0.04 0.03 0.05 0.04</y></SimmSpline>",
            "<Unknown/>",
            "x of a point of muscle 'vasti'",
        ),
    ],
)
def test_what_is_wrong_is_named_with_its_line(old, new, sentence, tmp_path):
    text = with_muscle("40000", muscles("40000"))
    assert old in text
    with pytest.raises(mbd.ModelError, match=sentence) as found:
        mbd.read_model(written(tmp_path, text.replace(old, new)))
    assert "line" in str(found.value)
