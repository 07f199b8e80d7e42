"""A scene with effects that never act: j17."""

import time
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.references import quantity, size
from mbd.hardcases.schemes import EVERY

A2, J17 = "a2-double-pendulum", "j17-effects-off"
UNTIL, DT = 5.0, 1e-3
TIMES, LONG = 5, 20
"""Wall time is the least of several runs, each several times as long; other work on the machine changes it."""


def double_pendulum(effects: bool, cut: str = "auto") -> tuple[mbd.Model, mbd.State]:
    """The double pendulum of a2, bare or with a stop and a floor out of reach, friction with μ = 0, losses of 0."""
    numbers, begin = definition(A2)["definition"], definition(A2)["initial_conditions"]
    model = mbd.Model("double pendulum", gravity=(0.0, -numbers["g"], 0.0), cut=cut)
    upper = mbd.Link("upper", numbers["m1"], numbers["L1"], numbers["L1"])
    lower = mbd.Link("lower", numbers["m2"], numbers["L2"], numbers["L2"])
    losses = (mbd.Viscous(0.0), mbd.Coulomb(0.0, smoothing=0.01)) if effects else (None, None)
    shoulder = mbd.Revolute("shoulder", model.ground.origin, upper.start, loss=losses[0])
    elbow = mbd.Revolute("elbow", upper.end, lower.start, loss=losses[1])
    model.connect(shoulder, elbow)
    if effects:
        reach = numbers["L1"] + numbers["L2"]
        floor = mbd.touchdown(lower.end, mbd.Plane(offset=-2.5 * reach))
        model.constrain(
            mbd.Unilateral("stop", mbd.extension(elbow, offset=-100.0)), mbd.Unilateral("floor", floor, friction=0.0)
        )
    one, two = begin["theta1"], begin["theta2"]
    names = ("shoulder.angle", "elbow.angle") if cut == "auto" else ("upper floating.angle", "lower floating.angle")
    rates = (begin["thetadot1"], begin["thetadot2"])
    first, second = (one, two), rates
    if cut == "auto":
        first, second = (one, two - one), (rates[0], rates[1] - rates[0])
    return model, mbd.assemble(
        model, position=dict(zip(names, first, strict=True)), velocity=dict(zip(names, second, strict=True))
    )


def judge_absent(integrator: Any) -> Outcome:
    """The motion is the bare model's, to the bit, as are operations and the list of effects; the time is reported."""
    difference = quantity(J17, "max difference")
    worst, differing, events = 0.0, 0, 0
    for cut in "auto", "all":
        runs = [
            mbd.simulate(*double_pendulum(effects, cut), integrator, dt=DT, until=UNTIL) for effects in (False, True)
        ]
        bare, full = (run.record for run in runs)
        for one, other in zip((bare.time, bare.q, bare.v, bare.a), (full.time, full.q, full.v, full.a), strict=True):
            worst = max(worst, size(one - other) if one.shape == other.shape else np.inf)
            differing += int(one.tobytes() != other.tobytes())
        events += len(runs[1].events)
    (plain, _), (loaded, _) = double_pendulum(False), double_pendulum(True)
    costs = plain.cost(), loaded.cost()
    extra = set(costs[1].effects) ^ set(costs[0].effects)
    more = costs[1].newton + costs[1].residual - costs[0].newton - costs[0].residual
    return Outcome(
        [
            Figure("largest difference of the motion", worst, max(float(difference.value), difference.accuracy)),
            Figure("results that differ in a bit", differing, 0),
            Figure("events", events, 0),
            Figure("effects listed although they do nothing", len(extra), 0),
            Figure("operations more in the equations", more, 0),
            Figure("wall time over that of the bare model [-]", _slowdown(integrator)),
        ],
        [Curve("height of the lower end", runs[1].time, runs[1]["lower.end.y"], y_label="y [m]")],
    )


def _slowdown(integrator: Any) -> float:
    """Time of a run with the effects over that of one without, by turns so that a busy machine slows both."""
    scenes = [double_pendulum(effects) for effects in (False, True)]
    least = [np.inf, np.inf]
    for _ in range(TIMES):
        for k, (model, start) in enumerate(scenes):
            begin = time.perf_counter()
            mbd.simulate(model, start, integrator, dt=DT, until=LONG * UNTIL, store=1000)
            least[k] = min(least[k], time.perf_counter() - begin)
    return least[1] / least[0]


CASES = (HardCase(J17, "Effects that never act change no bit and no operation.", judge_absent, EVERY),)
