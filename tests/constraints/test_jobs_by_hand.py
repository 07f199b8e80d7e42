"""Jobs of people who build prostheses and walkers in a few words each, beside scipy's DOP853 phase by phase."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd

MASS, CENTER, LOSS, GRAVITY = 2.5, 0.19, 0.03, 9.81
INERTIA = 0.04 + MASS * CENTER**2
HOW: dict[str, Any] = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14, "max_step": 5e-3}


def shank(loss: Any = None) -> tuple[mbd.Model, mbd.Revolute]:
    model = mbd.Model("shank")
    body = mbd.Link("shank", mass=MASS, length=0.42, center=CENTER, inertia=0.04)
    knee = mbd.Revolute("knee", model.ground.origin, body.start, loss=loss or mbd.Viscous(LOSS))
    model.connect(knee)
    return model, knee


def swing(angle: float, rate: float, torque: float = 0.0, loss: float = LOSS) -> list[float]:
    return [rate, (torque - loss * rate - MASS * GRAVITY * CENTER * math.sin(angle)) / INERTIA]


def until_event(
    rates: Callable[..., Any], t: float, y: Any, end: float, event: Any, way: int
) -> tuple[float, Any, bool]:
    """To the event, at which it may begin, or the end."""
    begin = event(t, y)

    def watched(now: float, state: Any) -> float:
        return -way * 1e-6 if abs(begin) < 1e-9 and now < t + 1e-6 else event(now, state)

    watched.terminal, watched.direction = True, way  # type: ignore[attr-defined]
    found = solve_ivp(rates, (t, end), y, events=watched, **HOW)
    return float(found.t[-1]), found.y[:, -1], bool(found.status == 1)


def compared(
    model: mbd.Model, position: dict[str, float], names: tuple[str, ...], until: float, y: Any, **how: Any
) -> None:
    run = mbd.simulate(model, mbd.assemble(model, position), mbd.RungeKutta853(), until=until, **how)
    np.testing.assert_allclose([run[name][-1] for name in names], y, atol=1e-9)


def test_a_clutch_engages_a_spring_where_the_knee_turns():
    model, knee = shank()
    turn = mbd.Transition("free", "engaged", when="knee.rate", direction=1)
    over = mbd.measure(lambda angle, rest: angle - rest - 0.3, "knee.angle", "clutch.rest")
    back = mbd.Transition("engaged", "free", when=over, direction=1)
    pull = {"engaged": lambda angle, rest: -7.0 * (angle - rest - 0.3)}
    model.apply(
        mbd.Mode(
            "clutch", ("free", "engaged"), transitions=[turn, back], remembers={"rest": {"engaged": "knee.angle"}}
        ),
        mbd.Motor("spring", knee, by="clutch", torque=pull, arguments=["knee.angle", "clutch.rest"]),
    )
    t, y, more = 0.0, np.array([0.9, 0.0]), True
    while more:
        t, y, more = until_event(lambda t, y: swing(*y), t, y, 2.0, lambda t, y: y[1], 1)
        rest = y[0] + 0.3
        if more:
            t, y, more = until_event(
                lambda t, y, rest=rest: swing(*y, -7.0 * (y[0] - rest)),
                t,
                y,
                2.0,
                lambda t, y, rest=rest: y[0] - rest,
                1,
            )
    compared(model, {"knee.angle": 0.9}, ("knee.angle", "knee.rate"), 2.0, y, dt=4e-3)


def test_a_valve_brakes_for_a_while():
    model, _ = shank()
    near = mbd.measure(lambda angle: angle - 0.2, "knee.angle")
    causes = [mbd.Transition("open", "closed", when=near, direction=-1), mbd.Transition("closed", "open", after=0.15)]
    model.apply(
        mbd.Mode("valve", ("open", "closed"), transitions=causes, sets={"knee loss.coefficient": {"closed": 0.9}})
    )
    t, y = 0.0, np.array([0.9, 0.0])
    while t < 2.0:
        t, y, more = until_event(lambda t, y: swing(*y), t, y, 2.0, lambda t, y: y[0] - 0.2, -1)
        if more:
            end = min(t + 0.15, 2.0)
            y = solve_ivp(lambda t, y: swing(*y, 0.0, 0.9), (t, end), y, **HOW).y[:, -1]
            t = end
    compared(model, {"knee.angle": 0.9}, ("knee.angle", "knee.rate"), 2.0, y, dt=4e-3)


FRICTIONS = {
    "Dahl": (mbd.Viscous(LOSS) + mbd.Dahl(0.4, 25.0), LOSS, lambda v, z: (25.0 * z, v - 25.0 / 0.4 * abs(v) * z)),
    "LuGre": (
        mbd.Viscous(0.2) + mbd.LuGre(0.5, 0.3, 0.2, 30.0, 0.0), 0.2,
        lambda v, z: (30.0 * z, v - 30.0 * abs(v) * z / (0.3 + 0.2 * math.exp(-((v / 0.2) ** 2)))),
    ),
}  # fmt: skip


@pytest.mark.parametrize(("loss", "viscous", "law"), FRICTIONS.values(), ids=FRICTIONS)
def test_bristles_hold_and_slide(loss, viscous, law):
    def rates(t: float, y: Any) -> list[float]:
        force, change = law(y[1], y[2])
        return [*swing(y[0], y[1], -force, viscous), change]

    y = solve_ivp(rates, (0.0, 1.5), [0.9, 0.0, 0.0], **{**HOW, "max_step": 5e-4}).y[:, -1]
    compared(shank(loss)[0], {"knee.angle": 0.9}, ("knee.angle", "knee.rate"), 1.5, y[:2], tol=1e-11)


def test_a_belt_brakes_a_drum_by_the_tension_of_its_rope():
    model = mbd.Model("winch")
    drum, load = mbd.RigidBody("drum", 3.0, inertia=0.05), mbd.PointMass("load", 10.0)
    axle = mbd.Revolute("axle", model.ground.origin, drum.origin)
    model.connect(axle, mbd.Prismatic("lift", model.ground.point(0.1, 0.0), load.origin, axis=(0, 1, 0)))
    wound = mbd.measure(lambda height, turn: height + 0.1 * turn, "lift.displacement", "axle.angle")
    model.constrain(mbd.Bilateral("rope", wound))
    grip = 0.1 * (1.0 - math.exp(-0.2 * math.pi))  # μ = 0.2 over half a turn
    law = lambda tension, rate: grip * tension * mbd.tanh(rate / 0.05)  # noqa: E731
    model.apply(mbd.Motor("brake", axle, torque=law, arguments=["rope.multiplier", "axle.rate"]))

    def rates(t: float, y: Any) -> list[float]:
        """−10 · 0.1 θ̈ + λ = −10 g and 0.05 θ̈ + 0.1 λ = grip λ tanh."""
        A = [[-1.0, 1.0], [0.05, 0.1 - grip * math.tanh(y[1] / 0.05)]]
        return [y[1], np.linalg.solve(A, [-10.0 * GRAVITY, 0.0])[0]]

    y = solve_ivp(rates, (0.0, 0.8), [0.0, 0.5], **{**HOW, "max_step": 1e-3}).y[:, -1]
    start = mbd.assemble(model, {"axle.angle": 0.0}, {"axle.rate": 0.5})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=0.8)
    np.testing.assert_allclose([run["axle.angle"][-1], run["axle.rate"][-1]], y, atol=1e-9)
