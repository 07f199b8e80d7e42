"""Programs of contact modes as sums of their parts are those that are derived for the mode alone."""

import numpy as np
import pytest

import mbd
from mbd.compile import backend as backends, mechanism as mechanisms
from mbd.compile.cache import ObjectCache
from mbd.compile.composed import Composed
from mbd.compile.mechanism import Mechanism
from mbd.compile.orders import written
from mbd.equations.composition import composes
from mbd.equations.derivation import derive
from mbd.equations.programs import ActiveSet


def floor(space=True, soft=False):
    """Balls, or bodies in the plane, above a floor; two of them keep one height, and each third foot may be soft."""
    model = mbd.Model("balls", gravity=(0.0, -9.81, 0.0))
    for k in range(9):
        if space:
            body = mbd.RigidBody(f"ball {k}", 1.0 + 0.1 * k, (0.004, 0.005, 0.006))
            model.connect(mbd.Free(f"fly {k}", model.ground.origin, body.origin))
            touch = mbd.sphere_touchdown(body.origin, 0.1)
        else:
            body = mbd.RigidBody(f"ball {k}", 1.0 + 0.1 * k, 0.004)
            model.connect(mbd.Planar(f"fly {k}", model.ground.origin, body.origin))
            touch = mbd.touchdown(body.point(0.03, -0.1, name="foot"))
        if soft and k % 3 == 0:
            model.constrain(mbd.Penalty(f"touch {k}", touch, 1e5, friction=0.2))
        else:
            model.constrain(mbd.Unilateral(f"touch {k}", touch, friction=0.3))
    model.constrain(mbd.Bilateral("tie", mbd.measure(lambda a, b: a - b, "fly 0.y", "fly 1.y")))
    return model


SCENES = {"space": {}, "plane": {"space": False}, "soft": {"soft": True}}


@pytest.mark.parametrize(("name", "backend"), [*((name, "llvm") for name in SCENES), ("plane", "python")])
@pytest.mark.parametrize("stabilized", [False, True])
def test_a_sum_of_parts_is_the_program_of_the_mode(name, stabilized, backend, monkeypatch):
    model = floor(**SCENES[name])
    whole, parts = Mechanism(derive(model), backend), Mechanism(derive(model), backend)
    assert composes(parts.equations)
    monkeypatch.setattr(mechanisms, "composes", lambda equations: equations is parts.equations)
    equations, random = parts.equations, np.random.default_rng(3)
    parameters, layout = parts.parameters(), parts.layout
    for _ in range(2):
        block = random.uniform(-1.0, 1.0, layout.size)
        closed = random.random(len(equations.contacts)) < 0.6
        slips = [f for f, friction in enumerate(equations.frictions) if closed[friction.contact] and f % 4 < 2]
        rows = tuple(
            k
            for k, row in enumerate(equations.rows)
            if row.contact < 0 or (closed[row.contact] and row.friction not in slips)
        )
        pushing = tuple(c for c, contact in enumerate(equations.contacts) if closed[c] and contact.kind == "penalty")
        mode = ActiveSet(rows, pushing, stabilized, tuple(slips))
        one, other = whole.mode(mode), parts.mode(mode)
        assert other.order is not None and isinstance(other.tangent, Composed) and not isinstance(one.tangent, Composed)
        for program in ("tangent", "residual"):
            a, b = getattr(one, program), getattr(other, program)
            assert a.size == b.size
            found, left, cleared = np.zeros(a.size), np.full(a.size, np.nan), np.zeros(a.size)
            a(block, parameters, found)
            b(block, parameters, left)
            b(block, parameters, cleared)
            close = {"rtol": 1e-11, "atol": 1e-11 * np.max(np.abs(found))}
            np.testing.assert_allclose(cleared, found, **close)
            asked = np.ones(a.size, dtype=bool)
            if program == "tangent":  # of an eliminated matrix what its order asks for
                matrix, turning = written(other.order, layout.n, layout.n_v, stabilized)
                asked[: (layout.n + len(rows)) ** 2] = False
                asked[len(asked) - len(rows) * layout.n_v * stabilized :] = False
                asked[matrix], asked[turning] = True, True
                assert not found[~asked].any()
            np.testing.assert_allclose(left[asked], found[asked], **close)


@pytest.mark.parametrize("scheme", [mbd.HHT(alpha=0.05), mbd.HHT(formulation="index3"), mbd.RadauIIA()])
def test_a_run_of_modes_of_parts_is_that_of_whole_modes(scheme, monkeypatch):
    """Matrices of which only what an order asks for is written, between impacts of one body after the other."""
    ends = []
    for whole in (False, True):
        if whole:
            monkeypatch.setattr(mechanisms, "composes", lambda equations: False)
        model = floor(space=False)
        start = mbd.assemble(
            model, position={f"fly {k}.y": 0.11 + 0.002 * max(k, 1) for k in range(9)},
            velocity={f"fly {k}.x": 0.2 + 0.01 * k for k in range(9)},
        )  # fmt: skip
        ends.append(mbd.simulate(model, start, scheme, dt=1e-3, until=0.12, contact="events", progress=False))
    parts, run = ends
    assert [event.name for event in parts.events] == [event.name for event in run.events]
    for k in range(9):
        for column, close in (("x", 1e-9), ("y", 1e-9), ("x.rate", 1e-7), ("y.rate", 1e-7)):
            name = f"fly {k}.{column}"
            np.testing.assert_allclose(parts[name][-1], run[name][-1], rtol=0.0, atol=close, err_msg=name)


def test_parts_of_which_some_are_remembered_are_the_same(tmp_path, monkeypatch):
    """Modes asked for in another order number the nodes of their parts in another way."""
    monkeypatch.setattr(mechanisms, "choose_backend", lambda cache: backends.backend("llvm", 0, cache))
    model, cache = floor(space=False), ObjectCache(tmp_path)
    rows, random = derive(model).rows, np.random.default_rng(5)
    held = [range(9), range(4), range(3, 9), (0, 8)]
    modes = [ActiveSet(tuple(k for k, row in enumerate(rows) if row.contact in {-1, *each})) for each in held]
    modes += [mode._replace(stabilized=False) for mode in modes[:2]]

    def values(modes, cache):
        found = Mechanism(derive(model), cache)
        block = np.random.default_rng(4).uniform(-1.0, 1.0, found.layout.size)
        outputs = {}
        for mode in modes:
            code = found.mode(mode)
            outputs[mode] = np.zeros(code.tangent.size)
            code.tangent(block, found.parameters(), outputs[mode])
        return outputs

    expected = values(modes, ObjectCache())
    for _ in range(8):
        for mode, found in values([modes[k] for k in random.permutation(len(modes))[:4]], cache).items():
            np.testing.assert_allclose(found, expected[mode], rtol=1e-12, atol=1e-12 * np.abs(expected[mode]).max())
        for path in sorted(tmp_path.iterdir()):
            if random.random() < 0.2:
                path.unlink()
