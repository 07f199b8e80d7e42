"""The change of a posture that its rows ask for, by the inverse of many rows and by least squares of dependent ones."""

import numpy as np

import mbd
from mbd.assembly import foreseen, posture
from mbd.compile.mechanisms import is_known, mechanism_of
from mbd.compile.orders import MIN_UNKNOWNS


def test_rows_hold_and_the_change_is_least_whether_rows_depend_on_others_or_not():
    random, ways = np.random.default_rng(2), []
    for _ in range(40):
        n = int(random.integers(30, 60))
        m, repeated = int(random.integers(5, n - 3)), int(random.integers(0, 3))
        root = random.normal(size=(n, n))
        M, B = root @ root.T + np.eye(n), random.normal(size=(m, n))
        B = np.vstack([B, B[:repeated]])
        residual, pull = B @ random.normal(size=n), random.normal(size=n)
        change = posture._LeastChange(M, B)
        d = change(residual, pull)
        assert np.allclose(B @ d, -residual, atol=1e-6)
        free = np.linalg.svd(B)[2][m:]  # what moves no row has no force along it
        assert np.allclose(free @ M @ (d - pull), 0.0, atol=1e-6 * np.max(np.abs(M)))
        ways.append((change.inverse is not None, repeated > 0, len(B) >= MIN_UNKNOWNS))
    assert all(inverse == (large and not repeated) for inverse, repeated, large in ways)
    assert {inverse for inverse, _, _ in ways} == {True, False}


def test_a_large_chain_described_anew_is_not_examined_again(monkeypatch):
    def chain(mass=1.0):
        model, end = mbd.Model("chain"), None
        for k in range(70):
            rod = mbd.Link(f"rod {k}", length=1.0, mass=mass, center=0.5, inertia=0.1)
            model.connect(mbd.Revolute(f"hinge {k}", model.ground.origin if end is None else end, rod.start))
            end = rod.end
        return model

    asked, faults = [], foreseen.faults
    monkeypatch.setattr(foreseen, "faults", lambda model: asked.append(model) or faults(model))
    first = mbd.assemble(chain(), position={"hinge 0.angle": 0.3})
    assert len(asked) == 1
    assert is_known(again := chain())
    assert not is_known(chain(2.0))
    assert np.array_equal(mbd.assemble(again, position={"hinge 0.angle": 0.3}).q, first.q)
    assert len(asked) == 1
    assert mechanism_of(again) is mechanism_of(chain())
