"""Spatial pages and pictures: solids, the camera and the points obey the mechanics and the law of projection."""

import json
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.results.at_state import instant
from mbd.view import page as pages
from mbd.view.camera import FIRST, VIEWS, angles_of, camera
from mbd.view.forms import equal_inertia, mesh
from mbd.view.page import kept
from mbd.view.scene import scene
from mbd.view.solids import quaternions, rotations
from tests.helpers import one_body
from tests.view.pages import Elements, opened
from tests.view.test_page import unpacked

ANGLE = st.floats(-3.2, 3.2)
PIN, TIP = (0.02, 0.25, -0.03), (0.0, -0.25, 0.0)


@cache
def hanging() -> tuple[mbd.Model, mbd.State]:
    """Two bodies on cross joints, in gravity that is not along an axis."""
    model = mbd.Model("double pendulum", gravity=(1.0, -2.0, -9.0))
    upper = mbd.RigidBody("left upper", 2.0, (0.05, 0.02, 0.04, 0.005, 0.0, 0.002), center=(0.01, 0.02, 0.03))
    lower = mbd.RigidBody("right lower", **mbd.cylinder(1.0, 0.06, 0.6, axis="y").body)
    model.connect(
        mbd.Universal("shoulder", model.ground.origin, upper.point(*PIN, name="pin")),
        mbd.Universal("elbow", upper.point(*TIP, name="tip"), lower.point(0.0, 0.3, 0.0, name="top")),
    )
    return model, mbd.assemble(model, position={"shoulder.first": 0.9, "elbow.second": -0.4})


def stopped(from_ground: bool = True) -> mbd.Trajectory:
    """A ball joint with a stop of directions, seen from the ground or from its body."""
    model, body = mbd.Model("hip"), mbd.RigidBody("thigh", 1.0, (0.1, 0.1, 0.1), center=(0.0, -0.2, 0.0))
    ends = (model.ground.origin, body.origin) if from_ground else (body.origin, model.ground.origin)
    hip = mbd.Spherical("hip", *ends)
    model.connect(hip)
    model.constrain(mbd.Unilateral("stop", mbd.cone(hip, 0.4)))
    return mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=0.05)


@cache
def pendulum() -> mbd.Trajectory:
    return mbd.simulate(*hanging(), dt=5e-3, until=0.25, backend="python")


def page(run: mbd.Trajectory, folder: Path) -> tuple[str, dict]:
    text = run.page(folder / "page.html").read_text(encoding="utf-8")
    return text, json.loads(Elements(text).scripts[0])


@given(ANGLE, ANGLE)
def test_the_camera_turns_and_changes_no_distance(yaw, pitch):
    rows = camera(yaw, pitch)
    np.testing.assert_allclose(rows @ rows.T, np.eye(3), atol=1e-14)
    assert (
        np.linalg.det(rows) == pytest.approx(1.0) and rows[0, 1] == 0.0 and rows[1, 1] == pytest.approx(np.cos(pitch))
    )


def test_views_look_along_the_axes_they_name():
    toward = {name: camera(*angles)[2] for name, angles in VIEWS.items()}
    np.testing.assert_allclose([toward["front"], toward["side"], toward["top"]], np.eye(3)[[0, 2, 1]], atol=1e-15)
    np.testing.assert_allclose(camera(*VIEWS["side"]), np.eye(3), atol=0.0)


@given(
    st.floats(0.1, 10.0), st.tuples(*[st.floats(0.05, 2.0)] * 3), st.tuples(ANGLE, ANGLE), st.sampled_from(["", "box"])
)
def test_a_body_is_drawn_as_the_solid_that_has_its_inertia(mass, sides, angles, kind):
    a, b, c = np.square(sides)
    turn = camera(*angles)
    wanted = turn @ np.diag(mass * np.array([b + c, a + c, a + b]) / 12.0) @ turn.T
    form = equal_inertia(mass, [*np.diag(wanted), wanted[0, 1], wanted[0, 2], wanted[1, 2]], kind)
    assert form is not None
    squares, round_ = form.half**2, form.kind != "box"
    if form.kind == "ball":
        second = np.full(3, squares[0] / 5.0)
    else:
        second = squares / np.array([4.0, 4.0, 3.0] if round_ else [3.0] * 3)
    found = form.axes @ np.diag(mass * (second.sum() - second)) @ form.axes.T
    np.testing.assert_allclose(found, wanted, atol=3e-3 * np.max(np.abs(wanted)))
    assert np.linalg.det(form.axes) == pytest.approx(1.0)


