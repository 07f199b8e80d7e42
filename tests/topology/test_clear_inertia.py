"""A mass matrix that one factorization tells to be sound passes every other look at it."""

import numpy as np
from hypothesis import given, settings, strategies as st

from mbd.assembly.inertia import _has_inertia, _weak_motions
from tests.comparisons import at_least, compared


@at_least(10)
@settings(max_examples=100)
@given(n=st.integers(1, 8), least=st.floats(-16.0, 0.0), sign=st.sampled_from([1.0, -1.0]), seed=st.integers(0, 99))
def test_clear_inertia_hides_no_weak_motion_and_no_negative_mass(n, least, sign, seed):
    rng = np.random.default_rng(seed)
    turned, _ = np.linalg.qr(rng.normal(size=(n, n)))
    sizes = rng.uniform(0.5, 2.0, n)
    sizes[0] = sign * 10.0**least
    units = 10.0 ** rng.integers(-3, 4, n)
    M = units[:, np.newaxis] * (turned * sizes @ turned.T) * units
    if not _has_inertia(M):
        assert sign < 0.0 or least < -1.0 or n > 1
        return
    compared()
    assert sign > 0.0
    assert not _weak_motions(M, n)
    scale = np.sqrt(np.diag(M))
    assert np.min(np.linalg.eigvalsh(M / np.outer(scale, scale))) > 0.0
