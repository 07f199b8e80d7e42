"""Gaits of walkers that remember and act beside return maps by hand: states to 1e-9, multipliers to 1e-8."""

import math
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.cli import Script
from tests.hip_walkers import Numbers, Rods, exchanged, held_out

STATES, MULTIPLIERS = 1e-9, 1e-8
SIDES = ("left", "right")
LEGS = ((5.0, 0.5, 0.0), (5.0, 0.5, 0.0))


def coordinates(gait: Any, *names: str) -> Numbers:
    """Values of a gait's state."""
    return np.array([gait.state[name] for name in names])


def compare(gait: Any, step: Any, c: Numbers, h: float = 2e-3, levels: int = 3) -> None:
    """That the gait is a fixed point of the map by hand, with its multipliers; others by hand are 0."""
    off, values = held_out(step, c, h, levels)
    assert np.max(np.abs(off)) < STATES
    own = np.array(gait.multipliers)
    np.testing.assert_allclose(sorted_by_parts(own), sorted_by_parts(values[: len(own)]), atol=MULTIPLIERS)
    np.testing.assert_allclose(values[len(own) :], 0.0, atol=1e-6)


def sorted_by_parts(values: Any) -> Any:
    """Complex numbers in an order that round-off does not change."""
    return np.array(sorted(values, key=lambda z: (round(z.real, 6), round(z.imag, 6))))


def test_a_torso_held_to_the_leg_that_stands() -> None:
    """PD torque between torso and stance leg, which is another one after each strike."""
    gait = Script.load("torso-walker").names["gait"]
    walker, strikes = Rods(10.0, (*LEGS, (2.0, 0.25, 0.1)), math.radians(3.0)), []

    def torques(_: float, q: Numbers, v: Numbers) -> Any:
        hold = 100.0 * (q[2] - math.pi) + 20.0 * v[2]
        return [hold, 0.0, -hold]

    def step(c: Numbers) -> Numbers:
        time, q, v = walker.swing(*walker.standing(c[0], c[2:], [c[1]]), 0, torques)
        strikes.append(time)
        v = walker.struck(q, v, 1)
        return np.array([q[3], q[4], *exchanged(v[2:])])

    c = coordinates(gait, "left hip.angle", "waist.angle", "left hip.rate", "right hip.rate", "waist.rate")
    compare(gait, step, c, 1e-3, 2)
    step(c)
    assert abs(strikes[-1] - gait.period) < STATES


def test_a_torso_on_the_bisector_of_the_legs() -> None:
    """M. Wisse, D. Hobbelen & A. Schwab, Adding an upper body to passive dynamic walking robots by means of a bisecting
    hip mechanism, IEEE Trans. Robotics 23 (2007) 112: the torso is held halfway between the legs.
    """
    model = mbd.Model("bisecting hip", gravity=mbd.on_slope(math.radians(3.0)))
    hip = mbd.PointMass("hip", mass=10.0)
    torso = mbd.Link("torso", mass=2.0, length=0.5, center=0.25, inertia=0.1)
    model.connect(
        mbd.Translation("trunk", model.ground.origin, hip.origin), mbd.Revolute("waist", hip.origin, torso.start)
    )
    legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in SIDES}
    for side, other in (SIDES, SIDES[::-1]):
        ahead = mbd.measure(lambda a, b: a[0] - b[0] - 0.1, legs[side].end, legs[other].end)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
        model.constrain(mbd.Unilateral(
            f"{side} foot", mbd.touchdown(legs[side].end), release=mbd.When(f"{other} foot"), only_while=ahead
        ))  # fmt: skip
    names = ["waist.angle", "left hip.angle", "right hip.angle"]
    model.constrain(mbd.Bilateral("bisector", mbd.measure(lambda t, a, b: t - math.pi - 0.5 * (a + b), *names)))
    start = mbd.assemble(
        model, {"left hip.angle": 0.271, "right hip.angle": -0.271, "waist.angle": math.pi},
        {"left hip.rate": -1.0924, "right hip.rate": -0.3774}, closed=["left foot"],
    )  # fmt: skip
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=SIDES)
    walker = Rods(10.0, (*LEGS, (2.0, 0.25, 0.1)), math.radians(3.0), rows=[[0.0, 0.0, -0.5, -0.5, 1.0]])

    def step(c: Numbers) -> Numbers:
        rates = [c[1], c[2], 0.5 * (c[1] + c[2])]
        _, q, v = walker.swing(*walker.standing(c[0], rates, [math.pi]), 0, lambda *_: 0.0)
        v = walker.struck(q, v, 1)
        return np.array([q[3], v[3], v[2]])

    compare(gait, step, coordinates(gait, "left hip.angle", "left hip.rate", "right hip.rate"))


def test_a_push_along_the_trailing_leg_with_a_spring_between_the_legs() -> None:
    """Kuo's toe-off and hip spring."""
    gait = Script.load("ankle-push-off").names["gait"]
    walker = Rods(10.0, LEGS)

    def step(c: Numbers) -> Numbers:
        _, q, v = walker.swing(
            *walker.standing(c[0], c[1:]), 0, lambda _, a, __: [20.0 * (a[1] - a[0]), 20.0 * (a[0] - a[1])]
        )
        v = walker.struck(q, walker.pushed(q, v, 0, 4.0), 1)
        return np.array([q[3], v[3], v[2]])

    compare(gait, step, coordinates(gait, "left hip.angle", "left hip.rate", "right hip.rate"))
    before = gait.run.energy
    assert before["left push-off"][-1] == pytest.approx(-gait.energy["impact"], rel=1e-9)


def test_legs_that_swing_by_reflex() -> None:
    """Delay and burst of a reflex are phases of the swing, of which the last is free."""
    gait = Script.load("reflex-walker").names["gait"]
    walker = Rods(10.0, LEGS)

    def step(c: Numbers) -> Numbers:
        q, v, time = *walker.standing(c[0], c[1:]), 0.0
        for torque, until in ((0.0, 0.03), (8.0, 0.18), (0.0, None)):
            time, q, v = walker.swing(q, v, 0, lambda *_, size=torque: [-size, size], until, time)
        v = walker.struck(q, v, 1)
        return np.array([q[3], v[3], v[2]])

    compare(gait, step, coordinates(gait, "left hip.angle", "left hip.rate", "right hip.rate"))


@pytest.mark.parametrize("inertia", [0.3, 1e-9])
def test_a_wheel_that_pushes_off_loses_cos_2_alpha_of_what_its_speed_differs_by(inertia: float) -> None:
    """Each strike ``(I + m l²) ω⁺ = (I + m l² cos 2α) ω⁻ + P l sin 2α``, on level ground."""
    names, alpha = Script.load("push-off-wheel").names, math.pi / 8.0
    start = names["start"]
    gait = mbd.limit_cycle(names["model"], start, section="spoke 0", parameters={"hub.inertia": inertia})
    struck = gait.run.at([gait.period], side="left")["wheel.angle.rate"][0]
    assert abs(-struck - 0.8 / math.tan(alpha)) < STATES
    kept = (inertia + math.cos(2.0 * alpha)) / (inertia + 1.0)
    assert abs(abs(gait.multipliers[0]) ** (1.0 / 8.0) - kept) < MULTIPLIERS
