"""What a run decides hangs on the motion: not on the last bit of its start, on who computes, or on fused products."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mbd
from mbd.compile.cache import default_cache
from mbd.compile.host import TURNED_OFF, host
from mbd.equations import programs
from tests.simulation import singular_linkages
from tests.simulation.mechanisms import box, kneed_walker, kneed_walker_start

OMEGA = 150.0
DECISIONS = ("steps", "shortened", "singular_steps", "restarts", "events", "impacts", "modes")
"""Counts of a run that tell which way it went."""


@cache
def driven_slider_crank(cut):
    """A crank without mass turned at a constant speed, as in case c3, and its start with both links along x."""
    crank, length = 0.15, 0.3
    model = mbd.Model("slider-crank", gravity=(0.0, 0.0, 0.0), cut=cut)
    arm = mbd.Link("crank", mass=0.0, length=crank, center=0.5 * crank)
    rod = mbd.Link("rod", mass=0.151104, length=length, center=0.5 * length, inertia=0.151104 * length**2 / 12)
    slider = mbd.PointMass("slider", mass=0.075552)
    main = mbd.Revolute("main bearing", model.ground.origin, arm.start)
    model.connect(
        main, mbd.Revolute("crank pin", arm.end, rod.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin), mbd.Revolute("wrist", rod.end, slider.origin),
    )  # fmt: skip
    model.constrain(mbd.Bilateral("drive", main, value=lambda t: 0.5 * np.pi + OMEGA * t))
    return model, mbd.assemble(model, position={"main bearing.angle": 0.5 * np.pi, "guide.displacement": 0.45})


@cache
def slow_slider_crank():
    """Crank and rod of 0.7 m, flat twice."""
    return singular_linkages.slider_crank(0.7, turn=5.0, until=0.6)


@cache
def scenes():
    """Name → model and start, end, steps: singular configurations are passed, contacts close, slip and open."""
    walker, tumbling = kneed_walker(), box(0.3)
    falls = mbd.assemble(tumbling, {"place.y": 0.6, "place.angle": 0.3}, {"place.angle": 0.5, "place.x": 0.2})
    found = {name: (*make.start, until) for name, make, until in (
        ("equal rods", singular_linkages.slider_crank(1.0), 0.5), ("four-bars", singular_linkages.four_bars(1), 0.6),
    )}  # fmt: skip
    found |= {"walker": (walker, kneed_walker_start(walker), 0.7), "box": (tumbling, falls, 0.6)}
    found |= {f"driven, {cut} cut": (*driven_slider_crank(cut), 8e-4) for cut in ("all", ("guide",))}
    return found


def last_bits(start, seed):
    """The start with each number moved by one unit in its last place, up, down or not."""
    rng = np.random.default_rng(seed)

    def moved(numbers):
        return np.nextafter(numbers, numbers + rng.integers(-1, 2, len(numbers)))

    return replace(start, q=moved(start.q), v=moved(start.v))


def decisions(model, start, scheme, dt, until, backend="auto"):
    """The counts, and kind and name of every event."""
    run = mbd.simulate(model, start, scheme, dt=dt, until=until, backend=backend)
    return [run.stats[count] for count in DECISIONS], [[event.kind, event.name] for event in run.events]


SCHEMES = (mbd.GeneralizedAlpha(0.9), mbd.HHT(0.05), mbd.RungeKutta853())


def judged(seed):
    """What a run decides whose scene, scheme and dt belong to a seed."""
    rng = np.random.default_rng(seed)
    model, start, until = list(scenes().values())[seed % len(scenes())]
    scheme = SCHEMES[rng.integers(len(SCHEMES))]
    return model, start, scheme, until / np.exp(rng.uniform(np.log(40), np.log(250))), until


@pytest.mark.parametrize("seed", range(48))
def test_the_last_bit_of_a_start_decides_nothing(seed):
    model, start, *rest = judged(seed)
    expected = decisions(model, start, *rest)
    for nudge in range(2):
        assert decisions(model, last_bits(start, nudge), *rest) == expected


@pytest.mark.parametrize("seed", range(4))
def test_the_last_bit_decides_nothing_where_residuals_of_collocation_fall_no_more(seed):
    """Next to a singular configuration round-off stays above the tighter tolerance, below the one asked for."""
    rng = np.random.default_rng(seed)
    dts = [0.0003108964665420226, 0.0004457383265439875, *10.0 ** rng.uniform(-3.5, -2.5, 2)]
    case = slow_slider_crank()
    model, start = case.start
    for dt in dts if seed == 0 else dts[2:]:
        expected = decisions(model, start, mbd.RadauIIA(), dt, case.until)
        for nudge in range(3):
            assert decisions(model, last_bits(start, nudge), mbd.RadauIIA(), dt, case.until) == expected


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(12))
def test_machine_code_and_plain_python_decide_alike(seed):
    model, start, scheme, dt, until = judged(seed)
    dt = max(dt, until / 60)
    assert decisions(model, start, scheme, dt, until) == decisions(model, start, scheme, dt, until, "python")


@pytest.mark.usefixtures("made_afresh")
@pytest.mark.parametrize("tried", ["as it is", "massless coordinates among the pivots"])
def test_a_pivot_of_round_off_leads_no_step_astray(tried, monkeypatch):
    """A massless coordinate has a geometric stiffness of round-off: no pivot; and if it were, a search takes over."""
    factors = programs.factors
    if tried != "as it is":
        monkeypatch.setattr(programs, "factors", lambda matrix, n, most, massless: factors(matrix, n, most))
    model, start = driven_slider_crank.__wrapped__(("guide",))  # a model of its own, with code of its own
    for dt in np.geomspace(1e-5, 3e-5, 24):
        for nudge in range(2):
            run = mbd.simulate(model, last_bits(start, nudge), mbd.GeneralizedAlpha(0.9), dt=dt, until=40 * dt)
            assert run.stats["steps"] == 40 and run.stats["shortened"] == 0
            assert run.stats["residuals"] <= 90 and run.stats["tangents"] <= 90


# without fused products ----------------------------------------------------------------------------------------------
SEEDS = range(0, 12, 3)


def tell():
    """What the scenes of the first seeds decide, as a line; and whether products are fused."""
    print(json.dumps([host().fused, [decisions(*judged(seed)) for seed in SEEDS]]))


@pytest.mark.skipif(not host().fused, reason="this machine, or this build, fuses no products anyway")
def test_without_fused_products_the_same_is_decided():
    code = """if True:
        from functools import partial
        from mbd.kernel import build
        from tests.kernel.test_decisions import tell
        build.object_of = partial(build.object_of, level=0)  # the same bits in a fifth of the time
        tell()"""
    environment = {**os.environ, TURNED_OFF: ",".join(filter(None, [os.environ.get(TURNED_OFF), "-fma"]))}
    if (place := default_cache().directory) is not None:  # that kernel is for nobody else
        environment["MBD_CACHE"] = str(place.with_name("objects for tests"))
    found = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=600, check=True
    )
    fused, told = json.loads(found.stdout)
    assert not fused
    assert told == json.loads(json.dumps([decisions(*judged(seed)) for seed in SEEDS]))


@pytest.mark.parametrize(
    ("asked", "said"), [("fma", "with a minus"), ("-fmaa", "did you mean -fma"), ("-nonsense", "-nonsense")]
)
def test_a_feature_that_is_none_of_the_processor_is_refused_by_name(asked, said):
    code = "from mbd.compile.host import host; host()"
    found = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, TURNED_OFF: asked}, capture_output=True, text=True, timeout=120
    )
    assert found.returncode == 1
    assert TURNED_OFF in found.stderr and said in found.stderr
