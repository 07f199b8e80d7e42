"""Long steps of a ball joint by quaternion: events inside them, turns that no chart covers, rows far apart."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mbd
from tests.joints.quaternion_ball import CayleyBall, QuaternionBall

NAMES = ("ball.w", "ball.x", "ball.y", "ball.z")
SPINS = ("ball.spin x", "ball.spin y", "ball.spin z")
ACROSS, ALONG = 0.04, 0.06
"""Moments of inertia of a symmetric body [kg m²]."""
TIP = np.array([1.0, 0.2, 0.3])
FINE = np.linspace(0.0, 2.0, 20001)
SCHEMES = (mbd.Newmark(), mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8, formulation="index3"), mbd.RadauIIA(tolerance=1e-12),
           mbd.RungeKutta853())  # fmt: skip
BALLS = (QuaternionBall, CayleyBall)


@cache
def spinning(ball, law=None):
    """A free symmetric body on a ball joint, whose tip passes a level, or strikes it."""
    model = mbd.Model("spinning body", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 1.0, (ACROSS, ACROSS, ALONG))
    model.connect(ball("ball", model.ground.origin, body.origin))
    if law is not None:
        places = body.point(*TIP, name="tip"), model.ground.point(0.0, -10.0, 0.0, name="floor")
        model.constrain(law("level", mbd.measure(lambda tip, floor: tip[1] - floor[1], *places, unit="m")))
    return model


def started(model, turn, rates):
    x, y, z, w = turn.as_quat()
    return mbd.assemble(model, dict(zip(NAMES, (w, x, y, z), strict=True)), dict(zip(SPINS, rates, strict=True)))


def heights(turn, rates, time):
    """Of the tip, by regular precession about the angular momentum: R = R₀ exp(t L/A) exp(t (1 − C/A) ω₃ e₃)."""
    momentum = np.array([ACROSS, ACROSS, ALONG]) * rates
    spin = np.array([0.0, 0.0, (1.0 - ALONG / ACROSS) * rates[2]])
    time = np.atleast_1d(time)[:, None]
    return (turn * Rotation.from_rotvec(time * momentum / ACROSS) * Rotation.from_rotvec(time * spin)).apply(TIP)[:, 1]


def crossings(values):
    """The instants at which values at FINE change their sign."""
    k = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    return FINE[k] + (FINE[k + 1] - FINE[k]) * values[k] / (values[k] - values[k + 1])


def chances(seed):
    """Random (turn, rates, heights of the tip)."""
    chance = np.random.default_rng(seed)
    while True:
        rates = chance.normal(size=3)
        rates *= chance.uniform(3.0, 8.0) / np.linalg.norm(rates)
        turn = Rotation.random(random_state=int(chance.integers(1 << 30)))
        yield turn, rates, heights(turn, rates, FINE)


@pytest.mark.parametrize("ball", BALLS)
@pytest.mark.parametrize("seed", range(8))
def test_a_dip_inside_a_long_step_is_an_impact(ball, seed):
    model = spinning(ball, mbd.Unilateral)
    turn, rates, tip = next(each for each in chances(seed) if min(each[2][[0, -1]]) > each[2].min() + 0.1)
    level = float(tip.min()) + 3e-4
    instant = float(crossings(tip - level)[0])
    for scheme in SCHEMES[3:]:
        for way in (1.0, 1.5):
            run = mbd.simulate(model, started(model, turn, rates), scheme, dt=way / float(np.linalg.norm(rates)),
                               until=instant + 0.05, parameters={"ground.floor.y": level})  # fmt: skip
            assert [event.time for event in run.events] != []
            assert run.events[0].time == pytest.approx(instant, abs=0.02)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("seed", range(3))
def test_events_are_met_however_far_a_step_would_turn(scheme, seed):
    """About a fixed axis every scheme is exact, and so are its events."""
    model = spinning(QuaternionBall, mbd.Event)
    speed = float(np.random.default_rng(seed).uniform(3.0, 9.0))
    turn, rates = Rotation.from_euler("xyz", [0.3, -0.4, seed]), np.array([0.0, 0.0, speed])
    tip = heights(turn, rates, FINE)
    level = 0.5 * float(tip.min() + tip.max())
    wanted = crossings(tip - level)
    for way in (1.0, 3.5, 7.0):
        run = mbd.simulate(model, started(model, turn, rates), scheme, dt=way / speed, until=2.0,
                           parameters={"ground.floor.y": level})  # fmt: skip
        np.testing.assert_allclose([event.time for event in run.events], wanted, atol=1e-7)
        said = [note for note in run.stats["notes"] if "steps were divided" in note]
        assert len(said) == (way > 2.0)
        assert np.max(np.diff(run.time)) * speed < np.pi / 2.0 + 1e-9


@pytest.mark.parametrize("ball", BALLS)
@pytest.mark.parametrize("scheme", SCHEMES[3:], ids=repr)
def test_a_step_of_many_turns_is_as_accurate_as_its_parts(ball, scheme):
    model = spinning(ball)
    turn, rates, tip = next(chances(5))
    start = started(model, turn, rates)
    run = mbd.simulate(model, start, scheme, dt=1.0, until=2.0)
    x, y, z, w = run.final.q[[1, 2, 3, 0]]
    found = Rotation.from_quat([x, y, z, w]).apply(TIP)[1]
    assert found == pytest.approx(float(tip[-1]), abs=5e-3 if scheme.order() == 5 else 1e-5)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_there_is_one_way_from_each_stored_row_to_the_next(scheme):
    model = spinning(QuaternionBall)
    run = mbd.simulate(
        model, started(model, Rotation.identity(), (0.0, 0.0, 9.0)), scheme, dt=0.05, until=3.0, store=40
    )
    times = np.linspace(0.0, 3.0, 50)
    np.testing.assert_allclose(run.at(times)["ball.w"] ** 2, np.cos(4.5 * times) ** 2, atol=1e-9)
    assert len(run.time) < 25


def test_a_tolerance_counts_what_a_chart_leaves_of_the_way():
    """A Cayley chart has ẋ = v + ¼ (x·v) x about a fixed axis, which accelerations know nothing of."""
    model = spinning(CayleyBall)
    for scheme in (mbd.GeneralizedAlpha(0.8), mbd.HHT(0.05)):
        run = mbd.simulate(model, started(model, Rotation.identity(), (0.0, 0.0, 3.0)), scheme, tol=1e-3, until=1.0)
        assert abs(run.final.q[0]) == pytest.approx(abs(np.cos(1.5)), abs=1e-3)
