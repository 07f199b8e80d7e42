"""The energy ledger and the step table."""

from itertools import pairwise

import numpy as np
import pytest

import mbd
from mbd.analysis.gait import gait, mirrored
from mbd.equations.equations import Row
from mbd.errors import UnknownNameError
from mbd.results.trajectory import Trajectory
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start, pendulum
from tests.view.handmade_runs import Sheet, ball, oscillator, record, walker


def test_the_parts_sum_to_the_change_of_energy():
    for run in (oscillator(), ball(), walker()):
        ledger = run.energy
        assert sum(ledger.sums.values()) == pytest.approx(ledger.change, abs=1e-12)
        np.testing.assert_allclose(ledger.total, ledger.kinetic + ledger.potential)


def test_work_is_integrated_with_order_8():
    errors = [float(np.max(np.abs(oscillator(dt).energy.numerical))) for dt in (0.16, 0.08, 0.04)]
    assert all(np.log2(a / b) > 7.8 for a, b in pairwise(errors))
    assert oscillator(0.02).energy.drift < 1e-13


def test_a_damper_takes_and_a_force_gives():
    ledger = oscillator().energy
    assert np.all(np.diff(ledger["damper"]) <= 0.0) and ledger.sums["damper"] < 0.0
    assert {part.name: part.kind for part in ledger.parts} == {"damper": "damper", "push": "force"}
    assert ledger["push"][0] == 0.0 and ledger["numerical"][0] == 0.0


def test_the_work_of_a_prescribed_motion_is_counted():
    """A mass dragged by x(t) = sin t: λ h_t is the power of the drive, and the only cause of its kinetic energy."""
    sheet = Sheet(1)
    coordinates = sheet.coordinates("slider.displacement")
    from mbd.tape.functions import cos, sin

    rows = (Row("drive", "", sheet.q[0] - sin(sheet.t), sheet.v[0] - cos(sheet.t)),)
    equations = sheet.equations("driven", coordinates, 1.5 * sheet.v[0] ** 2, sheet.tape.zero, rows=rows)
    t = np.linspace(0.0, 2.0, 201)
    q, v, a = (x[:, None] for x in (np.sin(t), np.cos(t), -np.sin(t)))
    ledger = Trajectory(record(equations, t, q, v, a, lam=-3.0 * a)).energy
    assert ledger.sums["drive"] == pytest.approx(1.5 * (np.cos(2.0) ** 2 - 1.0), rel=1e-6)
    assert ledger.drift < 1e-8


def test_a_bead_on_a_turning_hoop_takes_its_energy_from_the_turning():
    """T = ½ R²(θ̇² + Ω² sin²θ): the hoop's drive works, though no constraint row shows it."""
    from scipy.integrate import solve_ivp

    from mbd.tape.functions import cos, sin

    turn, g = 3.0, 9.81
    sheet = Sheet(1)
    coordinates = sheet.coordinates("bead.angle")
    kinetic = 0.5 * (sheet.v[0] ** 2 + turn**2 * sin(sheet.q[0]) ** 2)
    equations = sheet.equations("hoop", coordinates, kinetic, -g * cos(sheet.q[0]))

    def rate(_: float, y: np.ndarray) -> list[float]:
        return [y[1], turn**2 * np.sin(y[0]) * np.cos(y[0]) - g * np.sin(y[0])]

    t = np.linspace(0.0, 2.0, 201)
    y = solve_ivp(rate, (0.0, 2.0), [0.5, 0.0], t_eval=t, rtol=1e-11, atol=1e-12).y
    a = np.array([rate(0.0, state)[1] for state in y.T])
    ledger = Trajectory(record(equations, t, y[:1].T, y[1:].T, a[:, None])).energy
    assert np.ptp(ledger.total) > 0.1
    assert ledger.drift < 1e-8 and [part.name for part in ledger.parts] == ["moving coordinates"]


def test_a_potential_that_moves_with_time_does_work():
    """V = ½ k (x − t)²: the wall of the spring walks away."""
    sheet = Sheet(1)
    coordinates = sheet.coordinates("slider.displacement")
    equations = sheet.equations("walk", coordinates, 0.5 * sheet.v[0] ** 2, 2.0 * (sheet.q[0] - sheet.t) ** 2)
    t = np.linspace(0.0, 2.0, 201)
    q, v, a = t - np.sin(2.0 * t) / 2.0, 1.0 - np.cos(2.0 * t), 2.0 * np.sin(2.0 * t)
    ledger = Trajectory(record(equations, t, q[:, None], v[:, None], a[:, None])).energy
    assert ledger.drift < 1e-7 and [part.name for part in ledger.parts] == ["changing potential"]


