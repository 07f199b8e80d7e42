"""Feet that slide, more of them than determine how they share their load."""

import numpy as np
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


def sliding_table(order):
    """A table whose four feet stand on a floor, connected in an order."""
    model = mbd.Model("table", gravity=(0.0, 0.0, -9.81))
    top = mbd.RigidBody("top", 2.0, (0.02, 0.02, 0.01))
    model.connect(mbd.Free("float", model.ground.origin, top.origin))
    floor = mbd.Plane(normal=(0.0, 0.0, 1.0))
    for k in order:
        x, y = ((0.15, 0.1), (-0.1, 0.12), (-0.12, -0.12), (0.13, -0.09))[k]
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(top.point(x, y, -0.05), floor), friction=0.3))
    return model


@pytest.mark.parametrize("seed", range(3))
def test_a_table_that_slides_and_turns_stops_whatever_the_order_of_its_feet_and_the_scheme(seed):
    chance = np.random.default_rng(seed)
    speeds = dict(zip(("float.x", "float.y"), 0.4 * chance.normal(size=2), strict=True))
    speeds["float.angular_velocity.z"] = 3.0 * chance.normal()
    stops = {}
    for scheme in mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853():
        for order in (0, 1, 2, 3), (2, 0, 3, 1):
            model = sliding_table(order)
            start = mbd.assemble(model, {"float.z": 0.05}, speeds, closed=[f"foot {k}" for k in range(4)])
            run = mbd.simulate(model, start, scheme, dt=2e-3, until=0.5)
            assert [event.kind for event in run.events] == ["stuck"] * 4
            stops[scheme, order] = run.events[-1].time
        assert np.ptp([time for (known, _), time in stops.items() if known == scheme]) < 1e-13
    exact = stops[mbd.RungeKutta853(), (0, 1, 2, 3)]
    assert stops[mbd.RadauIIA(), (0, 1, 2, 3)] == pytest.approx(exact, abs=1e-8)
    assert stops[mbd.HHT(0.05), (0, 1, 2, 3)] == pytest.approx(exact, abs=2e-4)
