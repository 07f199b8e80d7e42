"""What single forces do, and what they refuse."""

import math
import pickle

import numpy as np
import pytest
import sympy

import mbd
from mbd.bodies import Ground
from mbd.errors import ModelError, TraceError
from mbd.testing.forces import generalized
from mbd.testing.measures import between
from tests.helpers import FreeScope

GROUND = Ground()
ROD = mbd.Link("rod", 1.0, 0.5, 0.2)
HINGE = mbd.Revolute("hinge", GROUND.origin, ROD.start)
BALL = mbd.PointMass("ball", 1.0)


def ball_at(*place: float, speed=(0.0, 0.0, 0.0)) -> FreeScope:
    scope = FreeScope([HINGE])
    scope.move("ball", (*place, 0.0, 0.0, 0.0), (*speed, 0.0, 0.0, 0.0))
    return scope


def test_a_stretched_spring_pulls_its_ends_together():
    spring = mbd.Spring("spring", GROUND.origin, BALL.origin, stiffness=10.0, length=1.0)
    scope = ball_at(3.0, 0.0, 0.0)
    assert scope.value(spring.act(scope).potential) == pytest.approx([20.0])
    assert scope.value(*generalized(spring.act(scope), scope)) == pytest.approx([-20.0, 0, 0, 0, 0, 0])


def test_a_spring_without_length_has_no_root():
    spring = mbd.Spring("spring", GROUND.origin, BALL.origin, stiffness=10.0)
    scope = ball_at(0.0, 0.0, 0.0)
    assert scope.value(*generalized(spring.act(scope), scope)) == [0.0] * 6


def test_a_damper_resists_the_rate_of_its_length():
    damper = mbd.Damper("damper", GROUND.origin, BALL.origin, 5.0)
    scope = ball_at(0.0, 2.0, 0.0, speed=(7.0, 3.0, 0.0))
    assert scope.value(*generalized(damper.act(scope), scope))[:3] == pytest.approx([0.0, -15.0, 0.0])
    assert damper.parameters() == {"damper.coefficient": 5.0}


def test_an_applied_force_has_the_moment_of_its_arm():
    force, joint, _ = between(lambda a, b, joint: mbd.Applied("push", a, force=(2.0, 3.0, 4.0), torque=1.5))
    scope = FreeScope([joint])
    scope.move("thigh", (3.0, 0.2, 0.1, 0.3, -0.2, 0.1), (0.1, -0.2, 0.3, 0.5, 0.4, -0.6))
    motion = scope.frame(force.frame)
    origin = scope.frame(force.frame.body.origin)
    arm = np.array(scope.value(*motion.position)) - scope.value(*origin.position)
    work = np.array(scope.value(*generalized(force.act(scope), scope)))
    np.testing.assert_allclose(work[:3], (2.0, 3.0, 4.0))
    moment = np.cross(arm, (2.0, 3.0, 4.0))
    assert work[3] == pytest.approx(moment[0])  # the first turn is about the x axis of the ground


def test_numbers_are_run_time_parameters():
    force = mbd.Applied("push", BALL.origin, force=(2.0, 3.0), torque=4.0)
    assert force.parameters() == {
        "push.force.x": 2.0, "push.force.y": 3.0, "push.force.z": 0.0, "push.torque.x": 0.0, "push.torque.y": 0.0,
        "push.torque.z": 4.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    "torque",
    [
        lambda t, angle, gain: gain * mbd.sin(angle) + t,
        sympy.Symbol("gain") * sympy.sin(sympy.Symbol("angle")) + sympy.Symbol("t"),
    ],
    ids=["function", "sympy"],
)
def test_functions_and_expressions_see_named_quantities_and_parameters(torque):
    arguments = {"t": "t", "angle": "hinge.angle", "gain": 2.5}
    motor = mbd.Motor("drive", HINGE, torque=torque, arguments=arguments)
    scope = FreeScope([HINGE])
    scope.move("rod", (0.0, 0.0, 0.0, 0.0, 0.0, 0.4))
    scope.numbers[scope.time] = 3.0
    ((_, value),) = motor.act(scope).pairs
    assert scope.value(value) == pytest.approx([2.5 * math.sin(0.4) + 3.0])
    assert motor.parameters() == {"drive.gain": 2.5}
    assert motor.mentions() == [HINGE, "t", "hinge.angle"]


def test_a_function_of_a_frame_receives_its_position():
    potential = mbd.Potential("well", lambda p: p[0] ** 2 + 3.0 * p[1], [BALL.origin])
    scope = ball_at(2.0, 5.0, 0.0)
    assert scope.value(potential.act(scope).potential) == pytest.approx([19.0])


def test_a_potential_is_an_energy_of_positions_and_time():
    model = mbd.Model("cart", gravity=(0.0, 0.0, 0.0))
    cart = mbd.PointMass("cart", 1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, cart.origin))
    model.apply(mbd.Potential("well", lambda q, v: 0.5 * q * q + 0.3 * v * q, ["rail.displacement", "rail.rate"]))
    with pytest.raises(ModelError, match="'well': the potential depends on velocities; .* a force: mbd.Applied"):
        mbd.assemble(model)


def test_one_function_may_give_all_components():
    force = mbd.Applied("push", BALL.origin, force=lambda t: (t, 2.0 * t))
    scope = ball_at(0.0, 0.0, 0.0)
    scope.numbers[scope.time] = 1.5
    assert scope.value(*generalized(force.act(scope), scope))[:3] == pytest.approx([1.5, 3.0, 0.0])


