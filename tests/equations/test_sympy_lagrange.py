"""The recursion gives Lagrange's equations: those of sympy, and those of the positions-only route on the tape."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings, strategies as st
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols, msubs

import mbd
from mbd.equations import derive
from mbd.equations.programs import accelerations
from mbd.tape.derivatives import gradient, jvp
from mbd.tape.node import Node, Tape
from mbd.topology.plan import plan
from tests.equations.mechanisms import random_tree
from tests.equations.numbers import at, block, inputs


class Numbers:
    """A scope whose parameters are plain numbers."""

    def parameter(self, owner, field, value):
        return value


def about(axis, s, c):
    """Rodrigues' rotation from sine and cosine."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + s * skew + (1 - c) * (skew @ skew)


def placement(joint, q, sin, cos):
    """R, p of a joint from its definition in the docstrings, independently of its code."""
    forward = joint.joint if joint.is_reversed else joint
    value = dict(zip([label.name for label in forward.labels], q, strict=True))
    R, p = np.eye(3), np.zeros(3)
    match type(forward).__name__:
        case "Revolute":
            R = about(forward.axis, sin(q[0]), cos(q[0]))
        case "Cylindrical":
            R = about(forward.axis, sin(value["angle"]), cos(value["angle"]))
            p = value["displacement"] * np.array(forward.axis)
        case "Screw":
            R = about(forward.axis, sin(q[0]), cos(q[0]))
            p = q[0] * (forward.pitch / (2 * np.pi)) * np.array(forward.axis)
        case "Prismatic":
            p = q[0] * np.array(forward.axis)
        case "Universal":
            R = about(forward.axis, sin(q[0]), cos(q[0])) @ about(forward.second_axis, sin(q[1]), cos(q[1]))
        case "Planar":
            R, p = about((0, 0, 1), sin(value["angle"]), cos(value["angle"])), np.array([value["x"], value["y"], 0.0])
        case "Translation":
            p = np.array([value.get(axis, 0.0) for axis in "xyz"])
    return (R.T, -R.T @ p) if joint.is_reversed else (R, p)


def lagrangian(model, edges, q, sin, cos, rate):
    """T − V of a tree by absolute positions and rotations; `rate` differentiates arrays by time."""
    placed = {"ground": (np.eye(3), np.zeros(3))}
    first, energy = 0, 0
    for joint in edges:
        frames = [np.array(f.rotation or np.eye(3)) for f in (joint.parent, joint.child)]
        R, p = placed[joint.parent.body.name]
        Rj, pj = placement(joint, q[first : first + len(joint.labels)], sin, cos)
        first += len(joint.labels)
        p = p + R @ (np.array(joint.parent.offset) + frames[0] @ pj)
        R = R @ frames[0] @ Rj @ frames[1].T
        p = p - R @ np.array(joint.child.offset)
        body = joint.child.body
        placed[body.name] = (R, p)
        mass = body.mass_properties(Numbers())
        center = p + R @ np.array(mass.center)
        v, W = rate(center), R.T @ rate(R)
        omega = np.array([W[2, 1], W[0, 2], W[1, 0]])
        energy += 0.5 * mass.mass * (v @ v) + 0.5 * (omega @ np.array(mass.inertia) @ omega)
        energy += mass.mass * (np.array(model.gravity) @ center)
    return energy


def by_sympy(model, edges, point, n):
    """r by sympy's Lagrange method."""
    t, q = sp.Symbol("t"), list(dynamicsymbols(f"q:{n}"))
    rate = np.vectorize(lambda entry: sp.sympify(entry).diff(t), otypes=[object])
    left = LagrangesMethod(lagrangian(model, edges, q, sp.sin, sp.cos, rate), q).form_lagranges_equations()
    values = {sp.diff(x, t, 2): point["a", k] for k, x in enumerate(q)}
    values |= {sp.diff(x, t): point["v", k] for k, x in enumerate(q)} | {x: point["q", k] for k, x in enumerate(q)}
    return [float(entry) for entry in msubs(left, values)]


