"""Starts solved in an order chosen beforehand: what the search for pivots finds, with the same dependent rows."""

from itertools import product
from random import Random

import numpy as np
import pytest

import mbd
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.testing.mechanisms import random_tree
from tests.simulation.singular_linkages import four_bars

MECHANISMS = [(seed, spatial, twice) for seed, spatial, twice in product(range(5), (False, True), (0, 2))]


def cut_everywhere(seed, spatial, twice):
    """Random joints, each of which is rows; up to so many hinges stand twice."""
    model = random_tree(seed, 9, spatial, most=40)
    hinges = [joint for joint in model.joints if isinstance(joint, mbd.Revolute)][:twice]
    model.cut = "all"
    for k, hinge in enumerate(hinges):
        model.connect(mbd.Revolute(f"again {k}", hinge.parent, hinge.child, axis=hinge.axis))
    return model, mbd.assemble(model), len(hinges)


def first_row(model, start):
    """Accelerations and multipliers of a start, and what is said of rows that depend on others."""
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=1e-3, progress=False)
    assert run.stats["compiled"]
    return run.record.a[0], run.record.lam[0], [note for note in run.stats["notes"] if "redundant" in note]


def assert_starts_alike(model, start, monkeypatch):
    """The note on dependent rows of both starts."""
    mechanism = mechanism_of(model)
    assert mechanism.order(mechanism.equations.bilateral) is not None
    one = first_row(model, start)
    monkeypatch.setattr(Mechanism, "order", lambda self, rows: None)
    other = first_row(model, start)
    for a, b in zip(one[:2], other[:2], strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-9 * max(1.0, float(np.abs(b).max())))
    assert one[2] == other[2]
    return one[2]


@pytest.mark.filterwarnings("ignore::mbd.MbdWarning")
@pytest.mark.sampled(4)
@pytest.mark.parametrize(("seed", "spatial", "twice"), MECHANISMS)
def test_mechanisms_cut_everywhere_start_as_by_a_search_for_pivots(seed, spatial, twice, monkeypatch):
    model, start, doubled = cut_everywhere(seed, spatial, twice)
    assert bool(assert_starts_alike(model, start, monkeypatch)) == (doubled > 0)


def test_loops_start_as_by_a_search_for_pivots(monkeypatch):
    assert_starts_alike(*four_bars(12).start, monkeypatch)


@pytest.mark.parametrize("seed", range(3, 11))
def test_rows_that_are_multiples_of_each_other_are_found(seed, monkeypatch):
    """Two angles in a ratio, told twice: of the second row numbers leave round-off alone, or nothing."""
    draw = Random(seed)
    model = mbd.Model("chains side by side")
    for k in range(6):
        end = model.ground.point(3.0 * k, 0.0)
        for i in range(7):
            rod = mbd.Link(f"rod {k} {i}", length=1.0, **mbd.rod(mass=draw.uniform(0.5, 2.0), length=1.0).link)
            model.connect(mbd.Revolute(f"hinge {k} {i}", end, rod.start))
            end = rod.end
    one, other, times = (round(draw.uniform(*bounds), 2) for bounds in ((0.5, 5.0), (0.5, 5.0), (0.3, 0.95)))
    for name, a, b in (("ratio", one, other), ("again", one * times, other * times)):
        gear = mbd.measure(lambda x, y, a=a, b=b: a * x - b * y, "hinge 0 0.angle", "hinge 1 0.angle", unit="rad")
        model.constrain(mbd.Bilateral(name, gear))
    bent = {f"hinge {k} {i}.angle": 0.3 * np.sin(k + 2 * i) for k in range(6) for i in range(7) if k > 1 or i > 0}
    assert assert_starts_alike(model, mbd.assemble(model, position=bent), monkeypatch)
