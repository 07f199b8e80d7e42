"""The recursion gives the same equations as sympy's Lagrange method on random small trees."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings, strategies as st
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols, msubs

import mbd
from mbd.equations import derive
from mbd.equations.programs import accelerations
from tests.equations.mechanisms import random_tree
from tests.equations.numbers import at, block, inputs

t = sp.Symbol("t")


class Floats:
    """A scope whose parameters are plain numbers, so that joints can be written out in sympy."""

    tape = None

    def parameter(self, owner, field, value):
        return value


def rotation_about(axis, angle):
    a = sp.Matrix(axis)
    skew = sp.Matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return sp.eye(3) + sp.sin(angle) * skew + (1 - sp.cos(angle)) * skew * skew


def joint_placement(joint, q):
    """R, p of a joint from its definition in the docstrings, independently of its code."""
    forward = joint.joint if joint.is_reversed else joint
    kind = type(forward).__name__
    R, p = sp.eye(3), sp.zeros(3, 1)
    if kind in ("Revolute", "Cylindrical", "Screw"):
        R = rotation_about(forward.axis, q[[label.name for label in forward.labels].index("angle")])
    if kind == "Screw":
        p = q[0] * forward.pitch / (2 * np.pi) * sp.Matrix(forward.axis)
    if kind in ("Prismatic", "Cylindrical"):
        p = q[[label.name for label in forward.labels].index("displacement")] * sp.Matrix(forward.axis)
    if kind == "Universal":
        R = rotation_about(forward.axis, q[0]) * rotation_about(forward.second_axis, q[1])
    if kind == "Planar":
        R, p = rotation_about((0, 0, 1), q[2]), sp.Matrix([q[0], q[1], 0])
    if kind == "Translation":
        p = sp.Matrix([q[forward.axes.index(a)] if a in forward.axes else 0 for a in "xyz"])
    return (R.T, -R.T * p) if joint.is_reversed else (R, p)


def frame_placement(frame):
    R = sp.Matrix(frame.rotation) if frame.rotation is not None else sp.eye(3)
    return R, sp.Matrix(frame.offset)


def lagrangian(model, edges, q):
    """T − V of the tree by absolute positions and rotations."""
    placements = {"ground": (sp.eye(3), sp.zeros(3, 1))}
    first, energy = 0, 0
    for joint in edges:
        R, p = placements[joint.parent.body.name]
        Rf, pf = frame_placement(joint.parent)
        Rj, pj = joint_placement(joint, q[first : first + len(joint.labels)])
        Rc, pc = frame_placement(joint.child)
        first += len(joint.labels)
        p = p + R * (pf + Rf * pj)
        R = R * Rf * Rj * Rc.T
        p = p - R * pc
        body = joint.child.body
        placements[body.name] = (R, p)
        mass = body.mass_properties(Floats())
        center = p + R * sp.Matrix(mass.center)
        v, W = center.diff(t), R.T * R.diff(t)
        omega = sp.Matrix([W[2, 1], W[0, 2], W[1, 0]])
        kinetic = mass.mass * v.dot(v) / 2 + (omega.T * sp.Matrix(mass.inertia) * omega)[0] / 2
        energy += kinetic + mass.mass * sp.Matrix(model.gravity).dot(center)
    return energy


@settings(max_examples=6)
@given(seed=st.integers(0, 10_000), spatial=st.booleans())
def test_equations_equal_those_of_sympy(seed, spatial):
    from mbd.topology.plan import plan

    model = random_tree(seed, 2 if spatial else 3, spatial, most=3 if spatial else 4)
    edges = plan(model).edges
    equations = derive(model)
    n = equations.n_v
    q = list(dynamicsymbols(f"q:{n}"))
    method = LagrangesMethod(lagrangian(model, edges, q), q)
    left = method.form_lagranges_equations()
    point = inputs(equations, seed)
    values = {sp.diff(x, t, 2): point["a", k] for k, x in enumerate(q)}
    values |= {sp.diff(x, t): point["v", k] for k, x in enumerate(q)}
    values |= {x: point["q", k] for k, x in enumerate(q)}
    expected = [float(entry) for entry in msubs(left, values)]
    np.testing.assert_allclose(at(list(equations.balance), point), expected, rtol=1e-9, atol=1e-9)


def test_both_front_doors_agree_on_a_double_pendulum():
    m, l, g = sp.symbols("m l g")
    a, b = mbd.Coordinate("a"), mbd.Coordinate("b")  # both from the vertical
    T = m * l**2 * (a.v**2 + b.v**2 / 2 + a.v * b.v * sp.cos(a.q - b.q))
    V = -m * g * l * (2 * sp.cos(a.q) + sp.cos(b.q))
    values = {m: 0.7, l: 0.4, g: 9.81}
    textbook = derive(mbd.Lagrangian("double pendulum", [a, b], T, V, parameters=values))
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
    assert equations.kinetic is not None
    assert pytest.approx(at([equations.output("kinetic_energy")], point)[0]) == at([equations.kinetic], point)[0]
