"""Inputs and outputs of linearizations: differences, runs, cuts, refusals."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.assembly.pose import Posture
from mbd.assembly.posture import close_nearby, close_velocities
from mbd.testing.mechanisms import random_loop, random_tree
from tests.cases.small_motions import PLAIN, four_bar
from tests.joints.quaternion_ball import QuaternionBall

pytestmark = pytest.mark.filterwarnings("ignore:.*nothing depends on:mbd.errors.MbdWarning")

STEP = 1e-5
"""Of central differences, whose error is its square."""


def look(model, state, **ports):
    return mbd.linearize(model, state, backend=PLAIN, **ports)


def nearby(found, state, x, parameters=None):
    """The state whose independent coordinates and rates are x, with all active rows closed."""
    instant, n_v = found.instant, len(found.coordinates)
    mechanism, rows = instant.mechanism, instant.mechanism.equations.rows
    x = np.asarray(x)[: len(found.picked)]
    q, v, z = state.q.copy(), state.v.copy(), state.z.copy()
    for place, value in zip(found.picked, x, strict=True):
        part = q if place < n_v else v if place < 2 * n_v else z
        part[place % n_v if place < 2 * n_v else place - 2 * n_v] = value
    manager = found.instant.system.manager
    flags = manager.flags(state.mode.closed)
    values = mechanism.parameters({**state.parameters, **(parameters or {})})
    near = Posture(mechanism, manager, values, q, v, flags, state.anchors.copy())
    held = [k for k in instant.rows if not rows[k].is_velocity]
    loose = np.array([k not in found.picked for k in range(n_v)])
    assert np.max(np.abs(close_nearby(near, held, loose)), initial=0.0) < 1e-11
    close_velocities(near, np.array([n_v + k not in found.picked for k in range(n_v)]))
    return replace(state, q=near.q, v=near.y[:n_v], z=z)


def differences_by_states(model, state, found, ports):
    """Central differences of rates and outputs over states closed nearby: A and C."""
    count = len(found.picked)
    columns = []
    for unit in np.eye(count):
        ends = [look(model, nearby(found, state, found.x[:count] + side * STEP * unit), **ports) for side in (1, -1)]
        columns.append([(a - b) / (2 * STEP) for a, b in zip(*(reaction(end, found) for end in ends), strict=True)])
    return [np.array(part).T for part in zip(*columns, strict=True)]


def reaction(end, found):
    """Rates of the independent states of another linearization, and the outputs there."""
    return end.drift[list(found.picked)], end.output_values


def check_by_parameters(model, state, found, ports, names):
    """B and D are the differences of accelerations and outputs over values of parameters."""
    for column, name in enumerate(names):
        value = found.instant.value(parameter_node(found, name))
        ends = [look(model, state, parameters={name: value + side * STEP}, **ports) for side in (1, -1)]
        rate, seen = ((a - b) / (2 * STEP) for a, b in zip(*(reaction(end, found) for end in ends), strict=True))
        assert found.B[:, column] == pytest.approx(rate, rel=1e-6, abs=1e-6 * (1 + np.max(np.abs(rate))))
        assert found.D[:, column] == pytest.approx(seen, rel=1e-6, abs=1e-6 * (1 + np.max(np.abs(seen))))


def parameter_node(found, name):
    equations = found.instant.mechanism.equations
    place = next(k for k, parameter in enumerate(equations.parameters) if parameter.name == name)
    return equations.tape.input("p", place)


def furnished(model, rng, spatial=True):
    """The model with a motor, a push at the last body and a gust that is a law; its inputs and outputs."""
    joint = next((each for each in model.joints if len(each.labels) == 1), None)
    body = (
        model.joints[-1].child.body if model.joints[-1].child.body is not model.ground else model.joints[0].child.body
    )
    tip = body.point(0.3, -0.2, 0.1 if spatial else 0.0, name="tip")
    push = [rng.uniform(-2, 2) for _ in range(3)] if spatial else [rng.uniform(-2, 2), rng.uniform(-2, 2), 0.0]
    model.apply(mbd.Applied("push", tip, force=push, torque=(0.0, 0.0, rng.uniform(-1, 1))))
    inputs = ["push.force.x", "push.force.y", "push.torque.z", "gravity.x"]
    if joint is not None:
        model.apply(mbd.Motor("drive", joint, torque=0.0))  # an exact zero, which would fold
        inputs.append("drive.torque")
    labels = [name for each in model.joints for name in each.coordinate_names][:3]
    outputs = [f"{body.name}.tip", f"{body.name}.tip.vx", *labels, "kinetic_energy"]
    outputs += [f"{model.joints[0].name}.reaction_force", f"{model.joints[0].name}.reaction_torque.z"]
    return {"inputs": inputs, "outputs": outputs}


# differences ------------------------------------------------------------------------------------------------------
@given(st.integers(0, 10**6), st.booleans())
@settings(max_examples=6)
def test_ports_of_random_trees_are_differences_of_accelerations_and_results(seed, spatial):
    rng = random.Random(seed)
    model = random_tree(seed, 3, spatial=spatial, most=4)
    ports = furnished(model, rng, spatial)
    empty = mbd.assemble(model, backend=PLAIN)
    state = replace(
        empty, q=empty.q + [rng.uniform(-0.5, 0.5) for _ in empty.q], v=np.array([rng.uniform(-1, 1) for _ in empty.v])
    )
    found = look(model, state, **ports)
    check_by_parameters(model, state, found, ports, ports["inputs"])
    A, C = differences_by_states(model, state, found, ports)
    assert pytest.approx(A, rel=1e-5, abs=1e-5 * (1 + np.max(np.abs(A)))) == found.A
    assert pytest.approx(C, rel=1e-5, abs=1e-5 * (1 + np.max(np.abs(C)))) == found.C


@given(st.integers(0, 10**6), st.sampled_from(["auto", "all"]))
@settings(max_examples=4)
def test_ports_of_random_loops_are_differences_of_accelerations_and_results(seed, cut):
    rng = random.Random(seed)
    model, angles = random_loop(seed)
    model.cut = cut
    ports = furnished(model, rng, spatial=False)
    state = mbd.assemble(model, position=angles, velocity={"hinge 0.angle": rng.uniform(-1, 1)}, backend=PLAIN)
    found = look(model, state, **ports)
    check_by_parameters(model, state, found, ports, ports["inputs"])
    A, C = differences_by_states(model, state, found, ports)
    assert pytest.approx(A, rel=1e-4, abs=1e-4 * (1 + np.max(np.abs(A)))) == found.A
    assert pytest.approx(C, rel=1e-4, abs=1e-4 * (1 + np.max(np.abs(C)))) == found.C


def standing(friction=None):
    """A link on its foot, with a motor at a hinge above it, a stop that pushes, and a soft heel."""
    model = mbd.Model("standing")
    shank, thigh = mbd.Link("shank", 2.0, 0.5, 0.2, 0.05), mbd.Link("thigh", 3.0, 0.5, 0.3, 0.1)
    base = mbd.Planar("base", model.ground.origin, shank.end)
    knee = mbd.Revolute("knee", shank.start, thigh.end)
    model.connect(base, knee)
    model.constrain(
        mbd.Unilateral("foot", mbd.touchdown(shank.end), friction=friction),
        mbd.Unilateral("stop", mbd.extension(knee, 0.0)),
        mbd.Penalty("heel", mbd.touchdown(shank.point(-0.1, -0.51, name="heel")), 2e3, 30.0),
    )
    model.apply(mbd.Motor("drive", knee, torque=lambda t: -30.0 + 0.0 * t))
    return model


@pytest.mark.parametrize("friction", [None, 0.3])
def test_ports_with_closed_contacts_are_differences(friction):
    """A foot that sticks or slides, a stop and a force law; the contacts stay as they are."""
    model = standing(friction)
    closed, speed = ["foot", "stop", "heel"], {"base.x": 0.4} if friction else {}
    state = mbd.assemble(model, closed=closed, velocity=speed, backend=PLAIN)
    state = nearby(look(model, state), state, look(model, state).x + 0.02)
    ports = {"inputs": ["drive.torque", "gravity.y"], "outputs": ["foot.force", "stop.force", "heel.force", "base.y"]}
    ports["outputs"] += ["foot.friction", "thigh.start", "knee.reaction_force"]
    found = look(model, state, **ports)
    assert min(found.output_values[:3]) > 0.5
    A, C = differences_by_states(model, state, found, ports)
    assert pytest.approx(A, rel=1e-4, abs=1e-4 * (1 + np.max(np.abs(A)))) == found.A
    assert pytest.approx(C, rel=1e-4, abs=1e-4 * (1 + np.max(np.abs(C)))) == found.C
    lighter, heavier = (look(model, state, parameters={"gravity.y": -9.81 + side * STEP}, **ports) for side in (-1, 1))
    rate, seen = ((b - a) / (2 * STEP) for a, b in zip(reaction(lighter, found), reaction(heavier, found), strict=True))
    assert found.B[:, 1] == pytest.approx(rate, abs=1e-5)
    assert found.D[:, 1] == pytest.approx(seen, abs=1e-5)


# inputs that are laws, and prescribed motions -----------------------------------------------------------------------
def test_an_input_is_added_to_a_law():
    """Of a function, an expression and samples as of the number that they have at the instant."""
    import sympy

    laws = [2.5, lambda t: 2.5 + 3.0 * t, sympy.Rational(5, 2) + sympy.Symbol("t"), mbd.Samples([-1, 1], [2.0, 3.0])]
    found = []
    for law in laws:
        model = four_bar()
        model.apply(mbd.Motor("drive", model.joints[0], torque=law))
        model.apply(mbd.Applied("push", model.joints[1].child, force=(law, law), torque=law))
        state = mbd.assemble(model, position={"a.angle": 0.4}, velocity={"a.angle": 1.0}, backend=PLAIN)
        inputs = ["drive.torque", "push.force.x", "push.force.y", "push.torque.z"]
        found.append(look(model, state, inputs=inputs, outputs=["a.reaction_force", "drive.power"]))
    for other in found[1:]:
        for name in "ABCD":
            assert getattr(other, name) == pytest.approx(getattr(found[0], name), abs=1e-11)
    assert np.all(np.max(np.abs(found[0].B), axis=0) > 0.01)


def test_a_lagrangian_has_forces_on_its_coordinates_and_prescribed_rows():
    """A pendulum of length r by its angle, and in x and y with a rod whose length is prescribed by its acceleration."""
    one = mbd.Lagrangian(
        "pendulum", [mbd.Coordinate("theta", unit="rad")],
        kinetic=lambda m, r, theta_rate: m * r**2 * theta_rate**2 / 2,
        potential=lambda m, r, g, theta: -m * g * r * mbd.cos(theta),
        parameters={"m": 1.5, "r": 0.7, "g": 9.81},
    )  # fmt: skip
    one.observe("height", lambda theta: -0.7 * mbd.cos(theta), "theta", unit="m")
    state = mbd.assemble(one, position={"theta": 0.3}, backend=PLAIN)
    found = look(one, state, inputs=["theta.force", "g"], outputs=["theta.acceleration", "height"])
    assert found.B[1] == pytest.approx([1 / (1.5 * 0.49), -math.sin(0.3) / 0.7])
    assert pytest.approx(np.array([[-9.81 / 0.7 * math.cos(0.3), 0.0], [0.7 * math.sin(0.3), 0.0]])) == found.C
    assert found.state_space.output_units[1] == "m" and found.state_space.input_units[0] == "N m"
    two = mbd.Lagrangian(
        "x and y", ["x", "y"],
        kinetic=lambda x_rate, y_rate: 0.75 * (x_rate**2 + y_rate**2), potential=lambda y: 1.5 * 9.81 * y,
        constraints={"rod": lambda x, y, r: (x**2 + y**2 - r**2) / 2}, parameters={"r": 0.7},
    )  # fmt: skip
    state = mbd.assemble(two, position={"y": -0.7}, backend=PLAIN)
    found = look(two, state, inputs=["r.acceleration", "x.force"], outputs=["y.acceleration", "rod.multiplier"])
    assert found.states == ("x", "x.rate", "r", "r.rate")
    assert pytest.approx(np.array([[-1.0, 0.0], [-1.5 / 0.7, 0.0]])) == found.D  # ÿ = −r̈; −λ r = m (r̈ − g)
    with pytest.raises(mbd.ModelError, match="'r' prescribes a motion .* ask for the input 'r.acceleration'"):
        look(two, state, inputs="r")


@pytest.mark.parametrize(("cut", "swing"), [("auto", 0.0), ("auto", 2.0), ("all", 2.0)])
def test_a_prescribed_motion_acts_by_its_acceleration(cut, swing):
    """A crank driven by (size + rate t + change t²/2) cos(swing t − 0.3): size is an input by its acceleration."""
    model = four_bar(cut)
    slide = mbd.PointMass("slide", 0.8)
    middle = model.joints[1].child.body.center
    model.connect(mbd.Translation("hang", middle, slide.origin))
    model.apply(mbd.Spring("cord", middle, slide.origin, 40.0, 0.1))

    def law(t, size, rate, change):
        return (size + rate * t + 0.5 * change * t * t) * mbd.cos(swing * t - 0.3 * bool(swing))

    arguments = ["t", ("size", 0.4), ("rate", 1.5), ("change", 0.7)]
    model.constrain(mbd.Bilateral("crank drive", model.joints[0], law, arguments))
    outputs = ["crank drive.torque", "b.angle", "coupler.end.vy", "d.reaction_force.x"]
    ports = {"inputs": ["crank drive.size.acceleration", "gravity.y"], "outputs": outputs}
    state = mbd.assemble(model, position={"hang.x": 0.2}, velocity={"hang.y": 0.5}, backend=PLAIN)
    found = look(model, state, **ports)
    assert found.states[-2:] == ("crank drive.size", "crank drive.size.rate")
    count = len(found.picked)
    assert count == 4 and found.A[-2, -1] == 1.0 and found.B[-1, 0] == 1.0 and found.x[-2:].tolist() == [0.4, 0.0]

    def difference(name, moves=True):
        ends = []
        for side in (1, -1):
            given = {f"crank drive.{name}": model.parameters[f"crank drive.{name}"] + side * STEP}
            there = nearby(found, state, found.x, given) if moves else state
            ends.append(look(model, there, parameters=given, **ports))
        return [(a - b) / (2 * STEP) for a, b in zip(*(reaction(end, found) for end in ends), strict=True)]

    with pytest.raises(mbd.ModelError, match="rows turn as this state moves .*give an equilibrium"):
        found.descriptor()
    rate, seen = difference("change", moves=False)
    assert found.B[:count, 0] == pytest.approx(rate, abs=1e-5)
    assert found.D[:, 0] == pytest.approx(seen, abs=1e-5)
    A, C = differences_by_states(model, state, found, ports)
    assert found.A[:count, :count] == pytest.approx(A, rel=1e-5, abs=1e-4)
    assert found.C[:, :count] == pytest.approx(C, rel=1e-5, abs=1e-4)
    if swing:  # as the size is an input, its own rate is 0 at the state
        model.tunable = ("crank drive.rate", "crank drive.change")
        still = [*arguments[:2], ("rate", 0.0), ("change", 0.0)]
        model.constraints[-1] = replace(model.constraints[-1], arguments=still)
        state = mbd.assemble(model, position={"hang.x": 0.2}, velocity={"hang.y": 0.5}, backend=PLAIN)
        found = look(model, state, **ports)
    else:
        law_itself = look(model, state, inputs=["crank drive.value.acceleration", "gravity.y"], outputs=outputs)
        assert law_itself.states[-1] == "crank drive.value.rate"
        for name in "ABCD":
            assert getattr(law_itself, name) == pytest.approx(getattr(found, name), abs=1e-12)
    for column, name in (-2, "size"), (-1, "rate"):
        rate, seen = difference(name)
        assert found.A[:count, column] == pytest.approx(rate, rel=1e-5, abs=1e-4)
        assert found.C[:, column] == pytest.approx(seen, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("cut", ["auto", "all"])
def test_a_pendulum_on_a_driven_cart_has_its_transfer_function(cut):
    """A point mass on a rod of length L: θ/ẅ = −(1/L)/(s² + g/L), and the drive feels (M + m) ẅ + m L θ̈."""
    length, mass, cart = 0.5, 0.7, mbd.PointMass("cart", 2.0)
    model, bob = mbd.Model("driven", cut=cut), mbd.Link("bob", mass, length, length)
    rail = mbd.Prismatic("rail", model.ground.origin, cart.origin)
    model.connect(rail, mbd.Revolute("pin", cart.origin, bob.start))
    model.constrain(mbd.Bilateral("drive", rail, 0.3))
    state = mbd.assemble(model, backend=PLAIN)
    found = look(model, state, inputs="drive.value.acceleration", outputs=["pin.angle", "drive.force"])
    s = np.array([0.4 + 1.0j, 3.0j + 1.0])
    swing = -1.0 / (length * s**2 + 9.81)
    wanted = np.stack([swing, (2.0 + mass) + mass * length * s**2 * swing], axis=-1)[..., None]
    assert found.transfer(s) == pytest.approx(wanted, rel=1e-9)
    assert found.descriptor().transfer(s) == pytest.approx(wanted, rel=1e-9)
    assert found.x[-2:] == pytest.approx([0.3, 0.0]) and found.state_space.state_units[-2:] == ("m", "m/s")


def test_a_belt_acts_by_the_rate_of_its_speed():
    """A wheel on a belt of speed w, ẋ + r φ̇ + w = 0: m ẍ = F, I φ̈ = r F, so that ẍ = −I ẇ/(I + m r²)."""
    mass, radius, inertia = 2.0, 0.3, 0.11
    model, wheel = mbd.Model("belt"), mbd.RigidBody("wheel", mass, inertia)
    model.connect(mbd.Planar("roll", model.ground.origin, wheel.origin))
    model.constrain(mbd.Bilateral("road", mbd.height(wheel.origin), radius))
    grip = mbd.Nonholonomic(
        "belt", lambda x, turn: x + radius * turn, lambda t: 0.2 + 0.0 * t, ["roll.x.rate", "roll.angle.rate"]
    )
    model.constrain(grip)
    state = mbd.assemble(model, position={"roll.y": radius}, velocity={"roll.angle": 0.5}, backend=PLAIN)
    found = look(model, state, inputs="belt.bias.rate", outputs=["roll.x.rate", "roll.angle.rate", "belt.force"])
    assert found.states[-1] == "belt.bias" and found.x[-1] == 0.0
    assert found.descriptor().transfer(1.0 + 2.0j) == pytest.approx(found.transfer(1.0 + 2.0j))
    share = inertia / (inertia + mass * radius**2)
    free = found.states.index("roll.x.rate")
    assert found.state_space.input_units == ("m/s²",)
    assert found.B[-1, 0] == 1.0
    assert found.B[free, 0] == pytest.approx(-share)
    assert found.D[:, 0] == pytest.approx([0.0, 0.0, -mass * share])
    assert found.C[1, [free, -1]] == pytest.approx([-1.0 / radius, -1.0 / radius])
    for asked in "belt.bias", "belt.bias.acceleration":
        with pytest.raises(mbd.ModelError, match=r"'belt'.* acts by its rate; ask for the input 'belt.bias.rate'"):
            look(model, state, inputs=asked)


# choices that do not matter, and runs -------------------------------------------------------------------------------
def held_still(model, state, effort):
    """The efforts, parameters, that make a state at rest an equilibrium: of least norm."""
    found = look(model, state, inputs=effort)
    return dict(zip(effort, -np.linalg.pinv(found.B) @ reaction(found, found)[0], strict=True))


def loaded(seed, loop):
    """A planar tree or loop with springs, losses and a push on each body; where it is held; the pushes' parameters."""
    rng = random.Random(seed)
    model, places = random_loop(seed) if loop else (random_tree(seed, 3, spatial=False, most=4), {})
    for place, joint in enumerate(model.joints):
        if len(joint.labels) == 1:
            model.joints[place] = replace(joint, stiffness=rng.uniform(5.0, 20.0), loss=mbd.Viscous(0.3))
    moving = [body for name, body in model.bodies.items() if name != "ground"]
    for body in moving:
        model.apply(mbd.Applied(f"push {body.name}", body.origin, force=(0.0, 0.0), torque=0.0))
    parts = "force.x", "force.y", "torque.z"
    return model, places, [f"push {body.name}.{part}" for body in moving for part in parts]


