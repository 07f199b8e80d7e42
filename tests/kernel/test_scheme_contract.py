"""A scheme that stands in the list of schemes runs compiled, with rows and events, at its order."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mbd
from mbd.errors import CapabilityError
from mbd.kernel import build
from mbd.kernel.schemes import contract
from mbd.state import Mode, State
from tests.kernel.midpoint import Midpoint
from tests.simulation.mechanisms import G, ball, pendulum


@pytest.fixture(scope="module", autouse=True)
def listed():
    """The kernel with one scheme more: an entry, and a line in the list."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contract, "SCHEMES", (*contract.SCHEMES, "tests.kernel.midpoint"))
        build.entry.cache_clear()
        yield
    build.entry.cache_clear()


def crank():
    """A slider-crank that swings under its weight: a loop, whose rows hold positions."""
    model = mbd.Model("slider-crank")
    arm = mbd.Link("crank", mass=1.0, length=0.3, center=0.15, inertia=0.01)
    rod = mbd.Link("rod", mass=0.8, length=1.0, center=0.5, inertia=0.07)
    slider = mbd.PointMass("slider", mass=1.5)
    model.connect(
        mbd.Revolute("main", model.ground.origin, arm.start),
        mbd.Revolute("crank pin", arm.end, rod.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin),
        mbd.Revolute("slider pin", slider.origin, rod.end),
    )
    return model, mbd.assemble(model, position={"main.angle": 0.6}, velocity={"main.angle": 1.5})


def swing():
    model = pendulum()
    return model, mbd.assemble(model, position={"hinge.angle": 1.0})


def ends(scene, scheme, **settings):
    model, start = scene()
    found = mbd.simulate(model, start, scheme, until=0.6, **settings)
    return np.concatenate([found.record.q[-1], found.record.v[-1]]), found


@pytest.mark.parametrize("scene", [swing, crank])
def test_a_listed_scheme_runs_compiled_at_its_order(scene):
    exact, _ = ends(scene, mbd.RungeKutta853(), tol=1e-12)
    errors = []
    for dt in (0.02, 0.01, 0.005):
        found, run = ends(scene, Midpoint(), dt=dt)
        assert run.stats["compiled"]
        errors.append(np.max(np.abs(found - exact)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.2), errors


def test_it_is_the_same_interpreted():
    fast, plain = (ends(crank, Midpoint(), dt=0.01, backend=backend)[1] for backend in ("auto", "python"))
    assert fast.stats["compiled"] and not plain.stats["compiled"]
    for part in ("time", "q", "v", "a", "lam"):
        np.testing.assert_allclose(getattr(fast.record, part), getattr(plain.record, part), rtol=0, atol=1e-11)


def test_a_ball_bounces_when_it_should():
    model = ball(restitution=0.5)
    found = mbd.simulate(
        model, mbd.assemble(model, position={"fall.displacement": 1.0}), Midpoint(), dt=0.01, until=1.0
    )
    fall = math.sqrt(2.0 / G)
    times = [event.time for event in found.events if event.kind == "closed"]
    np.testing.assert_allclose(times[:2], [fall, 2.0 * fall], rtol=0, atol=1e-9)


def test_what_it_cannot_do_is_refused_by_its_name():
    model, start = swing()
    with pytest.raises(CapabilityError, match=r"Midpoint\(\) does not estimate its error"):
        mbd.simulate(model, start, Midpoint(), tol=1e-6, until=0.1)
    with pytest.raises(CapabilityError, match=r"Midpoint\(\) has no step in Python"):
        Midpoint().start(None, State(0.0, np.zeros(1), np.zeros(1), np.zeros(0), Mode()), Mode(), 0.1)


def test_the_kernel_of_another_order_of_schemes_is_another():
    with pytest.MonkeyPatch.context() as patch:
        digest = build.source_digest()
        patch.setattr(contract, "SCHEMES", contract.SCHEMES[::-1])
        assert build.source_digest() != digest


def test_a_scheme_that_is_not_listed_is_refused_by_name():
    with pytest.raises(CapabilityError, match="'bdf 7', which no entry has: there are 'newmark'"):
        contract.scheme_named("bdf 7")
