"""Coordinates and velocities declared apart: laws of a joint whose coordinates are a unit quaternion."""

import numpy as np
import pytest

import mbd
from mbd.bodies import Ground
from mbd.compile.mechanisms import mechanism_of
from mbd.configuration import Configuration
from mbd.testing import LawBroken, check_joint, check_model
from tests.joints.quaternion_ball import CayleyBall, QuaternionBall, axis_angle

BALLS = pytest.mark.parametrize("ball", [QuaternionBall, CayleyBall], ids=["exponential", "cayley"])


def two_bodies(ball, gravity=(0.5, -9.81, 1.0), rod=False, loss=None):
    """A body on a tilted hinge, a second one on a ball joint, both turned against their axes, with a spring."""
    model = mbd.Model("two bodies", gravity=gravity)
    base = mbd.RigidBody("base", 2.0, (0.3, 0.4, 0.5, 0.01, 0.02, 0.03), center=(0.1, 0.2, 0.05))
    load = mbd.RigidBody("load", 1.0, (0.2, 0.3, 0.4, 0.01, 0.0, 0.02), center=(0.1, -0.3, 0.2))
    hinge = mbd.Revolute("hinge", model.ground.point(0.3, 0.1), base.point(0.1, 0.4), axis=(1, 2, 3))
    model.connect(hinge, ball("ball", base.point(0.2, -0.3, 0.1), load.point(0.1, 0.2, 0.3), loss=loss))
    model.apply(mbd.Spring("spring", base.point(0.3, 0, 0), load.point(0.5, 0, 0.1), stiffness=30.0, length=0.1))
    if rod:
        model.constrain(
            mbd.Bilateral("rod", mbd.distance(model.ground.point(1, 0, 0.2), load.point(0.3, 0.1, -0.2)), 1.0)
        )
    return model


@BALLS
def test_a_joint_with_more_coordinates_than_velocities_keeps_the_laws(ball):
    verdict = check_joint(lambda a, b: ball("joint", a, b), postures=3)
    assert {"(q ⊕ x) ⊖ q = x", "ẋ = D(x)⁻¹ v moves q ⊕ x with v", "q̇ = N(q) v is the rate of q ⊕ s v"} <= set(
        verdict.laws
    )


@BALLS
def test_equations_are_exact_anywhere_in_a_chart(ball):
    laws = check_model(two_bodies(ball, rod=True, loss=mbd.Viscous(0.2)), postures=2).laws
    assert {"B = ∂h/∂q", "ḧ = B a + (ḣ)˙ at a = 0"} <= set(laws)


class Skewed(QuaternionBall):
    """Increments that are taken for velocities, as at the center of the chart."""

    def increment_rates(self, x, v):
        return list(v)


def test_increments_taken_for_velocities_break_the_laws():
    with pytest.raises(LawBroken) as told:
        check_joint(lambda a, b: Skewed("joint", a, b), postures=1)
    assert "ẋ = D(x)⁻¹ v moves q ⊕ x with v" in told.value.laws
    with pytest.raises(LawBroken, match="B = ∂h/∂q"):
        check_model(two_bodies(Skewed, rod=True), postures=1)


@BALLS
def test_a_configuration_holds_coordinates_that_add_beside_those_that_do_not(ball):
    ground, body = Ground(), mbd.RigidBody("body", 1.0, (1.0, 1.0, 1.0))
    joints = [mbd.Universal("first", ground.origin, body.origin), ball("ball", ground.origin, body.origin),
              mbd.Prismatic("last", ground.origin, body.origin)]  # fmt: skip
    whole = Configuration.of_joints(joints, [("cut.angle", "rad")])
    assert (whole.n_q, whole.n_v, whole.is_vector) == (8, 7, False)
    assert whole.velocity_names[1:4] == ("first.second.rate", "ball.spin x", "ball.spin y")
    assert whole.velocity_units == ("rad/s",) * 5 + ("m/s", "rad/s")
    assert whole.places.tolist() == [0, 1, -1, -1, -1, 6, 7]
    assert whole.velocities_of == ((0,), (1,), *(((2, 3, 4),) * 4), (5,), (6,))
    rng = np.random.default_rng(3)
    q, x, v = whole.normalise(rng.normal(size=(5, 8))), rng.uniform(-1, 1, (5, 7)), rng.normal(size=(5, 7))
    there = whole.compose(q, x)
    np.testing.assert_allclose(whole.difference(q, there), x, atol=1e-14)
    np.testing.assert_array_equal(there[:, [0, 1, 6, 7]], q[:, [0, 1, 6, 7]] + x[:, [0, 1, 5, 6]])
    np.testing.assert_allclose(np.sum(there[:, 2:6] ** 2, axis=1), 1.0, atol=1e-15)
    np.testing.assert_array_equal(whole.compose(q[0], x[0]), there[0])
    np.testing.assert_allclose(whole.interpolate(q, there, np.ones(5)), there, atol=1e-14)
    np.testing.assert_allclose(whole.increment_velocities(x, whole.increment_rates(x, v)), v, atol=1e-14)


@BALLS
def test_one_placement_is_normalised_as_many_are(ball):
    configuration, rng = mechanism_of(two_bodies(ball)).equations.configuration, np.random.default_rng(3)
    many = rng.normal(size=(50, configuration.n_q))
    each = np.stack([configuration.normalise(one) for one in many])
    np.testing.assert_array_equal(each, configuration.normalise(many))
    assert np.all(configuration.misplaced(many[0], 1e-9)) and not configuration.misplaced(each[0], 1e-9)


@BALLS
def test_a_start_names_all_coordinates_of_a_joint_or_none(ball):
    model, names = two_bodies(ball), ("ball.w", "ball.x", "ball.y", "ball.z")
    with pytest.raises(mbd.ModelError, match="belong together"):
        mbd.assemble(model, {"ball.w": 1.0})
    with pytest.raises(mbd.ModelError, match="which no placement of joint 'ball' has"):
        mbd.assemble(model, dict(zip(names, (0.8, 0.8, 0.0, 0.0), strict=True)))
    start = mbd.assemble(model, dict(zip(names, (0.9238796, 0.3826834, 0.0, 0.0), strict=True)), {"ball.spin z": 2.0})
    assert start.q[1:] @ start.q[1:] == pytest.approx(1.0, abs=1e-15)
    assert abs(start.moved["ball.w"]) < 1e-6
    assert start["ball.spin z"] == 2.0


def test_a_start_with_rows_moves_quaternions_along_their_joint():
    model = two_bodies(CayleyBall, rod=True)
    start = mbd.assemble(model)
    assert start.q[1:] @ start.q[1:] == pytest.approx(1.0, abs=1e-15)
    names = ("ball.w", "ball.x", "ball.y", "ball.z")
    held = dict(zip(names, start.q[1:].tolist(), strict=True))
    named = mbd.assemble(model, held, {"ball.spin x": 0.5, "ball.spin y": -0.2})
    np.testing.assert_allclose(named.q, start.q, atol=1e-12)
    assert [named["ball.spin x"], named["ball.spin y"]] == [0.5, -0.2]
    with pytest.raises(mbd.AssemblyError, match="in conflict: 'rod', 'ball'"):
        mbd.assemble(model, dict(zip(names, axis_angle((1.0, 2.0, -1.0), 0.3), strict=True)))
    assert mbd.mobility(model, start).dof == 3
