"""A run with derivatives is the run without them: rows, steps, failures and what the run says of its accuracy."""

import numpy as np

import mbd
from benchmarks.walkers import seven
from mbd.testing import random_loop, random_tree


def assert_equal_runs(model, start, scheme, dt, until, name):
    """Both runs, to the bit; how many rows were compared."""
    alone = mbd.simulate(model, start, scheme, dt=dt, until=until, on_failure="return")
    other = mbd.simulate(model, start, scheme, dt=dt, until=until, on_failure="return", wrt=[name])
    assert np.array_equal(alone.time, other.time)
    assert np.array_equal(alone.record.q, other.record.q) and np.array_equal(alone.record.v, other.record.v)
    assert alone.message == other.message
    assert list(map(str, alone.stats["notes"])) == list(map(str, other.stats["notes"]))
    return len(alone.time)


def test_runs_of_random_mechanisms_are_the_same_with_derivatives():
    """With long steps some fail, some say how large their errors are: estimates came from the second look, 1 % off."""
    rows = 0
    for seed in range(4):
        model, place = random_loop(seed, 3) if seed % 2 else (random_tree(seed, 2, False, most=5), {})
        rng = np.random.default_rng(seed)
        names = mbd.assemble(model, place).names
        speed = {name: float(6.0 * rng.normal()) for name in (names[:1] if seed % 2 else names)}
        start = mbd.assemble(model, place, speed)
        rows += assert_equal_runs(model, start, mbd.RadauIIA(), 2e-2, 0.6, "gravity.y")
    assert rows > 60


def test_seven_links_fail_at_the_same_instant_with_derivatives():
    """A step at a singular configuration was followed as one far from it, which failed 0.1 s before the run did."""
    model, start = seven()
    assert assert_equal_runs(model, start, mbd.RadauIIA(), 1e-2, 4.0, "gravity.y") > 250
