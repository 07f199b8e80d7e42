"""Fits of machines with modes: transitions move with what is sought, and their order may change on the way."""

import math

import numpy as np
import pytest

import mbd

DEGREE = math.pi / 180.0
REST = {"early stance": 8.0, "late stance": 12.0, "push-off": 50.0, "early swing": 62.0, "late swing": 3.0}  # [°]
DAMPING = (1.2, 1.0, 0.3, 0.06, 1.6)  # [N m s/rad]
STIFFNESS = {"phase.k1": 99.0, "phase.k2": 60.0, "phase.k3": 45.0, "phase.k4": 39.7, "phase.k5": 15.9}  # [N m/rad]


def powered_knee():
    """A shank below a thigh that is moved to and fro; the impedance of the knee has five phases."""
    model = mbd.Model("powered knee")
    thigh = mbd.Link("thigh", mass=7.0, length=0.42, center=0.18, inertia=0.12)
    shank = mbd.Link("shank", mass=3.5, length=0.45, center=0.2, inertia=0.06)
    hip = mbd.Revolute("hip", model.ground.origin, thigh.start)
    knee = mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(hip, knee)
    swing = lambda t: (7.5 - 17.5 * mbd.cos(2.0 * math.pi * t)) * DEGREE  # noqa: E731
    model.constrain(mbd.Bilateral("hip drive", hip, swing))
    beyond, states = mbd.measure(lambda angle, limit: angle + limit, "knee.angle", "phase.bend"), tuple(REST)
    straight = mbd.measure(lambda angle, limit: angle + limit, "knee.angle", "phase.straight")
    causes = [
        {"when": "knee.rate", "direction": -1}, {"after": 0.15}, {"when": beyond, "direction": -1},
        {"when": "knee.rate", "direction": 1}, {"when": straight, "direction": 1},
    ]  # fmt: skip
    turns = [mbd.Transition(states[k], states[(k + 1) % 5], **cause) for k, cause in enumerate(causes)]
    numbers = {"bend": 25.0 * DEGREE, "straight": 12.0 * DEGREE}
    numbers |= {name.removeprefix("phase."): value for name, value in STIFFNESS.items()}

    def impedance(k, rest):
        return lambda angle, rate, *stiffness: -stiffness[k] * (angle + rest * DEGREE) - DAMPING[k] * rate

    torque = {state: impedance(k, rest) for k, (state, rest) in enumerate(REST.items())}
    reads = ["knee.angle", "knee.rate", *STIFFNESS]
    model.apply(mbd.Mode("phase", states, transitions=turns, numbers=numbers))
    model.apply(mbd.Motor("motor", knee, torque=torque, by="phase", arguments=reads))
    return model, mbd.assemble(model, {"knee.angle": -20.0 * DEGREE}, {"knee.rate": 30.0 * DEGREE})


def recorded(model, start):
    how, times = {"integrator": mbd.RungeKutta853(), "dt": 5e-3}, np.linspace(0.0, 2.0, 101)
    run = mbd.simulate(model, start, **how, until=2.0)
    return run, {"time": times, "knee.angle": run.at(times)["knee.angle"]}, how


@pytest.mark.parametrize("factors", [(1.03, 0.98, 1.04, 0.97, 1.03), (1.1, 0.92, 1.12, 0.9, 1.1)], ids=["near", "far"])
def test_the_stiffnesses_of_five_phases_are_found_from_the_angle_of_the_knee(factors):
    model, start = powered_knee()
    run, data, how = recorded(model, start)
    guess = {name: factor * value for (name, value), factor in zip(STIFFNESS.items(), factors, strict=True)}
    first = mbd.simulate(model, start, **how, until=2.0, parameters=guess)
    if factors[0] > 1.05:  # this one walks through other phases
        assert [event.name for event in first.events] != [event.name for event in run.events]
    found = mbd.fit(model, start, data, guess, **how)
    assert found.converged and found.values == pytest.approx(STIFFNESS, rel=1e-9)


@pytest.mark.slow
def test_thresholds_and_timers_are_found_with_stiffnesses():
    model, start = powered_knee()
    _, data, how = recorded(model, start)
    wanted = {"phase.k1": 99.0, "phase.bend": 25.0 * DEGREE, "phase.late stance to push-off.after": 0.15}
    found = mbd.fit(model, start, data, {name: 1.06 * value for name, value in wanted.items()}, **how)
    assert found.values == pytest.approx(wanted, rel=1e-9)
