"""Named points: always among the results and on the page, wherever they are used, and free for the motion."""

import pickle
import random

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.equations import derive
from mbd.errors import ModelError
from mbd.tape.derivatives import live
from mbd.testing.mechanisms import random_body, random_frame, random_joint
from mbd.view.page import content
from mbd.view.scene import scene
from tests.forward_kinematics import poses


def leg() -> tuple[mbd.Model, mbd.Link]:
    model = mbd.Model("leg")
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.05)
    model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    return model, shank


def run_of(model: mbd.Model, until: float = 0.05) -> mbd.Trajectory:
    start = mbd.assemble(model, position={"knee.angle": 0.7})
    return mbd.simulate(model, start, dt=1e-2, until=until, backend="python")


@settings(max_examples=6)
@given(seed=st.integers(0, 10_000))
def test_markers_move_as_forward_kinematics_says(seed):
    rng, spatial = random.Random(seed), seed % 2 == 0
    model, bodies, places = mbd.Model("tree"), [], {}
    for k in range(3):
        body = random_body(rng, f"body {k}", spatial)
        onto = rng.choice([model.ground, *bodies])
        frames = (random_frame(rng, each, spatial, 0.5) for each in (onto, body))
        model.connect(random_joint(rng, f"joint {k}", *frames, spatial))
        bodies.append(body)
        for name in f"marker {k}", f"body {k}.mark":
            places[name] = body, [rng.uniform(-1.0, 1.0) for _ in range(3)]
        mbd.Marker(f"marker {k}", *places[f"marker {k}"])
        body.point(*places[f"body {k}.mark"][1], name="mark")
    names = [name for joint in model.joints for name in joint.coordinate_names]
    values = [{name: rng.uniform(-1.0, 1.0) for name in names} for _ in range(2)]
    start = mbd.assemble(model, position=values[0], velocity={f"{name}.rate": v for name, v in values[1].items()})
    run = mbd.simulate(model, start, dt=1e-3, until=1e-3, backend="python")

    def along(s):
        """Where the markers are on the path q + s v + s² a/2."""
        rate, change = ({name: run[f"{name}.{end}"][0] for name in names} for end in ("rate", "acceleration"))
        now = poses(model, model.joints, lambda name: run[name][0] + s * rate[name] + s * s / 2.0 * change[name])
        return np.array([now[body.name][1] + now[body.name][0] @ place for body, place in places.values()])

    h = 1e-4
    before, now, after = along(-h), along(0.0), along(h)
    velocities = [[run[f"{name}.v{axis}"][0] for axis in "xyz"] for name in places]
    accelerations = [[run[f"{name}.a{axis}"][0] for axis in "xyz"] for name in places]
    size = 1.0 + np.max(np.abs(accelerations))
    np.testing.assert_allclose([run[name][0] for name in places], now, atol=1e-12)
    np.testing.assert_allclose(velocities, (after - before) / (2.0 * h), atol=1e-6 * size)
    np.testing.assert_allclose(accelerations, (after - 2.0 * now + before) / h**2, atol=1e-5 * size)


def test_a_point_that_nothing_uses_changes_no_equation_and_no_bit_of_the_motion():
    model, shank = leg()
    without, plain = derive(model), run_of(model)
    shank.point(0.1, -0.4, name="toe")
    mbd.Marker("heel", shank, (-0.05, -0.4))
    beside, run = derive(model), run_of(model)
    assert [len(live(each.balance)) for each in (without, beside)] == [len(live(without.balance))] * 2
    assert run["knee.angle"].tobytes() == plain["knee.angle"].tobytes()
    assert "heel.x" not in plain and run["heel"].shape == (len(run), 3)
    assert {"shank.toe.x", "shank.toe.vy", "heel.ax"} <= set(run.names)