@given(st.integers(0, 10**6), st.booleans())
@settings(max_examples=6)
def test_poles_and_transfer_functions_do_not_depend_on_the_cut(seed, loop):
    """At an equilibrium that forces and torques hold against gravity and springs."""
    model, places, effort = loaded(seed, loop)
    first, last = model.joints[0], model.joints[-1]
    start = mbd.assemble(model, position=places, backend=PLAIN)
    held = held_still(model, start, effort)
    outputs = [f"{last.child.full_name}.x", f"{last.parent.full_name}.vy", *first.coordinate_names]
    outputs += [f"{first.name}.reaction_force"]
    points, found = np.array([0.3 + 1j, 2.0 + 0.5j, 1.0 + 20.0j]), []
    for cut in "auto", "all", [last.name]:
        model.cut = cut
        state = mbd.assemble(model, position={name: start[name] for name in start.names}, backend=PLAIN)
        found.append(look(model, state, parameters=held, inputs=effort[-3:], outputs=outputs))
    poles, wanted = np.poly(found[0].state_space.poles), found[0].transfer(points)
    for other in found:
        whole = other.descriptor()
        assert whole.transfer(points) == pytest.approx(wanted, rel=1e-6, abs=1e-7 * (1 + np.max(np.abs(wanted))))
        assert other.is_equilibrium
        assert np.poly(other.state_space.poles) == pytest.approx(poles, rel=1e-6, abs=1e-6 * np.max(np.abs(poles)))
        assert other.transfer(points) == pytest.approx(wanted, rel=1e-6, abs=1e-8 * (1 + np.max(np.abs(wanted))))


