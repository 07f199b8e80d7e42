"""The coefficients of Radau IIA obey the conditions that define it."""

import numpy as np

from mbd.kernel.schemes.collocation import RADAU

DEGREE = np.arange(1.0, 4.0)


def test_stages_are_exact_for_parabolas_and_the_end_for_degree_four():
    c, A = RADAU.c, RADAU.A
    for k in DEGREE:
        np.testing.assert_allclose(A @ c ** (k - 1.0), c**k / k, atol=1e-15)
    for k in range(1, 6):
        np.testing.assert_allclose(A[2] @ c ** (k - 1.0), 1.0 / k, atol=1e-15)
    assert c[2] == 1.0


def test_the_transformation_makes_the_weights_diagonal():
    T = np.array([RADAU.t_real, RADAU.t_pair, RADAU.t_pair.conj()]).T
    inverse = np.array([RADAU.s_real, RADAU.s_pair, RADAU.s_pair.conj()])
    np.testing.assert_allclose(inverse @ T, np.eye(3), atol=1e-14)
    values = np.array([RADAU.real, RADAU.pair, RADAU.pair.conjugate()])
    np.testing.assert_allclose(T @ np.diag(values) @ inverse, RADAU.A, atol=1e-14)


def test_the_embedded_error_vanishes_for_degree_three():
    """``μ f(y₀) + Σ e_i (Y_i − y₀)`` is a difference of two quadratures of order 3."""
    for k in DEGREE:
        slope = RADAU.real * (1.0 if k == 1.0 else 0.0)
        assert abs(slope + RADAU.e @ RADAU.c**k) < 1e-14, k
    assert abs(RADAU.e @ RADAU.c**4) > 1e-3
