"""Multipliers of index 3 that err after a restart, so that a contact seems to pull, cost a run nothing."""

from functools import cache

import numpy as np
import pytest

import mbd

SCHEMES = [
    mbd.GeneralizedAlpha(0.8, formulation="index3"), mbd.GeneralizedAlpha(0.5, formulation="index3"),
    mbd.HHT(0.1, formulation="index3"), mbd.HHT(0.3, formulation="index3"),
]  # fmt: skip
UNTIL = 0.6
WAVES = [tuple(pair) for pair in np.random.default_rng(5).uniform((0.01, 3.0), (0.05, 8.0), (3, 2)).tolist()]
"""Heights and wave numbers of surfaces y = a cos k x [m, 1/m]."""


@cache
def over(waves: tuple[float, float], kind: str) -> mbd.Model:
    """A point on waves without friction, and a cart whose marks restart the scheme as it passes them."""
    height, number = waves
    model = mbd.Model("waves")
    point, cart = mbd.PointMass("point", mass=1.0), mbd.PointMass("cart", mass=1.0)
    model.connect(
        mbd.Translation("place", model.ground.origin, point.origin),
        mbd.Prismatic("rail", model.ground.origin, cart.origin),
    )
    if kind == "contact":
        surface = mbd.touchdown(point.origin, lambda x: height * mbd.cos(number * x))
        model.constrain(mbd.Unilateral("foot", surface, friction=0.0))
    else:
        gap = mbd.measure(lambda x, y: y - height * mbd.cos(number * x), "place.x", "place.y")
        model.constrain(mbd.Bilateral("foot", gap))
    model.constrain(mbd.Event("mark", mbd.measure(lambda s: mbd.sin(20.0 * s), "rail.displacement"), reset={}))
    return model


@cache
def crossing(waves: tuple[float, float], seed: int) -> tuple[dict, float, float, float]:
    """From a crest, at 0.6 to 0.95 of the speed at which it would leave: start, that speed, place at the end, force."""
    rng, (height, number) = np.random.default_rng(seed), waves
    speed = rng.uniform(0.6, 0.95) * (9.81 / (height * number**2)) ** 0.5
    start = {
        "position": {"place.x": 0.0, "place.y": height, "rail.displacement": rng.uniform(0.01, 0.1)},
        "velocity": {"place.x": speed, "rail.displacement": rng.uniform(0.5, 1.5)},
    }
    model = over(waves, "contact")
    true = mbd.simulate(model, mbd.assemble(model, **start, closed="foot"), mbd.RungeKutta853(), tol=1e-8, until=UNTIL)
    return start, speed, true["place.x"][-1], float(np.min(true["foot.force"]))


@pytest.mark.covering
@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_a_contact_that_presses_never_opens_and_errs_on_the_whole_no_more_than_a_row_that_may_pull(scheme, contact):
    rng, errors = np.random.default_rng(11), []
    for seed in range(12):
        for waves in WAVES:
            start, speed, end, force = crossing(waves, seed)
            assert force > 0.5
            part = rng.uniform(0.2, 0.5)  # of a wave, in radians, passed in a step
            how = {"dt": part / (waves[1] * speed), "until": UNTIL, "contact": contact}
            model, other = over(waves, "contact"), over(waves, "row")
            run = mbd.simulate(model, mbd.assemble(model, **start, closed="foot"), scheme, **how)
            row = mbd.simulate(other, mbd.assemble(other, **start), scheme, **how)
            assert {event.name for event in run.events} == {"mark"}
            assert np.min(run["foot.force"]) > 0.0
            errors.append([abs(found["place.x"][-1] - end) * waves[1] / part**2 for found in (run, row)])
    contacts, rows = np.sum(errors, axis=0)
    assert contacts <= rows