def test_solids_of_the_geometry_words_are_drawn_as_they_are():
    def drawn(solid):
        form = equal_inertia(solid.mass, [*solid.inertia, 0.0, 0.0, 0.0], solid.form)
        return form.kind, np.abs(form.axes) @ form.half

    for solid, kind, half in (
        (mbd.box(2.0, (1.0, 2.0, 3.0)), "box", [0.5, 1.0, 1.5]),
        (mbd.cylinder(3.0, 0.5, 2.0, "x"), "cylinder", [1.0, 0.5, 0.5]),
        (mbd.sphere(1.0, 0.4), "ball", [0.4, 0.4, 0.4]),
        (mbd.box(2.0, (0.2, 0.2, 0.2)), "box", [0.1, 0.1, 0.1]),  # whose inertia a ball has too
        (mbd.box(2.0, (0.2, 0.5, 0.2)), "box", [0.1, 0.25, 0.1]),  # and a cylinder
    ):
        found = drawn(solid)
        assert found[0] == kind
        np.testing.assert_allclose(found[1], half, rtol=1e-12)
    assert drawn(mbd.disk(1.0, 0.3, "y"))[0] == "cylinder"
    assert equal_inertia(0.0, [1.0] * 6) is None and equal_inertia(1.0, [0.0] * 6) is None


def shown(name: str, form: str = "", **contact: Any) -> Any:
    """The scene of a body of three equal moments that touches a plane, at one instant."""
    model, body = one_body(mbd.RigidBody("body", 1.0, (0.004, 0.004, 0.004), form=form), mbd.Free, "float", title=name)
    if contact:
        model.constrain(mbd.Unilateral("touch", contact["of"](body), friction=0.3))
    return scene(instant(model, mbd.assemble(model, {"float.y": 0.3, "float.x": 0.1}, backend="python")), 1)


def test_of_equal_solids_the_one_is_drawn_that_words_of_the_model_tell():
    def ball(body):
        return mbd.sphere_touchdown(body.origin, 0.1)

    def foot(body):
        return mbd.sphere_touchdown(body.point(0.0, -0.2, 0.0), 0.1)

    def edge(body):
        return mbd.disk_touchdown(body.origin, 0.2, axis=(1, 0, 0))

    assert [shown("plain").solids[0].form.kind, shown("worded", "ball").solids[0].form.kind] == ["box", "ball"]
    one = shown("ball", of=ball)  # of the inertia of a ball of radius 0.1 m, which it has by its contact too
    assert [solid.form.kind for solid in one.solids] == ["ball"] and not one.around.balls
    with_foot = shown("foot", of=foot)
    assert [solid.form.kind for solid in with_foot.solids] == ["box"] and len(with_foot.around.balls) == 1
    heavy_below = shown("heavy below", of=lambda body: mbd.sphere_touchdown(body.point(0.0, 0.05, 0.0), 0.12))
    (whole,) = heavy_below.solids  # one ball, where it touches, which turns
    assert not heavy_below.around.balls and whole.form.half == pytest.approx([0.12] * 3)
    assert whole.center[0] == pytest.approx([0.1, 0.35, 0.0])
    in_a_large_one = shown("in a large one", of=lambda body: mbd.sphere_touchdown(body.point(0.0, 0.4, 0.0), 0.6))
    assert [solid.form.kind for solid in in_a_large_one.solids] == ["box"] and len(in_a_large_one.around.balls) == 1
    told = shown("told", "box", of=lambda body: mbd.sphere_touchdown(body.point(0.0, 0.05, 0.0), 0.12))
    assert [solid.form.kind for solid in told.solids] == ["box"]
    rim = shown("rim", "cylinder", of=edge)  # of a radius that its inertia has not: what touches is drawn
    assert not rim.solids and len(rim.around.wheels) == 1
    with pytest.raises(mbd.ModelError, match="form of 'body': no form named 'bal'; did you mean 'ball'"):
        shown("wrong", "bal")


