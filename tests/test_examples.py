"""Every example runs as ``mbd run`` runs it, and is checked on physical numbers.

Reference values of walkers, of the double pendulum and of the slider-crank were computed twice each, by methods other
than Newmark's (80-bit Taylor series, DOP853 at 1e-13, closed forms), and agree with the publications named beside them.
"""

import math
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq
from scipy.special import ellipk

import mbd
from mbd.analysis.gait import Step, gait
from mbd.cli import Script, examples
from tests.problems import case

g = 9.81
NAMES = (
    "amputee-in-space", "ankle-push-off", "basin-picture", "bicycle", "billiard-ball", "chapter-walker",
    "compare-two-knees", "compass-gait", "double-pendulum", "find-a-gait", "four-bar", "from-the-laboratory",
    "identify-a-shank", "kneed-walker", "lagrangian-double-pendulum", "long-pendulum", "mpk-swing-control", "pendulum",
    "powered-knee", "prosthetic-leg", "push-off-wheel", "raibert-hopper", "reflex-walker", "rimless-wheel",
    "rolling-coin", "shaken-block", "simplest-walker-lagrangian", "slider-crank", "slip-runner", "spinning-top",
    "spring-mass-walker", "steeper-slope", "tennis-racket", "tippe-top", "torso-walker", "tune-a-knee-damper",
    "user-constraint", "user-integrator", "walker-in-space",
)  # fmt: skip
HEAVY = ("amputee-in-space",)
"""Whose plain twin takes minutes: see tests/cases/test_space_examples.py."""
STUDIES = ("compare-two-knees", "from-the-laboratory", "identify-a-shank", "tune-a-knee-damper")
"""Which find gaits or fits before their run, for seconds."""
LONG = ("steeper-slope", "long-pendulum", "basin-picture")
"""Which run for seconds, and are run again where the site is made."""
EACH = [pytest.param(name, marks=pytest.mark.slow) if name in (*STUDIES, *LONG) else name for name in NAMES]
COARSE = ("long-pendulum", "tippe-top", "user-integrator")
"""Of steps so long, for very many periods, or of order so low that other schemes differ."""
WALKERS = ("chapter-walker", "compass-gait", "kneed-walker", "prosthetic-leg")


@lru_cache
def script(name: str) -> dict[str, Any]:
    """What an example defines."""
    return Script.load(name).names


@lru_cache
def run_of(name: str) -> mbd.Trajectory:
    """The run that ``mbd run NAME`` makes."""
    return Script.load(name).run(None, {})


def again(name: str, **changes: Any) -> mbd.Trajectory:
    """A run of an example with something changed: start, dt, until, integrator, backend, parameters."""
    names = script(name)
    given = {word: names[word] for word in ("start", "integrator", "dt", "until")} | changes
    start, integrator = given.pop("start"), given.pop("integrator")
    return mbd.simulate(names["model"], start, integrator, **given)


def restarted(name: str, position: dict[str, float], velocity: dict[str, float], **changes: Any) -> mbd.State:
    """Another start of an example; the trailing foot is about to leave the ground."""
    return mbd.assemble(script(name)["model"], position=position, velocity=velocity, **changes)


def zeros(run: mbd.Trajectory, name: str) -> list[float]:
    """Times at which a quantity passes through zero [s]."""
    time, value = run.time, run[name]
    crossed = np.flatnonzero(value[:-1] * value[1:] < 0.0)
    return [brentq(lambda t: run.at(t)[name], time[k], time[k + 1], xtol=1e-13) for k in crossed]


def strikes(run: mbd.Trajectory, word: str) -> list[Any]:
    """Closings of the contacts whose name contains a word."""
    return [event for event in run.events if event.kind == "closed" and word in event.name]


def last_step(run: mbd.Trajectory) -> Step:
    return gait(run)[-1]


# all of them ------------------------------------------------------------------------------------------------------


def test_these_are_all_the_examples() -> None:
    assert tuple(examples()) == NAMES


@pytest.mark.parametrize("name", EACH)
def test_an_example_runs_without_faults(name: str) -> None:
    assert script(name)["model"].check() == []
    run = run_of(name)
    assert run.success
    assert run.energy.drift < 0.01
    assert max(run.violation.length, run.violation.angle) < 1e-10


@pytest.mark.sampled(4)
@pytest.mark.parametrize("name", [name for name in EACH if name not in HEAVY])
def test_the_plain_twin_moves_like_the_machine_code(name: str) -> None:
    until = 20 * script(name)["dt"]
    fast, plain = (again(name, until=until, backend=backend) for backend in ("auto", "python"))
    assert fast.final.q == pytest.approx(plain.final.q, rel=1e-9, abs=1e-11)
    assert fast.final.v == pytest.approx(plain.final.v, rel=1e-9, abs=1e-9)


