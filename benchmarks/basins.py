"""Many runs in one call of the machine code: what a start costs, and the basins of two walkers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.stopwatch import processor_seconds
from mbd.simulation.batch.runner import Runner
from mbd.simulation.many_runs import start_line

STARTS = 20000
"""Runs of no length [-]."""
SIMPLEST, COMPASS = (200, 100), (60, 50)
"""Grids of starts of the two walkers."""


def measure(repeats: int) -> list[Figure]:
    """Overhead of a start, aim 5 µs; a start of both basins, aims 120 and 1200 µs: 1e6 and 1e5 of them in 60 s."""
    model, gait = simplest_walker()
    walker = compass_gait()
    options = {
        "contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6, "backend": "auto"
    }  # fmt: skip
    runner = Runner(model, gait.state, mbd.RungeKutta853(), 0.2, (gait.section, 0.0), {}, options, 1)
    lines = np.tile(start_line(runner.run, gait.state), (STARTS, 1))
    studies: dict[str, tuple[Callable[[], Any], int, float]] = {
        "a start in a batch": (partial(runner.ends, lines, runner.changes), STARTS, 5.0),
        "a start of the basin, simplest walker": (partial(_simplest, model, gait), int(np.prod(SIMPLEST)), 120.0),
        "a start of the basin, compass gait": (partial(_compass, *walker), int(np.prod(COMPASS)), 1200.0),
    }
    samples = interleaved({name: partial(processor_seconds, run) for name, (run, _, _) in studies.items()}, repeats)
    return [
        Figure(name, samples[name].least / count * 1e6, "µs", aim, spread=samples[name].spread)
        for name, (_, count, aim) in studies.items()
    ]


def _simplest(model: Any, gait: mbd.LimitCycle) -> mbd.Basin:
    """Starts just after a heel strike, as in the case of the basin."""

    def start(axes: Any) -> dict[str, Any]:
        theta, rate = axes["theta"], axes["s"] - axes["theta"]
        turn = 1.0 - np.cos(2.0 * theta)
        return {"theta": theta, "theta.rate": rate, "phi": 2.0 * theta, "phi.rate": turn * rate}

    axes = {"theta": np.linspace(0.1, 0.5, SIMPLEST[0]), "s": np.linspace(-0.03, 0.03, SIMPLEST[1])}
    return mbd.basin(model, gait, axes, start=start, dt=0.2, workers=1)


def _compass(model: Any, gait: mbd.LimitCycle) -> mbd.Basin:
    """Rates of both legs just after a step."""
    axes = {
        "left hip.rate": np.linspace(-2.0, -0.4, COMPASS[0]), "right hip.rate": np.linspace(-1.6, 0.8, COMPASS[1])
    }  # fmt: skip
    return mbd.basin(model, gait, axes, dt=0.05, workers=1)


def simplest_walker() -> tuple[Any, mbd.LimitCycle]:
    """The simplest walker without mass in its feet (Garcia et al. 1998), at γ = 0.009; another crossing is no step."""
    from sympy import Piecewise, cos, pi, sin, symbols

    theta, phi, gamma = mbd.Coordinate("theta"), mbd.Coordinate("phi"), symbols("gamma")
    push = sin(theta.q - gamma) + sin(phi.q) * (theta.v**2 - cos(theta.q - gamma))
    model = mbd.Lagrangian(
        "simplest walker", [theta, phi], kinetic=theta.v**2 / 2 + phi.v**2 / 2, potential=cos(theta.q - gamma),
        forces={phi: push}, parameters={gamma: 0.009},
    )  # fmt: skip
    turn = cos(2 * theta.q)
    after = {theta.q: -theta.q, phi.q: -2 * theta.q, theta.v: turn * theta.v, phi.v: turn * (1 - turn) * theta.v}
    model.constrain(
        mbd.Event(
            "heel strike", phi.q - 2 * theta.q, direction=+1,
            reset={name: Piecewise((value, theta.q < 0), (name, True)) for name, value in after.items()},
        ),
        mbd.Event("falls forward", theta.q + pi / 2, direction=-1, terminal=True),
        mbd.Event("falls backward", theta.q - pi / 2, direction=+1, terminal=True),
    )  # fmt: skip
    start = mbd.assemble(
        model, position={"theta": 0.2003109, "phi": 0.4006218}, velocity={"theta": -0.1998325, "phi": -0.0158}
    )  # fmt: skip
    return model, mbd.limit_cycle(model, start, section="heel strike", dt=0.1, longest=60.0)


def compass_gait() -> tuple[Any, mbd.LimitCycle]:
    """Two straight legs down 3° (Goswami et al. 1996)."""
    model = mbd.Model("compass gait", gravity=mbd.on_slope(np.radians(3.0)))
    hip = mbd.PointMass("hip", mass=10.0)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    for side, other in (("left", "right"), ("right", "left")):
        leg = mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, leg.start))
        ahead = mbd.measure(lambda mine, its: mine - its, f"{side} hip.angle", f"{other} hip.angle", unit="rad")
        release = mbd.When(f"{other} foot")
        model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(leg.end), release=release, only_while=ahead))
    low = mbd.measure(lambda y: y - 0.5, "trunk.y")
    model.constrain(mbd.Event("fall", low, terminal=True, direction=-1))
    start = mbd.assemble(
        model, closed="left foot", position={"left hip.angle": 0.27, "right hip.angle": -0.27},
        velocity={"left hip.angle": -1.1, "right hip.angle": -0.4},
    )  # fmt: skip
    return model, mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
