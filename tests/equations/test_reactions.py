"""Reactions balance every body: Newton's and Euler's equations hold with what the results say."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.equations import derive
from tests.equations.mechanisms import four_bar, random_tree
from tests.equations.numbers import at, derivative, inputs, placed, solved


def triple(equations, name, point):
    return at([equations.output(f"{name}.{axis}") for axis in "xyz"], point)


def motion_of(equations, point):
    along = {("x", k): point["v", k] for k in range(equations.n_v)} | {("t", 0): 1.0}
    return along | {("v", k): point["a", k] for k in range(equations.n_v)}


def momentum_rates(equations, body, point):
    """d/dt of linear momentum, and of angular momentum about the center, in ground axes."""
    scope = equations.geometry.scope
    mass = body.mass_properties(scope)
    motion = scope.frame(body.center)
    R = np.array([[scope.real(x) for x in row] for row in motion.rotation], dtype=object)
    I = np.array([[scope.tape.lift(x) for x in row] for row in mass.inertia], dtype=object)  # noqa: E741
    spin = R @ (I @ (R.T @ np.array([scope.real(x) for x in motion.angular_velocity], dtype=object)))
    momenta = [*(mass.mass * scope.real(v) for v in motion.velocity), *spin]
    change = derivative([scope.tape.lift(part) for part in momenta], point, motion_of(equations, point))
    return change[:3], change[3:], at([scope.tape.lift(mass.mass)], point)[0]


def check_balance(model, equations, point, pushes=()):
    """Σ F = ṗ and Σ M = L̇ for every body; `pushes` are (body, place, force, torque) of other causes."""
    for body in model.bodies.values():
        if body is model.ground:
            continue
        linear, angular, mass = momentum_rates(equations, body, point)
        center = triple(equations, f"{body.name}.center", point)
        force, torque = mass * np.array(model.gravity), np.zeros(3)
        for joint in model.joints:
            for frame, sign in (joint.child, 1.0), (joint.parent, -1.0):
                if frame.body is body:
                    F = sign * triple(equations, f"{joint.name}.reaction_force", point)
                    place = triple(equations, joint.child.full_name, point)
                    force = force + F
                    torque = torque + np.cross(place - center, F)
                    torque = torque + sign * triple(equations, f"{joint.name}.reaction_torque", point)
        for owner, place, F, T in pushes:
            if owner is body:
                force, torque = force + F, torque + T + np.cross(place - center, F)
        np.testing.assert_allclose(force, linear, atol=2e-6 * (1 + np.abs(linear).max()))
        np.testing.assert_allclose(torque, angular, atol=2e-6 * (1 + np.abs(angular).max()))


@settings(max_examples=12)
@given(seed=st.integers(0, 10_000), spatial=st.booleans())
def test_reactions_balance_the_bodies_of_a_tree(seed, spatial):
    model = random_tree(seed, 3, spatial)
    equations = derive(model)
    check_balance(model, equations, solved(equations, inputs(equations, seed)))


@pytest.mark.parametrize("cut", ["auto", "all", ["A"], ["C"], ["B", "D"]])
def test_reactions_balance_the_bodies_of_a_loop(cut):
    model = mbd.Model("four-bar", cut=cut)
    for joint in four_bar().joints:
        model.connect(mbd.Revolute(joint.name, joint.parent, joint.child))
    equations = derive(model)
    start = inputs(equations, 3) | {("q", k): 0.3 for k in range(equations.n_q)}
    check_balance(model, equations, solved(equations, placed(equations, start)))


@pytest.mark.parametrize("cut", ["auto", ["crank pin"], ["elbow"], ["wrist"], ["sleeve"]], ids=str)
def test_reactions_balance_the_bodies_of_a_spatial_loop(cut):
    """A loop of a hinge, two universal joints and a sleeve, which has one degree of freedom."""
    model = mbd.Model("spatial loop", cut=cut)
    crank = mbd.RigidBody("crank", 1.0, (0.1, 0.2, 0.25), center=(0.1, 0.2, 0.0))
    tip = (0.3, 0.1, 0.1)
    rod = mbd.RigidBody("rod", 2.0, (0.3, 0.1, 0.35), center=(0.0, 0.5, 0.1))
    lever = mbd.RigidBody("lever", 1.5, (0.2, 0.1, 0.22, 0.01, 0.02, 0.0), center=(0.1, 0.1, 0.2))
    model.connect(
        mbd.Revolute("crank pin", model.ground.origin, crank.origin),
        mbd.Universal("elbow", crank.point(0.0, 0.4, 0.1), rod.origin),
        mbd.Universal("wrist", rod.point(0.0, 1.0, 0.0), lever.point(*tip), axis=(1, 0, 0), second_axis=(0, 1, 0)),
        mbd.Cylindrical("sleeve", model.ground.point(0.6, 0.9), lever.origin, axis=(0.0, 0.6, 0.8)),
    )
    equations = derive(model)
    start = placed(equations, inputs(equations, 5, spread=0.3))
    assert np.abs(at([row.value for row in equations.rows], start)).max() < 1e-12
    point = solved(equations, start)
    assert np.abs([point["a", k] for k in range(equations.n_v)]).max() > 1e-3
    check_balance(model, equations, point)


def test_joint_effects_are_no_part_of_the_reaction():
    """A motor, a loss and a spring at a pin turn the link; the pin's own torque about its axis stays zero."""
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=2.0, length=0.7, center=0.3, inertia=0.05)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.3), stiffness=2.0, rest=0.1)
    model.connect(pin)
    model.apply(mbd.Motor("drive", pin, torque=1.3))
    model.constrain(mbd.Unilateral("stop", mbd.flexion(pin)), mbd.Penalty("pad", mbd.extension(pin), stiffness=9.0))
    equations = derive(model)
    point = solved(equations, inputs(equations, 2), rows=())
    assert triple(equations, "pin.reaction_torque", point)[2] == 0.0
    (angle, rate, acceleration) = (point[kind, 0] for kind in "qva")
    along = np.array([np.sin(angle), -np.cos(angle), 0.0])
    across = np.array([np.cos(angle), np.sin(angle), 0.0])
    expected = 2.0 * 0.3 * (acceleration * across - rate**2 * along) + np.array([0.0, 2.0 * 9.81, 0.0])
    np.testing.assert_allclose(triple(equations, "pin.reaction_force", point), expected, rtol=1e-12, atol=1e-12)


