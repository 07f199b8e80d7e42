"""The small dense solvers of the kernel, against numpy."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from mbd.kernel.algebra.linear import eliminate, factor, solve, solve_again, solve_definite

sizes = st.integers(1, 9)
seeds = st.integers(0, 2**32 - 1)


def solved(A, b):
    flat, x, pivots = A.flatten(), b.copy(), np.zeros(len(b), dtype=np.int64)
    assert factor(flat, len(b), pivots) == 0
    solve(flat, len(b), pivots, x)
    return x


@given(n=sizes, seed=seeds)
def test_lu_solves_what_numpy_solves(n, seed):
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(n, n)), rng.normal(size=n)
    bound = 1e-13 * np.linalg.cond(A) * (1.0 + np.abs(b).max())
    np.testing.assert_allclose(A @ solved(A, b), b, rtol=0, atol=bound * np.abs(A).max())


@given(n=st.integers(2, 6), m=st.integers(1, 3), seed=seeds)
def test_lu_solves_saddle_point_systems_whose_mass_is_singular(n, m, seed):
    m = min(m, n - 1)
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    root[:, 0] = 0.0
    B = rng.normal(size=(m, n))
    B[0, 0] = 1.0 + abs(B[0, 0])
    K = np.block([[root.T @ root, B.T], [B, np.zeros((m, m))]])
    b = rng.normal(size=n + m)
    np.testing.assert_allclose(solved(K, b), np.linalg.solve(K, b), rtol=1e-6, atol=1e-7 * np.linalg.cond(K))


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_a_missing_pivot_is_told_by_its_column(value):
    A = np.eye(3)
    A[1, 1] = value
    assert factor(A.flatten(), 3, np.zeros(3, dtype=np.int64)) == 2


def eliminated(A, b, tolerance=1e-12):
    n = len(b)
    flat, x, columns, work = A.flatten(), b.copy(), np.zeros(n, dtype=np.int64), np.zeros(3 * n)
    rank = eliminate(flat, n, x, columns, work, tolerance)
    return rank, x, columns


@given(n=st.integers(2, 8), rank=st.integers(1, 8), seed=seeds)
def test_elimination_finds_the_rank_and_a_solution_of_consistent_equations(n, rank, seed):
    rank = min(rank, n)
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, rank)) @ rng.normal(size=(rank, n))
    b = A @ rng.normal(size=n)
    found, x, columns = eliminated(A, b, 1e-10)
    assert found == np.linalg.matrix_rank(A, tol=1e-9 * np.linalg.norm(A, 2))
    assert sorted(columns) == list(range(n))
    np.testing.assert_allclose(A @ x, b, rtol=0, atol=1e-8 * (1.0 + np.abs(b).max()))


@given(n=st.integers(2, 8), seed=seeds)
def test_elimination_tells_a_conflict(n, seed):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n - 1)) @ rng.normal(size=(n - 1, n))
    away = np.linalg.svd(A.T)[2][-1]  # A x never has a part along this
    found, _, _ = eliminated(A, A @ rng.normal(size=n) + 3.0 * away, 1e-10)
    assert found == -1 - (n - 1)


@given(n=sizes, seed=seeds)
def test_elimination_does_not_mind_the_units_of_rows_and_columns(n, seed):
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(n, n)) + 3.0 * np.eye(n), rng.normal(size=n)
    rows, columns = 10.0 ** rng.integers(-12, 12, n), 10.0 ** rng.integers(-12, 12, n)
    rank, x, _ = eliminated(rows[:, None] * A * columns, rows * b)
    assert rank == n
    np.testing.assert_allclose(columns * x, np.linalg.solve(A, b), rtol=1e-7, atol=1e-9)


@given(n=sizes, seed=seeds)
def test_definite_masses_are_solved_with(n, seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    M, b = root @ root.T + 0.1 * np.eye(n), rng.normal(size=n)
    flat, x = M.flatten(), b.copy()
    assert solve_definite(flat, n, x, np.zeros(n))
    bound = 1e-13 * np.linalg.cond(M) * (1.0 + np.abs(b).max())
    again = b.copy()
    solve_again(flat, n, again)
    for found in (x, again):
        np.testing.assert_allclose(M @ found, b, rtol=0, atol=bound * np.abs(M).max())


@given(n=st.integers(1, 12), seed=seeds)
def test_masses_of_a_tree_are_solved_from_its_tips_without_a_new_entry(n, seed):
    """Zeros between branches stay zeros; what is solved is what numpy solves."""
    rng = np.random.default_rng(seed)
    carriers = [int(rng.integers(-1, k)) for k in range(n)]
    J = np.zeros((n, n))  # rates of bodies by coordinates: of those on the way down
    for k in range(n):
        below = k
        while below >= 0:
            J[k, below] = rng.normal()
            below = carriers[below]
    M, b = J.T @ J + np.diag(rng.uniform(0.1, 1.0, n)), rng.normal(size=n)
    flat, x = M.flatten(), b.copy()
    assert solve_definite(flat, n, x, np.zeros(n)) > 0.0
    bound = 1e-13 * np.linalg.cond(M) * (1.0 + np.abs(b).max())
    np.testing.assert_allclose(M @ x, b, rtol=0, atol=bound * np.abs(M).max())
    assert not np.tril(flat.reshape(n, n))[M == 0.0].any()


@given(n=st.integers(2, 9), seed=seeds)
def test_masses_that_are_not_definite_are_refused(n, seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    root[-1] = root[0]
    signs = np.ones(n)
    signs[rng.integers(n)] = -1.0
    for M in (root @ root.T, np.diag(signs)):
        assert not solve_definite(M.flatten(), n, rng.normal(size=n), np.zeros(n))
