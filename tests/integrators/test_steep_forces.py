"""Forces far steeper than a step resolves: a run is right, or fails with an error, or says that dt is large."""

from __future__ import annotations

import pytest
from hypothesis import given, settings, strategies as st

import mbd


@pytest.mark.parametrize("scheme", [mbd.RadauIIA(), mbd.HHT(), mbd.Newmark(), mbd.RungeKutta853(), mbd.RungeKutta4()])
def test_a_speed_that_a_steep_law_leads_to_1_comes_there_or_the_run_ends_by_name(scheme):
    model = mbd.Model("pushed mass", gravity=(0.0, 0.0, 0.0))
    mass = mbd.PointMass("mass", mass=1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, mass.origin)
    model.connect(rail)
    model.apply(mbd.Motor("law", rail, force=lambda v: 1e4 * (v - v**3), arguments=["rail.rate"]))
    runs = 0

    @settings(max_examples=25)
    @given(speed=st.floats(0.3, 4.0), exponent=st.floats(-5.0, -1.5))
    def holds(speed, exponent):
        nonlocal runs
        runs += 1
        start = mbd.assemble(model, velocity={"rail.displacement": speed})
        dt = 10.0**exponent
        run = mbd.simulate(model, start, scheme, dt=dt, until=max(0.02, 5.0 * dt), on_failure="return")
        if run.success and not any("not resolved" in note or "dt is large" in note for note in run.stats["notes"]):
            assert 0.5 < run["rail.rate"][-1] < 1.5  # −1 is another solution, which no speed above 0 leads to

    holds()
    assert runs >= 20
