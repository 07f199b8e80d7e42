"""When residuals of a step pass: beside forces, and beside what rows are made of, however large accelerations are."""

from types import SimpleNamespace

import numpy as np
import pytest

from mbd.kernel.schemes.iteration import residual_size

TOLERANCE = 1e-9


def balanced(seed, level=0, stabilized=1):
    """Numbers of a step in balance, three rates and two rows, with accelerations and velocities of any size."""
    chance = np.random.default_rng(seed)
    n, m = 3, 2
    block = np.zeros(2 * n)
    block[:n] = chance.normal(size=n) * 10.0 ** chance.uniform(0.0, 6.0)
    block[n:] = chance.normal(size=n) * 10.0 ** chance.uniform(0.0, 9.0)
    scale = 10.0 ** chance.uniform(-3.0, 1.0, n + 2 * m)
    return SimpleNamespace(
        n=n, n_v=n, n_rows=m, o_v=0, o_a=n, block=block, out=np.zeros(n + 2 * m), weight=1.0 / scale[:n], scale=scale,
        rows=np.arange(m), row_level=np.full(m, level), stabilized=stabilized, blur=0.0, n_clusters=1,
    )  # fmt: skip


@pytest.mark.parametrize("both", [0, 1])
@pytest.mark.parametrize("seed", range(20))
def test_no_row_on_positions_is_off_by_more_than_its_own_size_times_the_tolerance(seed, both):
    """A step of 1 s with a million m/s² moves by as many metres: that is no measure of a row of millimetres."""
    K = balanced(seed)
    for row in range(2):
        K.out[:] = 0.0
        assert residual_size(K, 0, 2, 1.0, 1.0, TOLERANCE, both) == 0.0
        K.out[3 + row] = -1.5 * TOLERANCE * K.scale[3 + row]
        assert residual_size(K, 0, 2, 1.0, 1.0, TOLERANCE, both) > 1.0


@pytest.mark.parametrize("stabilized", [0, 1])
@pytest.mark.parametrize("seed", range(10))
def test_nor_one_on_velocities(seed, stabilized):
    K = balanced(seed, 1, stabilized)
    for row in range(2):
        K.out[:] = 0.0
        K.out[(5 if stabilized else 3) + row] = 1.5 * TOLERANCE * K.scale[5 + row]
        assert residual_size(K, 0, 2, 1.0, 1.0, TOLERANCE, 0) > 1.0


def test_residuals_that_are_not_finite_pass_nothing():
    K = balanced(1)
    for place in range(5):
        K.out[:] = 0.0
        K.out[place] = np.nan
        assert residual_size(K, 0, 2, 1.0, 1.0, TOLERANCE, 0) == -1.0