def test_small_inputs_move_a_run_as_the_linear_equations_say():
    """A step of torque on a four-bar at rest, and a push by samples; what is left is of second order in the step."""
    from scipy.signal import lsim

    model = four_bar()
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    model.apply(mbd.Applied("push", model.joints[1].child, force=(mbd.Samples([0.0, 0.5], [0.0, 0.0]), 0.0)))
    state = mbd.assemble(model, position={"a.angle": 0.4}, backend=PLAIN)
    held = held_still(model, state, ["drive.torque"])
    outputs = ["b.angle", "coupler.end.vx", "d.reaction_force.y"]
    linear = look(model, state, parameters=held, inputs=["drive.torque", "push.force.x"], outputs=outputs)
    assert linear.is_equilibrium
    left = []
    for size in 2e-2, 1e-2:
        model.forces[-1] = replace(
            model.forces[-1], force=(mbd.Samples([0.0, 0.5], [0.0, 3.0 * size], kind="linear"), 0.0, 0.0)
        )
        stepped = {"drive.torque": held["drive.torque"] + size}
        run = mbd.simulate(model, state, mbd.RadauIIA(), dt=0.02, until=0.5, parameters=stepped)
        times = np.linspace(0.0, 0.5, 101)
        pushes = np.column_stack([np.full(101, size), 3.0 * size * times / 0.5])
        _, wanted, _ = lsim(linear.to_scipy(), pushes, times)
        seen = np.column_stack([run.at(times)[name] for name in outputs]) - linear.output_values
        assert np.max(np.abs(wanted), axis=0) == pytest.approx(np.max(np.abs(seen), axis=0), rel=0.1)
        left.append(np.max(np.abs(seen - wanted), axis=0))
    assert np.all(left[0] < 0.02) and left[0] / left[1] == pytest.approx(4.0, rel=0.3)


