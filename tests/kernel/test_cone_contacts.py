"""Branches by cones in the whole complementarity solver: degenerate, rank-deficient, infeasible problems."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from mbd.kernel import codes
from mbd.kernel.contact import complementarity as solver
from mbd.kernel.contact.complementarity import complementarity
from mbd.kernel.contact.cone_contacts import solve_cones
from mbd.kernel.contact.cone_problem import CONE_RTOL, cone_places
from mbd.kernel.records import TABLE, Kernel

seeds = st.integers(0, 2**32 - 1)


class Problem:
    """``M w + force + R λ = 0`` with held rows H, contacts of normals N and tangents T, and dry frictions D.

    mu : of each contact, 0 without friction, None for a tangent row that sticks whatever its force
    """

    def __init__(self, M, force, N=(), T=(), mu=(), H=(), D=(), limits=(), bias=(), held=()):
        self.n, self.N, self.T, self.mu = len(M), N, T, mu
        self.M, self.f = np.asarray(M, float), np.asarray(force, float)
        rows, contact, friction, who = [], [], [], []
        for h in H:
            rows.append(h), contact.append(-1), friction.append(-1)
        self.places = []
        for c, row in enumerate(N):
            self.places.append(len(rows))
            rows.append(row), contact.append(c), friction.append(-1)
            if mu[c] is None or mu[c] > 0.0:
                rows.append(T[c]), contact.append(c)
                friction.append(-1 if mu[c] is None else len(who))
                who += [] if mu[c] is None else [(len(rows) - 1, c, float(mu[c]))]
        for d, limit in zip(D, limits, strict=True):
            rows.append(d), contact.append(-1), friction.append(len(who))
            who.append((len(rows) - 1, -1, float(limit)))
        self.B, self.who, self.contacts = np.array(rows, float).reshape(len(rows), self.n), who, len(N)
        self.bias = np.resize(np.asarray(bias if len(bias) else [0.0], float), len(rows))
        self._kernel(contact, friction)
        for c in held:
            self.K.free[c] = 0

    def _kernel(self, contact, friction):
        n, rows, contacts, frictions = self.n, len(self.B), self.contacts, len(self.who)
        size, most = n + rows, 64
        values = dict.fromkeys(TABLE.integers, 0) | dict.fromkeys(TABLE.reals, 0.0)
        values |= {name: np.zeros(most * most) for name in TABLE.real_arrays}
        values |= {name: np.zeros(most * most, dtype=np.int64) for name in TABLE.integer_arrays}
        values |= {"n_v": n, "n": n, "n_rows": rows, "n_contacts": contacts, "n_frictions": frictions}
        values |= {"code": [self.evaluate], "hooks": None}
        values["cone_work"] = np.zeros(cone_places(max(rows, 1)))
        values["kkt"], values["scale"] = np.zeros(size * size), np.ones(most * most)
        K = self.K = Kernel(**values)
        K.leader[:], K.group_size[:] = np.arange(len(K.leader)), 1
        K.row_contact[:rows], K.row_friction[:rows] = contact, friction
        K.normal[:contacts] = self.places
        for f, (row, c, _) in enumerate(self.who):
            K.friction_row[f], K.friction_contact[f], K.loose[f], K.sticks[f] = row, c, 1, 1
        K.active[:contacts] = K.free[:contacts] = 1
        K.code[0](K.block, K.params, K.acc)

    def limit(self, f, lam):
        _, c, size = self.who[f]
        return size if c < 0 else -size * lam[self.places[c]]

    def evaluate(self, block, _params, out):
        rows, lam, slip = len(self.B), block[self.K.o_lam :], block[self.K.o_slip :]
        R, force = self.B.T.copy(), self.f.copy()
        for f, (row, c, size) in enumerate(self.who):
            if c >= 0:
                R[:, self.places[c]] -= slip[f] * size * self.B[row]
            else:
                force += slip[f] * size * self.B[row]
        limits = [self.limit(f, lam) for f in range(len(self.who))]
        zero = np.zeros(rows)
        parts = [self.M.ravel(), force, R.ravel(), self.B.ravel(), zero, zero, self.bias, [0.0], limits]
        flat = np.concatenate([np.asarray(part, float) for part in parts])
        out[: len(flat)] = flat

    def solve(self, level=0):
        if level == 1:
            self.K.bias[: len(self.B)] = self.bias
        return complementarity(self.K, level)

    def check(self, bound=1e-8):
        """Balance, Signorini's and Coulomb's laws, whatever the solver thinks of its solution."""
        K, rows = self.K, len(self.B)
        w, lam = K.jump[: self.n].copy(), K.impulse[:rows].copy()
        assert np.abs(self.M @ w + self.f + self.B.T @ lam).max() < bound * (1.0 + np.abs(lam).max())
        gamma, size = self.B @ w + self.bias, bound * (1.0 + np.abs(lam).max() + np.abs(w).max())
        chosen = {row for row, _, _ in self.who} | set(self.places)
        for row in set(range(rows)) - chosen:
            contact = K.row_contact[row]
            assert abs(gamma[row]) < size or (contact >= 0 and K.active[contact] == 0)
        for c, row in enumerate(self.places):
            if K.free[c]:
                assert lam[row] <= size and gamma[row] >= -size and min(-lam[row], gamma[row]) <= size
            else:
                assert abs(gamma[row]) < size
        for f, (row, _, _) in enumerate(self.who):
            limit = self.limit(f, lam)
            assert abs(lam[row]) <= limit + size
            if abs(gamma[row]) > 30 * size:
                assert abs(lam[row] - np.sign(gamma[row]) * limit) < 30 * size


@pytest.fixture
def only_cones(monkeypatch):
    """Nothing but cones changes branches; whether they were solved, as a list with one entry."""
    found = []

    def counted(K, level, allowed):
        found.append(solve_cones(K, level, allowed))
        return found[-1]

    def wrong(K, level):
        return int(not found or is_wrong(K, level))

    monkeypatch.setattr(solver, "solve_cones", counted)
    monkeypatch.setattr(solver, "change_all", wrong)
    monkeypatch.setattr(solver, "change_worst", wrong)
    return found


def is_wrong(K, level):
    """Whether the solution breaks a law."""
    faults = [solver.contact_fault(K, c, level) for c in range(K.n_contacts) if K.free[c] > 0]
    choosing = [f for f in range(K.n_frictions) if K.loose[f] > 0 and solver.is_on(K, f)]
    faults += [solver.friction_fault(K, f, level) for f in choosing]
    return max(faults, default=0.0) > 0.0


def scene(rng, contacts, dofs, frictions=0, held=0, copies=False, coefficient=0.5, level=0):
    """A random problem; all contacts can open: normals have a common direction."""
    root = rng.normal(size=(dofs, dofs))
    M = root @ root.T + 0.5 * np.eye(dofs)
    N, T = rng.normal(size=(contacts, dofs)), rng.normal(size=(contacts, dofs))
    N[:, 0] = 2.0 + np.abs(N).sum(axis=1)
    if copies:
        N[contacts // 2 :], T[contacts // 2 :] = N[: contacts - contacts // 2], T[: contacts - contacts // 2]
    H = rng.normal(size=(held, dofs))
    H[:, 0] = 0.0
    mu = rng.choice([0.0, 0.1, coefficient], contacts)
    D, limits = rng.normal(size=(frictions, dofs)), rng.uniform(0.0, 2.0, frictions)
    force = rng.normal(size=dofs) * 5.0
    if level == 0:
        return Problem(M, force, N, T, mu, H, D, limits)
    count = contacts + held + frictions + np.count_nonzero(mu)
    return Problem(M, 0.0 * force, N, T, mu, H, D, 0.0 * limits, rng.normal(size=count))


@settings(max_examples=40)
@given(contacts=st.integers(1, 5), frictions=st.integers(0, 2), held=st.integers(0, 1), seed=seeds)
def test_contacts_and_friction_obey_their_laws(contacts, frictions, held, seed):
    problem = scene(np.random.default_rng(seed), contacts, 2 * contacts + frictions + held + 1, frictions, held)
    assert problem.solve() == 0
    problem.check()


# cones alone -----------------------------------------------------------------------------------------------
@pytest.mark.covering
@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("seed", range(15))
def test_cones_alone_find_accelerations_and_impulses(only_cones, seed, level):
    rng = np.random.default_rng(seed)
    problem = scene(rng, 2 + seed % 4, 14, seed % 3, seed % 2, coefficient=0.3, level=level)
    assert problem.solve(level) == 0
    assert only_cones == [1]
    problem.check()


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(15))
def test_contacts_twice_at_one_place_are_no_obstacle(only_cones, seed):
    problem = scene(np.random.default_rng(seed), 2 + seed % 5, 4 + seed % 3, 0, seed % 2, True, coefficient=0.0)
    assert problem.solve() == 0
    assert only_cones == [1]
    problem.check()


@pytest.mark.parametrize("seed", range(2))
def test_more_contacts_than_could_be_tried_one_set_after_the_other(only_cones, seed):
    problem = scene(np.random.default_rng(seed), 9, 22, 2, 1, coefficient=0.4)
    assert problem.solve() == 0
    problem.check()


@pytest.mark.parametrize("seed", range(5))
def test_held_rows_may_depend_on_each_other(only_cones, seed):
    rng = np.random.default_rng(seed)
    problem = scene(rng, 3, 9, 1, 0)
    row = np.append(0.0, rng.normal(size=8))
    whole = Problem(problem.M, problem.f, N=problem.N, T=problem.T, mu=problem.mu, H=[row, 2.0 * row])
    assert whole.solve() == 0 and only_cones == [1]
    whole.check()


@pytest.mark.parametrize("seed", range(5))
def test_friction_of_a_contact_that_is_held_follows_its_force(only_cones, seed):
    """Its push is no unknown, but follows those that are."""
    rng = np.random.default_rng(seed)
    problem = scene(rng, 3, 9)
    pressed = problem.f + 40.0 * problem.N[0]
    whole = Problem(problem.M, pressed, N=problem.N, T=problem.T, mu=[0.3, 0.3, 0.0], held=[0])
    assert whole.solve() == 0 and only_cones == [1]
    whole.check()


@pytest.mark.parametrize("seed", range(5))
def test_contacts_under_given_impulses_choose_whether_they_part(only_cones, seed):
    """The second phase of an impact: the normal row is on or off, tangents stay."""
    problem = scene(np.random.default_rng(seed), 4, 12, level=1, coefficient=0.3)
    K = problem.K
    for c, row in enumerate(problem.places):
        K.free[c], K.parting[c], K.given[row] = 2, 1, -0.4 * (c + 1)
    assert problem.solve(1) == 0 and only_cones == [1]
    given = K.given[: len(problem.B)].copy()
    total = K.impulse[: len(problem.B)] + given
    w = K.jump[: problem.n]
    assert np.abs(problem.M @ w + problem.B.T @ total).max() < 1e-9 * (1.0 + np.abs(total).max())
    gamma = problem.B @ w + problem.bias
    for row in problem.places:
        more = -K.impulse[row]
        assert more > -1e-9 and gamma[row] > -1e-9 and min(more, gamma[row]) < 1e-9
    for f, (row, _, _) in enumerate(problem.who):
        assert abs(total[row]) <= problem.limit(f, total) + 1e-9


# where they cannot --------------------------------------------------------------------------------------------------
def solved(problem):
    return solve_cones(problem.K, 0, CONE_RTOL)


@pytest.mark.parametrize("level", [0, 1])
def test_a_vice_has_no_solution_and_says_so(level):
    """Two walls that come together: impulses without bound miss their laws by little of their own size."""
    problem = Problem(np.eye(2), np.zeros(2), N=[[1, 0], [-1, 0]], mu=[0.0, 0.0], bias=[-1.0, -1.0])
    assert problem.solve(level) in (codes.NO_IMPACT, codes.CONFLICT)


def test_masses_that_only_contacts_determine_are_left_to_newtons_method():
    problem = Problem(np.diag([1.0, 0.0]), [1.0, 1.0], N=[[0, 1]], mu=[0.0])
    assert solved(problem) == 0
    problem.K.active[0] = 1
    assert problem.solve() == 0
    assert problem.K.impulse[0] == pytest.approx(-1.0)


def test_friction_that_follows_a_pin_is_left_to_newtons_method():
    pin = Problem(np.eye(2), [0.3, 1.0], N=[[0, 1]], T=[[1, 0]], mu=[0.1])
    assert solved(pin) == 1
    assert solve_cones(Kernel(**vars(pin.K) | {"loaded": 1}), 0, CONE_RTOL) == 0


def test_tangents_without_limit_stick_while_their_contact_pushes(only_cones):
    sticking = Problem(np.eye(2), [0.3, 1.0], N=[[0, 1]], T=[[1, 0]], mu=[None])
    assert sticking.solve() == 0 and only_cones == [1]
    sticking.check()


def test_nothing_to_choose_is_nothing_found():
    assert solved(Problem(np.eye(2), [1.0, 0.0], H=[[1, 0]])) == 0


def test_a_friction_of_a_contact_that_closes_after_all_sticks_or_slides():
    """Cones that end away from a solution part the contact; that Newton's method closes it leaves no friction idle."""
    rng = np.random.default_rng(2858)
    contacts, frictions, held = int(rng.integers(2, 8)), int(rng.integers(0, 3)), int(rng.integers(0, 2))
    problem = scene(rng, contacts, 4, frictions, held, copies=True, level=1)
    status = problem.solve(1)
    assert status in (0, codes.NO_IMPACT)
    if status == 0:
        problem.check(1e-7)
