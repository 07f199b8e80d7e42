"""Tangents and Jacobians are the derivatives that they say they are."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from mbd.equations import derive
from mbd.equations.programs import accelerations, newton, residual
from tests.equations.mechanisms import four_bar, furnished, leg, random_tree, walker
from tests.equations.numbers import at, block, derivative, inputs

SCENES = {
    "leg": leg,
    "walker": walker,
    "four-bar": four_bar,
    "four-bar, all cut": lambda: four_bar("all"),
    "planar tree": lambda: furnished(random_tree(3, 3, spatial=False), 1),
    "spatial tree": lambda: furnished(random_tree(5, 3, spatial=True), 2),
}


def _newton_is_derivative_of_residual(equations, seed):
    rows = list(range(len(equations.rows)))
    penalties = [k for k, contact in enumerate(equations.contacts) if contact.kind == "penalty"]
    n, n_v, m = equations.n_v + equations.n_z, equations.n_v, len(rows)
    point = inputs(equations, seed, x=0.2)
    c0, c1 = point["c", 0], point["c", 1]
    for stabilized in False, True:
        sizes = ((n,), (m,), (m,)) if stabilized else ((n,), (m,))
        program = newton(equations, rows, penalties, stabilized)
        K, *rest = block(at(program, point), (n + m, n + m), *sizes)
        out = residual(equations, rows, penalties, stabilized)
        np.testing.assert_allclose(at(out, point), np.concatenate(rest), rtol=1e-12, atol=1e-12)
        for j in range(n):
            k = j - n_v
            along = {("a", j): 1.0, ("v", j): c0, ("x", j): c1} if k < 0 else {("s", k): 1.0, ("z", k): c0}
            change = derivative(out, point, along)
            np.testing.assert_allclose(K[:n, j], change[:n], rtol=1e-6, atol=1e-6)
            if stabilized:
                np.testing.assert_allclose(c0 * K[n:, j], change[n + m :], rtol=1e-6, atol=1e-6)
            else:
                np.testing.assert_allclose(c1 * K[n:, j], change[n : n + m], rtol=1e-6, atol=1e-6)
        for k in range(m):
            change = derivative(out, point, {("lam", k): 1.0})
            np.testing.assert_allclose(K[:n, n + k], change[:n], rtol=1e-9, atol=1e-9)
        assert not K[n:, n:].any()


@pytest.mark.parametrize("scene", SCENES)
def test_newton_matrix_is_the_derivative_of_the_residual(scene):
    _newton_is_derivative_of_residual(derive(SCENES[scene]()), 4)


@settings(max_examples=5)
@given(seed=st.integers(0, 10_000), spatial=st.booleans())
def test_newton_matrix_is_the_derivative_of_the_residual_on_random_trees(seed, spatial):
    model = furnished(random_tree(seed, 3, spatial, most=5), seed)
    _newton_is_derivative_of_residual(derive(model), seed)


@pytest.mark.parametrize("scene", SCENES)
def test_accelerations_program_is_the_linear_form_of_the_residual(scene):
    equations = derive(SCENES[scene]())
    n, n_v, R = equations.n_v + equations.n_z, equations.n_v, len(equations.rows)
    anchors = sum(len(contact.anchors) for contact in equations.contacts)
    point = inputs(equations, 7)
    values = at(accelerations(equations), point)
    sizes = ((n, n), (n,), (n, R), (R, n), (R,), (R,), (R,), (anchors,), (1,))
    M, f, Rm, B, h, hv, bias, captured, T = block(values, *sizes)
    penalties = [k for k, contact in enumerate(equations.contacts) if contact.kind == "penalty"]
    out = at(residual(equations, range(R), penalties, stabilized=True), point)
    rates = np.array([point["a", k] for k in range(n_v)] + [point["s", k] for k in range(equations.n_z)])
    lam = np.array([point["lam", k] for k in range(R)])
    v = np.array([point["v", k] for k in range(n_v)])
    np.testing.assert_allclose(M @ rates + f + Rm @ lam, out[:n], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(h, out[n : n + R], atol=1e-14)
    np.testing.assert_allclose(hv, out[n + R :], atol=1e-14)
    hv_nodes = [row.rate for row in equations.rows]
    motion = {("x", k): point["v", k] for k in range(n_v)} | {("t", 0): 1.0}
    np.testing.assert_allclose(hv, derivative([row.value for row in equations.rows], point, motion), atol=1e-7)
    np.testing.assert_allclose(bias, derivative(hv_nodes, point, motion), atol=1e-7)
    explicit = derivative([row.value for row in equations.rows], point, {("t", 0): 1.0})
    np.testing.assert_allclose(hv, B[:, :n_v] @ v + explicit, atol=1e-7)
    assert len(captured) == anchors
    assert T[0] == pytest.approx(0.5 * v @ M[:n_v, :n_v] @ v)
