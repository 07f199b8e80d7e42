"""Derivatives of runs over singular configurations: of the steps as they were taken; in doubt where these are long."""

import warnings

import numpy as np
import pytest

import mbd
from benchmarks.walkers import seven
from mbd.testing import random_loop
from tests.sensitivity.differences import differences, off

FAMILY = (
    mbd.HHT(alpha=0.05, tolerance=1e-12),
    mbd.GeneralizedAlpha(0.8, tolerance=1e-12),
    mbd.Newmark(tolerance=1e-12),
)


def linkage(seed):
    """A random loop in motion, and what it is differentiated by."""
    model, place = random_loop(seed, 3)
    names = mbd.assemble(model, place).names
    start = mbd.assemble(model, place, {names[0]: float(6.0 * np.random.default_rng(seed).normal())})
    return model, start, ["gravity.y", next(name for name in model.parameters if "mass" in name)]


def test_steps_that_hold_positions_alone_have_derivatives_of_their_own():
    """The first of each passage was followed as a step of the stabilized form from the solution of the one before it.

    Derivatives were off by 1 to 34 % of the largest.
    """
    compared = 0
    for seed in range(24):
        model, start, names = linkage(seed)
        for scheme in FAMILY:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                plain = mbd.simulate(model, start, scheme, dt=2e-2, until=0.6, on_failure="return")
                if not (plain.success and plain.stats["singular_steps"]):
                    continue
                other = mbd.simulate(model, start, scheme, dt=2e-2, until=0.6, wrt=names[:1])
                assert other.stats["singular_steps"] == plain.stats["singular_steps"]
                assert np.array_equal(other.record.q, plain.record.q)
                run = mbd.simulate(model, start, scheme, dt=2e-2, until=0.6, wrt=names)
                found = differences(model, start, scheme, names, step=1e-5, dt=2e-2, until=0.6)
            if found is None:
                continue
            wanted, noise = found[0][:-1], found[1]  # good to a few 1e-7 next to such a pose
            own = np.array([run.sensitivities[name] for name in (*start.names, *start.velocity_names)])
            far = off(own, wanted)
            assert np.all(far < 1e-5), (seed, scheme, far, noise)
            compared += 1
    assert compared >= 5


def test_derivatives_of_steps_that_are_long_for_the_motion_are_in_doubt():
    """Seven links at 10 ms: 15 of 100 of the derivatives are wrong, where the motion is off by 0.15 rad."""
    model, start = seven()
    with pytest.warns(mbd.MbdWarning, match="derivatives are in doubt"):
        mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-2, until=1.0, wrt=["right hip.angle"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.6, wrt=["right hip.angle"])
        mbd.simulate(model, start, mbd.RadauIIA(), tol=1e-6, until=0.6, wrt=["right hip.angle"])
