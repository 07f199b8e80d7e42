"""Feet that slide, more of them than determine how they share their load."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

import mbd

FEET = (-0.2, 0.05, 0.2)


def sliding_block() -> mbd.Model:
    """A block on three feet in a line, under a load that changes."""
    model, block = mbd.Model("block"), mbd.RigidBody("block", 2.0, (0.02, 0.03, 0.025))
    model.connect(mbd.Planar("place", model.ground.origin, block.origin))
    for k, x in enumerate(FEET):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(block.point(x, -0.05)), friction=0.2))
    load = lambda t: (3.0 * mbd.sin(9.0 * t), -2.0 * mbd.cos(7.0 * t) - 1.0, 0.0)  # noqa: E731
    model.apply(mbd.Applied("load", block.origin, force=load))
    return model


BLOCK = sliding_block()


@given(st.lists(st.floats(0.05, 0.5), min_size=3, max_size=3))
def test_schemes_agree_on_how_feet_that_slide_share_their_load(coefficients):
    """Loads follow the frictions, which follow the loads: at every stage of a step."""
    parameters = {f"foot {k}.mu": mu for k, mu in enumerate(coefficients)}
    start = mbd.assemble(BLOCK, position={"place.y": 0.05}, velocity={"place.x": 1.5}, parameters=parameters)
    ends = [
        mbd.simulate(BLOCK, start, scheme, dt=2e-3, until=0.1, parameters=parameters)["place.x"][-1]
        for scheme in (mbd.RadauIIA(), mbd.RungeKutta853())
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)
