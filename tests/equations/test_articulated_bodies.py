"""Accelerations of trees by articulated bodies are those of M, also in runs; where digits are lost M decides."""

import math
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.equal import DIRECT_PIVOT_RTOL
from tests.equations.mechanisms import random_tree
from tests.equations.test_states import model as pulled
from tests.space_scenes import JOINTS, scene


def both(model, start, seed, away=0.3):
    """ẋ, v̇, what pivots keep and v̇·M v̇ as the program has them, and −M⁻¹ f, at an increment from the start."""
    mechanism, rng = mechanism_of(model), np.random.default_rng(seed)
    layout, program, parameters = mechanism.layout, mechanism.free_rates(), mechanism.parameters()
    n, x = layout.n, away * rng.normal(size=layout.n_v)
    block = mechanism.block(0.3, start.q, rng.normal(size=n), np.zeros(layout.n_anchors))
    block[layout.x : layout.x + n] = x
    found = np.full(2 * n + 2, np.nan)
    program(block, parameters, found)
    terms = mechanism.terms_of(block, parameters)
    rates = np.linalg.solve(terms.M, -terms.f)
    return mechanism, x, block, found, rates, float(rates @ terms.M @ rates), np.linalg.cond(terms.M)


@given(st.sampled_from(list(JOINTS)), st.integers(0, 10**6))
@settings(max_examples=12, deadline=None)
def test_rates_of_random_trees_are_those_of_the_mass_matrix(joint, seed):
    case = scene("tree", joint, seed)
    mechanism, x, block, found, rates, pull, condition = both(case.model, case.start, seed)
    n = len(rates)
    allowed = 1e-13 * condition
    np.testing.assert_allclose(found[n : 2 * n], rates, rtol=0.0, atol=allowed * np.abs(rates).max())
    np.testing.assert_allclose(found[2 * n + 1], pull, rtol=10.0 * allowed)
    configuration, v = mechanism.equations.configuration, block[mechanism.layout.v : mechanism.layout.a][:n]
    np.testing.assert_allclose(found[:n], configuration.increment_rates(x, v), rtol=1e-12, atol=1e-12)
    assert 0.0 < found[2 * n] <= 1.0 + 1e-12


@given(st.integers(0, 10**6), st.integers(1, 5))
@settings(max_examples=8, deadline=None)
def test_so_are_those_of_planar_trees(seed, bodies):
    model = random_tree(seed, bodies, spatial=False, most=9)
    start = mbd.assemble(model)
    _, _, _, found, rates, pull, condition = both(model, start, seed)
    n = len(rates)
    np.testing.assert_allclose(found[n : 2 * n], rates, rtol=0.0, atol=1e-13 * condition * np.abs(rates).max())
    np.testing.assert_allclose(found[2 * n + 1], pull, rtol=1e-12 * condition)


@pytest.mark.parametrize("axes", [((0, 0, 1),), ((0, 0, 1), (0, 1, 0)), ((0, 0, 1), (0, 1, 0), (1, 0, 0))])
def test_what_pivots_keep_does_not_fall_with_the_number_of_joints(axes):
    model, before = mbd.Model("long chain"), None
    for k in range(24):
        bar = mbd.RigidBody(f"bar {k}", 1.0, (0.02, 0.1, 0.1), center=(0.5, 0.0, 0.0))
        end = model.ground.origin if before is None else before.point(1.0, 0.0, 0.0)
        model.connect(mbd.Revolute(f"joint {k}", end, bar.origin, axis=axes[k % len(axes)]))
        before = bar
    start = mbd.assemble(model, {f"joint {k}.angle": 0.1 for k in range(24)})
    assert both(model, start, 0)[3][-2] > DIRECT_PIVOT_RTOL


def runs(model, start, dt=0.01, until=0.2):
    """By articulated bodies, and by M alone."""
    by_bodies = mbd.simulate(model, start, mbd.RungeKutta853(), dt=dt, until=until)
    with mock.patch.object(Mechanism, "free_rates", return_value=None):
        return by_bodies, mbd.simulate(model, start, mbd.RungeKutta853(), dt=dt, until=until)


@pytest.mark.parametrize(
    ("joint", "seed", "adds"), [("spherical", 3, False), ("free", 3, False), ("revolute", 0, True)]
)
def test_runs_are_those_with_the_mass_matrix(joint, seed, adds):
    case = scene("tree", joint, seed)
    assert mechanism_of(case.model).vector is adds
    by_bodies, by_masses = runs(case.model, case.start)
    np.testing.assert_allclose(by_bodies.final.q, by_masses.final.q, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(by_bodies.final.v, by_masses.final.v, rtol=0.0, atol=1e-11)


def hanging(light, round_about):
    """A light bar on a ball joint, and a bar of 1 kg on the next, in line with it, with a radius of gyration."""
    model = mbd.Model("in line")
    upper = mbd.RigidBody("upper", light, (light, light, light), center=(0.0, -0.5, 0.0))
    lower = mbd.RigidBody("lower", 1.0, (round_about**2,) * 3, center=(0.0, -1.0, 0.0))
    model.connect(mbd.Spherical("hip", model.ground.origin, upper.origin))
    model.connect(mbd.Spherical("knee", upper.point(0.0, -1.0, 0.0), lower.origin))
    tilt = {"hip.orientation": (math.cos(0.2), 0.0, 0.0, math.sin(0.2))}
    return model, mbd.assemble(model, tilt, {"knee.angular_velocity": (0.1, 0.05, 0.2)})


def test_where_masses_differ_much_the_mass_matrix_and_the_balance_decide():
    model, start = hanging(1e-6, 1e-4)
    assert both(model, start, 0, 0.0)[3][-2] < DIRECT_PIVOT_RTOL
    by_bodies, by_masses = runs(model, start, 0.001, 0.01)
    assert np.array_equal(by_bodies.final.q, by_masses.final.q)
    assert np.array_equal(by_bodies.final.v, by_masses.final.v)


def test_a_light_body_above_a_ball_joint_loses_nothing_about_the_line_of_both():
    """What a ball joint passes on turns nothing about a joint in line with it, whatever it weighs."""
    model, start = hanging(1e-6, 0.3)
    assert both(model, start, 0, 0.0)[3][-2] > 0.01


def test_there_is_none_where_states_have_rates_too():
    assert mechanism_of(pulled()).free_rates() is None