@pytest.mark.covering
@pytest.mark.parametrize("name", [name for name in NAMES if name not in (*COARSE, *STUDIES, *HEAVY)])
@pytest.mark.parametrize("integrator", [mbd.Newmark(), mbd.HHT(0.1), mbd.GeneralizedAlpha(0.8)], ids=repr)
def test_the_choice_of_integrator_changes_little(name: str, integrator: Any) -> None:
    until = min(0.5, script(name)["until"])
    usual, other = again(name, until=until), again(name, until=until, integrator=integrator)
    assert [event.name for event in usual.events] == [event.name for event in other.events]
    size = np.max(np.abs(usual.final.q))
    assert other.final.q == pytest.approx(usual.final.q, abs=2e-4 * size)


@pytest.mark.parametrize("name", WALKERS)
@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_walker_that_starts_otherwise_walks_on_or_falls_by_name(name: str, factor: float) -> None:
    names = script(name)
    start = names["start"]
    hips = [f"{side} hip.angle" for side in ("left", "right")]
    knees = [name for name in start.names if "knee" in name or "ankle" in name]
    trailing = next(contact for contact in ("right foot", "right ball") if contact in _contacts(name))
    begin = restarted(
        name,
        {hip: start[hip] for hip in hips} | dict.fromkeys(knees, 0.0),
        {hip: factor * start[f"{hip}.rate"] for hip in hips} | dict.fromkeys(knees, 0.0),
        closed=sorted(start.mode.closed),
        open=[trailing],
    )
    run = again(name, start=begin, until=4.0)
    assert run.success
    assert run.message.startswith(("reached", "ended by 'fall'"))
    assert len(gait(run)) > 1
    assert run.energy.drift < 0.01


def _contacts(name: str) -> list[str]:
    return [contact.name for contact in script(name)["model"].contacts]


# pendulums --------------------------------------------------------------------------------------------------------


def test_a_falling_rod_has_the_period_of_the_elliptic_integral() -> None:
    period = 4.0 * math.sqrt(2.0 / (3.0 * g)) * ellipk(math.sin(math.pi / 4) ** 2)
    rests = zeros(run_of("pendulum"), "pin.rate")
    assert np.diff(rests) == pytest.approx(period / 2, abs=2e-6)


def test_a_rod_released_from_the_horizontal_pulls_with_five_halves_of_its_weight() -> None:
    run = run_of("pendulum")
    lowest = zeros(run, "pin.angle")
    assert lowest
    for time in lowest:
        assert run.at(time)["pin.reaction_force.y"] == pytest.approx(2.5 * 2.0 * g, rel=1e-5)


def _double_pendulum_error(run: mbd.Trajectory) -> float:
    errors, reference = [], case("a2-double-pendulum")["[theta1, theta2"]
    for time, (*angles, rate1, rate2) in zip(reference.t, reference.value, strict=True):
        now = run.at(time)
        upper, elbow = now["pin.angle"], now["elbow.angle"]
        errors += [upper - angles[0], upper + elbow - angles[1]]
        errors += [now["pin.rate"] - rate1, now["pin.rate"] + now["elbow.rate"] - rate2]
    return float(np.max(np.abs(errors)))


def test_the_double_pendulum_meets_its_reference_at_second_order() -> None:
    coarse = _double_pendulum_error(run_of("double-pendulum"))
    fine = _double_pendulum_error(again("double-pendulum", dt=5e-4))
    assert coarse < 2e-4
    assert 3.6 < coarse / fine < 4.4


def test_energies_in_sympy_move_like_bodies() -> None:
    bodies, energies = run_of("double-pendulum"), run_of("lagrangian-double-pendulum")
    assert energies["upper"] == pytest.approx(bodies["pin.angle"], abs=1e-8)
    assert energies["lower"] == pytest.approx(bodies["pin.angle"] + bodies["elbow.angle"], abs=1e-8)
    assert energies.energy.total[0] == pytest.approx(case("a2-double-pendulum")["total energy"].value, abs=1e-12)


def test_the_simplest_walker_of_energies_keeps_its_published_step() -> None:
    strikes = [event.time for event in run_of("simplest-walker-lagrangian").events]
    assert len(strikes) == 5
    assert np.diff([0.0, *strikes]) == pytest.approx(case("f1-simplest-walker-long")["step period"].value, abs=1e-7)