def stopped_leg(dt: float) -> Trajectory:
    """A driven leg with losses, a spring and a penalty knee stop that closes."""
    model = mbd.Model("stopped leg")
    thigh = mbd.Link("thigh", mass=1.0, length=0.5, center=0.2)
    shank = mbd.Link("shank", mass=0.5, length=0.5, center=0.2, inertia=0.01)
    knee = mbd.Revolute("knee", thigh.end, shank.start, loss=mbd.Viscous(0.05) + mbd.Quadratic(0.02))
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start, loss=mbd.Viscous(0.1)), knee)
    model.constrain(mbd.Penalty("stop", mbd.flexion(knee), stiffness=500.0, damping=2.0))
    model.apply(
        mbd.Applied("push", shank.end, force=lambda t: (3.0 * mbd.sin(5.0 * t), 0.0, 0.0)),
        mbd.Spring("band", model.ground.point(0.3, 0.0), shank.end, stiffness=30.0, length=0.4),
    )
    start = mbd.assemble(model, position={"hip.angle": 0.5, "knee.angle": -0.3}, velocity={"knee.rate": 4.0})
    return mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=dt, until=1.0)


@pytest.mark.parametrize("steps", [(4e-3, 2e-3, 1e-3), (5e-4, 2.5e-4, 1.25e-4)])
def test_what_the_ledger_leaves_over_falls_with_the_step_as_the_scheme_promises(steps):
    """Steps that do not resolve the impact on the stop, which takes shorter ones of its own, and such that do."""
    runs = [stopped_leg(dt) for dt in steps]
    assert all((len(run.time) > 1.5 / dt) is (steps[0] > 1e-3) for run, dt in zip(runs, steps, strict=True))
    left = [abs(float(run.energy.numerical[-1])) for run in runs]
    assert all(1.7 < np.log2(a / b) < 2.3 for a, b in pairwise(left))
    last = runs[-1].energy
    assert {part.name for part in last.parts} == {"hip loss", "knee loss", "push", "stop"}
    assert last.sums["stop"] < 0.0 < last.sums["push"] and runs[-1].events[0].name == "stop"
    assert last.drift < 1e-4


@pytest.mark.parametrize("make", ["controlled", "driven", "rubbing"])
def test_long_explicit_steps_leave_over_what_the_scheme_itself_makes(make):
    """Works between samples of a controller, of a multiplier, and of dry friction fall like the steps' own errors."""
    model = pendulum(mbd.Viscous(0.2) if make == "controlled" else mbd.Coulomb(0.5) if make == "rubbing" else None)
    if make == "controlled":
        model.apply(mbd.Motor("motor", model.joints[0], torque=0.5))
        told = {"reads": ["hinge.angle"], "writes": ["motor.torque"], "period": 0.3}
        model.apply(
            mbd.Controller("servo", lambda t, v, s: {"motor.torque": 2 * np.sin(3 * t) - v["hinge.angle"]}, **told)
        )
    elif make == "driven":
        model.constrain(mbd.Bilateral("drive", model.joints[0], value=lambda t: t + 0.3 * t * t))
    start = mbd.assemble(model, {"hinge.angle": {"controlled": 1.0, "driven": 0.0, "rubbing": 1.5}[make]})
    runs = [mbd.simulate(model, start, mbd.RungeKutta853(), dt=dt, until=2.7) for dt in (0.1, 0.05)]
    left = [float(np.max(np.abs(run.energy.numerical))) for run in runs]
    assert left[1] < (1e-6 if make == "rubbing" else 1e-10) and left[1] < left[0] / 20.0


