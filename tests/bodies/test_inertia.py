"""Solids against their integrals, human segments against their sum."""

import numpy as np
import pytest

import mbd
from mbd.bodies.inertia import SEGMENTS
from mbd.errors import ModelError


def moments(points: np.ndarray) -> np.ndarray:
    """Principal moments about the axes of a unit mass spread evenly over points."""
    squares = (points**2).mean(axis=0)
    return squares.sum() - squares


def grid(n: int = 60) -> np.ndarray:
    """Midpoints of cells of the cube [-1, 1]³."""
    line = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    return np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)


CUBE = grid()
SOLIDS = [
    ("box", mbd.box(1.0, (2.0, 4.0, 6.0)), CUBE * (1.0, 2.0, 3.0)),
    ("sphere", mbd.sphere(1.0, 1.0), CUBE[(CUBE**2).sum(axis=1) < 1.0]),
    ("cylinder", mbd.cylinder(1.0, 1.0, 4.0), (CUBE * (1.0, 1.0, 2.0))[(CUBE[:, :2] ** 2).sum(axis=1) < 1.0]),
    ("cylinder x", mbd.cylinder(1.0, 1.0, 4.0, "x"), (CUBE * (2.0, 1.0, 1.0))[(CUBE[:, 1:] ** 2).sum(axis=1) < 1.0]),
    ("disk", mbd.disk(1.0, 1.0), (CUBE * (1.0, 1.0, 0.0))[(CUBE[:, :2] ** 2).sum(axis=1) < 1.0]),
    ("rod", mbd.rod(1.0, 2.0), CUBE * (0.0, 1.0, 0.0)),
]


@pytest.mark.parametrize(("solid", "points"), [case[1:] for case in SOLIDS], ids=[case[0] for case in SOLIDS])
def test_moments_are_the_integrals_over_the_solid(solid, points):
    np.testing.assert_allclose(solid.inertia, moments(points), rtol=5e-3, atol=1e-12)


@pytest.mark.parametrize("solid", [case[1] for case in SOLIDS], ids=[case[0] for case in SOLIDS])
def test_solids_make_possible_bodies(solid):
    assert mbd.RigidBody("solid", **solid.body).faults() == []


def test_a_rod_makes_a_link_whose_center_is_halfway():
    link = mbd.Link("rod", length=2.0, **mbd.rod(3.0, 2.0).link)
    assert link.center.offset == (0.0, -1.0, 0.0)
    assert link.inertia == (1.0, 0.0, 1.0)
    assert link.faults() == []


def test_the_segments_of_a_person_weigh_what_the_person_weighs():
    limbs = ("thigh", "shank", "foot")
    assert SEGMENTS["HAT"][0] + 2 * sum(SEGMENTS[name][0] for name in limbs) == pytest.approx(1.0, abs=1e-9)
    assert SEGMENTS["leg"][0] == pytest.approx(sum(SEGMENTS[name][0] for name in limbs))


def test_a_thigh_by_winter():
    thigh = mbd.segment("thigh", body_mass=80.0, length=0.4)
    assert thigh.mass == pytest.approx(8.0)
    assert thigh.center[1] == pytest.approx(-0.433 * 0.4)
    assert thigh.inertia[2] == pytest.approx(8.0 * (0.323 * 0.4) ** 2)


def test_unknown_segments_and_axes_are_told():
    with pytest.raises(ModelError, match="did you mean 'thigh'"):
        mbd.segment("thihg", 80.0, 0.4)
    with pytest.raises(ModelError, match="'x', 'y' or 'z'"):
        mbd.cylinder(1.0, 1.0, 1.0, axis="w")
