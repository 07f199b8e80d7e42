"""Which rows depend on others is found over the entries of each row alone, to the bit as over all of them."""

import numpy as np
from hypothesis import given, strategies as st

from mbd.kernel.algebra import redundancy
from mbd.kernel.records import Kernel


def judged(B, M, whole):
    """Marks and coefficients of dependent rows, over whole rows if `whole`."""
    m, n = B.shape
    kept_as_usual = redundancy.keep_row

    def keep_row(K, row, kept):
        kept_as_usual(K, row, kept)
        K.support[2 * kept : 2 * kept + 2] = 0, n

    acc = np.concatenate([M.ravel(), np.zeros(n + n * m), B.ravel(), np.zeros(3 * m)])
    K = Kernel(
        n=n, n_v=n, n_rows=m, vector=1, acc=acc, limits=np.zeros(24, dtype=np.int64),
        rows=np.arange(m), row_unit=np.zeros(m, dtype=np.int64), unit=np.zeros(n, dtype=np.int64),
        dropped=np.zeros(m, dtype=np.int64), state=np.zeros(64, dtype=np.int64), work=np.zeros(n + m),
        basis=np.full((m + 1) * n, 7.0), lower=np.zeros((m + 1) * m), dependence=np.zeros(m * m),
        support=np.full(m * (n + 2), -1), columns=np.zeros(n + m, dtype=np.int64), orders=np.zeros(1, dtype=np.int64),
    )  # fmt: skip
    redundancy.keep_row = keep_row if whole else kept_as_usual
    try:
        redundancy.find_dependent(K, m)
    finally:
        redundancy.keep_row = kept_as_usual
    return K.dropped.copy(), K.dependence.copy(), K.lower.copy()


@given(parts=st.integers(1, 5), most=st.integers(1, 4), seed=st.integers(0, 2**32 - 1))
def test_rows_are_judged_by_their_own_entries(parts, most, seed):
    """Bodies of a few coordinates each, with rows that may depend on each other or join two of them."""
    rng, B = np.random.default_rng(seed), np.zeros((2 * parts + 1, 3 * parts))
    for part in range(parts):
        lines = rng.normal(size=(2, 3))
        lines[1] = lines[0] * rng.integers(0, 2) + lines[1] * rng.integers(0, 2)  # the same, another one, both or none
        B[2 * part : 2 * part + 2, 3 * part : 3 * part + 3] = lines
    B[-1] = rng.normal(size=3 * parts) * (rng.random(3 * parts) < most / 4)
    B = B[rng.permutation(len(B))]
    M = np.diag(rng.uniform(0.5, 2.0, 3 * parts))
    for one, other in zip(judged(B, M, False), judged(B, M, True), strict=True):
        np.testing.assert_array_equal(one, other)
    left = B[judged(B, M, False)[0] == 0]
    assert np.linalg.matrix_rank(left) == len(left) == np.linalg.matrix_rank(B)
