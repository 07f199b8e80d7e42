"""Gaits that nothing takes energy from: the member of their family with a given energy or speed."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import fsolve

import mbd
from mbd.gait.family import energy_of, energy_slope
from tests.gait.test_gaits_with_modes import walker as torso_walker
from tests.helpers import one_body
from tests.spring_mass import MASS, G, derivative, runner_apex, speed_at, until, walker_apex

ANGLE, STIFFNESS = math.radians(68.0), 20e3
SIDES = ("left", "right")


def runner() -> tuple[mbd.Model, mbd.State]:
    """A point mass on a spring leg, at an apex."""
    model, body = one_body(mbd.PointMass("body", MASS), mbd.Translation, "place", title="runner")
    model.constrain(mbd.SpringLeg("leg", body.origin, STIFFNESS, 1.0, ANGLE))
    model.constrain(mbd.Event("apex", mbd.measure("place.y.rate"), direction=-1))
    return model, mbd.assemble(model, {"place.y": 1.0}, {"place.x": 5.0, "place.y": 0.0})


def walker(stiffness: float = 14e3, angle: float = math.radians(69.0)) -> tuple[mbd.Model, mbd.State]:
    """A point mass on two spring legs, highest over its left foot with 816 J."""
    model, body = one_body(mbd.PointMass("body", MASS), mbd.Translation, "place")
    model.constrain(*(mbd.SpringLeg(f"{side} leg", body.origin, stiffness, 1.0, angle) for side in SIDES))
    model.constrain(mbd.Event("highest", mbd.measure("place.y.rate"), direction=-1))
    start = mbd.assemble(
        model, {"place.x": 0.3, "place.y": 0.97}, {"place.x": 1.1, "place.y": 0.0}, closed=["left leg"],
        anchors={"left leg": (0.3, 0.0)},
    )  # fmt: skip
    return model, start


def at_energy(energy: float, y: float) -> np.ndarray:
    """What the apex map by hand leaves of the height, where the energy gives the speed."""
    return runner_apex(float(y), speed_at(float(y), energy), STIFFNESS, ANGLE)[0] - y


def differences(gait: mbd.LimitCycle, name: str, value: float) -> list[float]:
    """Slopes of the energy along the section, and by a parameter, with an error of fourth order."""

    def energy(c: np.ndarray, change: float = 0.0) -> float:
        now = {**gait.parameters, name: value + change}
        return float(energy_of(gait.map, [gait.chart.at(c, gait.map.vector(now))], now)[0])

    def slope(along: Callable[[float], float]) -> float:
        return sum(w * (along(k * 1e-3) - along(-k * 1e-3)) for k, w in ((1, 8.0), (2, -1.0))) / 12e-3

    units, zero = np.eye(gait.chart.size), np.zeros(gait.chart.size)
    by = [slope(lambda h, unit=unit: energy(h * unit)) for unit in units]
    return [*by, slope(lambda h: energy(zero, h * abs(value))) / abs(value)]


@pytest.mark.parametrize(("made", "energy", "how"), [
    (runner, 1860.0, {"section": "apex"}), (walker, 816.0, {"section": "highest", "mirror": SIDES}),
])  # fmt: skip
def test_slopes_of_energy_along_the_section_and_by_parameters_are_exact(made, energy, how) -> None:
    """The walker stands on a compressed leg on its section."""
    gait = mbd.limit_cycle(*made(), energy=energy, **how)
    known = dict(zip(gait.run.record.parameter_names, gait.run.record.parameters, strict=False))
    for name in {"body.mass", "gravity.y", "left leg.stiffness", "leg.stiffness"} & known.keys():
        values = {**gait.parameters, name: known[name]}
        found = energy_slope(gait.map, gait.chart, values, name)
        np.testing.assert_allclose(found, differences(gait, name, known[name]), rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("energy", [1800.0, 1860.0])
def test_a_runner_of_a_given_energy_runs_as_by_hand(energy: float) -> None:
    model, start = runner()
    gait = mbd.limit_cycle(model, start, section="apex", energy=energy)
    y = float(fsolve(lambda y: at_energy(energy, y[0]), [gait.state["place.y"]], xtol=1e-13)[0])
    v = speed_at(y, energy)
    _, _, way, period = runner_apex(y, v, STIFFNESS, ANGLE)
    np.testing.assert_allclose([gait.state["place.y"], gait.state["place.x.rate"]], [y, v], atol=1e-9)
    np.testing.assert_allclose([gait.period, gait.distance], [period, way], atol=1e-9)
    slope = derivative(lambda c: [runner_apex(c[0], speed_at(c[0], energy), STIFFNESS, ANGLE)[0]], [y])
    np.testing.assert_allclose(gait.multipliers, slope[0], atol=1e-8)
    np.testing.assert_allclose(gait.trivial["energy"], 1.0, atol=1e-8)
    assert gait.residual["J"] < 1e-7


@pytest.mark.parametrize(("near", "stability"), [(0.95, "stable"), (1.32, "unstable")])
def test_a_runner_of_one_energy_has_a_low_stable_gait_and_a_high_unstable_one(near: float, stability: str) -> None:
    """67°, 1860 J: the two fixed points of the apex map."""
    model, _ = runner()
    angle, speed = math.radians(67.0), speed_at(near, 1860.0)
    start = mbd.assemble(model, {"place.y": near}, {"place.x": speed, "place.y": 0.0})
    gait = mbd.limit_cycle(model, start, section="apex", energy=1860.0, parameters={"leg.touchdown_angle": angle})

    def apex(c: np.ndarray) -> list[float]:
        return [runner_apex(float(c[0]), speed_at(float(c[0]), 1860.0), STIFFNESS, angle)[0]]

    y = float(fsolve(lambda c: np.array(apex(c)) - c, [near], xtol=1e-13)[0])
    np.testing.assert_allclose(gait.state["place.y"], y, atol=1e-9)
    np.testing.assert_allclose(gait.multipliers, derivative(apex, [y])[0], atol=1e-8)
    assert gait.stability == stability


def test_a_walker_of_816_joules_walks_on_two_springs_as_by_hand() -> None:
    """k = 14 kN/m, 69°, 816 J: walking of Geyer, Seyfarth & Blickhan (2006)."""
    model, start = walker()
    given = 14e3, math.radians(69.0)
    gait = mbd.limit_cycle(model, start, section="highest", mirror=SIDES, energy=816.0)

    def left(c: np.ndarray) -> np.ndarray:
        return np.array(walker_apex(c[0], c[1], 816.0, *given)[:2]) - c

    y, ahead = fsolve(left, [gait.state["place.y"], 0.0], xtol=1e-13)
    _, _, v, way, period = walker_apex(y, ahead, 816.0, *given)
    foot = gait.state["place.x"] - gait.state.anchors[0]
    np.testing.assert_allclose([gait.state["place.y"], foot, gait.state["place.x.rate"]], [y, ahead, v], atol=1e-9)
    np.testing.assert_allclose([gait.period, gait.distance], [period, way], atol=1e-9)
    P = derivative(lambda c: walker_apex(c[0], c[1], 816.0, *given)[:2], [y, ahead], 2e-4)
    theirs = np.linalg.eigvals(P)
    np.testing.assert_allclose(np.sort_complex(gait.multipliers), np.sort_complex(theirs), atol=1e-8)
    assert gait.stability == "stable"
    report = mbd.gait_report(gait)
    for side in SIDES:
        np.testing.assert_allclose(report["step length"][side], way, atol=1e-8)
        np.testing.assert_allclose(report["step time"][side], period, atol=1e-8)
    forward = [curve.mean for curve in report.walks[0].curves if "forward" in f"{curve.subject} {curve.quantity}"]
    assert len(forward) == 2 and all(np.ptp(each) > 100.0 for each in forward)
    touching = mbd.limit_cycle(model, start, section="right leg", mirror=SIDES, energy=816.0)
    np.testing.assert_allclose([touching.period, touching.step_lengths["right leg"]], [period, way], atol=1e-9)
    np.testing.assert_allclose(np.sort_complex(touching.multipliers), np.sort_complex(gait.multipliers), atol=1e-7)


def test_a_gait_of_a_given_speed_has_it_and_follows_it() -> None:
    model, start = runner()
    gait = mbd.limit_cycle(model, start, section="apex", speed=5.0)
    assert abs(gait.speed - 5.0) < 1e-9
    h = 1e-3
    ends = [mbd.limit_cycle(model, gait.state, section="apex", speed=5.0 + sign * h) for sign in (1.0, -1.0)]
    for name in ("period", "largest multiplier"):
        by_hand = (ends[0].scalars[name] - ends[1].scalars[name]) / (2.0 * h)
        np.testing.assert_allclose(gait.derivatives[name, "speed"], by_hand, rtol=1e-4)
    branch = mbd.branch(gait, "speed", to=5.2)
    last = mbd.limit_cycle(model, gait.state, section="apex", speed=5.2)
    np.testing.assert_allclose(branch.curve[-1].state["place.y"], last.state["place.y"], atol=1e-9)


def test_derivatives_and_branches_keep_the_energy() -> None:
    model, start = runner()
    gait = mbd.limit_cycle(model, start, section="apex", energy=1850.0)

    def beside(name: str, value: float) -> mbd.LimitCycle:
        return mbd.limit_cycle(model, gait.state, section="apex", energy=1850.0, parameters={name: value})

    for name, value, h in (("leg.stiffness", STIFFNESS, 20.0), ("body.mass", MASS, 1e-2), ("gravity.y", -G, 1e-3)):
        ends = [beside(name, value + sign * h) for sign in (1.0, -1.0)]
        for scalar in ("period", "speed", "largest multiplier")[: 3 if name == "leg.stiffness" else 2]:
            by_hand = (ends[0].scalars[scalar] - ends[1].scalars[scalar]) / (2.0 * h)
            np.testing.assert_allclose(gait.derivatives[scalar, name], by_hand, rtol=1e-4)
    branch = mbd.branch(gait, "leg.touchdown_angle", to=math.radians(67.0))
    last = beside("leg.touchdown_angle", math.radians(67.0))
    np.testing.assert_allclose(branch.curve[-1].state["place.y"], last.state["place.y"], atol=1e-9)


def test_a_gait_that_is_alone_has_no_other_energy() -> None:
    model, start = torso_walker()
    with pytest.raises(mbd.GaitError, match=r"no gait with energy 300 J was found: the gaits near are isolated"):
        mbd.limit_cycle(model, start, section="right foot", mirror=SIDES, energy=300.0)


@pytest.mark.parametrize("section", ["lowest", "highest", "mat"])
def test_a_ball_on_a_spring_bounces_with_the_energy_asked_for(section: str) -> None:
    """From any instant, compressed ones too: ``T = 2 v/g + (π + 2 atan(g/(ω v)))/ω`` with ``m v²/2 = E``."""
    model, ball = one_body(mbd.PointMass("ball", 1.0), mbd.Prismatic, "rail", axis="y")
    model.constrain(
        mbd.Penalty("mat", mbd.height(ball.origin), stiffness=1e3),
        *(mbd.Event(name, mbd.measure("rail.rate"), direction=way) for name, way in (("lowest", 1), ("highest", -1))),
    )
    start = mbd.assemble(model, {"rail.displacement": -0.05}, closed="mat")
    gait = mbd.limit_cycle(model, start, section=section, energy=2.0)
    w, v = math.sqrt(1e3), 2.0
    np.testing.assert_allclose(gait.period, 2.0 * v / G + (math.pi + 2.0 * math.atan(G / (w * v))) / w, rtol=1e-11)


def test_what_a_family_keeps_must_be_told() -> None:
    model, start = runner()
    with pytest.warns(mbd.MbdWarning, match=r"form a family: .* of the start is 1784.8 J\) .* 1739.98 J"):
        gait = mbd.limit_cycle(model, start, section="apex")
    assert "one of a family, energy 1739.98 J" in str(gait)
    slow = mbd.assemble(model, {"place.y": 1.0}, {"place.x": 3.0, "place.y": 0.0})
    with pytest.raises(mbd.GaitError, match=r"it has fallen; .* form a family: .* of the start is 1144.8"):
        mbd.limit_cycle(model, slow, section="apex")
    for asked in (
        lambda: gait.at({"leg.stiffness": 21e3}),
        lambda: gait.derivatives["speed", "leg.stiffness"],
        lambda: mbd.branch(gait, "leg.stiffness", to=21e3),
    ):
        with pytest.raises(mbd.ModelError, match="is one of a family, since nothing takes energy"):
            asked()
    with pytest.raises(mbd.ModelError, match="is one of a family, since nothing takes energy: starts of other"):
        mbd.basin(model, gait, {"place.y": np.linspace(0.95, 1.0, 3)})
    with pytest.raises(mbd.ModelError, match="'gravity.x' is an exact 0 or ±1 of the model"):
        gait.at({"gravity.x": 0.1})
    with pytest.raises(mbd.ModelError, match="energy and speed each pick one gait"):
        mbd.limit_cycle(model, start, section="apex", energy=1850.0, speed=5.0)
    with pytest.raises(mbd.ModelError, match="energy must be a finite number, got nan"):
        mbd.limit_cycle(model, start, section="apex", energy=math.nan)


def test_feet_stand_where_a_start_says() -> None:
    model, start = walker()
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.1)
    np.testing.assert_allclose(run["left leg.force"][0], 14e3 * 0.03, rtol=1e-12)
    legs = mbd.Model("two feet")
    leg = mbd.Link("leg", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    legs.connect(mbd.Planar("leg", legs.ground.origin, leg.end))
    legs.constrain(mbd.Unilateral("foot", mbd.touchdown(leg.start)), mbd.Unilateral("knee", mbd.height(leg.center)))
    stood = mbd.assemble(legs, {"leg.angle": 2.9}, closed=["foot"], anchors={"foot": (0.7, 0.0)})
    np.testing.assert_allclose([stood["leg.start.x"], stood["leg.start.y"]], [0.7, 0.0], atol=1e-9)
    for anchors, closed, told in (
        ({"left leg": (0.3, 0.2)}, ["left leg"], "'left leg' stands on level ground, y = 0, got y = 0.2 m"),
        ({"left leg": (0.3, 0.0)}, [], "'left leg' stands nowhere, as it starts open"),
        ({"left leg": 0.3}, ["left leg"], r"the place of 'left leg' must be \(x, y\)"),
        ({"left log": (0.3, 0.0)}, ["left leg"], "no contact named 'left log'"),
        (["left leg"], ["left leg"], "anchors must map contacts to places"),
    ):
        with pytest.raises(mbd.ModelError, match=told):
            mbd.assemble(model, {"place.y": 0.97}, closed=closed, anchors=anchors)
    with pytest.raises(mbd.AssemblyError, match="'foot' stands at y = 0 m, not at y = 0.1 m"):
        mbd.assemble(legs, {"leg.angle": 2.9}, closed=["foot"], anchors={"foot": (0.7, 0.1)})
    with pytest.raises(mbd.ModelError, match="'knee' stands at no place"):
        mbd.assemble(legs, {"leg.angle": 2.9}, closed=["knee"], anchors={"knee": (0.7, 0.1)})


def standing_start(angle: float, speed: float, near: float) -> tuple[float, float]:
    """Stiffness and speed at the apex of a runner of a mean speed whose flights have just vanished, by hand."""
    foot = math.cos(angle)

    def left(x: np.ndarray) -> list[float]:
        state = np.array([0.0, math.sin(angle), x[1], 0.0])
        middle, time = until(state, [foot], 1e4 * x[0], lambda s: s[0] - foot, 1.0)
        return [middle[3], foot / time - speed]

    found = fsolve(left, [1e-4 * near, speed], xtol=1e-12)
    return 1e4 * float(found[0]), float(found[1])


@pytest.mark.parametrize("seed", [1, 2])
def test_a_branch_ends_where_flights_vanish_within_its_error(seed: int) -> None:
    """There the apex reaches the height of touchdown, and multipliers grow without bound as 1/distance."""
    random = np.random.default_rng(seed)
    angle, speed = math.radians(random.uniform(67.0, 69.0)), random.uniform(4.8, 5.4)
    expected, _ = standing_start(angle, speed, 15e3)
    model, body = one_body(mbd.PointMass("body", MASS), mbd.Translation, "place", title="runner")
    model.constrain(mbd.SpringLeg("leg", body.origin, 1.05 * expected, 1.0, angle))
    model.constrain(mbd.Event("apex", mbd.measure("place.y.rate"), direction=-1))
    start = mbd.assemble(model, {"place.y": math.sin(angle) + 1e-3}, {"place.x": speed, "place.y": 0.0})
    gait = mbd.limit_cycle(model, start, section="apex", speed=speed)
    (limit,) = mbd.branch(gait, "leg.stiffness", to=0.95 * expected).points("lost event")
    assert limit.what == "apex"
    assert abs(limit.value - expected) <= limit.error <= 1e-3 * expected
    assert abs(limit.value - expected) <= 1e-6 * expected
