"""Motions whose inertia is a small difference of large ones: computed, or refused by name."""

import numpy as np
import pytest

import mbd

G = 9.81


def tree(lengths, masses, centers, parents):
    """Links without inertia of their own, each from the end of an earlier one."""
    model = mbd.Model("tree")
    ends = [model.ground.origin]
    for k, parent in enumerate(parents):
        link = mbd.Link(f"link {k}", masses[k], lengths[k], centers[k] * lengths[k])
        model.connect(mbd.Revolute(f"j{k}", ends[parent], link.start))
        ends.append(link.end)
    return model


def accelerations(lengths, masses, centers, parents, angles):
    """Relative angular accelerations from rest by least squares over bodies, which adds up no masses."""
    n = len(parents)
    above = np.zeros((n, n))  # which absolute angles move the start of a link
    turns = np.eye(n)
    for k, parent in enumerate(parents):
        if parent > 0:
            above[k] = above[parent - 1]
            above[k, parent - 1] += 1.0
            turns[k] += turns[parent - 1]
    arms = above * lengths + np.diag(centers * lengths)
    absolute = turns @ angles
    along = np.vstack([arms * np.cos(absolute), arms * np.sin(absolute)])  # of masses per absolute angle
    weights = np.sqrt(np.concatenate([masses, masses]))
    pull = np.concatenate([np.zeros(n), np.full(n, -G)])
    jacobian = weights[:, None] * along
    size = np.linalg.norm(jacobian, axis=0)
    found = np.linalg.lstsq(jacobian / size, weights * pull, rcond=0)[0] / size
    return np.linalg.solve(turns, found), size


def start_of(model, angles):
    return mbd.assemble(model, position={f"j{k}.angle": float(angle) for k, angle in enumerate(angles)})


def drawn(seed):
    """A tree of 8 to 18 links; most chains come near to what double precision carries."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(8, 19))
    parents = [0] + [k if rng.random() < 0.85 else int(rng.integers(0, k + 1)) for k in range(1, n)]
    masses = 10.0 ** rng.uniform(-1.5, 1.5, n)
    angles = rng.uniform(-0.6, 0.6, n) * (rng.random() < 0.6) + 0.3 * (np.arange(n) == 0)
    return rng.uniform(0.1, 0.5, n), masses, rng.uniform(0.3, 0.7, n), parents, angles


@pytest.mark.covering
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RungeKutta853(), mbd.RadauIIA()], ids=["hht", "rk", "radau"])
@pytest.mark.parametrize("seed", range(8))
def test_a_tree_of_links_without_inertia_starts_with_the_accelerations_of_its_bodies(seed, scheme):
    words = drawn(seed)
    model, expected = tree(*words[:4]), accelerations(*words)[0]
    start = start_of(model, words[4])
    run = mbd.simulate(model, start, scheme, until=1e-8, dt=1e-8)
    found = [run[f"j{k}.angle.acceleration"][0] for k in range(len(expected))]
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.max(np.abs(expected)))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("count", range(10, 40, 3))
def test_a_chain_whose_masses_sit_near_its_joints_is_right_or_refused_by_name(count):
    words = np.full(count, 0.3), np.ones(count), np.full(count, 1 / 3), list(range(count))
    angles = 0.3 * (np.arange(count) == 0)
    expected = accelerations(*words, angles)[0]
    try:
        model = tree(*words)
        run = mbd.simulate(model, start_of(model, angles), mbd.HHT(0.05), until=1e-9, dt=1e-9)
    except mbd.MbdError as refused:
        told = str(refused)
    else:
        told = ""
    if count > 20 and told:
        assert "their own center" in told
        return
    assert not told
    found = [run[f"j{k}.angle.acceleration"][0] for k in range(count)]
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.max(np.abs(expected)))


@pytest.mark.parametrize("seed", range(4))
def test_a_motion_without_inertia_at_the_tip_of_such_a_tree_is_named(seed):
    lengths, masses, centers, parents, angles = drawn(seed)
    n = len(parents)
    model = tree(
        np.append(lengths, [0.2, 0.3]), np.append(masses, [0.0, 1.0]), np.append(centers, [0.5, 0.5]),
        [*parents, n, n + 1],
    )  # fmt: skip
    with pytest.raises(mbd.AssemblyError, match=f"nothing determines the motion of 'j({n}|{n + 1}).angle'"):
        start_of(model, np.append(angles, [0.1, 0.0]))  # in line: they fold without moving the mass
    start_of(model, np.append(angles, [0.1, 0.5]))


def test_a_long_chain_of_point_masses_keeps_its_energy_to_the_order_of_the_scheme():
    count = 30
    model = tree(np.full(count, 0.3), np.ones(count), np.full(count, 0.5), list(range(count)))
    start = start_of(model, 0.3 * (np.arange(count) == 0))
    lost = [
        np.max(np.abs(mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), until=0.05, dt=dt).energy.numerical))
        for dt in (1e-3, 5e-4)
    ]
    assert lost[0] / lost[1] > 3.0
