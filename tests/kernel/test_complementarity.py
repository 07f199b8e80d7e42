"""Who pushes and who sticks, for matrices of any kind: the solver alone, on arrays of its own."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.kernel import codes
from mbd.kernel.contact.complementarity import complementarity
from mbd.kernel.records import TABLE, Kernel


class Scene(Kernel):
    """`n` bodies' coordinates with contacts, each of a normal row, and with friction a tangent row after it."""


def scene(M, normals, tangents, mu, velocity, closed=None):
    """A kernel's arrays at velocity level: ``M w + R λ = 0``, bias = B v, one impact of contacts that may choose."""
    n, contacts = len(M), len(normals)
    with_friction = tangents is not None
    B = np.array([row for pair in zip(normals, tangents, strict=True) for row in pair]) if with_friction else normals
    B = np.atleast_2d(B)
    rows = len(B)
    normal = np.arange(contacts) * (2 if with_friction else 1)
    friction_row = normal + 1 if with_friction else np.zeros(1, dtype=int)
    frictions = contacts if with_friction else 0
    row_contact = np.repeat(np.arange(contacts), 2 if with_friction else 1)
    row_friction = np.full(rows, -1)
    if with_friction:
        row_friction[friction_row] = np.arange(contacts)
    size = n + rows
    K = Scene(
        vector=1, n=n, n_v=n, n_q=n, n_rows=rows, n_contacts=contacts, n_frictions=frictions, n_cones=0, n_clusters=1,
        dt=0.0, n_machines=0, n_impulses=0, n_anchors=0, loaded=0, loads_act=0, limits=np.zeros(24, dtype=int),
        params=np.zeros(1),
        acc=np.zeros(n * n + n + 2 * n * rows + 3 * rows + 1 + max(frictions, 1)),
        kkt=np.zeros(size * size), rhs=np.zeros(size), columns=np.zeros(size, dtype=int), work=np.zeros(3 * size),
        basis=np.zeros((rows + 1) * n), lower=np.zeros((rows + 1) * rows), dependence=np.zeros(rows * rows),
        pivots=np.zeros(size, dtype=int), force=np.zeros(n), bias=B @ velocity, jump=np.zeros(n),
        impulse=np.zeros(rows), given=np.zeros(rows), loads=np.zeros(rows), typical=np.zeros(n), scale=np.ones(size),
        y=np.array(velocity, dtype=float), limit=np.zeros(max(frictions, 1)), base_limit=np.zeros(max(frictions, 1)),
        slip=np.zeros(max(frictions, 1)), lean=np.zeros(max(frictions, 1)),
        sticks=np.ones(max(frictions, 1), dtype=int),
        loose=np.full(max(frictions, 1), 1 if with_friction else 0), active=np.ones(contacts, dtype=int),
        parting=np.zeros(contacts, dtype=int), free=np.ones(contacts, dtype=int), normal=normal,
        friction_row=friction_row, friction_contact=np.arange(max(contacts, 1)), row_contact=row_contact,
        row_friction=row_friction, rows=np.zeros(rows, dtype=int),
        dropped=np.zeros(rows, dtype=int), state=np.zeros(32, dtype=int), counts=np.zeros(24, dtype=int),
        leader=np.arange(max(frictions, 1)), group_size=np.ones(max(frictions, 1), dtype=int),
        detail=np.zeros(32), hooks=None, strategy=0, past=np.zeros(rows), past_limit=np.zeros(max(frictions, 1)),
    )  # fmt: skip

    for name in TABLE.real_arrays + TABLE.integer_arrays:  # what does not matter here
        if name not in vars(K):
            setattr(K, name, np.zeros(4 * size * size, dtype=float if name in TABLE.real_arrays else int))

    def accelerations(block, params, out):
        """M | f | ∂r/∂λ | B | h | ḣ | γ | captured | T | limits, of friction μ p that slides."""
        R = B.T.copy()
        slips, lam = block[K.o_slip :], block[K.o_lam :]
        for f in range(frictions):
            R[:, normal[f]] += slips[f] * (-mu) * B[friction_row[f]]
        limits = [-mu * lam[normal[f]] for f in range(frictions)]
        out[:] = np.concatenate(
            [
                M.ravel(),
                np.zeros(n),
                R.ravel(),
                B.ravel(),
                np.zeros(rows),
                B @ velocity,
                np.zeros(rows + 1),
                limits or [0.0],
            ]
        )

    K.code = {codes.ACCELERATIONS: accelerations}
    accelerations(K.block, None, K.acc)
    return K, B


