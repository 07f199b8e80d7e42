"""Laws of every joint: `mbd.testing.check_joint`, and what holds for the joints of the library only."""

import pytest

import mbd
from mbd.bodies import Ground
from mbd.joints.base import Joint, row_unit
from mbd.tape.node import Node
from mbd.testing import check_joint
from tests.helpers import FreeScope
from tests.instances import JOINTS

SOMEWHERE = (0.1, 0.2, 0.3, 0.5, 0.5, -0.5, 0.5)

every_joint = pytest.mark.parametrize("factory", [factory for _, factory in JOINTS], ids=[name for name, _ in JOINTS])


def made(factory) -> Joint:
    return factory(Ground().origin, mbd.Link("rod", 1.0, 0.5, 0.2).start)


@every_joint
def test_every_joint_keeps_the_laws(factory):
    verdict = check_joint(factory)
    assert len(verdict.laws) >= 20
    assert not verdict.notes


@pytest.mark.parametrize("factory", [factory for _, factory in JOINTS if made(factory).is_planar])
def test_rows_of_a_planar_joint_fold_to_those_of_the_plane(factory):
    joint = made(factory)
    scope = FreeScope()
    angle, x, y = (scope.tape.input("q", k) for k in range(3))
    R, _ = mbd.Revolute("turn", joint.parent, joint.child).transform([angle], scope)
    left = [value for _, value in joint.rows(R, (x, y, 0.0), scope) if isinstance(value, Node) and not value.is_zero]
    assert len(left) == 3 - len(joint.labels)


@every_joint
def test_labels_name_coordinates_and_rows_have_units(factory):
    joint = made(factory)
    assert joint.coordinate_names == tuple(f"joint.{label.name}" for label in joint.labels)
    assert {label.unit for label in joint.freedoms} <= {"rad", "m"}
    scope = FreeScope()
    R, p = joint.transform(SOMEWHERE[: len(joint.labels)], scope)
    labels = [label for label, _ in joint.rows(R, p, scope)]
    assert len(set(labels)) == len(labels)
    turns = sum(label.unit == "rad" for label in joint.freedoms) + sum(row_unit(label) == "rad" for label in labels)
    assert turns in (2, 3, 4)
    assert turns == 3 or isinstance(joint, mbd.Screw)
