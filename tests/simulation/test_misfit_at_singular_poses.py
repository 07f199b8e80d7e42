"""Redundant legs that do not fit quite, through flat poses: a right motion or an error, never a wrong angle."""

from math import log10

import numpy as np
import pytest

import mbd
from tests.simulation.singular_linkages import rod


def platform(turn: float, misfit: float):
    """A body on three parallel cranks, the third of which is too long by `misfit`."""
    model, body = mbd.Model("platform"), mbd.RigidBody("platform", mass=2.0, inertia=0.3)
    for k, x in enumerate((0.0, 1.3, 0.6)):
        crank = mbd.Link(f"leg {k}", **rod(1.0 + (misfit if k == 2 else 0.0)))
        foot, top = model.ground.point(x, 0.0, name=f"foot {k}"), body.point(x, 0.0, name=f"top {k}")
        model.connect(mbd.Revolute(f"base {k}", foot, crank.start), mbd.Revolute(f"top {k}", crank.end, top))
    position = {f"base {k}.angle": 0.3 for k in range(3)} | {"top 0.angle": -0.3}
    return model, mbd.assemble(model, position=position, velocity={"base 0.angle": turn}, project=True)


@pytest.mark.parametrize("seed", range(6))
def test_what_redundant_rows_miss_counts_like_round_off_next_to_a_singular_configuration(seed):
    chance = np.random.default_rng(seed)
    turn, misfit = float(chance.uniform(5.0, 7.0)), float(10.0 ** chance.uniform(-12.5, -10.7))
    right = mbd.simulate(*platform(turn, 0.0), mbd.RungeKutta853(), dt=5e-3, until=0.6).final.q[0]
    model, start = platform(turn, misfit)
    for dt in 10.0 ** chance.uniform(log10(3e-4), log10(1e-2), 4):
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=float(dt), until=0.6, on_failure="return")
        if run.success:
            assert run.final.q[0] == pytest.approx(right, abs=1e-6)
        else:
            assert "singular configuration" in run.message and "do not fit" in run.message
