"""Round-off is judged by the accepted state, not by an iterate that was thrown far, nor by where the motion began."""

import random

import numpy as np
import pytest

import mbd


def seen_from_a_body(seed: int) -> tuple[mbd.Model, mbd.State]:
    """Two bodies that a force flings; the ground is the child of their first joint, so that M grows with its square."""
    draw = random.Random(seed).uniform
    model = mbd.Model("flung", gravity=(0.0, -9.81, 0.0))
    first, second = (mbd.RigidBody(name, mass=draw(0.5, 2.0), inertia=draw(0.05, 0.5)) for name in ("first", "second"))
    model.connect(
        mbd.Planar("seen from it", first.point(draw(-0.7, 0.7), draw(-0.7, 0.7)), model.ground.origin),
        mbd.Revolute("hinge", first.point(draw(-0.5, 0.5), draw(-0.5, 0.5)), second.origin),
    )
    force = (draw(200.0, 2000.0), draw(-500.0, 500.0), 0.0)
    model.apply(
        mbd.Applied("push", second.point(draw(-0.5, 0.5), draw(-0.5, 0.5)), force=force),
        mbd.Spring("spring", model.ground.point(3.0, 2.5), second.point(0.3, 0.2), draw(10.0, 3000.0), 1.0),
    )
    names = {"seen from it.x": 1.0, "seen from it.y": 1.0, "seen from it.angle": 3.0, "hinge.angle": 3.0}
    return model, mbd.assemble(model, position={name: draw(-size, size) for name, size in names.items()})


@pytest.mark.filterwarnings("ignore::mbd.MbdWarning")
def test_rows_that_a_thrown_iterate_came_before_keep_the_balance():
    """Steps far too long fail, by name; those that are accepted end in balance."""
    compared = 0
    for seed in range(40):
        model, start = seen_from_a_body(seed)
        run = mbd.simulate(model, start, mbd.Newmark(0.3025, 0.6), dt=0.08, until=1.0, on_failure="return")
        balance = run.columns.balance.solve(run.columns.rows).rate
        off = np.max(np.abs(run.record.a - balance), axis=1)
        assert np.all(off <= 1e-5 * np.max(np.abs(run.record.a), axis=1)), seed
        compared += len(run) - 1
    assert compared > 100


def falling_chain(seed: int) -> tuple[mbd.Model, mbd.State]:
    """Links with all joints cut that fall from rest, far faster at the end than anything was at the start."""
    rng = random.Random(seed)
    model = mbd.Model("chain", gravity=(0.0, -9.81 * 10.0 ** rng.uniform(1.0, 3.0), 0.0), cut="all")
    end, position = model.ground.origin, {}
    for k in range(rng.choice([2, 3])):
        length = rng.uniform(0.3, 1.0)
        link = mbd.Link(f"link {k}", rng.uniform(0.5, 2.0), length, 0.4 * length, 0.1)
        model.connect(mbd.Revolute(f"joint {k}", end, link.start))
        position[f"joint {k}.angle"], end = rng.uniform(-2.0, 2.0), link.end
    return model, mbd.assemble(model, position=position)


@pytest.mark.parametrize("scheme", [mbd.Newmark(), mbd.GeneralizedAlpha(1.0)], ids=str)
def test_steps_of_what_was_at_rest_are_not_shortened(scheme):
    """Rows on velocities of 30 m/s hold to the round-off of these, not to that of the start."""
    for seed in (0, 5, 7, 11, 23, 24, 27, 50, 51, 68):
        model, start = falling_chain(seed)
        run = mbd.simulate(model, start, scheme, dt=5e-4, until=0.1)
        assert not run.stats["shortened"], seed
