"""The simplest walker of the case k4, with its equations as they stand there, and the grid of its starts."""

from functools import cache
from typing import Any

import numpy as np

import mbd
from tests.problems import case

LETTERS = {"walks": "W", "falls forward": "F", "falls backward": "B"}


@cache
def walker() -> tuple[mbd.Lagrangian, mbd.LimitCycle]:
    """The walker and its stable gait at γ = 0.009."""
    from sympy import Piecewise, cos, pi, sin, symbols

    theta, phi = mbd.Coordinate("theta"), mbd.Coordinate("phi")
    gamma = symbols("gamma")
    push = sin(theta.q - gamma) + sin(phi.q) * (theta.v**2 - cos(theta.q - gamma))
    model = mbd.Lagrangian(
        "simplest walker", [theta, phi], kinetic=theta.v**2 / 2 + phi.v**2 / 2, potential=cos(theta.q - gamma),
        forces={phi: push}, parameters={gamma: 0.009},
    )  # fmt: skip
    turn = cos(2 * theta.q)
    legs = {theta.q: -theta.q, phi.q: -2 * theta.q, theta.v: turn * theta.v, phi.v: turn * (1 - turn) * theta.v}
    old = {theta.q: theta.q, phi.q: phi.q, theta.v: theta.v, phi.v: phi.v}
    ahead = {name: Piecewise((value, theta.q < 0), (old[name], True)) for name, value in legs.items()}
    model.constrain(
        mbd.Event("heel strike", phi.q - 2 * theta.q, direction=+1, reset=ahead),
        mbd.Event("falls forward", theta.q + pi / 2, direction=-1, terminal=True),
        mbd.Event("falls backward", theta.q - pi / 2, direction=+1, terminal=True),
    )
    start = mbd.assemble(model, position={"theta": 0.2003109, "phi": 0.4006218},
                         velocity={"theta": -0.1998325, "phi": -0.0158})  # fmt: skip
    gait = mbd.limit_cycle(model, start, section="heel strike", dt=0.1, longest=60.0)
    return model, gait


def start_of(axes: Any) -> dict[str, Any]:
    """A start just after a heel strike."""
    theta, rate = axes["theta"], axes["s"] - axes["theta"]
    return {"theta": theta, "theta.rate": rate, "phi": 2.0 * theta, "phi.rate": (1.0 - np.cos(2.0 * theta)) * rate}


def grid() -> tuple[np.ndarray, np.ndarray]:
    """The centers of the cells along both axes."""
    sizes = case("k4-simplest-walker-basin").definition["grid"]
    theta = sizes["theta_min"] + (np.arange(sizes["n"]) + 0.5) * (sizes["theta_max"] - sizes["theta_min"]) / sizes["n"]
    s = sizes["s_min"] + (np.arange(sizes["m"]) + 0.5) * (sizes["s_max"] - sizes["s_min"]) / sizes["m"]
    return theta, s


def classes() -> np.ndarray:
    """Letters (theta, s): W, F, B, and x where the case leaves it open."""
    return np.array([list(row) for row in case("k4-simplest-walker-basin").definition["classes"]]).T
