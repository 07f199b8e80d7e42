"""Elimination on the tape solves what dense LU solves, costs what the zeros leave, and tells where it must not."""

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from mbd.tape.elimination import factors
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Tape
from tests.tape.counts import operations, total

seeds = st.integers(0, 2**32 - 1)


def scene(rng, n, m, density, simple):
    """[S Bᵀ; B 0] with S symmetric, definite and sparse; `simple` rows hold a coordinate with the coefficient ±1."""
    root = rng.normal(size=(n, n)) * (rng.random((n, n)) < density)
    S = root @ root.T + np.diag(rng.uniform(0.5, 2.0, n))
    B = rng.normal(size=(m, n)) * (rng.random((m, n)) < max(density, 0.3))
    places = rng.permutation(n)[:m]
    B[:, places] = np.where(np.eye(m), 1.0 + np.abs(B[:, places]), B[:, places])
    numbers = set()
    for k in range(min(m, simple)):
        B[k, places] = 0.0
        B[k, places[k]] = rng.choice((-1.0, 1.0))
        numbers.add((n + k, int(places[k])))
    return np.block([[S, B.T], [B, np.zeros((m, m))]]), numbers


def on_tape(K, numbers=()):
    """The matrix as nodes: zeros and the entries named, with their mirror images, are numbers, all others inputs."""
    tape, inputs, size = Tape(), {}, len(K)

    def entry(i, j):
        if K[i, j] == 0.0 or (i, j) in numbers or (j, i) in numbers:
            return tape.constant(K[i, j])
        inputs["p", i * size + j] = K[i, j]
        return tape.input("p", i * size + j)

    return tape, [[entry(i, j) for j in range(size)] for i in range(size)], inputs


def solved(K, n, b, numbers=()):
    """x, x again from what was kept, whether the pivots were sound, their weakest."""
    tape, matrix, inputs = on_tape(K, numbers)
    found = factors(matrix, n)
    assert found is not None
    right = [tape.input("q", k) for k in range(len(b))]
    inputs |= {("q", k): value for k, value in enumerate(b)}
    kept = found.kept()
    again = found.read({node.index: tape.input("held", k) for k, node in enumerate(kept)})
    *values, sound, weakest = evaluate([*found.solve(right), *kept, found.sound, found.weakest], inputs)
    x, stored = values[: len(b)], values[len(b) :]
    held = {("held", k): value for k, value in enumerate(stored)} | {("q", k): value for k, value in enumerate(b)}
    return np.array(x), np.array(evaluate(again.solve(right), held)), sound, weakest


@given(n=st.integers(1, 9), m=st.integers(0, 4), density=st.floats(0.05, 1.0), simple=st.integers(0, 4), seed=seeds)
def test_it_solves_what_numpy_solves(n, m, density, simple, seed):
    rng = np.random.default_rng(seed)
    m = min(m, n)
    K, numbers = scene(rng, n, m, density, simple)
    assume(np.linalg.cond(K) < 1e6)
    b = rng.normal(size=n + m)
    x, again, sound, _ = solved(K, n, b, numbers)
    exact = np.linalg.solve(K, b)
    assert sound == 1.0
    np.testing.assert_allclose(x, exact, rtol=0, atol=1e-14 * np.linalg.cond(K) * (1.0 + np.abs(exact).max()) * 100)
    np.testing.assert_array_equal(x, again)


@given(n=st.integers(2, 8), m=st.integers(1, 3), seed=seeds, scale=st.floats(-6.0, 6.0))
def test_units_change_no_judgement(n, m, seed, scale):
    rng = np.random.default_rng(seed)
    m = min(m, n)
    K, _ = scene(rng, n, m, 0.6, 0)
    assume(np.linalg.cond(K) < 1e5)
    size = np.concatenate([10.0 ** rng.uniform(-3, 3, n), np.full(m, 10.0**scale)])
    b = rng.normal(size=n + m)
    x, _, sound, _ = solved(size[:, None] * K * size, n, size * b)
    assert sound == 1.0
    np.testing.assert_allclose(x * size, np.linalg.solve(K, b), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("tiny", [0.0, 1e-14, -1e-12, np.nan, np.inf])
def test_a_planted_pivot_is_told(tiny):
    K = np.array([[tiny, 1.0, 2.0], [1.0, 3.0, 0.5], [2.0, 0.5, 1.0]])
    _, matrix, inputs = on_tape(np.where(K == 0.0, 1.0, K))
    inputs["p", 0] = tiny
    with np.errstate(all="ignore"):
        assert evaluate([factors(matrix, 3).sound], inputs) == [0.0]


@pytest.mark.parametrize("angle", [1e-5, 1e-9, 0.0])
def test_rows_that_nearly_depend_on_each_other_are_told(angle):
    B = np.array([[0.6, 0.8, 0.3], [0.6, 0.8, 0.3 + angle]])
    K = np.block([[np.diag([1.0, 2.0, 3.0]), B.T], [B, np.zeros((2, 2))]])
    assert solved(K, 3, np.ones(5))[2] == 0.0


def test_the_weakest_pivot_grows_as_rows_lose_rank():
    sizes = []
    for angle in 0.1, 0.01, 0.001:
        B = np.array([[1.0, 2.0, 0.0], [1.0, 2.0, angle]])
        _, _, sound, weakest = solved(np.block([[np.eye(3), B.T], [B, np.zeros((2, 2))]]), 3, np.ones(5))
        assert sound == 1.0
        sizes.append(weakest)
    assert sizes[1] > 10.0 * sizes[0]
    assert sizes[2] > 10.0 * sizes[1]


def test_rows_that_give_a_coordinate_need_no_division_and_lose_no_rank():
    rng = np.random.default_rng(1)
    K, numbers = scene(rng, 6, 3, 1.0, 3)
    tape, matrix, _ = on_tape(K, numbers)
    found = factors(matrix, 6)
    assert operations([*found.kept()])["div"] == 3
    assert found.weakest.is_zero
    assert total(found.solve([tape.input("q", k) for k in range(9)])) < 2 * 9**3 // 3


def test_zeros_cost_nothing():
    tape, matrix, _ = on_tape(np.diag([1.5, 2.5, 3.5, 4.5]))
    assert operations(factors(matrix, 4).solve([tape.input("q", k) for k in range(4)])) == {"div": 4, "mul": 4}
    links = 12
    chain = 2.0 * np.eye(links) - 0.9 * np.eye(links, k=1) - 0.9 * np.eye(links, k=-1)
    tape, matrix, _ = on_tape(chain)
    count = total(factors(matrix, links).solve([tape.input("q", k) for k in range(links)]))
    assert count < 10 * links


def test_what_cannot_be_eliminated_on_the_diagonal_is_left_to_others():
    _, matrix, _ = on_tape(np.array([[0.0, 2.0], [3.0, 0.0]]))
    assert factors(matrix, 2) is None
