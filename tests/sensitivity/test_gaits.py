"""Cases k1 and k6: the return maps of passive walkers, their Floquet multipliers, and derivatives of their gaits.

The gait is found by Newton's method on the exact return map; derivatives of period, length and speed by parameters
follow from the implicit function theorem.
"""

from dataclasses import dataclass

import numpy as np
import pytest

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from tests.cases.walkers import compass, kneed, standing
from tests.problems import case

DIRECTIONS = {
    "slope angle": lambda sizes: {
        "gravity.x": sizes["g"] * np.cos(sizes["slope"]), "gravity.y": sizes["g"] * np.sin(sizes["slope"]),
    },
    "hip mass": lambda sizes: {"hip.mass": 1.0},
}  # fmt: skip
PLACE = "position of the thigh (leg) mass of both legs: a2 + s, b2 - s, L fixed"


def both(part, name, rate):
    return {f"{side} {part}.{name}": rate for side in ("left", "right")}


COMPASS = DIRECTIONS | {
    PLACE: lambda sizes: both("leg", "center", -1.0),
    "thigh (leg) mass mt of both legs": lambda sizes: both("leg", "mass", 1.0),
}
KNEED = DIRECTIONS | {
    PLACE: lambda sizes: both("thigh", "center", -1.0),
    "shank mass ms of both legs": lambda sizes: both("shank", "mass", 1.0),
}


@dataclass
class Step:
    """One step: the state after it as (stance, rates), its length and instants, and their derivatives."""

    state: np.ndarray
    length: float
    period: float
    of_state: np.ndarray
    of_length: np.ndarray
    of_period: np.ndarray


def stepped(model, sizes, state, ways):
    """From (stance, stance rate, swing rate) from the vertical, by these and by directions of parameters."""
    slope, leg = sizes["slope"], sizes["a1"] + sizes["b1"] + sizes["a2"] + sizes["b2"]
    start = standing(model, [state[0], -2.0 * slope - state[0], *state[1:]], slope)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-10, until="right foot")
    names = [f"{side} hip.angle{rate}" for rate in ("", ".rate") for side in ("left", "right")]
    wrt = [*names, *((name, way(sizes)) for name, way in ways.items())]
    matrix, time = final_state_derivative(run, wrt, held=names)
    final = run.final
    lines = [[*final.names, *final.velocity_names].index(name) for name in names]
    found = matrix[lines]
    at_slope = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]).T  # angles by spread
    by_state = found[:, :4] @ at_slope
    found = np.hstack([by_state, found[:, 4:]])
    time = np.concatenate([time[:4] @ at_slope, time[4:]])
    after = np.array([final["right hip.angle"] - slope, final["right hip.angle.rate"], final["left hip.angle.rate"]])
    spread = final["right hip.angle"]
    of_after = found[[1, 3, 2]]  # the sides have changed their parts
    length = 2.0 * leg * np.sin(spread)
    return Step(after, length, run.final.time, of_after, 2.0 * leg * np.cos(spread) * found[1], time)


@pytest.mark.parametrize(
    ("name", "build", "ways"),
    [("k1-compass-gait-derivatives", compass, COMPASS), ("k6-kneed-walker-derivatives", kneed, KNEED)],
    ids=["compass", "kneed"],
)
def test_multipliers_and_derivatives_of_a_gait(name, build, ways):
    reference = case(name)
    sizes = reference.definition
    state = np.array(reference["state just after heel strike"].value)
    step = stepped(build(sizes), sizes, state, ways)
    assert step.state == pytest.approx(state, abs=1e-9)
    found = ordered(np.linalg.eigvals(step.of_state[:, :3]))
    real, imaginary = reference["Floquet multipliers"].value
    assert found == pytest.approx(ordered(np.array(real) + 1j * np.array(imaginary)), abs=2e-9)
    moved = np.linalg.solve(np.eye(3) - step.of_state[:, :3], step.of_state[:, 3:])
    of_period = step.of_period[:3] @ moved + step.of_period[3:]
    of_length = step.of_length[:3] @ moved + step.of_length[3:]
    of_speed = of_length / step.period - step.length / step.period**2 * of_period
    for kind, values in (
        ("period", of_period),
        ("step length along the slope", of_length),
        ("speed along the slope", of_speed),
    ):
        wanted = [reference[f"d({kind}) / d({way})"].value for way in ways]
        assert values == pytest.approx(wanted, rel=1e-8), kind


def ordered(values):
    """By size, conjugates in order."""
    return np.array(sorted(values, key=lambda z: (round(abs(z), 6), z.imag)))
