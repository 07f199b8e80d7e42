"""Case f4: a rimless wheel rolls down a slope at a steady speed, or rocks to rest on two spokes."""

import math
from itertools import pairwise

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import WITH_ROWS, name_of
from tests.cases.wheels import RimlessWheel
from tests.helpers import assert_second_order
from tests.problems import case

F4 = case("f4-rimless-wheel")
WHEEL = RimlessWheel(
    int(F4.definition["n_spokes"]), F4.definition["L"], F4.definition["g"], F4.definition["slope"],
    F4.definition["r_gyr2_over_L2"],
)  # fmt: skip
OTHER = RimlessWheel(spokes=11, length=0.7, gravity=3.5, slope=0.15, inertia=0.3, mass=2.4)
"""Another wheel, with inertia."""


def touchdowns(run: mbd.Trajectory) -> list[mbd.results.trajectory.EventRecord]:
    return [event for event in run.events if event.kind == "closed"]


@pytest.mark.parametrize("wheel", [WHEEL, OTHER], ids=["published", "another"])
@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
def test_period_and_speeds_of_steady_rolling_are_of_second_order(scheme: NewmarkFamily, wheel: RimlessWheel) -> None:
    """After one spoke from the published speed, or from the speed that another wheel keeps."""
    gain = 2.0 * (wheel.energy(wheel.half) - wheel.energy(-wheel.half))
    steady = wheel.eta * math.sqrt(gain / (1.0 - wheel.eta**2))
    period, before = wheel.next_impact(steady)
    if wheel is WHEEL:
        assert [steady, before, period] == pytest.approx(
            [F4[name].value for name in ("w just after", "w just before", "step period")], abs=1e-11
        )
    model = wheel.model()
    start = wheel.start(model, steady)

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(model, start, scheme, dt=dt, until=1.2 * period)
        (touch,) = touchdowns(run)
        speeds = [-run.at(touch.time, side=side)["roll.angle.rate"] for side in ("left", "right")]
        return [touch.time - period, speeds[0] - before, speeds[1] - steady]

    assert_second_order(errors, period / 400)


@pytest.mark.parametrize("share", [0.9, 1.1, 1.3])
@pytest.mark.parametrize("wheel", [WHEEL, OTHER], ids=["published", "another"])
def test_any_rolling_speed_returns_to_the_steady_one_by_the_square_of_eta(wheel: RimlessWheel, share: float) -> None:
    """ω² is drawn to that of steady rolling by η² with each spoke; instants and impulses as by hand."""
    gain = 2.0 * (wheel.energy(wheel.half) - wheel.energy(-wheel.half))
    steady = wheel.eta * math.sqrt(gain / (1.0 - wheel.eta**2))
    model, speed = wheel.model(), share * steady
    times, losses, expected, t = [], [], [], 0.0
    while len(times) < 5:
        period, before = wheel.next_impact(speed)
        speed, t = wheel.eta * before, t + period
        times.append(t)
        expected.append(speed)
        losses.append(0.5 * wheel.mass * wheel.length**2 * (1.0 + wheel.inertia) * (before**2 - speed**2))
    run = mbd.simulate(model, wheel.start(model, share * steady), mbd.HHT(), dt=2e-4, until=times[-1] + 0.01)
    touches = touchdowns(run)
    assert [touch.time for touch in touches] == pytest.approx(times, abs=2e-6)
    assert [touch.energy_loss for touch in touches] == pytest.approx(losses, rel=2e-6)
    found = -run.at([touch.time for touch in touches])["roll.angle.rate"]
    assert found == pytest.approx(np.array(expected), abs=2e-6)
    ratios = [(b - steady**2) / (a - steady**2) for a, b in pairwise(found**2)]
    assert ratios == pytest.approx([wheel.eta**2] * 4, abs=1e-3)
    if wheel is WHEEL:
        assert wheel.eta**2 == pytest.approx(F4["multiplier of the return map"].value, abs=1e-13)


