"""What a foot holds where it sticks after a slide is what forces between rows are made from, on curved ground too."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd


def sliding_rod(curvature: float, lean: float, speed: float) -> tuple[mbd.Model, mbd.State]:
    """A rod on one foot that slides along a valley or a hill and tips over."""
    model = mbd.Model("rod on curved ground")
    rod = mbd.Link("rod", mass=1.2, length=0.8, center=0.4, inertia=0.05)
    model.connect(mbd.Planar("flight", model.ground.origin, rod.start))
    ground = lambda x: 0.5 * curvature * x**2  # noqa: E731
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(rod.start, ground=ground), friction=0.6))
    start = mbd.assemble(
        model,
        position={"flight.x": 0.3, "flight.y": 0.5 * curvature * 0.09, "flight.angle": np.pi + lean},
        velocity={"flight.x": speed, "flight.y": curvature * 0.3 * speed, "flight.angle": 0.0},
        closed="foot",
    )
    return model, start


def test_forces_of_a_foot_that_sticks_after_a_slide_are_right_between_rows():
    compared = 0

    @settings(max_examples=15)
    @given(
        curvature=st.sampled_from((-0.8, 0.5, 1.3)), lean=st.floats(-0.4, 0.4), speed=st.floats(-1.5, -0.8)
    )  # fmt: skip
    def holds(curvature, lean, speed):
        nonlocal compared
        model, start = sliding_rod(curvature, lean, speed)
        exact = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-10, until=0.3)
        stuck = next((event.time for event in exact.events if event.kind == "stuck"), 1.0)
        ends = [event.time for event in exact.events if event.kind in ("slipped", "opened") and event.time > stuck]
        times = np.linspace(stuck + 2e-3, min([*ends, 0.3]) - 2e-3, 40)
        if times[-1] < times[0] + 0.02:
            return
        compared += 1
        for scheme in (mbd.RadauIIA(), mbd.RungeKutta853()):
            run = mbd.simulate(model, start, scheme, dt=0.06, until=0.3)
            for name in ("foot.force", "foot.friction.forward"):
                assert run.at(times)[name] == pytest.approx(exact.at(times)[name], abs=2e-3), name

    holds()
    assert compared >= 5
