"""Lemke's method: it solves what has a solution, says what has none, interpreted and compiled."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from mbd.kernel.lemke import LCP_BOUND, LCP_NOT_FINITE, LCP_RAY, LCP_SOLVED, lemke
from tests.kernel.complementarity import compiled, enumerated, is_solution, root, solved

sizes = st.integers(1, 8)
seeds = st.integers(0, 2**32 - 1)


@given(n=sizes, seed=seeds)
def test_a_positive_definite_problem_has_the_one_solution_that_enumeration_finds(n, seed):
    rng = np.random.default_rng(seed)
    J = root(rng, n, n + 2)
    M, q = J @ J.T, rng.normal(size=n)
    status, z = solved(M, q)
    assert status == LCP_SOLVED and is_solution(M, q, z)
    np.testing.assert_allclose(z, next(enumerated(M, q)), rtol=1e-6, atol=1e-7)


@given(n=sizes, seed=seeds)
def test_an_unsymmetric_p_matrix_has_the_one_solution_that_enumeration_finds(n, seed):
    """Diagonally dominant by rows with a positive diagonal, then scaled: a P-matrix."""
    rng = np.random.default_rng(seed)
    M = rng.normal(size=(n, n))
    np.fill_diagonal(M, 0.0)
    M = (M + np.diag(np.abs(M).sum(axis=1) + rng.uniform(0.1, 1.0, n))) * 10.0 ** rng.integers(-2, 3, n)
    q = rng.normal(size=n)
    status, z = solved(M, q)
    assert status == LCP_SOLVED
    np.testing.assert_allclose(z, next(enumerated(M, q)), rtol=1e-6, atol=1e-9 * (1.0 + np.abs(z).max()))


@given(n=st.integers(2, 8), rank=st.integers(1, 4), copies=st.integers(0, 4), seed=seeds)
def test_copies_of_rows_are_no_obstacle_and_forces_on_the_mechanism_are_unique(n, rank, copies, seed):
    """M = J Jᵀ of lower rank with q in its range plus a slack: there is a solution, and Jᵀ z is the same for each."""
    rng = np.random.default_rng(seed)
    J = root(rng, n, rank)
    J = np.vstack([J, J[rng.integers(0, n, copies)]])
    q = J @ rng.normal(size=rank)
    q[: n // 2] = np.maximum(q[: n // 2], 0.0)
    M = J @ J.T
    status, z = solved(M, q)
    found = next(enumerated(M, q), None) if len(q) <= 8 else None
    if status == LCP_SOLVED:
        assert is_solution(M, q, z)
        if found is not None:
            np.testing.assert_allclose(J.T @ z, J.T @ found, rtol=0, atol=1e-6 * (1.0 + np.abs(found).max()))
    else:
        assert status == LCP_RAY and found is None


@given(n=st.integers(1, 6), seed=seeds)
def test_stops_on_either_side_without_play_hold_in_spite_of_round_off(n, seed):
    """J v ≥ 0 and −J v ≥ 0: only v = 0 on these rows is left, which round-off alone makes impossible."""
    rng = np.random.default_rng(seed)
    J = root(rng, n, n + 1)
    J = np.vstack([J, -rng.uniform(0.5, 2.0, (n, 1)) * J])
    M, q = J @ J.T, J @ rng.normal(size=n + 1)
    status, z = solved(M, q)
    assert status == LCP_SOLVED and is_solution(M, q, z)
    np.testing.assert_allclose(M @ z + q, 0.0, rtol=0, atol=1e-7 * (1.0 + np.abs(q).max()))


@given(n=st.integers(2, 8), seed=seeds)
def test_resting_contacts_whose_gaps_are_zero_do_not_cycle(n, seed):
    """Many zeros in q, small whole numbers in M, so that nearly every ratio ties."""
    rng = np.random.default_rng(seed)
    J = rng.integers(-1, 2, size=(n, 3)).astype(float)
    M = J @ J.T
    q = M @ rng.integers(0, 2, n) * -1.0 + rng.integers(0, 2, n) * (rng.uniform(size=n) < 0.3)
    status, z = solved(M, q)
    assert status == LCP_SOLVED and is_solution(M, q, z)


def test_the_example_that_cycles_without_a_rule_against_it_is_solved():
    """Kostreva, Math. Programming 16 (1979) 127: a degenerate problem of three unknowns."""
    M, q = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]]), np.array([-1.0, -1.0, -1.0])
    status, z = solved(M, q)
    assert status == LCP_SOLVED
    np.testing.assert_allclose(z, [1 / 3, 1 / 3, 1 / 3], atol=1e-14)


@given(n=st.integers(1, 8), rank=st.integers(1, 3), seed=seeds)
def test_what_cannot_be_satisfied_ends_in_a_ray(n, rank, seed):
    """A row of zeros with q < 0, and two opposite rows that both ask to be pushed."""
    rng = np.random.default_rng(seed)
    J = root(rng, n, rank)
    J = np.vstack([J, -J[:1]])
    q = rng.normal(size=n + 1)
    q[0] = q[n] = -1.0
    status, z = solved(J @ J.T, q)
    assert status == LCP_RAY and not z.any()
    J[0] = 0.0
    q[n] = 1.0
    assert solved(J @ J.T, q)[0] == LCP_RAY


@given(n=sizes, seed=seeds)
def test_units_of_rows_and_unknowns_do_not_matter(n, seed):
    rng = np.random.default_rng(seed)
    J, scale = root(rng, n, n + 2), 10.0 ** rng.integers(-9, 9, n)
    M, q = J @ J.T, rng.normal(size=n)
    status, z = solved(scale[:, None] * M * scale, 1e5 * scale * q)
    assert status == LCP_SOLVED
    np.testing.assert_allclose(scale * z / 1e5, solved(M, q)[1], rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("n", [40, 60])
def test_large_problems(n):
    rng = np.random.default_rng(n)
    for rank in (n + 5, n // 2):
        J = root(rng, n, rank)
        z0 = np.maximum(rng.normal(size=n), 0.0)
        M = J @ J.T
        q = np.where(z0 > 0.0, 0.0, rng.uniform(size=n)) - M @ z0
        status, z = solved(M, q)
        assert status == LCP_SOLVED and is_solution(M, q, z)
        np.testing.assert_allclose(J.T @ z, J.T @ z0, rtol=0, atol=1e-7 * n)


# ends ---------------------------------------------------------------------------------------------------------------
def test_nothing_to_push_and_nothing_at_all():
    assert solved(np.eye(3), np.array([0.0, 1.0, 2.0]))[0] == LCP_SOLVED
    assert not solved(np.eye(3), np.array([0.0, 1.0, 2.0]))[1].any()
    assert lemke(np.zeros(0), 0, np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64), 9) == LCP_SOLVED


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_told(value):
    M, q = np.eye(2), np.array([-1.0, 1.0])
    M[1, 0] = value
    assert solved(M, q)[0] == LCP_NOT_FINITE
    assert solved(np.eye(2), np.array([-1.0, value]))[0] == LCP_NOT_FINITE


def test_the_bound_on_pivots_is_told():
    rng = np.random.default_rng(3)
    J = root(rng, 8, 9)
    assert solved(J @ J.T, -np.arange(1.0, 9.0), most=1)[0] == LCP_BOUND


# machine code -------------------------------------------------------------------------------------------------------
@settings(max_examples=30)
@given(n=st.integers(1, 12), rank=st.integers(1, 12), seed=seeds)
def test_machine_code_takes_the_same_path(n, rank, seed):
    rng = np.random.default_rng(seed)
    J = root(rng, n, min(rank, n))
    M, q = J @ J.T, rng.normal(size=n)
    plain, fast = solved(M, q), solved(M, q, function=compiled())
    assert plain[0] == fast[0]
    np.testing.assert_allclose(fast[1], plain[1], rtol=1e-9, atol=1e-9 * (1.0 + np.abs(plain[1]).max()))
