"""Factors in an order chosen beforehand: the solutions of numpy, or none where a pivot is not sound."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import mbd
from mbd.compile import orders
from mbd.compile.mechanisms import mechanism_of
from mbd.compile.orders import flat_order
from mbd.equal import DIRECT_PIVOT_RTOL, HALF_PRECISION_RTOL
from mbd.equations.programs import ActiveSet
from mbd.kernel.algebra.ordered import (
    OF_ACCELERATIONS,
    OF_TANGENT,
    SYMMETRIC,
    factor_ordered,
    order_at,
    solve_kkt,
    weakest_pivot,
)
from mbd.kernel.records import Kernel
from mbd.tape.ordering import Order, order
from tests.simulation.singular_linkages import four_bars

pytestmark = pytest.mark.usefixtures("made_afresh")  # of programs that are made in other ways


def saddle(rng, n, m, density=0.2):
    """M, R and B with few entries; M definite, rows independent."""
    root = np.where(rng.random((n, n)) < density / 2.0, rng.normal(size=(n, n)), 0.0)
    M = root @ root.T + np.diag(rng.uniform(0.5, 2.0, n))
    B = np.where(rng.random((m, n)) < density, rng.normal(size=(m, n)), 0.0)
    B[np.arange(m), rng.permutation(n)[:m]] += 3.0
    R = B.T * (1.0 + 0.2 * rng.random((n, m)))
    return M, R, B


def matrix(M, R, B):
    return np.block([[M, R], [B, np.zeros((len(B), len(B)))]])


def kernel(A, n, m):
    """What of the kernel these functions use, with an order for the entries of A; half of the rows are not active."""
    size, n_rows = n + m, 2 * m
    rows = list(range(1, n_rows, 2))
    places = {(int(i), int(j)) for i, j in np.argwhere(A != 0.0)}
    flat = flat_order(order(places, set(), n, size), places, n, n_rows, rows)
    return Kernel(
        n=n, state=np.zeros(24, dtype=np.int64), limits=np.zeros(24, dtype=np.int64), n_modes=1,
        mode_order=np.array([1]), orders=np.append(0, flat),
        rows=np.array([*rows, 0]), kkt=np.zeros(size * size), spare=np.full(2 * size * size + size, np.nan),
        pivots=np.zeros(size, dtype=np.int64),
    )  # fmt: skip


def accelerations(M, R, B):
    """The start of the output of the program, with rows that are not active between."""
    n, m = R.shape
    whole_R, whole_B = np.full((n, 2 * m), 7.0), np.full((2 * m, n), 7.0)
    whole_R[:, 1::2], whole_B[1::2] = R, B
    return np.concatenate([M.ravel(), np.zeros(n), whole_R.ravel(), whole_B.ravel()])


def assert_solves(K, A, rng):
    x = rng.normal(size=len(A))
    b = A @ x
    solve_kkt(K, len(A), b)
    np.testing.assert_allclose(b, x, rtol=0, atol=1e-13 * np.linalg.cond(A) * (1.0 + np.abs(x).max()))


@given(n=st.integers(4, 16), m=st.integers(0, 6), seed=st.integers(0, 2**32 - 1))
def test_sound_factors_solve_what_dense_ones_do(n, m, seed):
    m, rng = min(m, n // 2), np.random.default_rng(seed)
    M, R, B = saddle(rng, n, m)
    A = matrix(M, R, B)
    K = kernel(A, n, m)
    o = order_at(K, m)
    assert o == 1
    if factor_ordered(K, A.ravel(), o, OF_TANGENT, DIRECT_PIVOT_RTOL):
        assert_solves(K, A, rng)
        assert weakest_pivot(K) > 0.0 or m == 0
    acc = accelerations(M, R, B)
    if factor_ordered(K, acc, o, OF_ACCELERATIONS, DIRECT_PIVOT_RTOL):
        assert_solves(K, A, rng)
    if factor_ordered(K, acc, o, SYMMETRIC, DIRECT_PIVOT_RTOL):
        assert_solves(K, matrix(M, B.T, B), rng)


def test_matrices_of_mechanisms_of_like_masses_are_sound_in_their_order():
    for seed in range(60):
        rng, n = np.random.default_rng(seed), 4 + seed % 13
        M, R, B = saddle(rng, n, min(seed % 7, n // 2))
        K = kernel(matrix(M, R, B), n, len(B))
        assert factor_ordered(K, matrix(M, R, B).ravel(), 1, OF_TANGENT, DIRECT_PIVOT_RTOL)
        for source in (OF_ACCELERATIONS, SYMMETRIC):
            assert factor_ordered(K, accelerations(M, R, B), 1, source, DIRECT_PIVOT_RTOL)


@given(n=st.integers(4, 12), m=st.integers(1, 4), seed=st.integers(0, 2**32 - 1))
def test_symmetric_saddles_of_definite_masses_need_no_search(n, m, seed):
    rng = np.random.default_rng(seed)
    M, _, B = saddle(rng, n, min(m, n // 2))
    A = matrix(M, B.T, B)
    K = kernel(A, n, len(B))
    assert factor_ordered(K, A.ravel(), 1, OF_TANGENT, HALF_PRECISION_RTOL)
    assert_solves(K, A, rng)


@given(n=st.integers(6, 12), seed=st.integers(0, 2**32 - 1), apart=st.sampled_from([0.0, 1e-12, 1e-10]))
def test_rows_that_nearly_depend_on_each_other_are_not_sound(n, seed, apart):
    rng = np.random.default_rng(seed)
    M, _, B = saddle(rng, n, 3, 0.4)
    B[2] = B[0] - B[1] + apart * rng.normal(size=n) * (B[0] != 0.0)
    A = matrix(M, B.T, B)
    K = kernel(A, n, 3)
    assert not factor_ordered(K, A.ravel(), 1, OF_TANGENT, HALF_PRECISION_RTOL)
    assert K.order_start == 0


@pytest.mark.parametrize("wrong", [0.0, np.nan, np.inf])
def test_a_pivot_that_is_no_number_or_nothing_is_not_sound(wrong):
    rng = np.random.default_rng(1)
    A = matrix(*saddle(rng, 6, 2))
    K = kernel(A, 6, 2)
    A[3, 3] = wrong
    A[3, :3] = A[:3, 3] = 0.0
    assert not factor_ordered(K, A.ravel(), 1, OF_TANGENT, HALF_PRECISION_RTOL)


def test_an_order_is_for_its_own_rows_only():
    K = kernel(matrix(*saddle(np.random.default_rng(2), 6, 2)), 6, 2)
    assert order_at(K, 2) == 1
    assert order_at(K, 1) == 0
    K.rows[0] = 2
    assert order_at(K, 2) == 0


# runs ---------------------------------------------------------------------------------------------------------------
LOOPS = 12
SCHEMES = (
    mbd.GeneralizedAlpha(0.9),
    mbd.GeneralizedAlpha(0.5, formulation="index3"),
    mbd.RungeKutta853(),
    mbd.RadauIIA(),
)


def fall(scheme):
    """A row of four-bars from upright through the poses in which the couplers lie on the cranks."""
    return mbd.simulate(*four_bars(LOOPS).start, scheme, dt=1e-2, until=1.2)


def assert_same_run(one, two):
    for name in ("steps", "iterations", "singular_steps", "shortened"):
        assert one.stats[name] == two.stats[name], name
    a, b = one.record, two.record
    for part, bound in (("time", 1e-12), ("q", 1e-9), ("v", 1e-8), ("lam", 1e-4)):
        scale = max(1.0, float(np.max(np.abs(getattr(b, part)), initial=0.0)))
        np.testing.assert_allclose(getattr(a, part), getattr(b, part), rtol=0, atol=bound * scale, err_msg=part)


@pytest.mark.parametrize("stabilized", [False, True])
def test_a_tangent_touches_what_its_order_asks_for_alone(stabilized):
    """Which grows with the number of loops, while the matrix grows with its square."""
    touched = []
    for loops in (LOOPS, 2 * LOOPS):
        mechanism = mechanism_of(four_bars(loops).start[0])
        mode = mechanism.mode(ActiveSet(tuple(range(mechanism.layout.n_rows)), (), stabilized, (), ()))
        n, m, n_v = mechanism.layout.n, mechanism.layout.n_rows, mechanism.layout.n_v
        block = np.random.default_rng(loops).uniform(-1.0, 1.0, mechanism.layout.size)
        out, cleared = np.full(mode.tangent.size, np.nan), np.zeros(mode.tangent.size)
        mode.tangent(block, mechanism.parameters(), out)
        mode.tangent(block, mechanism.parameters(), cleared)
        known, tail = ~np.isnan(out), mode.active.tail(n)
        np.testing.assert_array_equal(out[known], cleared[known])
        assert not cleared[~known].any()
        assert known[np.concatenate(orders.written(mode.order, n, n_v, stabilized))].all()
        assert known[(n + m) ** 2 : (n + m) ** 2 + tail].all()
        touched.append(int(np.count_nonzero(known)))
    assert touched[1] < 2.1 * touched[0] < 0.5 * mode.tangent.size


@pytest.mark.sampled(2)
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_a_chain_of_loops_moves_as_with_dense_factors(scheme, monkeypatch):
    ordered = fall(scheme)
    assert ordered.stats["compiled"]
    assert ordered.stats["pivoted"] == 0
    monkeypatch.setattr(orders, "MIN_UNKNOWNS", 10**9)
    assert_same_run(ordered, fall(scheme))


@pytest.mark.parametrize("scheme", SCHEMES[:1] + SCHEMES[2:3], ids=repr)
def test_where_no_pivot_of_the_order_is_sound_pivots_are_searched_for(scheme, monkeypatch):
    def multipliers_first(places, numbers, coordinates, size):
        turns = tuple(reversed(range(size)))
        return Order(turns, turns, (tuple(range(size)),) * size, 0)

    ordered = fall(scheme)
    monkeypatch.setattr(orders, "order", multipliers_first)
    searched = fall(scheme)
    assert searched.stats["pivoted"] == searched.stats["factorizations"]
    assert_same_run(searched, ordered)


def test_small_mechanisms_have_no_order_and_long_chains_of_loops_have_one():
    for count, expected in ((2, False), (LOOPS, True)):
        found = mechanism_of(four_bars(count).start[0])
        rows = found.equations.bilateral
        assert (found.mode(ActiveSet(rows)).order is not None) == expected