def check(K, B, M, mu, velocity):
    """The laws of contact and friction on the solution."""
    jump, lam = K.jump, K.impulse
    size = np.abs(lam).max(initial=1e-12)
    speed = np.abs(B) @ (np.abs(velocity) + np.abs(jump)) + 1e-12
    np.testing.assert_allclose(M @ jump, -B.T @ lam, rtol=0, atol=1e-9 * (np.abs(B).max() * size + 1e-12))
    after = B @ (velocity + jump)
    for c, row in enumerate(K.normal):
        assert lam[row] <= 1e-10 * size
        assert after[row] >= -1e-9 * speed[row]
        assert abs(lam[row] * after[row]) <= 1e-8 * size * speed[row]
        if K.n_frictions:
            along, rate = lam[row + 1], after[row + 1]
            assert abs(along) <= -mu * lam[row] + 1e-9 * size
            assert along * rate >= -1e-9 * size * speed[row + 1]
            if abs(rate) > 1e-8 * speed[row + 1] and lam[row] < -1e-9 * size:
                assert abs(along) == pytest.approx(-mu * lam[row], rel=1e-8)
        assert K.active[c] in (0, 1)


def random_mass(rng, n):
    root = rng.normal(size=(n, n))
    return root @ root.T + 0.1 * np.eye(n)


@settings(max_examples=80)
@given(st.integers(0, 10**6), st.integers(2, 6), st.integers(1, 6))
def test_frictionless_contacts_of_any_number_complement(seed, n, contacts):
    rng = np.random.default_rng(seed)
    M, normals, velocity = random_mass(rng, n), rng.normal(size=(contacts, n)), rng.normal(size=n)
    K, B = scene(M, normals, None, 0.0, velocity)
    status = complementarity(K, 1)
    assert status == 0
    check(K, B, M, 0.0, velocity)


@settings(max_examples=80)
@given(st.integers(0, 10**6), st.integers(2, 4))
def test_contacts_that_are_there_twice_or_hang_together_share_their_load(seed, contacts):
    """Rank-deficient rows: copies, and sums of others; the motion is that without them."""
    rng = np.random.default_rng(seed)
    n = contacts + 1
    M, velocity = random_mass(rng, n), rng.normal(size=n)
    normals = rng.normal(size=(contacts, n))
    more = np.vstack([normals, normals[0], 2.0 * normals[1]])
    plain, _ = scene(M, normals, None, 0.0, velocity)
    twice, B = scene(M, more, None, 0.0, velocity)
    assert complementarity(plain, 1) == complementarity(twice, 1) == 0
    check(twice, B, M, 0.0, velocity)
    np.testing.assert_allclose(twice.jump, plain.jump, rtol=0, atol=1e-9)


@settings(max_examples=80)
@given(st.integers(0, 10**6), st.integers(2, 4))
def test_held_rows_that_hang_together_and_are_met_but_for_round_off_do_not_conflict(seed, contacts):
    """All that is left of their velocities is round-off of terms of size one, which no motion takes away."""
    rng = np.random.default_rng(seed)
    n = contacts + 1
    M, normals = random_mass(rng, n), rng.normal(size=(contacts, n))
    more = np.vstack([normals, rng.normal(size=(3, contacts)) @ normals])
    velocity = np.linalg.svd(normals)[2][-1]
    K, B = scene(M, more, None, 0.0, velocity)
    K.free[:] = 0
    K.bias[:] += rng.uniform(-1.0, 1.0, len(B)) * 1e-16
    assert complementarity(K, 1) == 0
    np.testing.assert_allclose(K.jump, 0.0, atol=1e-13)


