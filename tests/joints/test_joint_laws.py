"""Laws of every joint: the two uses of its definition describe the same mechanics."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import mbd
from mbd.bodies import Ground
from mbd.joints import Reversed
from mbd.joints.base import Joint, row_unit
from mbd.tape.derivatives import jvp
from mbd.tape.node import Node
from tests.helpers import FreeScope, skew
from tests.instances import JOINTS

ANGLES = st.lists(st.floats(-1.4, 1.4), min_size=3, max_size=3)
EYE = np.eye(3)


def made(factory, reverse: bool) -> Joint:
    joint = factory(Ground().origin, mbd.Link("rod", 1.0, 0.5, 0.2).start)
    return Reversed(joint) if reverse else joint


def moved(joint: Joint, values: list[float]):
    """Scope, coordinates and placement of a joint at a posture."""
    scope = FreeScope()
    q = [scope.tape.input("q", k) for k in range(len(joint.labels))]
    scope.numbers |= dict(zip(q, values, strict=False))
    R, p = joint.transform(q, scope)
    return scope, q, R, p


every_joint = pytest.mark.parametrize("factory", [factory for _, factory in JOINTS], ids=[name for name, _ in JOINTS])
both_ways = pytest.mark.parametrize("reverse", [False, True], ids=["forward", "reversed"])


@every_joint
@both_ways
@given(values=ANGLES)
def test_placement_is_a_rotation_and_a_place(factory, reverse, values):
    scope, _, R, _ = moved(made(factory, reverse), values)
    matrix = scope.matrix(R)
    np.testing.assert_allclose(matrix @ matrix.T, EYE, atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


@every_joint
@both_ways
@given(values=ANGLES)
def test_subspace_is_the_velocity_of_the_transform(factory, reverse, values):
    joint = made(factory, reverse)
    scope, q, R, p = moved(joint, values)
    rotation = scope.matrix(R)
    for coordinate, (angular, linear) in zip(q, joint.subspace(q, scope), strict=True):
        flat = jvp([scope.tape.lift(x) for row in (*R, p) for x in row], {coordinate: 1.0})
        slopes = np.array(scope.value(*flat)).reshape(4, 3)
        np.testing.assert_allclose(rotation.T @ slopes[:3], scope.matrix(skew(angular)), atol=1e-13)
        np.testing.assert_allclose(rotation.T @ slopes[3], scope.value(*linear), atol=1e-13)


@every_joint
@both_ways
@given(values=ANGLES)
def test_rows_vanish_on_the_joints_own_motion(factory, reverse, values):
    joint = made(factory, reverse)
    scope, _, R, p = moved(joint, values)
    residuals = scope.value(*(value for _, value in joint.rows(R, p, scope)))
    np.testing.assert_allclose(residuals, 0.0, atol=1e-13)


@every_joint
@both_ways
@given(values=ANGLES)
def test_coordinates_are_recovered_from_the_placement(factory, reverse, values):
    joint = made(factory, reverse)
    scope, q, R, p = moved(joint, values)
    np.testing.assert_allclose(scope.value(*joint.recover(R, p, scope)), scope.value(*q), atol=1e-13)


@every_joint
@both_ways
@given(values=ANGLES)
def test_rows_and_coordinates_share_the_six_freedoms(factory, reverse, values):
    """The Jacobian of the rows against a twist in child axes has full rank and vanishes along the subspace."""
    joint = made(factory, reverse)
    scope, q, R, p = moved(joint, values)
    placed = [scope.tape.input("placed", k) for k in range(12)]
    rows = joint.rows((tuple(placed[0:3]), tuple(placed[3:6]), tuple(placed[6:9])), tuple(placed[9:12]), scope)
    numbers = np.array(scope.value(*(x for row in (*R, p) for x in row)))
    rotation = numbers[:9].reshape(3, 3)
    scope.numbers |= dict(zip(placed, numbers, strict=True))
    columns = []
    for k in range(6):
        change = np.zeros(12)
        if k < 3:
            change[:9] = (rotation @ np.array(skew(EYE[k]), dtype=float)).ravel()
        else:
            change[9:] = rotation[:, k - 3]
        seeds = dict(zip(placed, map(float, change), strict=True))
        columns.append(scope.value(*jvp([scope.tape.lift(value) for _, value in rows], seeds)))
    jacobian = np.array(columns).T.reshape(len(rows), 6)
    assert len(rows) + len(joint.labels) == 6
    if rows:
        assert np.linalg.svd(jacobian, compute_uv=False).min() > 0.05
    for angular, linear in joint.subspace(q, scope):
        twist = scope.value(*angular, *linear)
        np.testing.assert_allclose(jacobian @ twist, 0.0, atol=1e-12)


@every_joint
def test_planar_joints_leave_the_z_direction_exactly_alone(factory):
    joint = made(factory, reverse=False)
    scope, _, R, p = moved(joint, [0.1, 0.2, 0.3])
    z = [scope.tape.lift(x) for x in (R[0][2], R[1][2], R[2][0], R[2][1], p[2])]
    turned = [all(node.is_zero for node in z), scope.tape.lift(R[2][2]).is_constant]
    assert all(turned) == joint.is_planar


@every_joint
def test_rows_of_a_planar_joint_fold_to_those_of_the_plane(factory):
    joint = made(factory, reverse=False)
    if not joint.is_planar:
        return
    scope = FreeScope()
    angle, x, y = (scope.tape.input("q", k) for k in range(3))
    R, _ = mbd.Revolute("turn", joint.parent, joint.child).transform([angle], scope)
    left = [value for _, value in joint.rows(R, (x, y, 0.0), scope) if isinstance(value, Node) and not value.is_zero]
    assert len(left) == 3 - len(joint.labels)


@every_joint
@both_ways
def test_parameters_are_declared_before_they_are_used(factory, reverse):
    joint = made(factory, reverse)
    scope, q, R, p = moved(joint, [0.1, 0.2, 0.3])
    joint.rows(R, p, scope)
    joint.subspace(q, scope)
    joint.elastic_energy(q, scope)
    joint.resistance(q, scope)
    assert scope.recorded == joint.parameters()


@every_joint
def test_labels_name_coordinates_and_rows_have_units(factory):
    joint = made(factory, reverse=False)
    assert joint.coordinate_names == tuple(f"joint.{label.name}" for label in joint.labels)
    assert {label.unit for label in joint.labels} <= {"rad", "m"}
    scope, _, R, p = moved(joint, [0.1, 0.2, 0.3])
    labels = [label for label, _ in joint.rows(R, p, scope)]
    assert len(set(labels)) == len(labels)
    turns = sum(label.unit == "rad" for label in joint.labels) + sum(row_unit(label) == "rad" for label in labels)
    assert turns in (2, 3, 4)
    assert turns == 3 or isinstance(joint, mbd.Screw)