# linkages ---------------------------------------------------------------------------------------------------------


def test_the_rocker_swings_between_the_two_alignments_of_crank_and_coupler() -> None:
    run, crank, coupler, rocker, base = run_of("four-bar"), 0.1, 0.35, 0.3, 0.4

    def opposite(side: float) -> float:  # of a triangle with the rocker and the base
        return math.acos((rocker**2 + base**2 - side**2) / (2 * rocker * base))

    late = run.time > 0.5
    assert np.ptp(run["rocker pin.angle"][late]) == pytest.approx(
        opposite(coupler + crank) - opposite(coupler - crank), abs=1e-4
    )
    assert np.ptp(run["drive.angle"]) > 4 * math.pi  # the crank goes round


def test_the_four_bar_stays_closed_and_keeps_its_energy_balance() -> None:
    run = run_of("four-bar")
    assert np.max(np.abs(run["coupler.end"] - run["rocker.end"])) < 1e-10
    turned = run["drive.angle"][-1] - run["drive.angle"][0]
    assert run.energy["motor"][-1] == pytest.approx(1.0 * turned, rel=1e-5)
    lost = trapezoid(1.0 * run["rocker pin.rate"] ** 2, run.time)
    assert run.energy["rocker pin loss"][-1] == pytest.approx(-lost, rel=1e-5)
    assert run.energy.change == pytest.approx(turned - lost, abs=2e-3)


@pytest.mark.parametrize("turn", [0.0, 2 * math.pi])
@pytest.mark.parametrize(("place", "angle"), enumerate((0.4, 1.9, 3.3, 5.2)))
def test_the_driven_slider_crank_needs_the_torque_of_inverse_dynamics(place: int, angle: float, turn: float) -> None:
    x, speed, acceleration, torque = case("c3-slider-crank-rigid-driven")["[x, xdot"].value[place]
    now = run_of("slider-crank").at((angle + turn) / 150.0)
    assert now["guide.displacement"] == pytest.approx(x, abs=1e-9)
    assert now["guide.rate"] == pytest.approx(speed, abs=1e-6)
    assert now["guide.acceleration"] == pytest.approx(acceleration, abs=0.01)
    assert now["drive.torque"] == pytest.approx(torque, abs=5e-4)


# walkers ----------------------------------------------------------------------------------------------------------


def test_the_rimless_wheel_rolls_at_its_steady_speed() -> None:
    run, reference = run_of("rimless-wheel"), case("f4-rimless-wheel")
    hits = strikes(run, "spoke")
    assert -run["wheel.angle.rate"][hits[-1].row] == pytest.approx(reference["w just after"].value, abs=1e-5)
    assert np.diff([hit.time for hit in hits]) == pytest.approx(reference["step period"].value, abs=2e-6)
    assert last_step(run).length == pytest.approx(2 * math.sin(math.pi / 8), abs=1e-12)
    assert hits[-1].energy_loss == pytest.approx(g * last_step(run).length * math.sin(0.1), rel=1e-4)


def test_the_shaken_block_sticks_and_slips_as_newmarks_sliding_block() -> None:
    # between its instants the block feels g sin γ ∓ μ g cos γ, or the acceleration of the table
    names = script("shaken-block")
    slope, mu, stroke, turning = (names[word] for word in ("slope", "mu", "stroke", "turning"))
    pull, grip = g * math.sin(slope), mu * g * math.cos(slope)
    run = run_of("shaken-block")
    time, slid, sign = 0.0, 0.0, 0.0

    def speed(t: float) -> float:
        return float(stroke * turning * math.cos(turning * t))

    def asked(t: float) -> float:
        """Of friction, by the table."""
        return float(-stroke * turning**2 * math.sin(turning * t) - pull)

    for event in run.events:
        if sign == 0.0:  # it stuck: friction reaches what it can give
            give_way = [(_first_root(lambda t: grip + s * asked(t), time), s) for s in (1.0, -1.0)]  # noqa: B023
            end, sign = min(give_way)
        else:
            drive = pull - sign * grip
            begin, before = time, speed(time)
            end = _first_root(lambda t: sign * (before + drive * (t - begin) - speed(t)), begin + 1e-7)  # noqa: B023
            table = stroke * (math.sin(turning * end) - math.sin(turning * begin))
            slid += before * (end - begin) + 0.5 * drive * (end - begin) ** 2 - table
            sign = 0.0 if abs(asked(end)) <= grip else math.copysign(1.0, -asked(end))
        assert event.time == pytest.approx(end, abs=1e-9)
        assert event.kind == ("stuck" if sign == 0.0 else "slipped")
        assert run["path.x"][event.row] - run["rail.displacement"][event.row] == pytest.approx(slid, abs=1e-9)
        time = end
    assert len(run.events) == 26 and slid > 0.1


