"""Cases a1, a1b and b1: a point mass on a rod, swinging widely and turning over, in five kinds of coordinates."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.pendulums import FORMS, WITH_EVENTS, WITH_ROWS, Pendulum
from tests.cases.schemes import INDEX_3, SCHEMES
from tests.helpers import assert_second_order
from tests.problems import case, integrated, pendulum

A1, A1B, B1 = case("a1-simple-pendulum"), case("a1b-rotating-pendulum"), case("b1-iftomm-a01-pendulum")
PAIRS = [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in FORMS for scheme in SCHEMES]
PAIRS += [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in WITH_ROWS for scheme in INDEX_3]


def last(swing: Pendulum, start: mbd.State, scheme: NewmarkFamily, steps: int, until: float) -> mbd.Trajectory:
    """A run of equal steps of which only the end is looked at."""
    return mbd.simulate(swing.model, start, scheme, dt=until / steps, until=until, store=steps)


@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_a_wide_swing_keeps_its_phase_to_second_order(form: str, scheme: NewmarkFamily) -> None:
    swing = FORMS[form]()
    start, reference = swing.start(A1.start["theta0"]), A1["theta(t)"]

    def errors(share: float) -> list[float]:
        runs = [last(swing, start, scheme, round(t / share), t) for t in reference.t]
        return [swing.angle(run)[-1] - exact for run, exact in zip(runs, reference.value, strict=True)]

    assert_second_order(errors, 0.0025)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("motion", [(-2.6, 0.4), (-1.0, 9.0)], ids=["swinging", "turning over"])
@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_any_pendulum_follows_its_equation_of_motion(
    form: str, scheme: NewmarkFamily, motion: tuple[float, float]
) -> None:
    """Another length, mass, gravity and start, against an explicit method."""
    swing = FORMS[form](length=0.7, mass=2.3, gravity=3.7)
    start, until = swing.start(*motion), 4.4 if motion[0] < -2.0 else 4.0
    angle, rate = integrated(pendulum(0.7, 3.7), motion, until)
    tension = 2.3 * (0.7 * rate**2 + 3.7 * math.cos(angle))

    def errors(dt: float) -> list[float]:
        run = last(swing, start, scheme, round(until / dt), until)
        turn = (swing.angle(run)[-1] - angle + math.pi) % (2 * math.pi) - math.pi
        return [turn, swing.rate(run)[-1] - rate, swing.tension(run)[-1] - tension]

    # at position level the round-off of multipliers grows like 1/dt²
    assert_second_order(errors, 0.004 if scheme.formulation == "index3" else 0.002)


@pytest.mark.parametrize("form", WITH_EVENTS)
def test_period_speed_and_tension_at_the_lowest_point_are_of_second_order(form: str) -> None:
    swing = FORMS[form]()
    swing.model.constrain(mbd.Event("lowest", mbd.measure(swing.across)))
    start = swing.start(A1.start["theta0"])
    period, tension = A1["period T"].value, A1["rod tension at lowest point"].value

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(swing.model, start, mbd.HHT(alpha=0.05), dt=dt, until=2.5 * period)
        times = [event.time for event in run.events]
        moment = run.at(times[4])
        speed = abs(swing.rate(moment)) * swing.length
        return [
            times[4] - times[0] - 2 * period,
            speed - A1["speed at lowest point"].value,
            swing.tension(moment) - tension,
        ]

    assert_second_order(errors, period / 800)


@pytest.mark.parametrize("form", WITH_EVENTS)
def test_a_pendulum_passes_its_lowest_point_twice_a_period(form: str) -> None:
    swing = FORMS[form]()
    swing.model.constrain(mbd.Event("lowest", mbd.measure(swing.across)))
    until = 10 * A1["period T"].value
    run = mbd.simulate(swing.model, swing.start(A1.start["theta0"]), mbd.HHT(), dt=1e-3, until=until)
    assert len(run.events) == A1["number of sign changes"].value
    assert np.max(np.abs(np.diff([event.time for event in run.events]) - until / 20)) < 1e-5


@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_the_tension_is_that_of_the_motion_at_every_step(form: str, scheme: NewmarkFamily) -> None:
    """T = m g (3 cos θ − 2 cos θ₀) along the whole swing, not oscillating from step to step."""
    swing = FORMS[form]()
    start = swing.start(A1.start["theta0"])

    def error(dt: float) -> float:
        run = mbd.simulate(swing.model, start, scheme, dt=dt, until=2.0)
        exact = 9.81 * (3 * np.cos(swing.angle(run)) - 2 * math.cos(A1.start["theta0"]))
        return float(np.max(np.abs(swing.tension(run) - exact)))

    assert_second_order(error, 0.005)


@pytest.mark.parametrize("form", WITH_EVENTS)
def test_a_pendulum_turns_over_with_the_published_time_speed_and_rod_force(form: str) -> None:
    swing = FORMS[form]()
    swing.model.constrain(mbd.Event("top", mbd.measure(swing.across), direction=-1))
    swing.model.constrain(mbd.Event("bottom", mbd.measure(swing.across), direction=1))
    start = swing.start(A1B.start["theta0"], A1B.start["thetadot0"])
    turn = A1B["time of one revolution"].value

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(swing.model, start, mbd.GeneralizedAlpha(0.9), dt=dt, until=5.25 * turn)
        tops = [event.time for event in run.events if event.name == "top"]
        bottoms = [event.time for event in run.events if event.name == "bottom"]
        assert len(tops) == len(bottoms) == 5
        moment = run.at(tops[3])
        return [
            bottoms[-1] - 5 * turn,
            tops[-1] - 4.5 * turn,
            swing.rate(moment) - A1B["thetadot at the top"].value,
            swing.tension(moment) - A1B["rod tension at the top"].value,
        ]

    assert_second_order(errors, turn / 400)


def test_a_revolute_angle_counts_its_turns_cut_or_not() -> None:
    until = 3.25 * A1B["time of one revolution"].value
    angles = {}
    for form in "minimal", "all joints cut":
        swing = FORMS[form]()
        run = mbd.simulate(swing.model, swing.start(0.0, 7.5), dt=1e-3, until=until)
        angles[form] = run["pivot.angle"]
    assert 6 * math.pi < angles["minimal"][-1] < 7 * math.pi
    assert angles["all joints cut"][-1] == pytest.approx(angles["minimal"][-1], abs=1e-4)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_ten_seconds_from_the_horizontal_meet_the_published_places(form: str, scheme: NewmarkFamily) -> None:
    swing = FORMS[form](B1.definition["L"], B1.definition["mass"], B1.definition["g"])
    start, reference = swing.start(math.atan2(B1.start["x0"], -B1.start["y0"])), B1["[x, y](t)"]

    def errors(share: float) -> list[float]:
        runs = [last(swing, start, scheme, round(t / share), t) for t in reference.t]
        angles = [swing.angle(run)[-1] for run in runs]
        return [
            math.hypot(math.sin(angle) - x, -math.cos(angle) - y)
            for angle, (x, y) in zip(angles, reference.value, strict=True)
        ]

    assert_second_order(errors, 0.002)


@pytest.mark.parametrize("form", WITH_EVENTS)
def test_a_swing_from_the_horizontal_keeps_its_energy_and_its_period(form: str) -> None:
    swing = FORMS[form](B1.definition["L"], B1.definition["mass"], B1.definition["g"])
    swing.model.constrain(mbd.Event("lowest", mbd.measure(swing.across)))
    start = swing.start(-math.pi / 2)

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(swing.model, start, mbd.HHT(alpha=0.05), dt=dt, until=10.0)
        times = [event.time for event in run.events]
        energy = run["kinetic_energy"] + run["potential_energy"] - B1["total energy"].value
        return [(times[6] - times[0]) / 3 - B1["period"].value, float(np.max(np.abs(energy)))]

    assert_second_order(errors, 0.004)


@pytest.mark.parametrize("scheme", [mbd.Newmark(formulation="index3"), mbd.GeneralizedAlpha(1.0, formulation="index3")])
def test_an_undamped_scheme_with_rows_at_position_level_is_refused_and_told_why(scheme: NewmarkFamily) -> None:
    swing = FORMS["natural"]()
    with pytest.raises(mbd.CapabilityError, match=r"multipliers grow.*use formulation='ggl'"):
        mbd.simulate(swing.model, swing.start(2.0), scheme, dt=1e-3, until=1.0)
    tree = FORMS["minimal"]()
    assert mbd.simulate(tree.model, tree.start(2.0), scheme, dt=1e-2, until=0.1).success