def test_a_solid_lighter_than_air_that_hides_the_mechanism_is_not_drawn():
    def drawn(moments, legs):
        model = mbd.Model("hip")
        hip, leg = mbd.RigidBody("hip", 0.1, moments), mbd.Link("leg", 5.0, 1.0, 0.5, (0.4, 0.01, 0.4))
        model.connect(mbd.Free("float", model.ground.origin, hip.origin))
        if legs:
            model.connect(mbd.Revolute("joint", hip.origin, leg.start))
        return [solid.name for solid in scene(instant(model, mbd.assemble(model, backend="python")), 1).solids]

    assert drawn((0.1, 0.1, 0.1), True) == []  # a box of 2.4 m and 7 g/m³
    assert drawn((1e-4, 1e-4, 1e-4), True) == drawn((0.1, 0.1, 0.1), False) == ["hip"]


def test_the_force_of_a_ball_acts_where_it_touches():
    model, ball = one_body(mbd.RigidBody("ball", **mbd.sphere(0.2, 0.05).body), mbd.Free, "float")
    model.constrain(mbd.Unilateral("touch", mbd.sphere_touchdown(ball.origin, 0.05), friction=0.3))
    start = mbd.assemble(model, {"float.y": 0.05}, {"float.x": 1.0}, closed=["touch"])
    picture = scene(mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=2e-3, until=0.02), 4)
    (push,) = picture.pushes
    np.testing.assert_allclose(push.place[:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(
        push.force, np.tile([-0.3 * 0.2 * 9.81, 0.2 * 9.81, 0.0], (len(push.force), 1)), atol=1e-6
    )
    assert len(picture.grounds) == 1 and not picture.touches


def test_links_that_have_a_moment_about_their_long_axis_are_as_thick_as_it_says():
    person = mbd.human(70.0, 1.75).without("torso", "left leg")
    model = mbd.Model("leg")
    model.connect(*person.joints)
    picture = scene(instant(model, mbd.assemble(model, backend="python")), 1)
    assert picture.limbs["right thigh"] == pytest.approx(np.sqrt(2.0) * 0.149 * person.bodies["right thigh"].length)
    assert set(picture.limbs) == {"right thigh", "right shank"}


@pytest.mark.parametrize(
    ("kind", "volume"), [("box", 8.0), ("cylinder", 2 * np.pi), ("ball", 4 * np.pi / 3), ("capsule", 10 * np.pi / 3),
                         ("cone", 2 * np.pi / 3)]
)  # fmt: skip
def test_facets_enclose_the_solid_and_look_outward(kind, volume):
    form = mesh(kind)
    corners = form.at[form.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normals.sum(axis=0), 0.0, atol=1e-13)
    assert np.all(np.sum(normals * form.normal[form.faces].mean(axis=1), axis=1) > 0.0)
    assert np.sum(corners[:, 0] * normals) / 6.0 == pytest.approx(volume, rel=0.07)
    np.testing.assert_allclose(np.linalg.norm(form.normal, axis=1), 1.0, atol=1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_quaternions_are_the_rotations_and_do_not_jump(seed):
    steps = np.random.default_rng(seed).normal(scale=0.3, size=(60, 3))
    R = [np.eye(3)]
    for step in steps:
        R.append(R[-1] @ camera(step[0], step[1]).T)
    q = quaternions(np.array(R))
    np.testing.assert_allclose(rotations(q), R, atol=1e-12)
    assert np.all(np.sum(q[1:] * q[:-1], axis=1) > 0.0)


def test_points_and_solids_lie_where_the_run_has_them_in_every_view():
    run = pendulum()
    picture = scene(run, 40)
    time = picture.instants.time
    places = {"left upper": np.array([PIN, TIP]) - [0.01, 0.02, 0.03], "right lower": np.array([[0.0, 0.3, 0.0]])}
    names = {"left upper": ["pin", "tip"], "right lower": ["top"]}
    assert picture.spatial and [solid.form.kind for solid in picture.solids] == ["box", "cylinder"]
    true = run.at(time)
    for solid in picture.solids:
        R = rotations(solid.turn) @ solid.form.axes.T
        for place, name in zip(places[solid.name], names[solid.name], strict=True):
            found = solid.center + R @ place
            ground = true[f"{solid.name}.{name}"]
            np.testing.assert_allclose(found, ground @ picture.turn.T, atol=1e-11)
            number = picture.points.index(f"{solid.name}.{name}")
            for yaw, pitch in (FIRST, *VIEWS.values()):
                seen = picture.positions[:, number] @ camera(yaw, pitch).T
                np.testing.assert_allclose(np.linalg.norm(seen, axis=1), np.linalg.norm(ground, axis=1), atol=1e-11)
    g = np.array([run.parameters.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
    np.testing.assert_allclose((camera(*FIRST) @ picture.turn @ g)[0], 0.0, atol=1e-12)


def test_hinges_lie_along_the_axes_of_their_joints():
    run = pendulum()
    picture = scene(run, 10)
    axes = {hinge.name: hinge.axis for hinge in picture.hinges}
    assert list(axes) == ["shoulder.first", "shoulder.second", "elbow.first", "elbow.second"]
    np.testing.assert_allclose(axes["shoulder.first"], np.tile(picture.turn[:, 2], (len(picture.instants.time), 1)))
    np.testing.assert_allclose(np.sum(axes["elbow.first"] * axes["elbow.second"], axis=1), 0.0, atol=1e-12)
    upper = picture.solids[0]
    own = rotations(upper.turn) @ upper.form.axes.T
    np.testing.assert_allclose(axes["elbow.first"], own[:, :, 2], atol=1e-12)
    np.testing.assert_allclose(axes["shoulder.second"], own[:, :, 0], atol=1e-12)


def test_the_page_holds_poses_and_its_own_small_renderer(tmp_path):
    text, data = page(pendulum(), tmp_path)
    count, picture = len(data["time"]), scene(pendulum(), pages.pictures(pendulum()))
    for held, solid in zip(data["solids"], picture.solids, strict=True):
        turn = np.array([unpacked(axis, count) for axis in held["turn"]]).T
        np.testing.assert_allclose(turn, solid.turn, atol=1e-4)
        place = np.array([unpacked(axis, count) for axis in held["at"]]).T
        np.testing.assert_allclose(place, solid.center, atol=held["at"][0]["step"])
    assert [solid["side"] for solid in data["solids"]] == ["left", "right"] and data["views"]["reset"] == list(FIRST)
    assert set(data["meshes"]) == {"box", "capsule", "cylinder"}
    assert 'id="camera"' in text and "webgl" in text and len(text) < 300_000


def test_the_picture_of_a_state_shows_what_the_page_shows(tmp_path):
    """Facets of solids lie within their size of their centers as the camera sees them; markers are where points are."""
    pytest.importorskip("matplotlib")
    view = (0.4, -0.3)
    model, start = hanging()
    axes = start.plot(tmp_path / "start.png", view=view)
    picture = scene(instant(model, start), 1)
    rows = camera(*angles_of(view))
    corners = np.concatenate([path.vertices for path in axes.collections[-1].get_paths()])
    for solid in picture.solids:
        half, center = solid.form.half, (rows @ solid.center[0])[:2]
        turned = rows @ rotations(solid.turn[:1])[0]
        reach = np.sum(np.abs(turned * half), axis=1)[:2]
        wanted = center + reach * np.array([[1.0, 1.0], [-1.0, -1.0]])
        if solid.form.kind == "box":
            assert np.min(np.abs(corners[:, 0] - wanted[0, 0])) < 1e-12 > np.min(np.abs(corners[:, 1] - wanted[1, 1]))
    dots = np.concatenate([line.get_xydata() for line in axes.lines])
    for number in picture.markers:
        place = rows[:2] @ picture.positions[0, number]
        assert np.min(np.linalg.norm(dots - place, axis=1)) < 1e-12


def test_a_planar_page_has_none_of_it(tmp_path):
    model = mbd.Model("planar")
    block = mbd.RigidBody("block", **mbd.box(1.0, (0.2, 0.3, 0.4)).body)
    model.connect(mbd.Revolute("pin", model.ground.origin, block.point(0.0, 0.15)))
    run = instant(model, mbd.assemble(model, position={"pin.angle": 0.4}))
    text, data = page(run, tmp_path)
    assert not run.facts.shapes and not data["spatial"] and not {"solids", "meshes", "views"} & set(data)
    assert not any(word in text for word in ("webgl", 'id="camera"', "#camera", "addShadow", "<!--camera-->"))


def test_a_long_run_leaves_out_pictures_that_others_show_and_says_so(tmp_path, monkeypatch):
    full = 401
    monkeypatch.setattr(pages, "LEAST", 30)
    monkeypatch.setattr(pages, "MAX_FRAME_RATE", 1600.0)
    monkeypatch.setattr(pages, "MAX_CHARACTERS", 100_000)
    text, data = page(pendulum(), tmp_path)
    assert len(text) <= 100_000 and 30 <= len(data["time"]) < full
    assert data["facts"][-1][0] == "pictures" and data["facts"][-1][1].startswith(f"{len(data['time'])} of {full}; ")


@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-3, 1e-2]))
@settings(max_examples=20)
def test_between_the_pictures_that_are_kept_nothing_is_missed_by_more_than_the_tolerance(seed, tolerance):
    rng = np.random.default_rng(seed)
    time = np.sort(np.concatenate([np.linspace(0.0, 1.0, 101), [0.37, 0.37]]))  # an event with both its sides
    moving = np.sin(time[:, None] * rng.uniform(0.0, 20.0, 3)) + np.where(np.arange(103) > 37, 0.5, 0.0)[:, None]
    moving[38:, 0] += 1.0
    found = kept(time, moving, tolerance)
    assert found[0] == 0 and found[-1] == 102 and np.all(np.diff(found) > 0)
    shown = moving.copy()
    for a, b in pairwise(found):
        share = (time[a : b + 1] - time[a]) / (time[b] - time[a] or 1.0)
        shown[a : b + 1] = moving[a] + share[:, None] * (moving[b] - moving[a])
    inside = np.setdiff1d(np.arange(103), found)
    assert np.max(np.abs(shown - moving)[inside], initial=0.0) <= tolerance + 1e-12
    twice = np.flatnonzero(np.diff(time) == 0.0)
    assert set(twice) | set(twice + 1) <= set(found)


@pytest.mark.parametrize("make", [pendulum, stopped, partial(stopped, from_ground=False)])
def test_a_file_keeps_solids_hinges_and_stops(make, tmp_path):
    run = make()
    loaded = mbd.load(run.save(tmp_path / "run"))
    assert loaded.page(tmp_path / "loaded.html").read_bytes() == run.page(tmp_path / "run.html").read_bytes()


def test_a_file_of_chosen_names_has_no_solids(tmp_path):
    run = pendulum()
    few = scene(mbd.load(run.save(tmp_path / "few", names=["shoulder.first"])), 10)
    assert not few.points and not few.spatial


@pytest.mark.slow
def test_the_camera_turns_in_a_browser(tmp_path):
    """Needs playwright and Chromium; drags, keys, buttons and the wheel move the camera, no error is logged."""
    path, small = pendulum().page(tmp_path / "page.html"), {"width": 390, "height": 844}
    with opened(path, "#t=0.2", reduced_motion="reduce", viewport=small) as tab:
        tab.click("#camera [data-move=side]")
        assert tab.inner_text("#seen") == "seen from the side"
        tab.focus("#scene")
        tab.keyboard.press("3")
        assert tab.inner_text("#seen") == "seen from the top"
        tab.keyboard.press("0")
        box = tab.locator("#scene").bounding_box()
        tab.mouse.move(box["x"] + 20, box["y"] + 200)
        tab.mouse.down()
        tab.mouse.move(box["x"] + 120, box["y"] + 200, steps=4)
        tab.mouse.up()
        assert tab.inner_text("#seen") == "turned 11°, raised 24°"
        tab.wait_for_timeout(200)
        pixels = "c.getContext('2d').getImageData(0, 0, c.width, c.height).data"
        ink = f"c => {pixels}.filter((x, i) => i % 4 == 3 && x).length"
        assert tab.eval_on_selector("#scene", ink) > 2000
        assert tab.evaluate("document.documentElement.scrollWidth") <= 390
