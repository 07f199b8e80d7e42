"""Bodies, their frames and what is impossible about them."""

import math
import pickle

import numpy as np
import pytest

import mbd
from mbd.bodies import Ground
from mbd.bodies.algebra import axis_rotation, dot, product, rotate, transpose
from mbd.errors import ModelError
from mbd.tape.node import Tape
from tests.helpers import FreeScope

BODIES = [
    ("point mass", lambda: mbd.PointMass("body", 2.0)),
    ("link", lambda: mbd.Link("body", 2.0, length=0.5, center=0.2, inertia=0.03)),
    ("spatial link", lambda: mbd.Link("body", 2.0, length=0.5, center=0.2, inertia=(0.03, 0.01, 0.03))),
    ("rigid body", lambda: mbd.RigidBody("body", 2.0, (0.3, 0.4, 0.5, 0.01, 0.02, 0.03), center=(0.1, 0.2, 0.3))),
    ("planar body", lambda: mbd.RigidBody("body", 2.0, 0.3)),
]
every_body = pytest.mark.parametrize("factory", [factory for _, factory in BODIES], ids=[name for name, _ in BODIES])


@every_body
def test_parameters_are_declared_before_they_are_used(factory):
    body, scope = factory(), FreeScope()
    body.mass_properties(scope)
    for frame in body.frames.values():
        frame.placement(scope)
    assert scope.recorded == body.parameters()


@every_body
def test_center_of_mass_is_where_its_frame_is(factory):
    body, scope = factory(), FreeScope()
    _, place = body.center.placement(scope)
    np.testing.assert_allclose(scope.value(*place), scope.value(*body.mass_properties(scope).center))
    np.testing.assert_allclose(scope.value(*place), body.center.offset)


@every_body
def test_inertia_matrix_is_symmetric_and_the_body_possible(factory):
    body, scope = factory(), FreeScope()
    matrix = scope.matrix(body.mass_properties(scope).inertia)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert body.faults() == []


@every_body
def test_bodies_are_values(factory):
    body = factory()
    assert pickle.loads(pickle.dumps(body)) == body == factory()
    assert len({body, factory()}) == 1


def test_a_link_hangs_along_minus_y():
    link = mbd.Link("shank", 2.0, length=0.5, center=0.2)
    assert link.start.offset == (0.0, 0.0, 0.0)
    assert link.end.offset == (0.0, -0.5, 0.0)
    assert link.center.offset == (0.0, -0.2, 0.0)
    assert link.end.full_name == "shank.end"


def test_lengths_are_run_time_parameters_and_zeros_fold():
    scope = FreeScope()
    _, place = mbd.Link("shank", 2.0, length=0.5, center=0.2).end.placement(scope)
    x, y, z = (scope.tape.lift(part) for part in place)
    assert x.is_zero
    assert z.is_zero
    assert not y.is_constant


def test_points_have_parameters_of_their_own():
    toe = mbd.Link("foot", 1.0, 0.2, 0.1).point(0.05, -0.2, name="toe")
    assert toe.parameters() == {"foot.toe.x": 0.05, "foot.toe.y": -0.2, "foot.toe.z": 0.0}
    unnamed = Ground().point(1, 0.5)
    assert unnamed.full_name == "ground.point(1, 0.5, 0)"


def test_a_turned_frame_shares_its_place():
    end = mbd.Link("foot", 1.0, 0.2, 0.1).end
    turned = end.turned(math.pi / 2)
    assert turned.rotation == ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert turned.placement(FreeScope())[1] is not None
    assert turned.landmark == "end"
    assert turned.is_planar
    assert not end.turned(0.3, axis=(1, 0, 0)).is_planar
    both = end.turned(0.3, axis=(1, 2, 3)).turned(-0.3, axis=(1, 2, 3))
    np.testing.assert_allclose(both.rotation, np.eye(3), atol=1e-15)


def test_a_wrong_frame_name_offers_the_right_one():
    with pytest.raises(ModelError, match="did you mean 'end'"):
        mbd.Link("foot", 1.0, 0.2, 0.1).frame("emd")
    with pytest.raises(ModelError, match="has a frame 'end' already"):
        mbd.Link("foot", 1.0, 0.2, 0.1).point(0, 0, name="end")


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (mbd.PointMass("hip", -1.0), "mass -1 kg is negative"),
        (mbd.Link("thigh", 1.0, -0.4, 0.2), "length -0.4 m is negative"),
        (mbd.Link("thigh", 1.0, 0.4, 0.2, inertia=-0.1), "negative principal moment"),
        (mbd.RigidBody("pelvis", 1.0, (1.0, 1.0, 3.0)), "triangle inequality"),
        (mbd.RigidBody("pelvis", 1.0, (1.0, 1.0, 1.0, 2.0, 0.0, 0.0)), "negative principal moment"),
        (mbd.RigidBody("pelvis", 0.0, (1.0, 1.0, 1.0)), "inertia without a mass"),
    ],
)
def test_impossible_bodies_are_faults(body, told):
    assert any(told in fault and f"'{body.name}'" in fault for fault in body.faults())


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: mbd.PointMass("hip", math.nan), "must be finite"),
        (lambda: mbd.PointMass(3.0, 1.0), "needs a name"),
        (lambda: mbd.PointMass("hip", "heavy"), "must be a number"),
        (lambda: mbd.Link("thigh", 1.0, 0.4, None), "must be a number"),
        (lambda: mbd.RigidBody("pelvis", 1.0, (1.0, 2.0)), "Ixx, Iyy, Izz"),
        (lambda: mbd.RigidBody("pelvis", 1.0, 1.0, center=(1.0,)), "three components"),
        (lambda: Ground().point(math.inf, 0.0), "must be finite"),
    ],
)
def test_wrong_numbers_are_refused_at_once(make, told):
    with pytest.raises(ModelError, match=told):
        make()


def test_a_planar_inertia_is_exempt_from_the_triangle_inequality():
    assert mbd.RigidBody("wheel", 1.0, (0.0, 0.0, 3.0)).faults() == []
    assert mbd.Link("thigh", 1.0, 0.4, 0.2, inertia=5.0).faults() == []


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.6, 0.0, 0.8)])
@pytest.mark.parametrize("flat", [False, True])
def test_a_rotation_is_traced_as_the_products_with_its_rows(axis, flat):
    """Where it turns about z, terms that are zero are left out, which changes no expression."""
    tape = Tape()
    R = axis_rotation(axis, tape.input("q", 0))
    a = (tape.input("q", 1), tape.input("q", 2), 0.0 if flat else tape.input("q", 3))
    for known in (R, product(R, R), transpose(R)):
        assert [tape.lift(part) for part in rotate(known, a)] == [tape.lift(dot(row, a)) for row in known]
