"""Disks that lean: where their edge touches a plane, and that it does not slip."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

import mbd
from mbd.errors import ModelError
from tests.cases.spatial import coin
from tests.comparisons import at_least, compared
from tests.problems import case

D4 = case("d4-rolling-disk")
AXIS = (0.3, -0.8, 0.5)


def disk(ground=None, axis=AXIS, radius=0.4):
    """A disk that floats, its edge held on a plane without slip."""
    model = mbd.Model("disk", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("disk", 1.0, (0.3, 0.4, 0.5, 0.02, 0.01, 0.03))
    center = body.point(0.0, 0.0, 0.0, name="hub")
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    edge = mbd.disk_touchdown(center, radius, axis, ground)
    tyre = mbd.Rolling("tyre", center, radius, mbd.Plane() if ground is None else ground, axis=axis)
    model.constrain(mbd.Bilateral("edge", edge), tyre)
    return model


MODEL = disk(mbd.Plane((0.2, 1.0, 0.4), 0.1))
TURNS = st.tuples(*[st.floats(-3.0, 3.0)] * 3)


@at_least(10)
@given(TURNS)
@settings(max_examples=15, deadline=None)
def test_the_lowest_point_of_the_edge_lies_on_the_plane_and_does_not_slip(vector):
    """Against all points of the edge, one by one."""
    R = Rotation.from_rotvec(vector)
    a, n = R.apply(np.array(AXIS) / np.linalg.norm(AXIS)), np.array([0.2, 1.0, 0.4]) / np.linalg.norm([0.2, 1.0, 0.4])
    if np.linalg.norm(np.cross(a, n)) < 0.05:
        return
    compared()
    start = mbd.assemble(
        MODEL, {"float.orientation": R, "float.x": 0.3, "float.z": 0.0},
        {"float.angular_velocity": (0.4, 1.0, -2.0)},
    )  # fmt: skip
    R = Rotation.from_quat(start["float.orientation"][[1, 2, 3, 0]])
    a, omega = R.apply(np.array(AXIS) / np.linalg.norm(AXIS)), R.apply(start["float.angular_velocity"])
    center = np.array([start[f"float.{axis}"] for axis in "xyz"])
    b = np.cross(a, n) / np.linalg.norm(np.cross(a, n))
    turn = np.linspace(0.0, 2.0 * np.pi, 100_001)[:, None]
    edge = center + 0.4 * (np.cos(turn) * b + np.sin(turn) * np.cross(a, b))
    heights = edge @ n - 0.1
    assert heights.min() == pytest.approx(0.0, abs=1e-8)
    speed = np.array([start[f"float.{axis}.rate"] for axis in "xyz"])
    slip = speed + np.cross(omega, edge[np.argmin(heights)] - center)
    assert slip == pytest.approx(np.zeros(3), abs=1e-3)


def rolling_coin():
    """Case d4 in the words of a disk."""
    d4 = D4.definition
    model = mbd.Model("coin", gravity=(0.0, 0.0, -9.81))
    m, R = d4["m"], d4["R"]
    body = mbd.RigidBody("disk", m, (m * R**2 / 4, m * R**2 / 2, m * R**2 / 4))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    floor, axis = mbd.Plane((0, 0, 1)), (0, 1, 0)
    model.constrain(mbd.Bilateral("edge", mbd.disk_touchdown(body.origin, R, axis, floor)))
    model.constrain(mbd.Rolling("tyre", body.origin, R, floor, axis=axis))
    return model


def d4_start(model):
    vectors = D4.definition["initial_vectors"]
    place = dict(zip(("float.x", "float.y", "float.z"), vectors["centre"], strict=True))
    lean = {"float.orientation": ((1, 0, 0), D4.start["lean_from_vertical"])}
    return mbd.assemble(model, place | lean, {"float.angular_velocity.ground": vectors["omega"]})


def test_a_coin_rolls_as_published_and_as_by_rows_of_ones_own():
    model = rolling_coin()
    run = mbd.simulate(model, d4_start(model), mbd.RungeKutta853(), tol=1e-12, until=4.0)
    wanted = D4["centre of disk"]
    found = np.stack([run.at(wanted.t)[f"float.{axis}"] for axis in "xyz"], axis=-1)
    assert found == pytest.approx(np.array(wanted.value), abs=1e-8)
    other = mbd.simulate(coin(), d4_start(coin()), mbd.RungeKutta853(), tol=1e-12, until=0.5)
    assert run.at(0.5)["float.x"] == pytest.approx(other.at(0.5)["float.x"], abs=1e-9)
    assert np.ptp(run.energy.total) < 1e-9 * run.energy.total[0]


def test_a_disk_on_a_belt_rolls_as_on_a_floor_that_the_observer_moves_along():
    floor, belt = disk(), disk(mbd.Plane(velocity=(0.7, 0.0, -0.4)))
    lean = {"float.orientation": ((1, 0, 0), 0.4), "float.x": 0.0, "float.z": 0.0}
    spin = {"float.angular_velocity": (0.5, -1.0, 3.0)}
    still = mbd.simulate(floor, mbd.assemble(floor, lean, spin), mbd.RungeKutta853(), tol=1e-11, until=0.5)
    moved = mbd.simulate(belt, mbd.assemble(belt, lean, spin), mbd.RungeKutta853(), tol=1e-11, until=0.5)
    assert moved.final["float.x"] - still.final["float.x"] == pytest.approx(0.7 * 0.5, abs=1e-9)
    assert moved.final["float.z"] - still.final["float.z"] == pytest.approx(-0.4 * 0.5, abs=1e-9)
    assert moved.final["float.orientation"] == pytest.approx(still.final["float.orientation"], abs=1e-9)


def test_disks_that_make_no_sense_are_named():
    body = mbd.RigidBody("disk", 1.0, (1.0, 1.0, 2.0))
    for make, said in (
        (lambda: mbd.disk_touchdown(body.origin, -1.0, AXIS), "must be positive"),
        (lambda: mbd.disk_touchdown(body.origin, 1.0, (0, 0, 0)), "axis of disk_touchdown"),
        (lambda: mbd.disk_touchdown(body.origin, 1.0, AXIS, "table"), "the ground is a mbd.Plane"),
        (lambda: mbd.disk_touchdown("hub", 1.0, AXIS), "its center"),
        (lambda: mbd.Rolling("tyre", body.origin, 1.0, axis=(0, 0, 0)), "axis of Rolling 'tyre'"),
    ):
        with pytest.raises(ModelError, match=said):
            make()
    on_ground = mbd.disk_touchdown(mbd.Model("m").ground.origin, 1.0, AXIS)
    assert "is on the ground" in on_ground.faults("edge")[0]
    own = mbd.disk_touchdown(body.origin, 1.0, AXIS, mbd.Plane(frame=body.point(1.0, 0.0)))
    assert "never move apart" in own.faults("edge")[0]