def test_coordinates_that_do_not_add_have_ports_too():
    """A turning top on a ball joint: B and D by parameters, A and C by small turns in its own axes."""
    model, body = mbd.Model("top"), mbd.RigidBody("top", 1.2, (0.02, 0.008, 0.02), center=(0.0, 0.3, 0.0))
    model.connect(QuaternionBall("ball", model.ground.origin, body.origin))
    tip = body.point(0.1, 0.5, 0.2, name="tip")
    model.apply(mbd.Applied("push", tip, force=(1.5, 2.0, 0.5), torque=(0.3, 0.1, 0.2), axes=body.origin))
    state = mbd.assemble(model, velocity={"ball.spin y": 3.0, "ball.spin x": 0.7}, backend=PLAIN)
    ports = {"inputs": ["push.force.x", "push.torque.z", "gravity.x"]}
    ports["outputs"] = ["top.tip", "top.tip.vy", "ball.reaction_force"]
    found = look(model, state, **ports)
    check_by_parameters(model, state, found, ports, ports["inputs"])
    configuration = found.instant.mechanism.equations.configuration
    for k, turn in enumerate(STEP * np.eye(3)):
        ends = [replace(state, q=configuration.compose(state.q, side * turn)) for side in (1, -1)]
        a, b = (look(model, end, **ports) for end in ends)
        assert found.C[:, k] == pytest.approx((a.output_values - b.output_values) / (2 * STEP), abs=1e-6)
        assert found.A[3:, k] == pytest.approx((a.drift - b.drift)[3:] / (2 * STEP), abs=1e-6)
    assert found.descriptor().transfer(2.0j + 1.0) == pytest.approx(found.transfer(2.0j + 1.0), abs=1e-9)
    assert found.descriptor().outputs == found.outputs and "d/dt ball.spin x" in repr(found.descriptor())
