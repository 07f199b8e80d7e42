"""Laws that the equations of every mechanism obey, whatever it is made of."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from mbd.equations import derive
from mbd.equations.programs import accelerations, constraint_jacobian, mass_matrix, scales
from tests.equations.mechanisms import four_bar, furnished, leg, random_tree, walker
from tests.equations.numbers import at, derivative, inputs

SCENES = {
    "leg": leg,
    "walker": walker,
    "four-bar": four_bar,
    "planar tree": lambda: furnished(random_tree(3, 4, spatial=False), 1),
    "spatial tree": lambda: furnished(random_tree(5, 3, spatial=True), 2),
}


@pytest.fixture(params=SCENES)
def equations(request):
    return derive(SCENES[request.param]())


def _mass(equations, point):
    n = equations.n_v
    return at([entry for column in mass_matrix(equations) for entry in column[:n]][: n * n], point).reshape(n, n)


def _speeds(equations, point):
    return np.array([point["v", k] for k in range(equations.n_v)])


def test_mass_matrix_is_symmetric_and_positive_semidefinite(equations):
    M = _mass(equations, inputs(equations, 1))
    np.testing.assert_allclose(M, M.T, rtol=1e-12, atol=1e-12)
    assert np.linalg.eigvalsh(M).min() > -1e-12 * np.abs(M).max()


def test_kinetic_energy_is_the_quadratic_form_of_the_mass_matrix(equations):
    point = inputs(equations, 2)
    v = _speeds(equations, point)
    assert at([equations.kinetic], point)[0] == pytest.approx(0.5 * v @ _mass(equations, point) @ v, rel=1e-12)


def test_forces_with_a_potential_are_its_gradient(equations):
    point = inputs(equations, 3)
    for effect in equations.effects:
        if effect.potential is not None:
            gradient = [derivative([effect.potential], point, {("x", k): 1.0})[0] for k in range(equations.n_v)]
            np.testing.assert_allclose(at(list(effect.generalized()), point)[: equations.n_v], gradient, atol=1e-7)


def test_potential_energy_is_the_sum_over_effects(equations):
    point = inputs(equations, 3)
    parts = [effect.potential for effect in equations.effects if effect.potential is not None]
    assert at([equations.potential], point)[0] == pytest.approx(at(parts, point).sum(), rel=1e-12)


def test_power_of_an_effect_is_that_of_its_generalized_forces(equations):
    point = inputs(equations, 4)
    v = _speeds(equations, point)
    for effect in equations.effects:
        if effect.power is not None:
            force = at(list(effect.generalized()), point)[: equations.n_v]
            assert at([effect.power], point)[0] == pytest.approx(-force @ v, rel=1e-10, abs=1e-12)
            if effect.kind == "loss":
                assert at([effect.power], point)[0] <= 0.0


def test_effects_make_up_the_balance(equations):
    """What is left without all effects is inertia alone, which vanishes at rest."""
    rest = inputs(equations, 5) | {(kind, k): 0.0 for kind in "va" for k in range(equations.n_v)}
    total = sum(at(list(effect.generalized()), rest) for effect in equations.effects if effect.contact < 0)
    np.testing.assert_allclose(at(list(equations.balance), rest), total, atol=1e-12)


def test_power_of_the_balance_is_the_change_of_energy_without_what_effects_give(equations):
    """``v · (M a + f) = d(T + V)/dt − Σ P`` for any motion."""
    point = inputs(equations, 6)
    v = _speeds(equations, point)
    motion = {("x", k): point["v", k] for k in range(equations.n_v)}
    motion |= {("v", k): point["a", k] for k in range(equations.n_v)}
    change = derivative([equations.kinetic, equations.potential], point, motion).sum()
    powers = [e.power for e in equations.effects if e.power is not None and e.contact < 0]
    given_power = at(powers, point).sum() if powers else 0.0
    work = v @ at(list(equations.balance), point)[: equations.n_v]
    assert work == pytest.approx(change - given_power, rel=1e-7, abs=1e-7)


@settings(max_examples=8)
@given(seed=st.integers(0, 10_000), spatial=st.booleans())
def test_energy_law_on_random_trees(seed, spatial):
    tree = derive(furnished(random_tree(seed, 3, spatial, most=5), seed))
    test_power_of_the_balance_is_the_change_of_energy_without_what_effects_give(tree)
    test_kinetic_energy_is_the_quadratic_form_of_the_mass_matrix(tree)
    test_effects_make_up_the_balance(tree)


def test_constraint_jacobian_is_the_derivative_of_the_rows(equations):
    point = inputs(equations, 7, x=0.1)
    rows = [row.value for row in equations.rows]
    B = constraint_jacobian(equations, range(len(rows)))
    for j in range(equations.n_v):
        change = derivative(rows, point, {("x", j): 1.0})
        np.testing.assert_allclose(at([line[j] for line in B], point), change, atol=1e-8)


def test_scales_bound_what_they_belong_to(equations):
    point = inputs(equations, 8)
    n, rows = equations.n_v + equations.n_z, len(equations.rows)
    sizes = at(scales(equations), point)
    assert len(sizes) == n + 2 * rows
    h = at([row.value for row in equations.rows] + [row.rate for row in equations.rows], point)
    assert (sizes[n:] >= np.abs(h) - 1e-15).all()
    out = at(accelerations(equations), point)
    M, f = out[: n * n].reshape(n, n), out[n * n : n * n + n]
    a = np.array([point["a", k] for k in range(equations.n_v)])
    Rm = out[n * n + n : n * n + n + n * rows].reshape(n, rows)
    lam = np.array([point["lam", k] for k in range(rows)])
    assert (sizes[:n] >= np.abs(M @ a + f + Rm @ lam) - 1e-12).all()


def test_coordinates_may_be_shared_between_chart_and_increment(equations):
    """Everything is evaluated at q ⊕ x."""
    point = inputs(equations, 9, x=0.3)
    together = point | {("q", k): point["q", k] + point["x", k] for k in range(equations.n_q)}
    together |= {("x", k): 0.0 for k in range(equations.n_v)}
    nodes = [*equations.balance, equations.kinetic, equations.potential, *(row.value for row in equations.rows)]
    np.testing.assert_allclose(at(nodes, point), at(nodes, together), rtol=1e-12, atol=1e-12)
