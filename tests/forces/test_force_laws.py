"""Laws of every force."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import mbd
from mbd.forces.base import Force
from mbd.tape.derivatives import gradient, jvp
from tests.helpers import FreeScope
from tests.instances import FORCES

every_force = pytest.mark.parametrize("factory", [factory for _, factory in FORCES], ids=[name for name, _ in FORCES])
POSE = st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6)


def scene(factory, pose=(0.0,) * 6, speed=(0.0,) * 6) -> tuple[Force, FreeScope]:
    """A force between two bodies that float, the first at rest and the second away from it."""
    thigh, shank = mbd.Link("thigh", 1.0, 0.5, 0.2), mbd.RigidBody("shank", 2.0, (1.0, 1.0, 1.0))
    joint = mbd.Revolute("hinge", thigh.end, shank.origin)
    force = factory(thigh.point(0.1, -0.3, 0.05, name="a"), shank.point(0.0, -0.2, 0.1, name="b"), joint)
    scope = FreeScope([joint])
    scope.move("thigh", (3.0, 0.2, 0.1, 0.3, -0.2, 0.1), (0.1, -0.2, 0.3, 0.5, 0.4, -0.6))
    scope.move("shank", pose, speed)
    scope.numbers[scope.time] = 0.7
    return force, scope


def generalized(force: Force, scope: FreeScope) -> list:
    """−f: virtual work per unit rate of every coordinate."""
    action, q, v = force.act(scope), scope.all_coordinates, scope.all_rates
    total = [scope.tape.zero] * len(v)
    for velocity, value in action.pairs:
        slopes = gradient(scope.tape.lift(velocity), v)
        total = [a + b * value for a, b in zip(total, slopes, strict=True)]
    if action.potential is not None:
        slopes = gradient(scope.tape.lift(action.potential), q)
        total = [a - b for a, b in zip(total, slopes, strict=True)]
    return total


@every_force
def test_parameters_are_declared_before_they_are_used(factory):
    force, scope = scene(factory)
    force.act(scope)
    own = {name: value for name, value in scope.recorded.items() if name.startswith("force.")}
    assert own == force.parameters()
    assert force.faults() == []


@every_force
def test_velocities_of_pairs_are_linear_in_the_rates(factory):
    force, scope = scene(factory)
    for velocity, _ in force.act(scope).pairs:
        v = scope.all_rates
        (euler,) = jvp([scope.tape.lift(velocity)], dict(zip(v, v, strict=True)))
        assert scope.value(euler) == pytest.approx(scope.value(velocity))


@every_force
@given(pose=POSE)
def test_action_equals_reaction(factory, pose):
    """A force between two bodies does no work on a motion of both together, and a torque none on a shift."""
    force, scope = scene(factory, pose)
    if isinstance(force, mbd.Applied):
        return
    work = np.array(scope.value(*generalized(force, scope)))
    np.testing.assert_allclose(work[:3] + work[6:9], 0.0, atol=1e-9)


@every_force
@given(pose=POSE, speed=POSE)
def test_losses_never_feed_energy_in(factory, pose, speed):
    force, scope = scene(factory, pose, speed)
    if force.kind != "loss":
        return
    powers = scope.value(*(scope.tape.lift(velocity * value) for velocity, value in force.act(scope).pairs))
    assert sum(powers) <= 0.0


@every_force
def test_kind_agrees_with_the_action(factory):
    force, scope = scene(factory)
    action = force.act(scope)
    assert force.kind in ("potential", "loss", "applied")
    assert (action.potential is not None) == (force.kind == "potential")
    assert bool(action.pairs) == (force.kind != "potential")