def _first_root(function: Any, begin: float) -> float:
    """Where a function, positive at first, falls through zero."""
    times = begin + np.linspace(0.0, 1.0, 20001)[1:]
    values = np.array([function(t) for t in times])
    place = int(np.argmax(values < 0.0))
    return float(brentq(function, times[max(place - 1, 0)], times[place], xtol=1e-14))


def test_the_torso_walker_repeats_its_stable_gait() -> None:
    run, found = run_of("torso-walker"), script("torso-walker")["gait"]
    struck = [event.time for event in strikes(run, "foot")]
    np.testing.assert_allclose(struck, found.period * np.arange(1, len(struck) + 1), atol=1e-8)
    assert found.period == pytest.approx(0.746772, abs=1e-6)
    assert abs(found.multipliers[0]) == pytest.approx(0.559377, abs=1e-6)
    assert np.max(np.abs(run["waist.angle"] - math.pi)) < 0.05
    left, right = run["stance"] == "left", run["stance"] == "right"
    assert not run["right drive.torque"][left].any() and not run["left drive.torque"][right].any()


def test_the_powered_knee_pushes_off_as_it_turns_and_brakes_before_it_is_straight() -> None:
    run, (turned, straightens) = run_of("powered-knee"), run_of("powered-knee").events
    assert np.degrees(run["knee.rate"][turned.row]) == pytest.approx(-3.0, abs=1e-8)
    assert np.degrees(run["knee.angle"][straightens.row]) == pytest.approx(-10.0, abs=1e-8)
    assert run["phase.most"][-1] == pytest.approx(run["knee.angle"][turned.row], abs=1e-10)


def test_the_hopper_settles_to_the_gait_that_is_stable() -> None:
    run = run_of("raibert-hopper")
    found = mbd.limit_cycle(script("raibert-hopper")["model"], run.final, section="toe")
    assert found.period == pytest.approx(0.632229, abs=1e-5)
    assert found.speed == pytest.approx(0.92728, abs=1e-4)
    assert abs(found.multipliers[0]) == pytest.approx(0.81955, abs=1e-4)
    hops = np.diff([event.time for event in strikes(run, "toe")])
    share = (hops[-1] - found.period) / (hops[-4] - found.period)  # of three hops
    assert share == pytest.approx(abs(found.multipliers[0]) ** 3, rel=0.05)


def test_the_knee_that_reads_and_brakes_bends_as_far_as_asked_and_is_straight_at_its_stop() -> None:
    run = run_of("mpk-swing-control")
    (stopped,) = strikes(run, "stop")
    assert np.degrees(np.min(run["knee.angle"])) == pytest.approx(-64.77, abs=0.05)
    assert run["knee.angle"][stopped.row] == pytest.approx(0.0, abs=1e-12)
    assert run["knee.rate"][stopped.row] == pytest.approx(0.0, abs=1e-9)


def test_a_runner_and_a_walker_on_springs_repeat_themselves() -> None:
    for name, highest in (("slip-runner", "apex"), ("spring-mass-walker", "highest")):
        run, found = run_of(name), script(name)["gait"]
        times = [event.time for event in run.events if event.name == highest]
        np.testing.assert_allclose(times, found.period * np.arange(1, len(times) + 1), atol=1e-8)
        assert found.stability == "stable"
    assert script("slip-runner")["gait"].speed == pytest.approx(5.0, abs=1e-10)
    force, down = run["left leg.force"], run["left leg.force"] > 0.0
    humps = np.flatnonzero((force[1:-1] > force[:-2]) & (force[1:-1] > force[2:])) + 1
    stances = np.flatnonzero(~down[:-1] & down[1:])
    assert len(humps) >= 2 * (len(stances) - 1)


