"""Derivatives of runs with impulses of the user's at strikes, against central differences of fourth order."""

import random

import numpy as np
import pytest

import mbd
from mbd.sensitivity.asked import with_inputs
from tests.simulation.test_strike_impulses import ALPHA, INERTIA, wheel

SCHEMES = {"RungeKutta853": (mbd.RungeKutta853(), 0.02), "RadauIIA": (mbd.RadauIIA(), 0.02), "HHT": (mbd.HHT(), 0.005)}


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("order", ["before", "with", "after"])
def test_pushes_that_depend_on_the_motion_are_differentiated(order, scheme):
    """P = a − b ω of the speed just before, or a number: by masses, gravity, and that number."""
    rng = random.Random(f"{order} {scheme}")
    a, b = rng.uniform(0.3, 0.6), rng.uniform(0.1, 0.3)
    by_speed = {"size": lambda w: a - b * w, "arguments": ["float.angle.rate"]}
    integrator, dt = SCHEMES[scheme]
    until = 0.35 if order == "after" else 0.8  # it leaves the ground then
    for more in (by_speed, {"size": a + b}):
        model, start = wheel(order, **more)
        names = ["hub.mass", "gravity.y"] + (["push 1.size"] if more is not by_speed else [])
        found = mbd.sensitivities(model, start, integrator, dt, until=until, wrt=names)
        assert sum(event.kind == "pushed" for event in found.run.events) >= (1 if order == "after" else 2)
        model = with_inputs(model, "auto", {}, names)
        known = dict(zip(found.run.record.parameter_names, found.run.record.parameters, strict=False))
        for k, name in enumerate(names):
            size, values = 1e-4 * abs(known[name]), []
            for part in (-2, -1, 1, 2):
                changed = {name: known[name] + part * size}
                run = mbd.simulate(model, start, integrator, dt, until=until, contact="events", parameters=changed)
                values.append(np.concatenate([run.final.q, run.final.v]))
            expected = (values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * size)
            np.testing.assert_allclose(found.matrix[: len(expected), k], expected, rtol=1e-7, atol=1e-8)


def test_the_speed_after_a_push_follows_its_size_as_the_momentum_about_the_new_spoke():
    """``(J + 1) ω⁺ = (J + cos 2α) ω⁻ + P sin 2α`` with ω = −dθ/dt."""
    model, start = wheel()
    found = mbd.sensitivities(model, start, mbd.RungeKutta853(), 0.02, until="spoke 1", wrt=["push 1.size"],
                              of=["float.angle.rate"])  # fmt: skip
    assert [event.kind for event in found.run.events][-2:] == ["pushed", "closed"]
    expected = -np.sin(2.0 * ALPHA) / (INERTIA + 1.0)
    assert found["float.angle.rate", "push 1.size"] == pytest.approx(expected, rel=1e-9)
