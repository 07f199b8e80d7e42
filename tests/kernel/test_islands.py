"""Bodies that do not touch each other are problems of their own, whatever else stands beside them."""

import numpy as np
from hypothesis import given, settings, strategies as st

import mbd
from mbd.assembly.islands import alike_islands, islands_of_rows
from mbd.kernel.algebra.islands import find_islands, gather_island
from mbd.kernel.algebra.saddle import solve_rows
from tests.kernel.test_complementarity import random_mass, scene


def shuffled(blocks, rng):
    """Blocks of masses and rows along the diagonal, coordinates and rows in random order."""
    n, m = sum(len(M) for M, _ in blocks), sum(len(B) for _, B in blocks)
    M, B, i, k = np.zeros((n, n)), np.zeros((m, n)), 0, 0
    for own, rows in blocks:
        M[i : i + len(own), i : i + len(own)], B[k : k + len(rows), i : i + len(own)] = own, rows
        i, k = i + len(own), k + len(rows)
    places, lines = rng.permutation(n), rng.permutation(m)
    return M[np.ix_(places, places)], B[np.ix_(lines, places)]


def made(seed, count):
    rng = np.random.default_rng(seed)
    blocks = [(random_mass(rng, n), rng.normal(size=(rng.integers(1, n + 2), n))) for n in rng.integers(1, 4, count)]
    return (*shuffled(blocks, rng), rng, count)


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(1, 5))
def test_islands_are_the_blocks_that_nothing_couples(seed, count):
    M, B, _, _ = made(seed, count)
    K, _ = scene(M, B, None, 0.0, np.zeros(len(M)))
    K.rows[:] = np.arange(len(B))
    assert find_islands(K, len(B)) == count
    label = K.island[: len(M) + len(B)].copy()
    whole = np.block([[M, B.T], [B, np.zeros((len(B), len(B)))]])
    assert np.array_equal((whole != 0.0) & (label[:, np.newaxis] != label), np.zeros_like(whole, dtype=bool))
    kernels = {tuple(K.members[: gather_island(K, len(B), island)]) for island in range(count)}
    assert kernels == {tuple(each) for islands in alike_islands(whole, len(M)) for each in islands}
    assert kernels == {
        (*own, *(lines + len(M))) for owns, many in islands_of_rows(M, B) for own, lines in zip(owns, many, strict=True)
    }


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(1, 5))
def test_islands_together_move_as_each_does_alone(seed, count):
    """Rows that depend on others included: of these B w = −bias has a solution."""
    M, B, rng, _ = made(seed, count)
    velocity, force = rng.normal(size=len(M)), rng.normal(size=len(M))
    K, _ = scene(M, B, None, 0.0, velocity)
    K.rows[:], K.force[:] = np.arange(len(B)), force
    assert solve_rows(K, len(B), True) == 0
    assert np.abs(M @ K.jump + force + B.T @ K.impulse).max() < 1e-9 * (1.0 + np.abs(K.impulse).max())
    assert np.abs(B @ (K.jump + velocity)).max() < 1e-9
    together = K.jump.copy()
    for owns, many in islands_of_rows(M, B):
        for own, lines in zip(owns, many, strict=True):
            alone, _ = scene(M[np.ix_(own, own)], B[np.ix_(lines, own)], None, 0.0, velocity[own])
            alone.rows[:], alone.force[:] = np.arange(len(lines)), force[own]
            assert solve_rows(alone, len(lines), True) == 0
            np.testing.assert_allclose(together[own], alone.jump, rtol=0, atol=1e-9)


def sliding(count, mu):
    """Rods on one end that slide along the ground, one beside the other (Painlevé's rods where μ is large)."""
    model, position, velocity = mbd.Model("rods"), {}, {}
    for k in range(count):
        rod = mbd.Link(f"rod {k}", 1.0, 1.0, 0.5, 1.0 / 12.0)
        model.connect(mbd.Planar(f"free {k}", model.ground.point(3.0 * k, 0.0), rod.start))
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(rod.start), friction=mbd.Coulomb(mu[k])))
        position[f"free {k}.angle"], velocity[f"free {k}.x"] = 1.0, 1.0 + k
    return model, mbd.assemble(model, position=position, velocity=velocity, closed=[f"foot {k}" for k in range(count)])


def test_sliding_bodies_beside_each_other_move_as_each_does_alone():
    mu = [0.1, 0.3, 0.4]
    together = mbd.simulate(*sliding(3, mu), dt=1e-3, until=0.02)
    for k in (0, 1):
        model, start = sliding(k + 1, mu[: k + 1])
        alone = mbd.simulate(model, start, dt=1e-3, until=0.02)
        for name in (f"free {k}.x", f"free {k}.angle", f"foot {k}.force"):
            np.testing.assert_allclose(together[name], alone[name], rtol=1e-12, atol=1e-13)


def test_painleves_paradox_is_found_beside_bodies_that_slide_well():
    mu = [0.3, 0.3, 5.0, 0.3]
    for order in ([0, 1, 2, 3], [2, 1, 0, 3]):
        model, start = sliding(4, [mu[k] for k in order])
        run = mbd.simulate(model, start, dt=1e-3, until=0.02)
        (stopped,) = (event for event in run.events if event.impulse.any())
        assert (stopped.name, stopped.kind) == (f"foot {order.index(2)}", "stuck")