@pytest.mark.parametrize(
    ("name", "published", "slope", "mass", "length_atol"),
    [("compass-gait", "f2-compass-gait-3deg", math.radians(3.0), 20.0, 3e-6),
     ("kneed-walker", "f3-kneed-walker-chen", 0.0504, 1.6, 2e-6)],
)  # fmt: skip
def test_a_walker_has_the_gait_of_its_published_parameters(
    name: str, published: str, slope: float, mass: float, length_atol: float
) -> None:
    """A. Goswami et al., INRIA RR-2996 (1996); V. F. Hsu Chen, MIT (2007). Angles there are from the vertical."""
    run, reference = run_of(name), case(published)
    hit = strikes(run, "foot")[-1]
    sides = ("left", "right") if hit.name == "left foot" else ("right", "left")
    angles, rates = (np.array([run[f"{side} hip.{what}"][hit.row] for side in sides]) for what in ("angle", "rate"))
    assert angles - slope == pytest.approx(reference["fixed point"].value[:2], abs=2e-6)
    assert rates == pytest.approx(reference["fixed point"].value[2:], abs=1e-5)
    step = last_step(run)
    assert step.period == pytest.approx(reference["step period"].value, abs=3e-6)
    assert step.length == pytest.approx(reference["step length"].value, abs=length_atol)
    assert step.loss == pytest.approx(mass * g * step.length * math.sin(slope), rel=2e-5)
    for knee in strikes(run, "knee lock")[-1:]:
        before = strikes(run, "foot")[-2 if knee.time < hit.time else -1]
        assert knee.time - before.time == pytest.approx(reference["knee strike time"].value, abs=5e-6)


def test_the_swing_foot_of_the_compass_gait_scuffs_unnoticed() -> None:
    run = run_of("compass-gait")
    assert len(strikes(run, "foot")) == 10
    assert -0.005 < run["right foot.gap"].min() < -0.003
    assert sum("below its surface while ignored" in note for note in run.stats["notes"]) == 2


def test_a_walker_that_starts_too_slowly_falls_by_name() -> None:
    start = script("kneed-walker")["start"]
    slow = restarted(
        "kneed-walker",
        {"left hip.angle": start["left hip.angle"], "right hip.angle": start["right hip.angle"]},
        {"left hip.angle": -0.5, "right hip.angle": 0.0},
        closed=["left foot", "left knee lock"],
    )
    run = again("kneed-walker", start=slow)
    assert run.success
    assert run.events[-1].name == "fall"
    assert run["hip.origin.y"][-1] == pytest.approx(0.5, abs=1e-9)


def _masses(run: mbd.Trajectory, row: int) -> list[tuple[float, Any, Any, float]]:
    """(mass, place, velocity, moment of inertia times rate of turning) of each part of the chapter's walker."""
    parts = [(47.0, run["hip.origin"][row], _velocity(run, "hip.origin", row), 0.0)]
    for side in ("left", "right"):
        thigh_rate = run[f"{side} hip.rate"][row]
        shank_rate = thigh_rate + run[f"{side} knee.rate"][row]
        for part, mass, length, rate in (("thigh", 7.0, 0.43, thigh_rate), ("shank", 3.5, 0.42, shank_rate)):
            frame = f"{side} {part}.center"
            parts.append((mass, run[frame][row], _velocity(run, frame, row), mass * length**2 / 12 * rate))
        parts.append((1.0, run[f"{side} sole.origin"][row], _velocity(run, f"{side} sole.origin", row), 0.0))
    return parts


def _velocity(run: mbd.Trajectory, frame: str, row: int) -> Any:
    return np.array([run[f"{frame}.{axis}"][row] for axis in ("vx", "vy", "vz")])


def test_the_chapter_walker_settles_into_a_steady_walk() -> None:
    run = run_of("chapter-walker")
    steps = gait(run).steps
    assert len(steps) == 17
    assert steps[-1].deviation < 1e-5
    assert steps[-1].period == pytest.approx(0.86544, abs=2e-4)  # at dt = 1e-4: 0.865442 s, 0.425600 m
    assert steps[-1].length == pytest.approx(0.42560, abs=5e-5)
    assert all(run[f"{side} foot.force"].min() >= 0.0 for side in ("left", "right"))


def test_what_gravity_gives_the_chapter_walker_its_strikes_and_knee_stops_take() -> None:
    run = run_of("chapter-walker")
    first, *_, last = [hit for hit in strikes(run, "foot") if hit.time > 9.0][:-1:2]
    given = 70.0 * g * math.sin(0.03) * (run["hip.origin.x"][last.row] - run["hip.origin.x"][first.row])
    taken = {name: run.energy[name][first.row] - run.energy[name][last.row] for name in run.energy.work}
    assert sum(taken.values()) == pytest.approx(given, rel=2e-3)
    assert 0.8 < (taken["left foot impact"] + taken["right foot impact"]) / given < 0.9
    for side in ("left", "right"):
        inside = slice(first.row, last.row + 1)
        acting = run[f"{side} knee stop.force"][inside] != 0.0
        power = np.where(acting, 20.0 * run[f"{side} knee.rate"][inside] ** 2, 0.0)
        opened = [event.row for event in run.events if (event.name, event.kind) == (f"{side} knee stop", "opened")]
        left = [run[f"{side} knee stop.gap"][row] for row in opened if first.row < row <= last.row]
        damped = trapezoid(power, run.time[inside]) + sum(
            0.5 * 5000.0 * gap**2 for gap in left
        )  # it lets go compressed
        assert taken[f"{side} knee stop"] == pytest.approx(damped, rel=0.02)


