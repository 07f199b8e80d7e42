"""Tangents from quantities of branches are those of one forward sweep a column; the shorter way is taken."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.bodies.algebra import ZERO, axis_rotation
from mbd.bodies.base import Frame
from mbd.equations import derive, programs
from mbd.equations.equations import ActingForces
from mbd.equations.tangents import seeded
from mbd.joints.base import Joint, Label
from mbd.tape.node import Tape
from mbd.testing.mechanisms import random_loop, random_scene
from tests.equations.mechanisms import four_bar, furnished, leg, random_tree, walker
from tests.equations.numbers import at, inputs
from tests.equations.test_states import model as pulled
from tests.tape.counts import total


def flat(columns):
    return [entry for column in columns for entry in column]


def both(equations):
    """r, and the columns of S by sweeps and by branches, with every row, penalty and friction acting."""
    rows, frictions = range(len(equations.rows)), range(len(equations.frictions))
    penalties = [k for k, contact in enumerate(equations.contacts) if contact.kind == "penalty"]
    forces = programs._forces(equations, rows, [(c, equations.tape.one) for c in penalties], frictions)
    r = programs.balance_with(equations, rows, penalties, frictions)
    return r, seeded(equations, r), equations.geometry.tangent(forces)


def assert_same(equations, seed=0):
    _, swept, known = both(equations)
    point = inputs(equations, seed)
    S, branches = (at(flat(columns), point) for columns in (swept, known))
    np.testing.assert_allclose(branches, S, rtol=0.0, atol=1e-12 * np.abs(S).max())
    for one, other in zip(flat(known), flat(swept), strict=True):
        assert one.is_zero or not other.is_zero  # an elimination meets no entry that need not be there


@given(seed=st.integers(0, 10**6), bodies=st.integers(1, 5), kind=st.sampled_from(["tree", "scene", "furnished"]))
@settings(max_examples=25, deadline=None)
def test_branches_give_the_tangents_of_random_planar_trees(seed, bodies, kind):
    if kind == "scene":
        model = random_scene(seed, bodies)
    else:
        model = random_tree(seed, bodies, spatial=False, most=9)
        model = furnished(model, seed) if kind == "furnished" else model
    assert_same(derive(model), seed)


@pytest.mark.parametrize("make", [leg, walker, four_bar, lambda: four_bar("all"), lambda: random_loop(4)[0], pulled])
def test_branches_give_the_tangents_of_mechanisms(make):
    assert_same(derive(make()))


def test_a_moving_base_and_bodies_beyond_a_slide():
    model = mbd.Model("cart", gravity=(1.0, -9.81, 0.0))
    cart, arm = mbd.RigidBody("cart", 2.0, 0.3, center=(0.1, 0.2, 0.0)), mbd.Link("arm", 1.0, 0.8, 0.3, inertia=0.05)
    sleeve, tip = mbd.RigidBody("sleeve", 0.4, 0.01, center=(0.05, 0.0, 0.0)), mbd.Link("tip", 0.3, 0.5, 0.2, 0.01)
    model.connect(
        mbd.Planar("base", model.ground.origin, cart.origin),
        mbd.Revolute("shoulder", cart.point(0.2, 0.5), arm.start),
        mbd.Prismatic("slide", arm.end.turned(0.4), sleeve.point(0.1, 0.1), axis=(0.6, 0.8, 0.0)),
        mbd.Revolute("wrist", tip.start, sleeve.point(0.0, -0.2)),  # seen from the tip
    )
    model.constrain(mbd.Bilateral("drive", mbd.measure("base.x"), value=lambda t: 0.3 * mbd.sin(5.0 * t)))
    assert_same(derive(model))


@dataclass(frozen=True)
class Eccentric(Joint):
    """A planar joint of one coordinate that turns by q + q²."""

    name: str
    parent: Frame
    child: Frame
    loss: None = None

    @property
    def labels(self):
        return (Label("q", "rad"),)

    @property
    def is_planar(self):
        return True

    def transform(self, q, scope):
        return axis_rotation((0.0, 0.0, 1.0), q[0] + q[0] * q[0]), ZERO

    def subspace(self, q, scope):
        return [((0.0, 0.0, 1.0 + 2.0 * q[0]), ZERO)]

    def rows(self, R, p, scope):
        raise NotImplementedError

    recover = rows


def test_what_branches_do_not_know_is_seeded():
    spatial = derive(random_tree(5, 3, spatial=True))
    assert spatial.geometry.tangent(ActingForces()) is None
    model = mbd.Model("eccentric")
    links = [mbd.Link(name, 1.0, 0.5, 0.2, inertia=0.03) for name in ("upper", "lower")]
    model.connect(
        Eccentric("cam", model.ground.origin, links[0].start), mbd.Revolute("elbow", links[0].end, links[1].start)
    )
    assert derive(model).geometry.tangent(ActingForces()) is None


def chain(n):
    model = mbd.Model("chain")
    above = model.ground.origin
    for k in range(n):
        rod = mbd.Link(f"rod {k}", 1.0, 1.0, 0.5, 1.0 / 12.0)
        model.connect(mbd.Revolute(f"joint {k}", above, rod.start))
        above = rod.end
    return model


@pytest.mark.parametrize("make", [leg, walker, four_bar, lambda: chain(2), lambda: chain(10)])
def test_the_shorter_way_is_taken(make):
    equations = derive(make())
    rows = equations.bilateral
    r = programs.balance_with(equations, rows, ())
    forces = programs._forces(equations, rows, (), ())
    counts = [total([*r, *flat(S)]) for S in (seeded(equations, r), equations.geometry.tangent(forces))]
    taken = programs.tangent(equations, r, forces, ())
    assert total([*r, *flat(taken)]) == min(counts)


def test_a_chain_takes_operations_with_the_square_of_its_links_at_most():
    counts = [total(programs.newton(derive(chain(n)), programs.ActiveSet(stabilized=False))) for n in (10, 20, 40)]
    assert counts[1] < 1300 + 5 * 20**2 and counts[2] - 2 * counts[1] < 4.5 * (40**2 - 2 * 20**2)


def test_the_choice_does_not_depend_on_what_was_asked_before():
    def asked(*modes):
        equations = derive(leg())
        made = {mode: programs.newton(equations, programs.ActiveSet(mode)) for mode in modes}
        copy = Tape()
        return [str(node) for node in mbd.tape.derivatives.substitute(made[(0,)], {}, copy)]

    assert asked((0,), (0, 1)) == asked((0, 1), (), (0,))