# rest -------------------------------------------------------------------------------------------------------------
def rocking(wheel: RimlessWheel, speed: float) -> tuple[list[float], float]:
    """Instants of the impacts of a rocking wheel by hand, by DOP853, and the instant at which they pile up."""
    from scipy.integrate import solve_ivp

    rate = wheel.gravity / wheel.length / (1.0 + wheel.inertia)
    settings = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}

    def motion(t: float, y: np.ndarray) -> list[float]:
        return [y[1], rate * math.sin(y[0] + wheel.slope)]

    def down(t: float, y: np.ndarray) -> float:
        return wheel.half - abs(y[0])

    down.terminal, down.direction = True, -1.0
    times, t, theta, w = [], 0.0, -wheel.half, speed
    while abs(w) > 1e-4:
        stroke = 2 * abs(w) / (rate * abs(math.sin(theta + wheel.slope)))
        away = solve_ivp(motion, (t, t + 0.01 * stroke), [theta, w], **settings)
        start = (float(away.t[-1]), away.y[:, -1])
        solved = solve_ivp(motion, (start[0], t + 20.0), start[1], events=down, max_step=stroke / 8, **settings)
        t, (theta, w) = float(solved.t[-1]), solved.y[:, -1]
        theta, w = -math.copysign(wheel.half, theta), wheel.eta * w  # onto the neighbouring spoke
        times.append(t)
    end = t
    while abs(w) > 1e-15:  # strokes so small that gravity's moment is constant
        end += 2 * abs(w) / (rate * abs(math.sin(theta + wheel.slope)))
        theta, w = -theta, wheel.eta * w
    return times, end


@pytest.mark.parametrize(("wheel", "speed"), [(WHEEL, 0.9), (WHEEL, 0.5), (OTHER, 0.22)])
def test_a_slow_wheel_rocks_with_ever_shorter_strokes_to_rest_on_two_spokes(wheel: RimlessWheel, speed: float) -> None:
    model = wheel.model()
    by_hand, end = rocking(wheel, speed)
    start = wheel.start(model, speed)
    run = mbd.simulate(model, start, mbd.HHT(), dt=2e-4, until=end + 1.0)
    times = [touch.time for touch in touchdowns(run)]
    assert 20 < len(times) < 120  # bounded work in an endless sequence
    assert times[:12] == pytest.approx(by_hand[:12], abs=5e-6)
    assert end - 2e-4 < times[-1] < end + 1e-5  # the last strokes, slower than 1e-6 m/s, are left out
    resting = run.time > times[-1]
    assert np.sum(resting) > 4000
    for name in "roll.angle.rate", "roll.x.rate", "roll.y.rate":
        assert np.max(np.abs(run[name][resting])) < 1e-9
    assert np.max(np.abs(run["roll.angle"][resting] - wheel.half)) < 1e-9
    feet = [run[f"spoke {k}.force"][resting] for k in (0, wheel.spokes - 1)]
    weight = wheel.mass * wheel.gravity * math.cos(wheel.slope)
    assert min(np.min(foot) for foot in feet) > 0.0
    assert feet[0] + feet[1] == pytest.approx(np.full(np.sum(resting), weight), rel=1e-9)
    along = [run[f"spoke {k}.friction"][resting] for k in (0, wheel.spokes - 1)]
    assert along[0] + along[1] == pytest.approx(
        np.full(np.sum(resting), -wheel.mass * wheel.gravity * math.sin(wheel.slope)), rel=1e-9
    )
    # moments about the foot in front: the hub is L cos α above the slope and L sin α behind it
    lever = math.cos(wheel.slope) * math.sin(wheel.half) - math.sin(wheel.slope) * math.cos(wheel.half)
    rear = wheel.mass * wheel.gravity * lever / (2.0 * math.sin(wheel.half))
    assert feet[1] == pytest.approx(np.full(np.sum(resting), rear), rel=1e-8)
    total = run["kinetic_energy"] + run["potential_energy"]
    assert np.max(np.diff(total)) < 1e-9
