"""Tangents and Jacobians are the derivatives that they say they are."""

import numpy as np
import pytest

from mbd.equations import derive
from mbd.equations.programs import ActiveSet, accelerations, residual
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


@pytest.mark.parametrize("scene", SCENES)
def test_accelerations_program_is_the_linear_form_of_the_residual(scene):
    equations = derive(SCENES[scene]())
    n, n_v, R = equations.n_v + equations.n_z, equations.n_v, len(equations.rows)
    point = inputs(equations, 7)
    values = at(accelerations(equations), point)
    sizes = ((n, n), (n,), (n, R), (R, n), (R,), (R,), (R,), (equations.n_anchors,), (1,))
    M, f, Rm, B, h, hv, bias, captured, T = block(values, *sizes)
    penalties = [k for k, contact in enumerate(equations.contacts) if contact.kind == "penalty"]
    out = at(residual(equations, ActiveSet(range(R), penalties)), point)
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
    assert len(captured) == equations.n_anchors
    assert T[0] == pytest.approx(0.5 * v @ M[:n_v, :n_v] @ v)
