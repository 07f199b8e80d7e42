"""Programs of contact modes as sums of their parts are those that are derived for the mode alone."""

import numpy as np
import pytest

import mbd
from mbd.compile import mechanism as mechanisms
from mbd.compile.composed import Composed
from mbd.compile.mechanism import Mechanism
from mbd.equations.composition import composes
from mbd.equations.derivation import derive


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
        mode = rows, pushing, stabilized, tuple(slips)
        one, other = whole.mode(*mode), parts.mode(*mode)
        assert isinstance(other.tangent, Composed) and not isinstance(one.tangent, Composed)
        for program in ("tangent", "residual"):
            a, b = getattr(one, program), getattr(other, program)
            assert a.size == b.size
            found = np.full(a.size, np.nan), np.full(a.size, np.nan)
            a(block, parameters, found[0])
            b(block, parameters, found[1])
            np.testing.assert_allclose(found[1], found[0], rtol=1e-11, atol=1e-11 * np.max(np.abs(found[0])))