def by_positions(model, edges, point, n):
    """r by differentiating T − V on a tape of its own."""
    tape = Tape()
    q, v, a = ([tape.input(kind, k) for k in range(n)] for kind in "qva")
    motion = dict(zip(q, v, strict=True))
    rate = np.vectorize(
        lambda entry: jvp([entry], motion)[0] if isinstance(entry, Node) else tape.zero, otypes=[object]
    )
    L = lagrangian(model, edges, q, mbd.sin, mbd.cos, rate)
    momenta = jvp(gradient(L, v), motion | dict(zip(v, a, strict=True)))
    return at([p - f for p, f in zip(momenta, gradient(L, q), strict=True)], point)


def compared(model, route, seed, tolerance=1e-9):
    equations = derive(model)
    point = inputs(equations, seed)
    expected = route(model, plan(model).edges, point, equations.n_v)
    np.testing.assert_allclose(at(list(equations.balance), point), expected, rtol=tolerance, atol=tolerance)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("seed", "spatial"), [(1, True), (3, False), (6, False), (3, True)])
def test_equations_equal_those_of_sympy(seed, spatial):
    compared(random_tree(seed, 2, spatial, most=2, turned=0.0), by_sympy, seed)


@pytest.mark.slow
@settings(max_examples=20)
@given(seed=st.integers(0, 10_000), spatial=st.booleans())
def test_equations_equal_those_of_sympy_on_more_trees(seed, spatial):
    compared(random_tree(seed, 2, spatial, most=3), by_sympy, seed)


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), spatial=st.booleans())
def test_equations_equal_those_of_the_positions_only_route(seed, spatial):
    compared(random_tree(seed, 4, spatial), by_positions, seed)


def test_both_front_doors_agree_on_a_double_pendulum():
    m, L, g = sp.symbols("m L g")
    a, b = mbd.Coordinate("a"), mbd.Coordinate("b")  # both from the vertical
    T = m * L**2 * (a.v**2 + b.v**2 / 2 + a.v * b.v * sp.cos(a.q - b.q))
    V = -m * g * L * (2 * sp.cos(a.q) + sp.cos(b.q))
    textbook = derive(mbd.Lagrangian("double pendulum", [a, b], T, V, parameters={m: 0.7, L: 0.4, g: 9.81}))
    model = mbd.Model("double pendulum")
    links = [mbd.Link(name, mass=0.7, length=0.4, center=0.4) for name in ("upper", "lower")]
    model.connect(
        mbd.Revolute("a", model.ground.origin, links[0].start), mbd.Revolute("b", links[0].end, links[1].start)
    )
    bodies = derive(model)
    q, v, acceleration = np.random.default_rng(0).normal(size=(3, 2))
    change = np.array([[1.0, 0.0], [1.0, 1.0]])  # absolute from relative angles

    def point(equations, q, v, acceleration):
        named = {("q", k): q[k] for k in range(2)} | {("v", k): v[k] for k in range(2)}
        return inputs(equations) | named | {("a", k): acceleration[k] for k in range(2)}

    relative = at(list(bodies.balance), point(bodies, q, v, acceleration))
    absolute = at(list(textbook.balance), point(textbook, change @ q, change @ v, change @ acceleration))
    np.testing.assert_allclose(relative, change.T @ absolute, rtol=1e-12)


def test_mass_matrix_of_the_textbook_double_pendulum():
    a, b = mbd.Coordinate("a"), mbd.Coordinate("b")
    T = a.v**2 + b.v**2 / 2 + a.v * b.v * sp.cos(a.q - b.q)
    equations = derive(mbd.Lagrangian("double pendulum", [a, b], T))
    point = inputs(equations, 3)
    M = block(at(accelerations(equations)[:4], point), (2, 2))[0]
    c = np.cos(point["q", 0] - point["q", 1])
    np.testing.assert_allclose(M, [[2.0, c], [c, 1.0]], rtol=1e-14)
