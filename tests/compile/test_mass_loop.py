"""The mass matrix of a large tree, filled by a loop, is that of straight-line code, and its code is short."""

import numpy as np
import pytest

import mbd
from mbd.compile import remembered
from mbd.compile.ir import Module
from mbd.compile.mass_loop import WithMasses
from mbd.compile.mechanism import Mechanism
from mbd.equations import sizes
from mbd.equations.derivation import derive
from mbd.testing.mechanisms import random_tree
from tests.fuzz.structures import SPACE, structure


@pytest.fixture(autouse=True)
def forgetful(monkeypatch):
    """Nothing is taken from programs of the same equations that were made before."""
    monkeypatch.setattr(remembered, "ENABLED", False)


def mechanisms_of(model, monkeypatch, backend="llvm"):
    """With the loop, and without."""
    found = []
    for least in (1, 10**9):
        monkeypatch.setattr(sizes, "MIN_LOOP_ENTRIES", least)
        found.append(Mechanism(derive(model), backend))
    assert [isinstance(each.accelerations, WithMasses) for each in found] == [True, False]
    return found


@pytest.mark.parametrize("backend", ["llvm", "python"])
def test_accelerations_of_random_trees_are_those_of_straight_code(backend, monkeypatch):
    compared = 0
    for seed in range(6):
        model = random_tree(seed, 10, spatial=seed % 2 == 1, most=20)
        loop, straight = mechanisms_of(model, monkeypatch, backend)
        random, n = np.random.default_rng(seed), loop.layout.n
        for _ in range(3):
            block, parameters = random.uniform(-1.0, 1.0, loop.layout.size), loop.parameters()
            one, other = loop.terms_of(block, parameters), straight.terms_of(block, parameters)
            for name in ("f", "R", "B", "h", "rate", "bias", "kinetic"):
                assert np.array_equal(getattr(one, name), getattr(other, name)), (seed, name)
            # numbers of the model are multiplied beforehand in straight code alone
            size = np.sqrt(np.outer(np.diag(other.M), np.diag(other.M)))
            assert np.all(np.abs(one.M - other.M) <= 1e-14 * size), seed
            assert np.array_equal(one.M, one.M.T), seed
            compared += np.count_nonzero(one.M)
        assert one.M.shape == (n, n)
    assert compared > 500


def test_runs_of_random_mechanisms_are_the_same(monkeypatch):
    compared = 0
    for number in (*range(0, 60, 9), *range(SPACE, SPACE + 60, 9)):
        runs = []
        for least in (1, 10**9):
            monkeypatch.setattr(sizes, "MIN_LOOP_ENTRIES", least)
            made = structure.__wrapped__(number)
            start = mbd.assemble(made.model, position=made.position, project=True)
            for scheme in (mbd.HHT(), mbd.RungeKutta4()):
                run = mbd.simulate(
                    made.model, start, scheme, dt=1e-3, until=5e-3, contact="events", on_failure="return"
                )
                runs.append(run.record)
        for one, other in zip(runs[:2], runs[2:], strict=True):
            assert np.allclose(one.q, other.q, rtol=1e-10, atol=1e-10, equal_nan=True), number
            assert np.allclose(one.v, other.v, rtol=1e-8, atol=1e-8, equal_nan=True), number
            compared += len(one.q)
    assert compared > 100


def test_code_of_a_chain_grows_with_its_bodies(monkeypatch):
    def lines(bodies, least):
        monkeypatch.setattr(sizes, "MIN_LOOP_ENTRIES", least)
        model, end = mbd.Model("chain"), None
        for k in range(bodies):
            rod = mbd.Link(f"rod {k}", length=1.0, **mbd.rod(mass=1.0, length=1.0).link)
            model.connect(mbd.Revolute(f"hinge {k}", model.ground.origin if end is None else end, rod.start))
            end = rod.end
        made = Mechanism(derive(model), "python")
        return Module({"accelerations": made._accelerations}, made.layout).lines

    assert lines(40, 1) < 2.3 * lines(20, 1)
    assert lines(40, 10**9) > 3.0 * lines(20, 10**9)