def test_a_single_torque_acts_about_z():
    for torque in (2.0, lambda t: 2.0, mbd.Samples([0, 1], [2.0, 2.0]), sympy.Integer(2)):
        force = mbd.Applied("twist", BALL.origin, torque=torque)
        scope = ball_at(0.0, 0.0, 0.0)
        assert scope.value(*generalized(force.act(scope), scope)) == pytest.approx([0, 0, 0, 0, 0, 2.0])


@pytest.mark.parametrize("kind", ["monotone", "spline", "linear", "hold"])
def test_samples_pass_through_their_values_and_stay_constant_outside(kind):
    signal = mbd.Samples([0.0, 1.0, 3.0], [1.0, 5.0, 2.0], kind=kind)
    for time, value in [(-9.0, 1.0), (0.0, 1.0), (1.0, 5.0), (3.0, 2.0), (50.0, 2.0)]:
        scope = FreeScope()
        scope.numbers[scope.time] = time
        assert scope.value(signal.signal(scope, "signal")) == pytest.approx([value])


def test_columns_of_samples_are_components():
    force = mbd.Applied("push", BALL.origin, force=mbd.Samples([0, 1], [[1.0, 2.0], [3.0, 4.0]], kind="linear"))
    scope = ball_at(0.0, 0.0, 0.0)
    scope.numbers[scope.time] = 0.5
    assert scope.value(*generalized(force.act(scope), scope))[:3] == pytest.approx([2.0, 3.0, 0.0])


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: mbd.Spring("s", GROUND, BALL.origin, 1.0), "must be a frame"),
        (lambda: mbd.Spring("s", GROUND.origin, BALL.origin, math.nan), "must be finite"),
        (lambda: mbd.Damper("d", GROUND.origin, BALL.origin, None), "such as mbd.Viscous"),
        (lambda: mbd.TorsionSpring("s", BALL, 1.0), "must be a joint"),
        (lambda: mbd.Motor("m", mbd.Planar("p", GROUND.origin, ROD.start), 1.0), "'p.x', 'p.y', 'p.angle'"),
        (lambda: mbd.Motor("m", HINGE, torque="full"), "must be a number, a function"),
        (lambda: mbd.Motor("m", HINGE, torque=mbd.Samples([0, 1], [[1, 2], [3, 4]])), "one component"),
        (lambda: mbd.Samples([], []), "one time and value at least"),
        (lambda: mbd.Applied("f", BALL.origin), "does nothing"),
        (lambda: mbd.Applied("f", BALL.origin, force=1.0), "three components"),
        (lambda: mbd.Applied("f", BALL.origin, force=(1.0, 2.0, 3.0, 4.0)), "got 4"),
        (lambda: mbd.Applied("f", BALL.origin, force=(1.0, 2.0), arguments=(3.0,)), "an argument is a name"),
        (lambda: mbd.Potential("v", lambda: 1.0, ()), "what it depends on"),
        (lambda: mbd.Samples([0.0, 1.0], [1.0, math.nan]), "nan"),
        (lambda: mbd.Samples([0.0, 1.0], [1.0]), "as many values as times"),
        (lambda: mbd.Samples([1.0, 0.0], [1.0, 2.0]), "increase"),
        (lambda: mbd.Samples([0.0, 1.0], [1.0, 2.0], kind="step"), "'spline', 'smooth', 'monotone'"),
    ],
)
def test_wrong_forces_are_refused_in_words(make, told):
    with pytest.raises(ModelError, match=told):
        make()


def test_a_function_of_the_wrong_size_is_told():
    scope = ball_at(0.0, 0.0, 0.0)
    with pytest.raises(ModelError, match="one number came"):
        mbd.Applied("push", BALL.origin, force=lambda t: t).act(scope)
    with pytest.raises(TraceError, match="torque of 'drive'"):
        mbd.Motor("drive", HINGE, torque=lambda t: (t, t)).act(FreeScope([HINGE]))


def test_forces_between_one_body_are_faults():
    assert "does nothing" in mbd.Spring("s", ROD.start, ROD.end, 1.0).faults()[0]
    assert "does nothing" in mbd.Damper("d", ROD.start, ROD.end, 1.0).faults()[0]


@pytest.mark.parametrize(
    "loss",
    [mbd.Coulomb(2.0), mbd.Stribeck(3.0, 2.0, 0.1), mbd.PinFriction(0.3, 0.02), mbd.Viscous(1.0) + mbd.Coulomb(2.0)],
)
def test_a_damper_of_a_loss_that_truly_sticks_is_refused(loss):
    """A force has no row that could hold it: the loss would take nothing."""
    with pytest.raises(ModelError, match="truly sticks.*smoothing"):
        mbd.Damper("d", GROUND.origin, BALL.origin, loss)
    mbd.Damper("d", GROUND.origin, BALL.origin, mbd.Coulomb(2.0, smoothing=0.1) + mbd.Viscous(1.0))


def test_forces_are_values():
    spring = mbd.Spring("spring", GROUND.origin, BALL.origin, stiffness=10.0, length=1.0)
    assert pickle.loads(pickle.dumps(spring)) == spring
    assert len({spring, pickle.loads(pickle.dumps(spring))}) == 1
