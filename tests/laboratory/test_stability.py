"""Margin of stability: at rest, of a center of mass that moves, and distances to hulls against scipy's."""

import numpy as np
import pytest

import mbd
from mbd.laboratory.stability import _inside


@pytest.mark.parametrize("seed", range(5))
def test_distances_to_hulls_are_those_of_scipy(seed):
    from scipy.spatial import ConvexHull

    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(3, 12)), 2))
    hull = ConvexHull(points)
    for place in rng.normal(size=(20, 2)) * 1.5:
        depth = -(hull.equations[:, :2] @ place + hull.equations[:, 2])  # to each edge's line, positive inside
        found = _inside(points, place)
        assert (found > 0.0) == bool(depth.min() > 0.0)
        if depth.min() > 0.0:
            assert found == pytest.approx(depth.min(), abs=1e-12)
        else:
            ends = points[hull.simplices]
            edge, way = ends[:, 1] - ends[:, 0], place - ends[:, 0]
            t = np.clip(np.sum(way * edge, axis=1) / np.sum(edge * edge, axis=1), 0.0, 1.0)
            nearest = ends[:, 0] + t[:, None] * (ends[:, 1] - ends[:, 0])
            assert -found == pytest.approx(np.linalg.norm(nearest - place, axis=1).min(), abs=1e-12)
    assert _inside(np.array([[0.0, 0.0]]), np.array([3.0, 4.0])) == -5.0
    assert _inside(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([0.5, 2.0])) == -2.0


def standing():
    """A stiff person of 1 m to the center of mass, who falls about a foot that is 0.2 m long."""
    model = mbd.Model("standing")
    body = mbd.RigidBody("foot", mass=70.0, inertia=8.0, center=(0.0, 1.0, 0.0))
    heel, toe = body.point(-0.05, 0.0, name="heel"), body.point(0.15, 0.0, name="toe")
    model.connect(mbd.Planar("base", model.ground.origin, body.origin))
    model.constrain(*(mbd.Unilateral(f.name, mbd.touchdown(f)) for f in (heel, toe)))
    start = mbd.assemble(model, closed=["heel", "toe"])
    return model, start, (heel, toe)


def test_at_rest_it_is_the_distance_to_the_edges_of_the_foot():
    model, start, (heel, toe) = standing()
    run = mbd.simulate(model, start, dt=2e-3, until=0.02)
    assert mbd.margin_of_stability(run, direction="forward") == pytest.approx(np.full(len(run), 0.15), abs=1e-9)
    assert mbd.margin_of_stability(run, direction="backward") == pytest.approx(np.full(len(run), 0.05), abs=1e-9)
    assert mbd.margin_of_stability(run).max() <= 0.0  # in the plane the support is a line
    wide = {"heel": [heel], "toe": [toe]}
    assert mbd.margin_of_stability(run, wide, "forward")[0] == pytest.approx(0.15)
    record = mbd.PlateRecord.at(
        "plate", run.time, np.tile([0.0, 687.0, 0.0], (len(run), 1)), np.zeros((len(run), 3)), height=0.0
    )
    motion = {"time": run.time} | {f"base.{label}": run[f"base.{label}"] for label in ("x", "y", "angle")}
    moments = mbd.inverse_dynamics(model, motion, plates=[mbd.ForcePlate("plate", heel, record)])
    found = mbd.margin_of_stability(moments, {"foot": [heel, toe]}, "forward")
    assert found == pytest.approx(np.full(len(run), 0.15), abs=1e-9)


def test_a_moving_center_of_mass_counts_ahead():
    model = mbd.Model("gliding")
    body = mbd.PointMass("body", mass=60.0)
    model.connect(mbd.Translation("base", model.ground.origin, body.origin, axes="xyz"))
    run = mbd.simulate(model, mbd.assemble(model, {"base.y": 0.9}, {"base.x": 0.5}), dt=1e-3, until=0.002)
    force = np.tile([0.0, 600.0, 0.0], (len(run), 1))
    record = mbd.PlateRecord.at("plate", run.time, force, np.zeros((len(run), 3)), height=0.0)
    motion = {"time": run.time} | {f"base.{axis}": run[f"base.{axis}"] for axis in "xyz"}
    moments = mbd.inverse_dynamics(model, motion, plates=[mbd.ForcePlate("plate", body.origin, record)])
    ahead = 0.5 * np.sqrt(0.9 / 9.81)
    assert mbd.margin_of_stability(moments, direction="forward")[0] == pytest.approx(-ahead, rel=1e-6)


def test_wrong_arguments_are_named():
    model, start, (heel, _) = standing()
    run = mbd.simulate(model, start, dt=2e-3, until=0.01)
    with pytest.raises(mbd.ModelError, match="'forward', 'backward'"):
        mbd.margin_of_stability(run, direction="up")
    with pytest.raises(mbd.ModelError, match="'hand' does not stand"):
        mbd.margin_of_stability(run, {"hand": [heel]})
    with pytest.raises(mbd.ModelError, match="takes a run"):
        mbd.margin_of_stability(3)