@pytest.mark.parametrize(("name", "sole"), [("chapter-walker", "foot"), ("prosthetic-leg", "ball")])
def test_soles_and_stops_of_a_person_bear_what_a_gait_laboratory_would_accept(name, sole) -> None:
    """Between impacts the vertical force is 0.5 to 1.5 body weights, and no stop pulls for any time."""
    run = run_of(name)
    gravity = np.array([run.parameters["gravity.x"], run.parameters["gravity.y"]])
    weight = gravity * sum(value for label, value in run.parameters.items() if label.endswith(".mass"))
    force = sum(
        np.stack([run[f"{side} {sole}.friction.forward"], run[f"{side} {sole}.force"]]) for side in ("left", "right")
    )
    carried = -weight @ force / (weight @ weight)
    assert 0.5 < carried.min() < 0.9 and 1.1 < carried.max() < 1.5
    for side in ("left", "right"):
        pulls = np.maximum(-run[f"{side} knee stop.force"], 0.0)
        assert trapezoid(pulls, run.time) < 1e-6 * trapezoid(np.abs(run[f"{side} knee stop.force"]), run.time)


def test_a_strike_keeps_the_angular_momentum_about_the_new_foot() -> None:
    run = run_of("chapter-walker")
    hits = strikes(run, "foot")[-3:]
    assert len(hits) == 3
    for hit in hits:
        foot = run[f"{hit.name.removesuffix('foot')}sole.origin"][hit.row]
        before, after = (
            sum(m * np.cross(p - foot, v)[2] + spin for m, p, v, spin in _masses(run, row))
            for row in (hit.row - 1, hit.row)
        )
        assert run.time[hit.row - 1] == run.time[hit.row]
        assert abs(after) > 1.0
        assert after == pytest.approx(before, rel=1e-9)


def test_the_chapter_walker_falls_or_limps_with_its_foot_elsewhere() -> None:
    def walk(ahead: float) -> mbd.Trajectory:
        lean, places = math.atan2(ahead, 0.85), {"left knee.angle": 0.0, "right knee.angle": 0.0}
        changes = {f"{side} shank.point(0.02, -0.42, 0).x": ahead for side in ("left", "right")}
        start = restarted(
            "chapter-walker",
            places | {"left hip.angle": 0.25 - lean, "right hip.angle": -0.25 - lean},
            places | {"left hip.angle": -1.0, "right hip.angle": -0.15},
            closed="left foot", open="right foot", parameters=changes,
        )  # fmt: skip
        return again("chapter-walker", start=start, until=20.0)

    assert walk(0.005).events[-1].name == "fall"
    even, limping = (gait(walk(ahead)).steps for ahead in (0.02, 0.03))
    assert abs(even[-1].period - even[-2].period) < 1e-6
    assert abs(limping[-1].period - limping[-2].period) > 0.03


def test_the_prosthetic_leg_limps_on() -> None:
    run = run_of("prosthetic-leg")
    steps = gait(run).steps
    assert len(steps) == 25
    prosthetic, sound = steps[-1], steps[-2]  # each ends with the touchdown of that foot
    assert sound.foot == "left ball"
    assert sound.period == pytest.approx(0.8137, abs=0.0005)
    assert prosthetic.period == pytest.approx(0.7645, abs=0.0005)
    assert [step.period for step in steps[-4:-2]] == pytest.approx([sound.period, prosthetic.period], abs=1e-5)
    assert run["left knee.angle"].min() < -0.4  # the sound knee bends further than the hydraulic one
    assert -0.3 < run["right knee.angle"].min() < -0.2


def test_the_prosthetic_leg_is_loaded_like_a_leg() -> None:
    run, weight = run_of("prosthetic-leg"), 68.3 * g
    for side in ("left", "right"):
        assert run[f"{side} ball.force"].min() >= 0.0
        assert 0.9 * weight < run[f"{side} ball.force"].max() < 1.35 * weight
        assert run[f"{side} knee stop.force"].min() == 0.0
        assert run[f"{side} knee stop.force"].max() < 60.0