def test_a_closed_contact_and_forces_enter_the_reactions():
    """A pendulum whose tip rests on the ground and is pushed: the pin takes what the ground and the push leave."""
    model = mbd.Model("propped")
    rod = mbd.Link("rod", mass=2.0, length=0.7, center=0.3, inertia=0.05)
    model.connect(mbd.Revolute("pin", model.ground.point(0.0, 0.5), rod.start))
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(rod.end), friction=0.0))
    push = np.array([0.4, -0.7, 0.0])
    model.apply(mbd.Applied("push", rod.center, force=push))
    equations = derive(model)
    point = placed(equations, inputs(equations, 2) | {("q", 0): 0.7})
    point = solved(equations, point)
    ground = np.array([0.0, at([equations.output("tip.force")], point)[0], 0.0])
    places = [triple(equations, name, point) for name in ("rod.end", "rod.center")]
    zero = np.zeros(3)
    check_balance(model, equations, point, [(rod, places[0], ground, zero), (rod, places[1], push, zero)])


@pytest.mark.parametrize("kind", [mbd.Translation, mbd.Prismatic])
def test_reactions_do_not_depend_on_the_side_from_which_a_joint_is_walked(kind):
    """A sliding joint with a loss between two bodies, reached from either of them."""
    one, two = mbd.Link("one", 1.3, 0.9, 0.4, 0.1), mbd.Link("two", 0.8, 1.1, 0.5, 0.2)
    found, position, velocity = [], {"near.angle": 0.3}, {"near.angle": 0.5}
    for cut in ("far", "near"):
        model = mbd.Model("slide", cut=[cut])
        a, b = one.point(0.2, -0.3).turned(0.4), two.point(-0.3, 0.1).turned(-0.7)
        label = kind("probe", a, b).labels[0].name
        slide = kind("slide", a, b, loss={label: mbd.Viscous(3.0)})
        model.connect(mbd.Revolute("near", model.ground.origin, one.start), slide)
        model.connect(mbd.Planar("far", model.ground.point(0.5, -0.2), two.origin))
        names = [name for joint in model.joints for name in joint.coordinate_names]
        position.setdefault(f"slide.{label}", 0.7), velocity.setdefault(f"slide.{label}", 1.9)
        if kind is mbd.Translation:
            position.setdefault("slide.y", 0.4)
        start = mbd.assemble(model, position, velocity)
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=2e-3)
        position, velocity = {n: run[n][0] for n in names}, {n: run[f"{n}.rate"][0] for n in names}
        found.append([run[f"slide.reaction_{part}"][0] for part in ("force", "torque")])
    np.testing.assert_allclose(found[0], found[1], atol=1e-9)
    assert abs(found[0][1][2]) > 0.1
