"""LU factors of complex matrices against numpy."""

import numpy as np
import pytest

from mbd.kernel.algebra.complex_linear import factor_complex, solve_complex


def laid_out(matrix, right):
    """matrix | pivots | right-hand side in one array, parts apart, and where the two latter begin."""
    n = len(right)
    parts = [np.zeros(3), matrix.real.ravel(), matrix.imag.ravel(), np.zeros(n), right.real, right.imag]
    return np.concatenate(parts), 3 + 2 * n * n, 3 + 2 * n * n + n


@pytest.mark.parametrize("n", [1, 2, 5, 13])
def test_a_complex_system_is_solved(n):
    rng = np.random.default_rng(n)
    matrix = rng.normal(size=(n, n)) + 1j * rng.normal(size=(n, n))
    matrix[0, 0] = 0.0 if n > 1 else 2.0j  # pivoting is needed
    exact = rng.normal(size=n) + 1j * rng.normal(size=n)
    places, o_pivots, o_b = laid_out(matrix, matrix @ exact)
    assert factor_complex(places, 3, n, o_pivots) == 0
    solve_complex(places, 3, n, o_pivots, places, o_b)
    np.testing.assert_allclose(places[o_b : o_b + n] + 1j * places[o_b + n :], exact, rtol=0, atol=1e-12 * n)


def test_a_singular_matrix_names_its_column():
    matrix = np.array([[1.0, 2.0, 0.0], [0.5j, 1.0j, 0.0], [0.0, 0.0, 1.0]], dtype=complex)
    places, o_pivots, _ = laid_out(matrix, np.ones(3, dtype=complex))
    assert factor_complex(places, 3, 3, o_pivots) == 2


def test_what_is_not_a_number_is_singular():
    places, o_pivots, _ = laid_out(np.full((2, 2), np.nan, dtype=complex), np.ones(2, dtype=complex))
    assert factor_complex(places, 3, 2, o_pivots) == 1
