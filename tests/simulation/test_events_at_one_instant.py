"""Guards of a user that cross zero at one instant: each has its event once, in any order, wherever a run ends."""

from dataclasses import replace

import numpy as np
import pytest

import mbd

SCHEMES = (mbd.HHT(alpha=0.05), mbd.RungeKutta853(), mbd.RadauIIA(), mbd.HHT(alpha=0.05, formulation="index3"))
FACTORS = (1.0, -3.0, 1e-3)


def falling(order, bounces=None):
    """A body that passes the height of all guards at once; the one that `bounces` turns it around."""
    model, body = mbd.Model("falls"), mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis="y"))
    for k in order:
        height = mbd.measure(lambda point, k=k: FACTORS[k] * (point[1] - 0.5), body.origin)
        back = {"fall.displacement.rate": lambda named: -0.5 * named["fall.displacement.rate"]}
        model.constrain(mbd.Event(f"guard {k}", height, reset=back if k == bounces else None))
    return model, mbd.assemble(model, {"fall.displacement": 1.0})


def names(run):
    return [event.name for event in run.events]


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("bounces", [None, 0, 1])
def test_each_has_its_event_once(scheme, order, bounces):
    """Behind a reset that turns the motion around the next guards had none, and those before it two."""
    model, start = falling(order, bounces)
    whole = mbd.simulate(model, start, scheme, dt=0.01, until=0.5)
    first = [event for event in whole.events if event.time == whole.events[0].time]
    assert sorted(event.name for event in first) == ["guard 0", "guard 1", "guard 2"]
    speed = np.sqrt(9.81)  # of a fall by 0.5 m
    up = 0.5 * speed if bounces is not None else -speed
    left = 0.5 - speed / 9.81
    assert whole.final.q[0] == pytest.approx(0.5 + up * left - 0.5 * 9.81 * left**2, abs=2e-4)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("end", range(3))
@pytest.mark.parametrize("bounces", [None, 1])
def test_a_run_that_one_of_them_ends_has_them_all_and_goes_on_to_the_bit(scheme, end, bounces):
    """The run ended with the first; without its memory the other events were never seen."""
    model, start = falling((0, 1, 2), bounces)
    whole = mbd.simulate(model, start, scheme, dt=0.01, until=0.5)
    part = mbd.simulate(model, start, scheme, dt=0.01, until=f"guard {end}")
    assert sorted(names(part)) == ["guard 0", "guard 1", "guard 2"]
    rest = mbd.simulate(model, part.final, scheme, dt=0.01, until=0.5)
    assert names(part) + names(rest) == names(whole)
    assert np.array_equal(rest.final.q, whole.final.q) and np.array_equal(rest.final.v, whole.final.v)
    anew = mbd.simulate(model, replace(part.final, memory=None), scheme, dt=0.01, until=0.5)
    assert names(anew) == names(rest)
    many = mbd.batch(model, [start, start], scheme, dt=0.01, until=f"guard {end}")
    assert many.time[0] == part.final.time and np.array_equal(many.q[0], part.final.q)
    assert np.array_equal(many.v[1], part.final.v)
