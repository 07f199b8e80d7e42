"""Forces far steeper than a step resolves: a run is right, or fails with an error, or says that dt is large."""

import numpy as np
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


def law_of(roots, steepness):
    """``−Π (v − v_i)``, which leads v to every second one of its zeros, of a slope of the steepness [1/s] at most."""
    v = np.linspace(roots[0], roots[-1], 400)
    size = steepness / np.max(np.abs(np.gradient(np.prod([v - root for root in roots], axis=0), v)))

    def law(v):
        force = -float(size)
        for root in roots:
            force = force * (v - float(root))
        return force

    return law


@pytest.mark.parametrize("scheme", [mbd.RadauIIA()], ids=str)
def test_a_step_ends_where_forces_lead_and_not_behind_a_place_from_which_they_push_back(scheme):
    """Every eighth run came to a zero of the law beyond one from which the law leads away, one of them silently."""
    ended, told = 0, 0

    @settings(max_examples=60)
    @given(
        first=st.floats(-1.5, 0.0),
        gaps=st.lists(st.floats(0.4, 1.0), min_size=2, max_size=4).filter(lambda gaps: len(gaps) % 2 == 0),
        exponents=st.tuples(st.floats(-3.0, 6.0), st.floats(0.0, 4.0)),
        parts=st.lists(st.floats(-0.3, 1.3), min_size=4, max_size=4),
    )
    def holds(first, gaps, exponents, parts):
        nonlocal ended, told
        roots, steepness = first + np.cumsum([0.0, *gaps]), 10.0 ** exponents[0]
        model = mbd.Model("pushed mass", gravity=(0.0, 0.0, 0.0))
        mass = mbd.PointMass("mass", mass=1.0)
        rail = mbd.Prismatic("rail", model.ground.origin, mass.origin)
        model.connect(rail)
        model.apply(mbd.Motor("law", rail, force=law_of(roots, steepness), arguments=["rail.rate"]))
        dt = 10.0 ** exponents[1] / steepness
        walls = np.array([-np.inf, *roots[1::2], np.inf])
        for part in parts:
            speed = float(roots[0] + part * (roots[-1] - roots[0]))
            start = mbd.assemble(model, velocity={"rail.displacement": speed})
            run = mbd.simulate(model, start, scheme, dt=dt, until=5.0 * dt, on_failure="return")
            basin = int(np.searchsorted(walls, speed)) - 1
            if run.success and np.min(np.abs(walls - speed)) > 0.02:
                ended += 1
                if not walls[basin] - 1e-3 < run["rail.rate"][-1] < walls[basin + 1] + 1e-3:
                    assert any("dt is large" in note for note in run.stats["notes"])
                    told += 1

    holds()
    assert ended > 30 and told <= ended // 30
