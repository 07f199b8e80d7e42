"""The examples in space, on numbers of Euler's equations and of Lagrange's top."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

import mbd
from mbd.analysis.gait import gait as steps_of
from mbd.joints.quaternions import rotation_of
from tests.test_examples import g, run_of, script, zeros


def test_a_racket_turns_over_when_euler_says_so() -> None:
    run = run_of("tennis-racket")
    A, B, C = 0.0014, 0.0152, 0.0166  # about the handle, across, off the face
    p, q = 1.0, 18.0
    twice, square = A * p * p + B * q * q, (A * p) ** 2 + (B * q) ** 2  # 2 T and L²
    rate = math.sqrt((B - A) * (twice * C - square) / (A * B * C))
    part = (C - B) * (square - twice * A) / ((B - A) * (twice * C - square))
    flips = zeros(run, "flight.angular_velocity.x")
    assert len(flips) == 3
    assert np.diff(flips) == pytest.approx(2.0 * ellipk(part) / rate, rel=1e-4)
    name = "flight.orientation"
    turned = [rotation_of(each) for each in run[name]]
    spun = np.einsum("kij,kj->ki", np.array(turned), run["flight.angular_velocity"] * [B, A, C])
    assert np.max(np.abs(spun - spun[0])) < 1e-5 * np.linalg.norm(spun[0])
    fallen = 1.5 + 5.0 * run.time - 0.5 * g * run.time**2
    assert run["racket.center.y"] == pytest.approx(fallen, abs=1e-6)


def test_a_top_nods_between_the_roots_of_its_cubic_and_goes_round() -> None:
    run = run_of("spinning-top")
    A, C, mgl, spin = 1.4e-4 + 0.2 * 0.06**2, 2.5e-4, 0.2 * g * 0.06, 60.0 * math.pi
    steep = (C * spin / A) ** 2 * A / (2.0 * mgl)  # 1 − u² = steep (cos θ₀ − u)
    released = math.cos(0.4)
    lowest = min(np.roots([1.0, -steep, steep * released - 1.0]), key=lambda u: abs(u - released))
    axis = run.at(np.linspace(0.0, 1.0, 20001))["body.tip"] / 0.12
    assert axis[:, 1].max() == pytest.approx(released, abs=1e-7)
    assert axis[:, 1].min() == pytest.approx(lowest, abs=3e-5)
    middle, half = 0.5 * (released + lowest), 0.5 * (released - lowest)

    def over_a_nod(what: Callable[[float], float]) -> float:
        """2 ∫ what/√f du between the roots of f = 2 m g l/A (cos θ₀ − u) (1 − u² − steep (cos θ₀ − u))."""

        def part(phase: float) -> float:
            u = middle + half * math.sin(phase)
            return what(u) / math.sqrt(2.0 * mgl / A * (steep - lowest - u))  # its third root

        return 2.0 * float(quad(part, -0.5 * math.pi, 0.5 * math.pi)[0])

    nod = over_a_nod(lambda u: 1.0)
    round_a_nod = over_a_nod(lambda u: C * spin / A * (released - u) / (1.0 - u * u))
    turned = run.at(np.arange(0.0, 1.0, nod))["body.tip"]
    assert turned[:, 1] / 0.12 == pytest.approx(released, abs=1e-5)
    round_ = np.unwrap(np.arctan2(turned[:, 0], turned[:, 2]))
    assert np.diff(round_) == pytest.approx(round_a_nod, rel=1e-3)


def test_a_walker_rocks_stably_forward_and_falls_to_the_side() -> None:
    gait = script("walker-in-space")["gait"]
    sizes = np.abs(gait.multipliers)
    assert np.sum(sizes > 1.0) == 1 and sizes[1:].max() < 0.55  # Kuo 1999: one mode, to the side
    lateral = gait.modes[0]
    assert abs(lateral["roll.angle.rate"]) > 3.0 * abs(lateral["left hip.angle.rate"])
    assert gait.multipliers[0].real == pytest.approx(-9.46593, rel=1e-4)
    assert (gait.period, gait.distance) == pytest.approx((0.7512633, 0.6320907), rel=1e-5)
    pendulum = math.sqrt(g * math.cos(0.03) / 1.0)  # to the side, of the leg's length over the edge of the foot
    tip = 0.1 * math.tanh(0.5 * pendulum * gait.period) * pendulum
    assert abs(gait.state["roll.angle.rate"]) == pytest.approx(tip, rel=0.1)
    run = run_of("walker-in-space")
    strikes = [event.time for event in run.events if event.kind == "closed"]
    assert np.diff([0.0, *strikes]) == pytest.approx(gait.period, rel=1e-6)
    lost = gait.energy["impact"]
    assert -lost == pytest.approx(69.1 * g * math.sin(0.03) * gait.distance, rel=1e-9)  # what the slope gives
    assert run["roll.angle"].min() < -0.01 < 0.01 < run["roll.angle"].max()
    for step in steps_of(run):  # the mirror image of a roll is its opposite, a step has no width
        assert step.deviation < 1e-9 and step.length == pytest.approx(gait.distance, rel=1e-9)


def test_a_billiard_ball_slides_on_a_parabola_and_rolls_on() -> None:
    run = run_of("billiard-ball")
    R, mu, v = 0.0286, 0.2, np.array([2.0, 0.0, 0.0])
    slip = v + np.cross([40.0, 30.0, 60.0], [0.0, -R, 0.0])
    size = float(np.linalg.norm(slip))
    grips = 2.0 * size / (7.0 * mu * g)
    assert [(event.kind, event.time) for event in run.events] == [("stuck", pytest.approx(grips, abs=1e-9))]
    slides = run.at(np.linspace(0.0, grips, 20))
    path = v * slides.time[:, None] - 0.5 * mu * g / size * slip * slides.time[:, None] ** 2
    assert slides["cue ball.origin"] - [0.0, R, 0.0] == pytest.approx(path, abs=1e-9)
    rolls = run.at(np.linspace(grips + 1e-6, 0.7, 20))
    speed = np.column_stack([rolls[f"roll.{axis}.rate"] for axis in "xyz"])
    assert speed == pytest.approx(np.tile(v - 2.0 / 7.0 * slip, (20, 1)), abs=1e-9)
    assert rolls["roll.angular_velocity.ground"][:, 1] == pytest.approx(30.0, abs=1e-9)


def test_a_tippe_top_turns_over_and_jellett_stays() -> None:
    run = run_of("tippe-top")
    R, a, A, C = 0.015, 0.0045, 5.052857142857143e-07, 5.4e-07
    turned = np.array([rotation_of(each) for each in run["float.orientation"]])
    axis = turned[:, :, 1]
    tilt = np.arccos(axis[:, 1])
    assert tilt[0] == pytest.approx(0.1, abs=1e-12)
    assert tilt[-1] > 3.1  # it stands on its peg
    momentum = np.einsum("kij,kj->ki", turned, run["float.angular_velocity"] * [A, C, A])
    jellett = momentum @ [0.0, R, 0.0] - a * np.einsum("ki,ki->k", momentum, axis)
    assert jellett == pytest.approx(np.full(len(jellett), 8.725777295065614e-07), rel=1e-7)
    assert run["float.angular_velocity.ground.y"][-1] < 0.6 * 155.0
    assert run["tip.force"].min() > 0.0


def test_a_report_in_space_tells_steps_along_the_way() -> None:
    gait = script("walker-in-space")["gait"]
    words = str(mbd.gait_report(gait)).splitlines()
    steps = next(line for line in words if line.startswith("step length [m]")).split()[3:5]
    assert [float(step) for step in steps] == pytest.approx([gait.distance] * 2, abs=5e-5)
