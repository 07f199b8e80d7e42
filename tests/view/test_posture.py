"""Pictures of states: what they show lies where forward kinematics puts it, and they need no display."""

import dataclasses
import gc

import numpy as np
import pytest

import mbd
from mbd.errors import ModelError
from mbd.results.at_state import instant
from mbd.view.camera import FIRST, camera
from mbd.view.scene import scene
from tests.helpers import one_body

pytest.importorskip("matplotlib")


def leg() -> tuple[mbd.Model, mbd.State]:
    model = mbd.Model("leg")
    thigh = mbd.Link("thigh", mass=7.0, length=0.5, center=0.2, inertia=0.1)
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.05)
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start), mbd.Revolute("knee", thigh.end, shank.start))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(shank.end, ground=mbd.Plane(offset=-1.0))))
    mbd.Marker("heel", shank, (-0.05, -0.4))
    return model, mbd.assemble(model, position={"hip.angle": 0.3, "knee.angle": -0.5})


def test_a_picture_shows_the_bodies_where_they_are(tmp_path):
    model, start = leg()
    axes = start.plot(tmp_path / "start.svg")
    drawn = np.concatenate([line.get_xydata() for line in axes.lines])
    knee = 0.5 * np.array([np.sin(0.3), -np.cos(0.3)])
    foot = knee + 0.4 * np.array([np.sin(-0.2), -np.cos(-0.2)])
    for place in np.zeros(2), knee, foot:
        assert np.min(np.abs(drawn - place).max(axis=1)) < 1e-12
    assert [text.get_text() for text in axes.texts] == ["heel"] and "leg, t = 0 s" in axes.get_title(loc="left")
    assert (tmp_path / "start.svg").stat().st_size > 1000
    del model


def test_the_picture_is_that_of_the_first_row_of_the_page():
    model, start = leg()
    run = mbd.simulate(model, start, dt=1e-2, until=0.02, backend="python")
    page, picture = scene(run, 2), scene(instant(model, start), 1)
    assert picture.points == page.points and picture.segments == page.segments
    np.testing.assert_array_equal(picture.positions[0], page.positions[0])
    np.testing.assert_allclose(scene(instant(model, run.final), 1).positions[0], page.positions[-1], atol=1e-12)
    assert run.final.plot().get_title(loc="left") == "leg, t = 0.02 s"


def test_closed_contacts_and_parameters_of_the_state_count(tmp_path):
    model, _ = leg()
    longer = mbd.assemble(model, closed=["foot"], position={"hip.angle": 0.3}, parameters={"shank.length": 0.6})
    axes = longer.plot(tmp_path / "start.png")
    assert "closed: foot" in axes.get_title(loc="left")
    lowest = min(float(line.get_ydata().min()) for line in axes.lines)
    np.testing.assert_allclose(lowest, -1.0, atol=1e-9)


def test_a_spatial_mechanism_is_seen_from_the_side(tmp_path):
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=(0.1, 0.01, 0.1))
    model.connect(mbd.Universal("joint", model.ground.origin, rod.start, second_axis="x"))
    start = mbd.assemble(model, position={"joint.first": 0.3, "joint.second": 0.4})
    axes = start.plot(tmp_path / "start.png")
    assert axes.get_aspect() == 1.0
    solids = axes.collections[-1]
    corners = np.concatenate([path.vertices for path in solids.get_paths()])
    end = scene(instant(model, start), 1).positions[0, 1] @ camera(*FIRST)[:2].T
    apart = np.linalg.norm(corners - end, axis=1)
    assert np.min(apart) < 0.03 and np.max(np.linalg.norm(corners, axis=1)) < 1.04, "the rod, as thick as it is drawn"


@pytest.mark.parametrize("view", ["back", 3.0, (0.1,), (0.1, float("nan")), ("front", 0.0), {"yaw": 1.0}])
def test_a_view_that_is_none_is_refused(view):
    model, start = leg()
    with pytest.raises(ModelError, match="view"):
        start.plot(model=model, view=view)