@settings(max_examples=120)
@given(st.integers(0, 10**6), st.integers(1, 4), st.sampled_from([0.05, 0.3, 0.9]))
def test_contacts_with_friction_obey_coulombs_law(seed, contacts, mu):
    rng = np.random.default_rng(seed)
    n = 2 * contacts + int(rng.integers(0, 3))
    M = random_mass(rng, n)
    normals, tangents = rng.normal(size=(contacts, n)), rng.normal(size=(contacts, n))
    velocity = rng.normal(size=n)
    K, B = scene(M, normals, tangents, mu, velocity)
    status = complementarity(K, 1)
    assert status in (0, codes.NO_IMPACT)
    if status == 0:
        check(K, B, M, mu, velocity)
    else:  # no answer may be given up that is there
        assert not any_solution(M, B, mu, velocity)


def any_solution(M, B, mu, velocity):
    """Whether some set of branches obeys all laws, by trying every one with dense algebra."""
    contacts = len(B) // 2
    D = B @ np.linalg.solve(M, B.T)
    start = B @ velocity
    for number in range(4**contacts):
        branches = [(number // 4**c) % 4 for c in range(contacts)]
        A, b = np.zeros((2 * contacts, 2 * contacts)), np.zeros(2 * contacts)
        for c, branch in enumerate(branches):  # unknown pushes p and frictions t: λ = (−p, t)
            N, T = 2 * c, 2 * c + 1
            if branch == 0:
                A[N, N] = A[T, T] = 1.0
                continue
            A[N], b[N] = D[N], -start[N]
            if branch == 1:
                A[T], b[T] = D[T], -start[T]
            else:
                A[T, T], A[T, N] = 1.0, (1.0 if branch == 2 else -1.0) * mu
        try:
            force = np.linalg.solve(A, b)
        except np.linalg.LinAlgError:
            continue
        after = start + D @ force
        good = True
        for c, branch in enumerate(branches):
            N, T = 2 * c, 2 * c + 1
            if branch == 0:
                good &= after[N] > 1e-7
            else:
                good &= force[N] > 1e-7
                good &= abs(force[T]) < mu * force[N] - 1e-7 if branch == 1 else force[T] * after[T] < -1e-7
        if good:
            return True
    return False


def test_where_no_set_of_branches_holds_it_says_so():
    """One contact that slides so that its push makes it approach, B_n M⁻¹ (B_n − μ s B_T)ᵀ = −3.99."""
    normal, tangent = np.array([[0.1, 1.0]]), np.array([[1.0, 0.0]])
    K, _ = scene(np.eye(2), normal, tangent, 50.0, np.array([-3.0, -1.0]))
    K.loose[0], K.sticks[0], K.slip[0] = 0, 0, 1.0
    assert complementarity(K, 1) == codes.NO_IMPACT
    K, B = scene(np.eye(2), normal, tangent, 50.0, np.array([-3.0, -1.0]))
    assert complementarity(K, 1) == 0, "free to choose, it sticks"
    check(K, B, np.eye(2), 50.0, np.array([-3.0, -1.0]))


def test_feet_that_brake_together_share_friction_in_the_ratio_of_their_limits():
    """Two contacts of one body along one line: their tangent rows are the same."""
    M = np.diag([2.0, 2.0, 0.2])
    normals = np.array([[0.0, 1.0, -0.25], [0.0, 1.0, 0.25]])
    tangents = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    velocity = np.array([0.1, -1.0, 0.4])
    K, B = scene(M, normals, tangents, 0.5, velocity)
    assert complementarity(K, 1) == 0
    check(K, B, M, 0.5, velocity)
    assert list(K.sticks) == [1, 1]
    shares = K.impulse[[1, 3]] / K.impulse[[0, 2]]
    assert shares[0] == pytest.approx(shares[1], rel=1e-9)


def test_a_body_that_nothing_can_hold_is_an_error_of_the_run():
    """A foot that must stay on a floor and on a wall that moves away from each other."""
    model = mbd.Model("torn", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, body.origin))
    model.constrain(
        mbd.Bilateral("pull", mbd.measure("rail.displacement"), value=lambda t: -0.1 * t),
        mbd.Unilateral("stop", mbd.measure(lambda x: x + 0.05, "rail.displacement")),
    )
    start = mbd.assemble(model, velocity={"rail.displacement": -0.1})
    with pytest.raises(mbd.SimulationError, match="conflict|no forces or impulses"):
        mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=1.0)
