"""Orders of elimination: every unknown once, no entry outside of the pattern, work in proportion to what there is."""

import numpy as np
from hypothesis import given, strategies as st

from mbd.tape.ordering import order


def saddle(rng, n, m, density):
    """Places of [S R; H 0] with S definite on its diagonal, and of numbers among them."""
    S = (rng.random((n, n)) < density) | np.eye(n, dtype=bool)
    B = rng.random((m, n)) < max(density, 2.0 / n)
    B[np.arange(m), rng.permutation(n)[:m]] = True
    pattern = np.block([[S | S.T, B.T], [B, np.zeros((m, m), dtype=bool)]])
    places = {(int(i), int(j)) for i, j in np.argwhere(pattern)}
    numbers = {(i, j) for i, j in places if rng.random() < 0.2}
    return places, numbers | {(j, i) for i, j in numbers}


def loops(count):
    """Places of a chain of four-bars: three coordinates meet in the two rows of each."""
    n, places = 2 * count + 1, set()
    for k in range(count):
        near = [2 * k, 2 * k + 1, 2 * k + 2, n + 2 * k, n + 2 * k + 1]
        places |= {(i, j) for i in near for j in near if min(i, j) < n}
    return places, n, n + 2 * count


@given(n=st.integers(3, 14), m=st.integers(0, 5), seed=st.integers(0, 2**32 - 1), density=st.floats(0.0, 0.5))
def test_an_order_takes_every_row_and_column_once_and_knows_all_its_fill_in(n, m, seed, density):
    m = min(m, n - 1)
    places, numbers = saddle(np.random.default_rng(seed), n, m, density)
    found = order(places, numbers, n, n + m)
    assert found is not None, "every coordinate has a pivot of its own"
    assert sorted(found.rows) == sorted(found.columns) == list(range(n + m))
    turn = {column: k for k, column in enumerate(found.columns)}
    entries = [set(line) for line in found.entries]
    for k, row in enumerate(found.rows):
        assert k in entries[k]
        assert {turn[j] for i, j in places if i == row} <= entries[k]
        for before in sorted(e for e in entries[k] if e < k):
            assert {e for e in entries[before] if e > before} <= entries[k]


@given(n=st.integers(3, 14), m=st.integers(1, 5), seed=st.integers(0, 2**32 - 1))
def test_a_multiplier_waits_for_the_coordinates_of_its_row(n, m, seed):
    m = min(m, n - 1)
    places, _ = saddle(np.random.default_rng(seed), n, m, 0.2)
    found = order(places, set(), n, n + m)
    turn = {column: k for k, column in enumerate(found.columns)}
    for row, column in places:
        if row >= n > column:
            assert turn[column] < turn[row]


def test_a_longer_chain_of_loops_takes_operations_in_proportion():
    cost = {}
    for count in (20, 40, 80):
        places, n, size = loops(count)
        cost[count] = order(places, set(), n, size).operations
    assert cost[80] - cost[40] <= 2.2 * (cost[40] - cost[20])
    assert cost[40] < 161**3 / 3 / 50


def test_a_number_in_both_places_takes_a_coordinate_and_its_multiplier_out_by_the_row():
    places = {(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (0, 2)}
    found = order(places, {(2, 0), (0, 2)}, 2, 3)
    assert set(zip(found.rows, found.columns, strict=True)) == {(2, 0), (0, 2), (1, 1)}
