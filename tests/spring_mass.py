"""Runners and walkers on springs by hand: phases integrated one after the other by DOP853, nothing shared with mbd.

The spring-loaded inverted pendulum (Blickhan 1989; Seyfarth, Geyer, Günther & Blickhan 2002) and bipedal spring-mass
walking (H. Geyer, A. Seyfarth & R. Blickhan, Compliant leg behaviour explains basic dynamics of walking and running,
Proc. R. Soc. B 273 (2006) 2861).
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

MASS, G = 80.0, 9.81
TIGHT = {"rtol": 1e-12, "atol": 1e-13, "method": "DOP853"}
Numbers = NDArray[np.float64]


def _rates(feet: Sequence[float], stiffness: float) -> Callable[[float, Numbers], Numbers]:
    """ẏ of (x, y, ẋ, ẏ) on springs of rest length 1 m from feet at these places."""

    def rates(_: float, s: Numbers) -> Numbers:
        force = np.array([0.0, -MASS * G])
        for foot in feet:
            arm = np.array([s[0] - foot, s[1]])
            length = float(np.hypot(*arm))
            force = force + stiffness * (1.0 - length) * arm / length
        return np.array([s[2], s[3], *(force / MASS)])

    return rates


def until(state: Numbers, feet: Sequence[float], stiffness: float, event: Callable[[Numbers], float], sign: float):
    """The state and time as an event crosses zero in a direction, from a state away from it."""

    def guard(_: float, s: Numbers) -> float:
        return event(s)

    guard.terminal, guard.direction = True, sign
    found = solve_ivp(_rates(feet, stiffness), (0.0, 3.0), state, events=guard, **TIGHT)
    assert found.status == 1
    return found.y[:, -1], float(found.t[-1])


def runner_apex(y: float, v: float, stiffness: float, angle: float) -> tuple[float, float, float, float]:
    """(y, v) of the next apex of a runner, the way and the time to it."""
    landing = math.sin(angle)
    fall = math.sqrt(2.0 * (y - landing) / G)
    foot = v * fall + math.cos(angle)
    state = np.array([v * fall, landing, v, -G * fall])
    state, stance = until(state, [foot], stiffness, lambda s: math.hypot(s[0] - foot, s[1]) - 1.0, 1.0)
    rise = state[3] / G
    return state[1] + 0.5 * state[3] * rise, state[2], state[0] + state[2] * rise, fall + stance + rise


def walker_apex(y: float, ahead: float, energy: float, stiffness: float, angle: float) -> tuple[float, ...]:
    """(y, ahead, v) of a walker as it is highest over the other foot, the way and the time to it.

    ahead : of the body before the foot that stands
    """
    v = speed_at(y, energy, stiffness, math.hypot(ahead, y))
    foot, landing = -ahead, math.sin(angle)
    state, first = until(np.array([0.0, y, v, 0.0]), [foot], stiffness, lambda s: s[1] - landing, -1.0)
    new = float(state[0]) + math.cos(angle)
    state, second = until(state, [foot, new], stiffness, lambda s: math.hypot(s[0] - foot, s[1]) - 1.0, 1.0)
    state, third = until(state, [new], stiffness, lambda s: s[3], -1.0)
    return float(state[1]), float(state[0]) - new, float(state[2]), float(state[0]), first + second + third


def speed_at(y: float, energy: float, stiffness: float = 0.0, length: float = 1.0) -> float:
    """The speed of a level motion with an energy at a height."""
    return math.sqrt(2.0 * (energy - MASS * G * y - 0.5 * stiffness * (1.0 - length) ** 2) / MASS)


def derivative(function: Callable[[Numbers], Sequence[float]], at: Sequence[float], h: float = 1e-3) -> Numbers:
    """The Jacobian by central differences of h and h/2, with Richardson's extrapolation."""
    columns = []
    for unit in np.eye(len(at)):
        steps = [
            (np.array(function(at + size * unit)) - np.array(function(at - size * unit))) / (2.0 * size)
            for size in (h, 0.5 * h, 0.25 * h)
        ]
        first, second = (4.0 * steps[1] - steps[0]) / 3.0, (4.0 * steps[2] - steps[1]) / 3.0
        columns.append((16.0 * second - first) / 15.0)
    return np.array(columns).T
