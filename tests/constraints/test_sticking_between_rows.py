"""What a foot holds where it sticks after a slide is what forces between rows are made from, on curved ground too."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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


@settings(max_examples=12)
@given(curvature=st.floats(-1.0, 1.5), lean=st.floats(-0.4, 0.4), speed=st.floats(-0.6, -0.2))
def test_forces_of_a_foot_that_sticks_after_a_slide_are_right_between_rows(curvature, lean, speed):
    model, start = sliding_rod(curvature, lean, speed)
    exact = mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-10, until=0.25)
    stuck = [event.time for event in exact.events if event.kind == "stuck"]
    loosened = [event.time for event in exact.events if event.kind in ("slipped", "open")]
    end = min([t for t in loosened if stuck and t > stuck[0]], default=0.25)
    if not stuck or end - stuck[0] < 0.02:
        return
    times = np.linspace(stuck[0] + 2e-3, end - 2e-3, 40)
    for scheme in (mbd.RadauIIA(), mbd.RungeKutta853()):
        run = mbd.simulate(model, start, scheme, dt=0.02, until=0.25)
        for name in ("foot.force", "foot.friction.forward"):
            assert run.at(times)[name] == pytest.approx(exact.at(times)[name], abs=2e-4), name
