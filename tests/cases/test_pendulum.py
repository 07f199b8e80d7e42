"""Cases a1, a1b and b1: a point mass on a rod, swinging widely and turning over, in five kinds of coordinates."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.pendulums import FORMS, WITH_ROWS, Minimal, Natural
from tests.cases.schemes import INDEX_3, SCHEMES, name_of
from tests.helpers import assert_second_order
from tests.problems import case, integrated, pendulum

A1, A1B, B1 = case("a1-simple-pendulum"), case("a1b-rotating-pendulum"), case("b1-iftomm-a01-pendulum")
PAIRS = [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in FORMS for scheme in SCHEMES]
PAIRS += [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in WITH_ROWS for scheme in INDEX_3]


@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_a_wide_swing_keeps_its_phase_to_second_order(form: str, scheme: NewmarkFamily) -> None:
    swing = FORMS[form]()
    start, times = swing.start(A1.start["theta0"]), A1["theta(t)"].t

    def error(steps: float) -> float:
        found = []
        for until, exact in zip(times, A1["theta(t)"].value, strict=True):
            run = mbd.simulate(swing.model, start, scheme, dt=until * steps, until=until, store=10000)
            found.append(float(swing.angle(run)[-1]) - exact)
        return float(np.linalg.norm(found))

    assert_second_order(error, 1 / 2000)


@pytest.mark.parametrize("form", FORMS)
def test_period_speed_and_tension_at_the_lowest_point_are_of_second_order(form: str) -> None:
    swing = FORMS[form]()
    start = swing.start(A1.start["theta0"])
    period, speed = A1["period"].value, A1["speed"].value
    tension = A1["rod tension at lowest point"].value

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(swing.model, start, mbd.HHT(alpha=0.05), dt=dt, until=2.25 * period)
        lowest = _zeros(run, swing)[[0, 4]]
        moment = run.at(lowest[1])
        return [
            lowest[1] - lowest[0] - 2 * period,
            abs(swing.rate(moment)) * swing.length - speed,
            swing.tension(moment) - tension,
        ]

    assert_second_order(errors, period / 1200)


def _zeros(run: mbd.Trajectory, swing: object) -> np.ndarray:
    """Instants at which the angle is zero, by secants on the run's own interpolation."""
    angle = swing.angle
    signs = np.sign(angle(run))
    found = []
    for k in np.flatnonzero((signs[1:] != signs[:-1]) & (np.abs(angle(run)[1:]) < 1.0)):
        low, high = run.time[k], run.time[k + 1]
        a, b = angle(run.at(low)), angle(run.at(high))
        for _ in range(6):
            low, a, high, b = high, b, high - b * (high - low) / (b - a) if b != a else high, b
            b = angle(run.at(min(max(high, 0.0), run.time[-1])))
        found.append(high)
    return np.array(found)
