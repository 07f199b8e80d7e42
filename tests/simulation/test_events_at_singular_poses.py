"""Events next to singular configurations: they are passed where they change nothing, else named."""

from __future__ import annotations

import functools
import random
from math import pi
from typing import Any

import numpy as np
import pytest

import mbd
from tests.simulation.singular_linkages import Passage, four_bars, kite, platform, slider_crank

SCHEMES = [
    mbd.Newmark(), mbd.HHT(0.05), mbd.HHT(0.1, formulation="index3"), mbd.GeneralizedAlpha(0.7), mbd.RadauIIA(),
    mbd.RungeKutta853(),
]  # fmt: skip
BESIDE = [0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6, 1e-5, -1e-4, 1e-3, -1e-2]
"""How far beside the singular configuration events lie [rad]; a linkage takes the first and two more."""


def linkage(seed: int) -> tuple[Passage, float]:
    """A linkage of random size and speed, and where its angle is at its first singular configuration."""
    rng = random.Random(seed)
    length, turn = rng.uniform(0.4, 1.8), rng.uniform(5.0, 9.0)
    if seed % 5 == 0:
        return kite(length, length * rng.uniform(1.2, 1.8)), 0.5 * pi
    if seed % 5 == 1:
        return slider_crank(length, turn / length), pi
    if seed % 5 == 2:
        return four_bars(2, until=1.0), 0.5 * pi
    legs = (0.0, rng.uniform(0.4, 2.0)) + ((rng.uniform(2.5, 3.0),) if seed % 2 else ())
    found = platform(legs, length=length, turn=rng.choice([-1.0, 1.0]) * turn / length**0.5)
    return found, 0.5 * pi if found.start[1].v[0] > 0.0 else -0.5 * pi


free_linkage = functools.cache(linkage)
"""The same, shared: nothing is added to its model."""


@functools.cache
def with_event(seed: int, beside: float, effect: str = "") -> tuple[mbd.Model, mbd.State]:
    """The start of the linkage with an event so far beside its singular configuration, or a stop; shared."""
    found, place = linkage(seed)
    model, start = found.start
    effects: dict[str, dict[str, Any]] = {"reset": {"reset": {}}, "terminal": {"terminal": True}}
    guard = mbd.measure(lambda x: x - place - beside, found.angle, unit="rad")
    if effect == "impact":
        model.constrain(mbd.Unilateral("there", stop_at(found, place + beside), restitution=0.5))
    else:
        model.constrain(mbd.Event("there", guard, **effects.get(effect, {})))
    return model, start


def stop_at(found: Passage, place: float) -> Any:
    """The gap of a stop where the angle has this value."""
    towards = 1.0 if place > 0.0 else -1.0
    return mbd.measure(lambda x: (place - x) * towards, found.angle, unit="rad")


@functools.cache
def with_event_beyond(seed: int) -> tuple[mbd.Model, mbd.State]:
    """The start of the linkage with an event 0.2 rad beyond its singular configuration; shared."""
    found, place = linkage(seed)
    model, start = found.start
    ahead = np.sign(place - start.q[list(start.names).index(found.angle)])
    model.constrain(mbd.Event("beyond", mbd.measure(lambda x: x - place - 0.2 * ahead, found.angle, unit="rad")))
    return model, start


def plain(seed: int, scheme: mbd.Integrator, dt: float) -> mbd.Trajectory:
    """The run without the event, to just beyond the configuration."""
    run = mbd.simulate(*with_event_beyond(seed), scheme, dt=dt, until=("beyond", 2.0))
    return mbd.simulate(*free_linkage(seed)[0].start, scheme, dt=dt, until=float(run.time[-1]))


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("seed", range(5))
def test_an_event_without_effect_next_to_a_singular_configuration_is_logged_and_changes_nothing(seed, scheme):
    found, place = free_linkage(seed)
    rng = random.Random(f"{seed} {scheme!r}")
    dt = 10.0 ** rng.uniform(-3.0, -2.2)
    free = plain(seed, scheme, dt)
    for beside in (0.0, *BESIDE[1 + seed :: 5]):
        model, start = with_event(seed, beside)
        run = mbd.simulate(model, start, scheme, dt=dt, until=float(free.time[-1]))
        (event,) = run.events
        assert found.off(run) < 1e-8 + 10.0 * dt**3
        before, after = run[found.angle][event.row - 1 : event.row + 1]
        assert abs(before - place - beside) < 1e-9 and abs(after - place - beside) < 1e-9
        there = free.at(event.time)
        assert abs(there[found.angle] - place - beside) < 1e-8 + 10.0 * dt**3
        assert abs(run[f"{found.angle}.rate"][event.row] - there[f"{found.angle}.rate"]) < 1e-6 + 100.0 * dt**2
        assert abs(run[found.angle][-1] - free[found.angle][-1]) < 40.0 * dt**2 * dt
        if abs(beside) < 1e-6:
            assert run.stats["restarts"] == free.stats["restarts"]
            assert abs(run[found.angle][-1] - free[found.angle][-1]) < 1e-12  # RungeKutta853 may take other steps


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("what", ["reset", "terminal", "end", "sample", "impact"])
def test_what_cannot_happen_at_a_singular_configuration_is_named(what, scheme):
    for seed, beside in ((3, 0.0), (4, 1e-9)):
        found, _ = free_linkage(seed)
        named = "'there'"
        dt, until = 2e-3, 0.6
        if what in ("reset", "terminal", "impact"):
            model, start = with_event(seed, beside, what)
        else:
            model, start = found.start if what == "end" else linkage(seed)[0].start
            watched = with_event(seed, beside)
            time = mbd.simulate(*watched, scheme, dt=dt, until=until).events[0].time
            named = "the end of the run" if what == "end" else "sample"
            until = time if what == "end" else until
            if what == "sample":
                reads = (found.angle,)
                model.apply(mbd.Controller("clock", lambda t, values, kept: None, reads=reads, period=time))
        run = mbd.simulate(model, start, scheme, dt=dt, until=until, on_failure="return")
        assert not run.success
        assert "singular configuration" in run.message and named in run.message, run.message
        assert found.off(run) < 1e-8 + 10.0 * dt**3


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_no_note_calls_the_motion_unique_from_a_start_at_a_singular_configuration(scheme):
    model, beside = platform((0.0, 1.3)).start
    flat = mbd.assemble(model, position={"base 0.angle": 0.5 * pi, "base 1.angle": 0.5 * pi, "top 0.angle": -0.5 * pi})
    run = mbd.simulate(model, flat, scheme, dt=1e-3, until=0.3, on_failure="return")
    mbd.simulate(model, beside, scheme, dt=1e-3, until=1e-3)  # in the same arrays, before anybody reads the notes
    assert not run.success or any("not unique" in note for note in run.stats["notes"])
    assert not any("motion is unique" in note for note in run.stats["notes"])


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_results_between_rows_next_to_such_an_event_are_those_of_the_motion(scheme):
    found, _ = free_linkage(3)
    dt = 2e-3
    run, free = (mbd.simulate(*start, scheme, dt=dt, until=0.45) for start in (with_event(3, 1e-9), found.start))
    times = run.events[0].time + dt * np.linspace(-3.0, 3.0, 61)
    told = [run.at(times)[name] for name in ("base 0.angle", "base 1.angle", "base 0.angle.rate")]
    true = [free.at(times)[name] for name in ("base 0.angle", "base 0.angle", "base 0.angle.rate")]
    np.testing.assert_allclose(told, true, atol=1e-6 if scheme.order() == 2 else 1e-10)