def test_the_prosthetic_joints_lose_what_their_laws_say() -> None:
    run = again("prosthetic-leg", dt=1e-4, until=3.0)
    knee, ankle = run["right knee.rate"], run["right ankle.rate"]
    hydraulic = 0.7 * knee**2 + 0.1 * np.abs(knee) ** 3
    assert run.energy["right knee loss"][-1] == pytest.approx(-trapezoid(hydraulic, run.time), rel=1e-3)
    points = {-30.0: -24.0, -6.0: -8.0, -2.0: -4.0, 0.0: 0.0, 2.0: 4.0, 6.0: 8.0, 30.0: 24.0}
    table = PchipInterpolator(list(points), list(points.values()))
    assert run.energy["right ankle loss"][-1] == pytest.approx(-trapezoid(table(ankle) * ankle, run.time), rel=1e-3)


# of one's own -----------------------------------------------------------------------------------------------------


def test_the_bead_leaves_the_dome_where_the_normal_force_is_used_up() -> None:
    run, v0 = run_of("user-constraint"), 0.5
    left, landed = run.events
    assert (left.name, left.kind, landed.name) == ("dome", "opened", "landing")
    height = 2.0 / 3.0 + v0**2 / (3.0 * g)
    assert run["slide.y"][left.row] == pytest.approx(height, abs=2e-6)
    assert np.hypot(run["slide.x"], run["slide.y"])[: left.row] == pytest.approx(1.0, abs=1e-12)
    speed = math.sqrt(g * height)  # v² = g R cos θ, along the tangent (cos θ, −sin θ)
    side = math.sqrt(1.0 - height**2)
    fall = (-speed * side + math.sqrt((speed * side) ** 2 + 2.0 * g * height)) / g
    assert run["slide.x"][-1] == pytest.approx(side + speed * height * fall, abs=1e-5)
    assert landed.time - left.time == pytest.approx(fall, abs=1e-5)


@pytest.mark.parametrize("push", [0.25, 1.0, 2.0])
def test_the_bead_leaves_earlier_when_it_starts_faster(push: float) -> None:
    start = restarted(
        "user-constraint", {"slide.x": 0.0, "slide.y": 1.0}, {"slide.x": push, "slide.y": 0.0}, closed="dome"
    )
    run = again("user-constraint", start=start)
    assert run["slide.y"][run.events[0].row] == pytest.approx(2.0 / 3.0 + push**2 / (3.0 * g), abs=1e-5)


def test_the_users_integrator_bounces_by_the_restitution() -> None:
    run = run_of("user-integrator")
    hits = strikes(run, "wall")
    assert len(hits) == 6
    first = math.sqrt(2.0 * 0.5 * g * (1.0 - math.cos(0.5))) / 0.5  # speed at the lowest point
    speeds = [run["pin.rate"][hit.row] for hit in hits]
    assert speeds == pytest.approx([first * 0.8 ** (k + 1) for k in range(6)], rel=2e-6)
    for one, other in pairwise(hits):  # half a period of the swing at that energy
        modulus = (run["pin.rate"][one.row] / (2.0 * math.sqrt(g / 0.5))) ** 2
        assert other.time - one.time == pytest.approx(2.0 * math.sqrt(0.5 / g) * ellipk(modulus), abs=2e-5)


def test_the_users_integrator_keeps_its_promise_of_order() -> None:
    angles = [again("user-integrator", dt=dt, until=1.0)["pin.angle"][-1] for dt in (8e-3, 4e-3, 2e-3, 1e-3)]
    steps = np.abs(np.diff(angles))
    assert np.log2(steps[:-1] / steps[1:]) == pytest.approx(script("user-integrator")["integrator"].order(), abs=0.15)


def test_the_gait_that_is_found_is_the_published_one_and_walks_on() -> None:
    found, cycle = script("find-a-gait")["found"], script("find-a-gait")["gait"]
    reference = case("k1-compass-gait-derivatives")
    period, far, _, multiplier = reference["period, step length"].value
    assert abs(cycle.period - period) < 1e-9
    assert abs(cycle.largest_multiplier - multiplier) < 1e-8 and cycle.stability == "stable"
    slope = reference["d(period) / d(slope angle)"].value
    assert 1 <= len(found.tries) <= 8 and abs(cycle.derivatives["period", "slope"] - slope) < 1e-8
    lengths = [step.length for step in gait(run_of("find-a-gait")).steps]
    assert len(lengths) >= 9 and max(abs(length - far) for length in lengths) < 1e-9


