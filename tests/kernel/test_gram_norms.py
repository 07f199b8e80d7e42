"""What is left of rows beside others: from their Gram matrix what Gram–Schmidt leaves."""

from types import SimpleNamespace

import numpy as np
from hypothesis import given, strategies as st

from mbd.kernel.algebra.column_weights import counted_inertia, least_inertia
from mbd.kernel.singular.gram_norms import pivoted_gram_norms


def kernel(rng, n, m, density):
    """Rows with few entries and their rates, behind a diagonal, as in K.out; two places of K.spare are read later."""
    there = rng.random((m, n)) < density
    there[np.arange(m), rng.permutation(n)[:m]] = True
    rows, turning = (np.where(there, rng.normal(size=(m, n)), 0.0) for _ in range(2))
    return SimpleNamespace(
        n_v=n, out=np.concatenate([rng.uniform(0.5, 2.0, n), rows.ravel()]), turning=turning.ravel(),
        basis=np.zeros((m + 1) * n), support=np.zeros(m * (n + 2), dtype=np.int64), spare=np.zeros(5 * m + m * m),
        columns=np.zeros(m, dtype=np.int64), rows=np.arange(m), row_level=np.zeros(m, dtype=np.int64),
        vector=1, unit=np.arange(n) % 2,
    )  # fmt: skip


def gram_schmidt(rows, order):
    """Lengths of rows less their parts along earlier ones, the longest remaining next or in a given order."""
    rows, left = rows.copy(), []
    for done in range(len(rows)):
        lengths = np.linalg.norm(rows, axis=1)
        lengths[[taken for _, taken in left]] = -1.0
        k = int(np.argmax(lengths)) if order is None else order[done]
        left.append((lengths[k], k))
        unit = rows[k] / lengths[k]
        rows = rows - np.outer(rows @ unit, unit)
        rows -= np.outer(rows @ unit, unit)
    return np.array([length for length, _ in left]), [k for _, k in left]


@given(n=st.integers(2, 16), m=st.integers(1, 10), seed=st.integers(0, 2**32 - 1), density=st.floats(0.05, 1.0))
def test_what_is_left_of_rows_is_that_of_gram_schmidt(n, m, seed, density):
    m, order = min(m, n), None
    K = kernel(np.random.default_rng(seed), n, m, density)
    weights = 1.0 / np.sqrt(K.out[:n])
    H, turning = (each.reshape(m, n) * weights for each in (K.out[n:], K.turning))
    for place, ahead in enumerate((0.0, -0.01, 0.01)):
        pivoted_gram_norms(K, m, 0.01, 0.005, ahead, place * m, 0, 1, n, n)
        lengths = np.linalg.norm(H - 0.005 * turning, axis=1) + 0.01 * np.linalg.norm(turning, axis=1)
        left, order = gram_schmidt((H - 0.005 * turning + ahead * turning) / lengths[:, None], order)
        np.testing.assert_array_equal(K.columns, order)
        np.testing.assert_allclose(K.spare[place * m : place * m + m], left, rtol=0, atol=3e-8)
        np.testing.assert_allclose(K.spare[3 * m : 4 * m], lengths[order], rtol=1e-12)
    assert np.all(np.diff(K.spare[:m]) <= 1e-12)  # the longest first


def test_nothing_is_left_of_a_row_that_depends_on_others():
    K = kernel(np.random.default_rng(3), 8, 4, 0.5)
    rows, turning = K.out[8:].reshape(4, 8), K.turning.reshape(4, 8)
    rows[3], turning[3] = rows[0] - 2.0 * rows[1], 0.0
    pivoted_gram_norms(K, 4, 0.0, 0.0, 0.0, 0, 0, 1, 8, 8)
    assert K.spare[3] < 1e-7 < K.spare[2]


def test_round_off_of_an_inertia_decides_nothing():
    """A thin rod has none about its own axis: zero, or what sums leave of it, weigh its columns alike."""
    found = []
    for tiny in (0.0, 1e-18, -3e-20):
        K = kernel(np.random.default_rng(7), 8, 5, 0.6)
        K.vector, K.out[3] = 0, tiny
        least = least_inertia(K, K.out, 0, 1, 0), least_inertia(K, K.out, 0, 1, 1)
        weighed = [1.0 / np.sqrt(counted_inertia(K, j, abs(K.out[j]), *least)) for j in range(8)]
        assert max(weighed) < 2e4
        pivoted_gram_norms(K, 5, 0.01, 0.005, 0.0, 0, 0, 1, 8, 8)
        found.append(K.spare[:5].copy())
    for each in found[1:]:
        np.testing.assert_allclose(each, found[0], rtol=0, atol=3e-8)