def test_a_marker_is_a_frame_as_any_other():
    model, shank = leg()
    heel = mbd.Marker("heel", shank, (0.0, -0.4))
    mbd.Marker("end", shank.end)
    floor = mbd.Plane(offset=-1.0)
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(heel, ground=floor)), mbd.Event("down", mbd.measure("end.vy")))
    model.apply(mbd.Spring("band", model.ground.point(1.0, 0.0, name="post"), heel.turned(0.3), stiffness=2.0))
    assert model.check() == []
    run = run_of(model)
    np.testing.assert_array_equal(run["heel"], run["shank.end"])
    np.testing.assert_array_equal(run["end.vy"], run["shank.end.vy"])
    assert run.facts.contacts[0].place == "heel"


def test_names_values_and_files_of_markers(tmp_path):
    model, shank = leg()
    mbd.Marker("heel", shank, (-0.05, -0.4, 0.01))
    start = mbd.assemble(model)
    run = mbd.simulate(model, start, dt=1e-2, until=0.02, backend="python", parameters={"heel.x": 0.3})
    assert run["heel.x"][0] == 0.3 and run["heel.z"][0] == 0.01
    again = mbd.load(run.save(tmp_path / "leg"))
    np.testing.assert_array_equal(again.at(0.013)["heel"], run.at(0.013)["heel"])
    np.testing.assert_array_equal(again["heel.ay"], run["heel.ay"])
    assert again.facts.markers == run.facts.markers == ("heel",)
    assert list(pickle.loads(pickle.dumps(model)).frames) == list(model.frames)


def test_the_page_shows_named_points():
    model, shank = leg()
    shank.point(0.1, -0.4, name="toe")
    mbd.Marker("post", model.ground, (0.5, 0.1))
    run = run_of(model)
    page = content(run, scene(run, 10))
    assert [page["points"][k]["name"] for k in page["markers"]] == ["post", "shank.toe"]


def test_the_last_point_of_a_name_counts_and_the_one_in_use_before_it():
    model, shank = leg()
    shank.point(0.1, -0.4, name="toe")
    used = shank.point(0.2, -0.4, name="toe")
    assert model.frames["shank.toe"].offset == (0.2, -0.4, 0.0)
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(used)))
    shank.point(0.3, -0.4, name="toe")
    assert model.frames["shank.toe"].offset == (0.2, -0.4, 0.0) and model.check() == []


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda shank: mbd.Marker("", shank, (0, 0)), "needs a name"),
        (lambda shank: mbd.Marker("a.b", shank, (0, 0)), "holds no dot"),
        (lambda shank: mbd.Marker("heel", "shank", (0, 0)), "lies on a body or at a frame"),
        (lambda shank: mbd.Marker("heel", shank), "give its place on 'shank'"),
        (lambda shank: mbd.Marker("heel", shank.end, (0, 0)), "not to a frame"),
        (lambda shank: mbd.Marker("heel", shank, (0, float("nan"))), "finite"),
        (lambda shank: mbd.Marker("heel", shank, 0.3), "place of Marker 'heel'"),
    ],
)  # fmt: skip
def test_a_wrong_marker_is_refused(make, words):
    with pytest.raises(ModelError, match=words):
        make(leg()[1])


def test_markers_that_share_a_name_are_faults():
    model, shank = leg()
    mbd.Marker("knee", shank, (0.0, 0.0))
    mbd.Marker("post", shank, (0.0, 0.0))
    mbd.Marker("post", model.ground, (0.0, 0.0))
    faults = "\n".join(model.check())
    assert "the marker 'knee' has the name of something else" in faults
    assert "two markers are named 'post', on 'ground' and 'shank'" in faults or "on 'shank' and 'ground'" in faults


def test_a_named_point_is_found_by_its_name_on_the_body():
    """As its own frames are; the error lists both."""
    foot = mbd.RigidBody("foot", 1.0, (0.01, 0.01, 0.01))
    toe = foot.point(0.1, -0.05, 0.0, name="toe")
    assert foot.frame("toe") == toe
    assert mbd.human(70.0, 1.7).bodies["left foot"].frame("outer ball").offset[1] < 0.0
    with pytest.raises(ModelError, match="did you mean 'toe'"):
        foot.frame("tow")