def test_the_drive_of_a_slider_crank_gives_back_what_it_takes():
    """At constant crank speed the energy after one turn is that of the start: the drive's net work is zero."""
    model = mbd.Model("slider-crank", gravity=(0.0, 0.0, 0.0))
    crank = mbd.Link("crank", mass=0.5, length=0.1, center=0.05)
    rod = mbd.Link("rod", mass=0.5, length=0.3, center=0.15)
    slider = mbd.PointMass("slider", mass=0.4)
    turn = mbd.Revolute("turn", model.ground.origin, crank.start)
    model.connect(
        turn, mbd.Revolute("pin", crank.end, rod.start), mbd.Prismatic("guide", model.ground.origin, slider.origin),
        mbd.Revolute("wrist", rod.end, slider.origin),
    )  # fmt: skip
    model.constrain(mbd.Bilateral("drive", turn, value=lambda t: 10.0 * t))
    reach = float(np.arccos(-1.0 / 3.0))  # from the end of the hanging crank up to y = 0
    pose = {"turn.angle": 0.0, "pin.angle": reach}
    start = mbd.assemble(model, position=pose, velocity={"turn.rate": 10.0})
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(rho_inf=0.9), dt=1e-3, until=0.2 * np.pi)
    work = run.energy["drive"]
    assert np.ptp(work) > 0.1 and abs(work[-1]) < 1e-3 * np.ptp(work)
    np.testing.assert_allclose(run.energy.total - run.energy.total[0], work, atol=1e-4 * np.ptp(work))


def test_the_ledger_prints_and_names_its_parts():
    ledger = oscillator().energy
    text = repr(ledger)
    for word in ("kinetic", "potential", "damper", "push", "numerical", "the integrator", "[J]"):
        assert word in text
    with pytest.raises(UnknownNameError, match="no part of the energy named 'dumper'; did you mean 'damper'"):
        ledger["dumper"]


def test_steps_of_a_repeating_walk_are_equal():
    steps = gait(walker(steps=5, period=0.5, swing=0.25))
    assert [step.foot for step in steps] == ["right foot", "left foot", "right foot", "left foot"]
    for step in steps:
        assert step.period == pytest.approx(0.5) and step.length == pytest.approx(2.0 * np.sin(0.25))
        assert step.speed == pytest.approx(4.0 * np.sin(0.25)) and step.deviation < 1e-12
    assert "length [m]" in repr(steps) and steps.as_json()[0]["foot"] == "right foot"


def test_the_loss_of_a_step_is_what_its_impacts_took():
    model = kneed_walker()
    run = mbd.simulate(model, kneed_walker_start(model), mbd.HHT(0.05), dt=2e-3, until=2.0)
    kinetic = run.energy.kinetic
    struck = {event.row for event in run.events if event.impulse.any()}
    landings = [0, *(event.row for event in run.events if event.kind == "closed" and event.name.endswith("foot"))]
    steps = gait(run)
    assert len(steps) >= 3
    for step, before, after in zip(steps, landings[:-1], landings[1:], strict=True):
        taken = sum(kinetic[row - 1] - kinetic[row] for row in struck if before < row <= after)
        assert taken > 0.1 and step.loss == pytest.approx(taken, rel=1e-9)


def test_a_long_walk_is_shortened_in_print_only():
    steps = gait(walker(steps=40, dt=0.1))
    assert len(steps) == 39 and "15 more" in repr(steps) and len(repr(steps).splitlines()) == 26


def test_a_mechanism_without_feet_has_no_steps():
    assert len(gait(oscillator())) == 0 and len(gait(ball())) == 0


def test_heel_and_toe_of_a_body_are_one_foot():
    """Two tilted feet fall one after the other; the first rocks between toe and heel until the second makes a step."""
    model, place = mbd.Model("feet"), {}
    for k, side in enumerate(("left", "right")):
        foot = mbd.RigidBody(f"{side} foot", mass=1.0, inertia=0.01)
        model.connect(mbd.Planar(f"{side} way", model.ground.origin, foot.origin))
        for part, x in ("heel", -0.1), ("toe", 0.1):
            model.constrain(mbd.Unilateral(f"{side} {part}", mbd.touchdown(foot.point(x, -0.1, name=part))))
        place |= {f"{side} way.x": k, f"{side} way.y": 0.15 + 0.3 * k, f"{side} way.angle": -0.2}
    run = mbd.simulate(model, mbd.assemble(model, place), dt=1e-3, until=("right toe", 1.0), backend="python")
    assert [event.name for event in run.events if event.kind == "closed"][:2] == ["left toe", "left heel"]
    (step,) = gait(run).steps
    assert step.foot == "right toe" and step.length == pytest.approx(1.0, abs=1e-3)


def test_sides_are_exchanged_word_by_word():
    assert mirrored(["left hip.angle", "right hip.angle", "trunk.x"]) == [
        ("left hip.angle", "right hip.angle"), ("right hip.angle", "left hip.angle"), ("trunk.x", "trunk.x"),
    ]  # fmt: skip
