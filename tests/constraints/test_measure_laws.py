"""Laws of every measure: `mbd.testing.check_measure`, and those of touchdown."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.constraints.disks import DiskTouchdown
from mbd.constraints.measure import Measure
from mbd.constraints.measures import Distance, JointMeasure, Separation
from mbd.constraints.rolling_touchdown import ProfileTouchdown, RollingTouchdown
from mbd.constraints.sphere_touchdown import SphereTouchdown
from mbd.constraints.touchdown import Touchdown
from mbd.constraints.turning_measures import Cone, Twist
from mbd.tape.derivatives import gradient
from mbd.testing import check_measure
from tests.helpers import FreeScope
from tests.instances import MEASURES

every_measure = pytest.mark.parametrize("factory", [make for _, make in MEASURES], ids=[name for name, _ in MEASURES])
POSE = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6)


def scene(factory, pose=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6)) -> tuple[Measure, FreeScope]:
    """A measure of two bodies that float."""
    thigh, shank = mbd.Link("thigh", 1.0, 0.5, 0.2), mbd.RigidBody("shank", 2.0, (1.0, 1.0, 1.0))
    joint = mbd.Revolute("hinge", thigh.end, shank.origin)
    scope = FreeScope([joint])
    scope.move("thigh", pose)
    scope.move("shank", (3.0, 0.2, 0.1, 0.3, -0.2, 0.1))
    return factory(thigh.point(0.0, 0.0, name="a"), shank.point(0.1, -0.2, 0.1, name="b"), joint), scope


@every_measure
def test_every_measure_keeps_the_laws(factory):
    measure, _ = scene(factory)
    verdict = check_measure(factory)
    stands = isinstance(measure, Touchdown | RollingTouchdown | ProfileTouchdown | SphereTouchdown | DiskTouchdown)
    between_bodies = stands and measure.ground.frame is not None
    assert any(law.startswith("frame invariance") for law in verdict.laws) == (
        between_bodies or isinstance(measure, JointMeasure | Distance | Separation | Cone | Twist)
    )


@pytest.mark.parametrize("factory", [make for _, make in MEASURES if isinstance(scene(make)[0], Touchdown)])
@settings(max_examples=8)
@given(pose=POSE)
def test_a_touchdown_has_a_unit_normal_and_tangents_across_it(factory, pose):
    """At contact ∇g and the tangents are an orthonormal frame; the normal is what makes λ the contact force."""
    measure, scope = scene(factory, pose)
    place = scope.coordinates("thigh")[:3]
    scope.numbers[place[1]] -= scope.value(measure.gap(scope))[0]  # near the ground; exact on level ground
    for _ in range(30):
        slope = scope.value(gradient(scope.tape.lift(measure.gap(scope)), place)[1])[0]
        scope.numbers[place[1]] -= scope.value(measure.gap(scope))[0] / slope
    captured = measure.captured(scope)
    anchors = [scope.tape.input("anchor", k) for k in range(len(captured))]
    scope.numbers |= dict(zip(anchors, scope.value(*captured), strict=True))
    rows = [measure.gap(scope), *(value for _, value in measure.tangents(scope, anchors))]
    frame = scope.matrix([gradient(scope.tape.lift(row), place) for row in rows])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame) == pytest.approx(np.linalg.det([[0, 1, 0], [1, 0, 0], [0, 0, 1]]))


@every_measure
def test_unit_and_title_are_known(factory):
    measure, _ = scene(factory)
    assert measure.title
    assert measure.mentions()
