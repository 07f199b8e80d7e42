"""Tangents of trees eliminated from the tips solve as the matrix does, also in runs and with losses and drives."""

import random
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanism import Mechanism
from mbd.equations import derive
from mbd.equations.equations import ActingForces
from mbd.equations.programs import MIN_COORDINATES, ActiveSet, balance_with
from mbd.equations.tangents import seeded
from tests.equations.mechanisms import random_tree
from tests.equations.numbers import at, inputs


def tree(seed, bodies, spatial):
    """A tree on hinges, some of which have springs, losses and drives."""
    rng, model, ends = random.Random(seed), mbd.Model("tree"), []
    for k in range(bodies):
        bar = mbd.RigidBody(f"bar {k}", rng.uniform(0.5, 2.0), (0.1, 0.2, 0.3), center=(0.5, 0.1, 0.0))
        before = rng.choice(ends[-3:]) if ends else model.ground.origin
        axis = rng.choice([(0, 0, 1), (0, 1, 0), (1, 0, 1)]) if spatial else (0, 0, 1)
        made = mbd.Spherical if spatial and rng.random() < 0.3 else mbd.Revolute
        words = {} if made is mbd.Spherical else {"axis": axis}
        if words and rng.random() < 0.5:
            words |= {"stiffness": 3.0, "rest": 0.2, "loss": mbd.Viscous(0.3) + mbd.Quadratic(0.2)}
        joint = made(f"joint {k}", before, bar.origin, **words)
        model.connect(joint)
        if made is mbd.Revolute and rng.random() < 0.3:
            name = f"joint {k}.angle"
            model.apply(mbd.Motor(f"drive {k}", joint, lambda t, x: mbd.sin(t) * x * x, arguments=["t", name]))
        ends.append(bar.point(1.0, 0.0, 0.3 if spatial else 0.0))
    return model


def both(model, seed):
    """y of S y = b by elimination and by the matrix, with the matrix and whether all pivots were sound."""
    equations, rng = derive(model), np.random.default_rng(seed)
    n, tape = equations.n_v, equations.tape
    S = seeded(equations, balance_with(equations, (), ()))
    found = equations.geometry.eliminated(ActingForces())
    b = rng.normal(size=n)
    point = inputs(equations, seed) | {("view", 10**6 + k): b[k] for k in range(n)}
    matrix = at([entry for column in S for entry in column], point).reshape(n, n).T
    y = at(found.solve([tape.input("view", 10**6 + k) for k in range(n)]), point)
    return y, np.linalg.solve(matrix, b), matrix, at([found.sound], point)[0]


@pytest.mark.parametrize("spatial", [False, True])
@given(st.integers(0, 10**6), st.integers(1, 7))
@settings(max_examples=15, deadline=None)
def test_elimination_solves_as_the_matrix_does(spatial, seed, bodies):
    y, known, matrix, _ = both(tree(seed, bodies, spatial), seed)
    np.testing.assert_allclose(y, known, rtol=0.0, atol=1e-13 * np.linalg.cond(matrix) * np.abs(known).max())


@given(st.integers(0, 10**6), st.integers(1, 5), st.booleans())
@settings(max_examples=15, deadline=None)
def test_so_it_does_with_joints_of_every_kind(seed, bodies, spatial):
    y, known, matrix, _ = both(random_tree(seed, bodies, spatial=spatial, most=12), seed)
    np.testing.assert_allclose(y, known, rtol=0.0, atol=1e-13 * np.linalg.cond(matrix) * np.abs(known).max())


def test_welded_bodies_pass_on_what_acts_beyond_them():
    model, before = mbd.Model("welded"), None
    for k in range(6):
        rod = mbd.Link(f"rod {k}", length=1.0, **mbd.rod(mass=1.0, length=1.0).link)
        joint = mbd.Weld if k in (0, 2, 3, 5) else mbd.Revolute
        model.connect(joint(f"joint {k}", before.end if before else model.ground.origin, rod.start))
        before = rod
    y, known, matrix, _ = both(model, 1)
    np.testing.assert_allclose(y, known, rtol=0.0, atol=1e-13 * np.linalg.cond(matrix) * np.abs(known).max())


def test_pivots_of_a_long_chain_are_sound():
    model, before = mbd.Model("long chain"), None
    for k in range(200):
        rod = mbd.Link(f"rod {k}", length=1.0, **mbd.rod(mass=1.0, length=1.0).link)
        model.connect(mbd.Revolute(f"hinge {k}", before.end if before else model.ground.origin, rod.start))
        before = rod
    equations = derive(model)
    found = equations.geometry.eliminated(ActingForces())
    assert equations.geometry.largest_tree == 200
    point = inputs(equations, 0) | {("c", 0): 5e-4, ("c", 1): 2.5e-7}
    assert at([found.sound], point)[0] == 1.0


def test_a_force_that_follows_other_joints_is_no_sum_over_joints():
    model = tree(0, 3, spatial=False)
    model.apply(mbd.Motor("far", model.joints[0], lambda x: -2.0 * x, arguments=["joint 2.angle"]))
    assert derive(model).geometry.eliminated(ActingForces()) is None


@pytest.mark.parametrize("spatial", [False, True])
def test_runs_are_those_with_the_matrix(spatial):
    model, scheme = tree(4, MIN_COORDINATES, spatial), mbd.HHT(alpha=0.1)
    start = mbd.assemble(model, velocity={"joint 0.angle": 0.5} if not spatial else {})
    found = mbd.simulate(model, start, scheme, dt=2e-3, until=0.1)
    with mock.patch.object(Mechanism, "_straight", return_value=None):
        known = mbd.simulate(tree(4, MIN_COORDINATES, spatial), start, scheme, dt=2e-3, until=0.1)
    for k in range(MIN_COORDINATES):
        for axis in "xyz":
            name = f"bar {k}.center.{axis}"
            np.testing.assert_allclose(found[name], known[name], rtol=0.0, atol=1e-9)


def test_steps_of_a_chain_use_it_and_those_of_small_trees_do_not():
    def uses(chains, links):
        model = mbd.Model(f"{chains} chains of {links}")
        for c in range(chains):
            before = model.ground.point(float(c), 0.0)
            for k in range(links):
                rod = mbd.Link(f"rod {c}-{k}", length=1.0, **mbd.rod(mass=1.0, length=1.0).link)
                model.connect(mbd.Revolute(f"hinge {c}-{k}", before, rod.start))
                before = rod.end
        return Mechanism(derive(model)).stepping(ActiveSet()).correction is not None

    assert uses(1, 32)
    assert not uses(32, 1)
    assert not uses(8, 4)