@pytest.mark.usefixtures("older_objects_left_alone")
def test_a_state_without_its_model_asks_for_it(tmp_path):
    model, start = leg()
    moved = dataclasses.replace(start, q=start.q + 0.1)
    with pytest.raises(ModelError, match=r"give it, as in state.plot\(model=model\)"):
        moved.plot(tmp_path / "moved.png")
    assert moved.plot(tmp_path / "moved.png", model=model) is not None
    other, strange = leg()[0], mbd.State(0.0, np.zeros(3), np.zeros(2))
    with pytest.raises(ModelError, match="this state is none of 'leg': q has 3 numbers, 2 are expected"):
        strange.plot(tmp_path / "strange.png", model=other)
    del model, other
    gc.collect()
    with pytest.raises(ModelError, match="does not know its model any more"):
        start.plot(tmp_path / "start.png")


def test_what_has_no_bodies_cannot_be_drawn():
    ball = mbd.Lagrangian("ball", [mbd.Coordinate("y", unit="m")], lambda y_rate: 0.5 * y_rate * y_rate)
    with pytest.raises(ModelError, match="'ball' has no bodies to draw"):
        mbd.assemble(ball).plot()


def test_a_wheel_its_road_and_a_blade_are_drawn():
    model, wheel = one_body(mbd.RigidBody("wheel", mass=1.0, inertia=0.01), mbd.Planar, "free")
    model.constrain(
        mbd.Unilateral("road", mbd.touchdown(wheel.origin, lambda x: 0.1 * x * x), friction=0.0),
        mbd.Rolling("tyre", wheel.origin, 0.2), mbd.KnifeEdge("edge", wheel.point(0.3, 0.0)),
    )  # fmt: skip
    axes = mbd.assemble(model, position={"free.y": 0.4, "free.angle": 0.5}).plot()
    road, rim, spoke, blade = (np.array(line.get_data()) for line in (axes.lines[k] for k in (1, 2, 3, 4)))
    np.testing.assert_allclose(road[1], 0.1 * road[0] ** 2, atol=1e-9)
    np.testing.assert_allclose(np.hypot(rim[0], rim[1] - 0.4), 0.2, atol=1e-9)
    np.testing.assert_allclose(spoke[:, 1] - spoke[:, 0], 0.2 * np.array([np.cos(0.5), np.sin(0.5)]), atol=1e-9)
    np.testing.assert_allclose(blade.mean(axis=1), [0.3 * np.cos(0.5), 0.4 + 0.3 * np.sin(0.5)], atol=1e-9)


def test_the_picture_of_a_state_shows_the_forces_of_contacts_that_are_closed(tmp_path):
    model, block = one_body(mbd.RigidBody("block", 2.0, (0.1, 0.1, 0.1)), mbd.Planar, "slide")
    corners = [block.point(x, -0.1, 0.0, name=f"corner {k}") for k, x in enumerate((-0.2, 0.2))]
    model.constrain(*(mbd.Unilateral(f"foot {k}", mbd.touchdown(each)) for k, each in enumerate(corners)))
    feet = ["foot 0", "foot 1"]
    standing = mbd.assemble(model, {"slide.y": 0.1}, closed=feet, backend="python")
    axes = standing.plot(tmp_path / "standing.png")
    arrows = [text for text in axes.texts if text.arrow_patch is not None]
    assert len(arrows) == 2
    for arrow, x in zip(arrows, (-0.2, 0.2), strict=True):
        assert arrow.xyann == pytest.approx((x, 0.0), abs=1e-12)
        assert arrow.xy[0] == pytest.approx(x, abs=1e-9)
        assert arrow.xy[1] > 0.0
    assert "9.81 N" in [text.get_text() for text in axes.texts]
    raised = mbd.assemble(model, {"slide.y": 0.4}, open=feet, backend="python")
    assert not any(text.arrow_patch is not None for text in raised.plot(tmp_path / "raised.png").texts)