def test_the_walker_survives_small_pushes_falls_back_of_too_slow_ones_and_ahead_of_too_fast_ones() -> None:
    basin, cycle = script("basin-picture")["basin"], script("basin-picture")["gait"]
    assert abs(cycle.period - case("f2-compass-gait-3deg")["step period"].value) < 1e-9
    stance, swing = (basin.axes[f"{side} hip.rate"] for side in ("left", "right"))
    row, column = (int(np.argmin(np.abs(axis - cycle.state[name]))) for axis, name in (
        (stance, "left hip.rate"), (swing, "right hip.rate")
    ))  # fmt: skip
    assert basin.outcome[row, column] == "walks"
    assert set(basin.outcome[-1]) == {"falls backward"}
    assert set(basin.outcome[0, :12]) == {"falls forward"}
    assert 0.1 < basin.share < 0.2


# studies ----------------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_the_knee_damper_that_was_tuned_makes_both_steps_equal() -> None:
    names = script("tune-a-knee-damper")
    untuned, tuned = names["untuned"], names["tuned"]
    apart = [gait.step_lengths["right foot"] - gait.step_lengths["left foot"] for gait in (untuned, tuned.gait)]
    assert apart[0] == pytest.approx(6.78e-3, abs=1e-5) and abs(apart[1]) < 1e-7
    assert tuned.success and tuned["right knee loss.coefficient"] == pytest.approx(0.10051, abs=1e-5)
    run = run_of("tune-a-knee-damper")
    lengths = [step.length for step in gait(run)]
    assert max(lengths) - min(lengths) < 1e-6


@pytest.mark.slow
def test_the_shank_is_identified_within_its_errors() -> None:
    names = script("identify-a-shank")
    found, truth = names["found"], names["truth"]
    assert found.converged and found.alike == ()
    for name, value in truth.items():
        assert abs(found.values[name] - value) < 4.0 * found.errors[name] < 0.1 * value
    assert found.noise == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_files_of_a_laboratory_lead_to_the_damper_of_the_knee() -> None:
    names = script("from-the-laboratory")
    film, motion, moments = (names[name] for name in ("film", "motion", "moments"))
    assert names["damper"] == pytest.approx(0.8, rel=0.03)
    # two components in the plane; seven freedoms take half of fourteen coordinates
    assert motion.rms == pytest.approx(0.0005 * math.sqrt(2.0) * math.sqrt(1.0 - 7 / 14), rel=0.05)
    off = motion["right knee.angle"] - film.at(motion.time)["right knee.angle"]
    assert np.sqrt(np.mean(off**2)) < 0.004
    calm = np.abs(motion.time - 1.2) < 0.1  # far from impacts
    assert np.abs(moments["trunk.residual_force"][calm]).max() < 60.0
    assert [plate.foot.body.name for plate in names["plates"]] == ["left foot", "right foot"]


@pytest.mark.slow
def test_the_orifice_makes_the_gait_less_lame_than_the_viscous_damper() -> None:
    report = script("compare-two-knees")["report"]
    viscous, hydraulic = (
        report.asymmetry(walk, next(m for m in walk.measures if m.quantity == "step length")) for walk in report.walks
    )
    assert viscous == pytest.approx(-0.00688, abs=2e-5) and hydraulic == pytest.approx(-0.00449, abs=2e-5)
    for walk in report.walks:  # what gravity gives is what impacts and dampers take
        way, fall = walk["stride length"]["left"], math.sin(math.radians(3.0)) * 9.81 * (34.6 + 12.2 + 2.85 + 2.3)
        assert sum(walk.spent().values()) == pytest.approx(-way * fall, rel=1e-6)


# steeper-slope ----------------------------------------------------------------------------------------------------


def test_a_compass_walker_begins_to_limp_at_the_published_slope() -> None:
    names = script("steeper-slope")
    slopes, doubling, limping, heavier = (names[name] for name in ("slopes", "doubling", "limping", "heavier"))
    assert math.degrees(doubling.value) == pytest.approx(4.390898250244, abs=1e-8)
    assert slopes["stable"][0] and not slopes["stable"][-1]
    assert limping.stability == "stable" and limping.parameters["slope"] > doubling.value
    (_, _, first), (_, _, second) = limping.steps
    assert 0.001 < abs(first - second) < 0.1
    assert limping.period == pytest.approx(2.0 * doubling.point.period, rel=1e-3)
    assert np.all(np.diff(heavier["slope"]) < 0.0) and heavier["slope"][-1] == pytest.approx(0.07219446807, abs=1e-9)
