"""Dependent rows: as many as the rank lacks, each a combination of the fewest others, in any order and scale."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from mbd.assembly.conflicts import Member, irreducible, linear_conflict, solvable
from mbd.assembly.dependence import dependences, rank_of
from tests.comparisons import at_least, compared


@st.composite
def deficient(draw):
    """A matrix of known rank, its rows of very different sizes."""
    rank, extra, n = draw(st.integers(1, 5)), draw(st.integers(0, 4)), draw(st.integers(5, 8))
    random = np.random.default_rng(draw(st.integers(0, 10**6)))
    B = random.standard_normal((rank + extra, rank)) @ random.standard_normal((rank, n))
    return random.permutation(B) * 10.0 ** random.uniform(-4, 4, (rank + extra, 1)), rank, random


def titles(B):
    return [f"row {k}" for k in range(len(B))]


@given(deficient())
def test_as_many_rows_are_named_as_the_rank_lacks_in_any_order(made):
    B, rank, random = made
    for order in (np.arange(len(B)), random.permutation(len(B))):
        found = dependences(B[order], titles(B))
        assert rank_of(B[order]) == rank
        assert len(found) == len(B) - rank


@at_least(4)
@given(deficient())
def test_a_dependent_row_is_the_combination_that_is_told(made):
    B, _, _ = made
    for row in dependences(B, titles(B)):
        compared()
        combined = sum(c * B[k] for k, (_, c) in zip(row.numbers, row.on, strict=True))
        np.testing.assert_allclose(combined, B[row.number], atol=1e-8 * np.abs(B[row.number]).max())
        assert all(k < row.number for k in row.numbers)
        assert rank_of(B[list(row.numbers)]) == len(row.numbers), "those it depends on are independent"


@given(deficient(), st.data())
def test_a_copy_of_any_row_is_named_with_that_row_alone_if_it_is_independent(made, data):
    B, rank, _ = made
    k = data.draw(st.integers(0, len(B) - 1))
    more = np.vstack([B, -3.0 * B[k]])
    found = dependences(more, [*titles(B), "copy"])
    assert rank_of(more) == rank and found[-1].row == "copy"
    if k not in [row.number for row in found]:
        assert found[-1].numbers == (k,) and found[-1].on[0][1] == pytest.approx(-3.0)
        assert str(found[-1]) == f"copy depends on row {k}"


def test_a_row_that_vanishes_depends_on_nothing():
    (row,) = dependences(np.array([[0.0, 0.0], [1.0, 2.0]]), ["idle", "other"])
    assert row.on == () and str(row) == "idle acts on nothing that moves"
    assert rank_of(np.zeros((2, 3))) == 0 and dependences(np.zeros((0, 3)), []) == ()


@given(st.integers(0, 10**6), st.integers(2, 5), st.integers(0, 4))
def test_an_irreducible_set_of_equations_has_no_solution_and_any_fewer_have_one(seed, members, bystanders):
    """A combination of some rows vanishes while that of their right-hand sides does not."""
    random = np.random.default_rng(seed)
    n = members + bystanders + 2
    B = random.standard_normal((members + bystanders, n))
    B[members - 1] = random.uniform(0.5, 2.0, members - 1) @ B[: members - 1]
    right = B @ random.standard_normal(n)
    right[members - 1] += 1.0
    order = random.permutation(len(B))
    owners = [Member(f"c{k}", "constraint") for k in order]
    conflict = linear_conflict(B[order], right[order], owners, ["m"] * n, "velocity", 1e-9)
    assert sorted(conflict.names) == [f"c{k}" for k in range(members)]
    assert conflict.error > 1e-3
    for left_out in range(members):
        fewer = [k for k in range(members) if k != left_out]
        assert solvable(B[fewer], right[fewer], 1e-9)


@given(st.sets(st.integers(0, 9), min_size=1), st.permutations(range(10)))
def test_the_deletion_filter_finds_the_one_conflict_in_any_order(core, order):
    assert set(irreducible(order, lambda some: not core <= set(some))) == core
