"""Discrete states: located transitions, timers, memories, laws by state, chains of one instant, and bad input."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from mbd.errors import ModelError, SimulationError
from tests.helpers import one_body

G = 9.81


def knee(**changes: Any) -> mbd.Model:
    """A shank that is let go, then pulled back to where it turned, then damped."""
    model = mbd.Model("knee")
    shank = mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    hinge = mbd.Revolute("knee", model.ground.origin, shank.start, loss=mbd.Viscous(0.05))
    model.connect(hinge)
    model.apply(
        mbd.Mode(
            "phase", ("swing", "pull", "brake"),
            transitions=[
                mbd.Transition("swing", "pull", when="knee.rate", direction=1),
                mbd.Transition("pull", "brake", after=0.13),
                mbd.Transition("brake", "swing", when=mbd.measure(lambda q: q - 0.1, "knee.angle")),
            ],
            remembers={"turn": {"pull": "knee.angle"}}, sets={"knee loss.coefficient": {"pull": 0.04}},
        ),
        mbd.Motor(
            "drive", hinge, by="phase", arguments=["knee.angle", "knee.rate", "phase.time", "phase.turn"],
            torque={"pull": lambda q, v, tau, turn: -3.0 * (q - turn) + tau, "brake": lambda q, v, tau, turn: -0.1 * v},
        ),
    )  # fmt: skip
    return model


def oracle(end: float, angle: float) -> tuple[list[tuple[float, str]], Any]:
    """The same by scipy at 1e-13, phase by phase: the transitions, and (q, v) at the end."""

    def rate(t: float, y: Any, phase: str, since: float, turn: float) -> list[float]:
        q, v = y
        torque = {"swing": 0.0, "pull": -3.0 * (q - turn) + (t - since), "brake": -0.1 * v}[phase]
        return [v, (torque - (0.04 if phase == "pull" else 0.05) * v - 2.0 * G * 0.2 * np.sin(q)) / 0.11]

    def at_turn(t: float, y: Any, *_: Any) -> Any:
        return y[1]

    def at_angle(t: float, y: Any, *_: Any) -> Any:
        return y[0] - 0.1

    at_turn.direction, at_turn.terminal, at_angle.terminal = 1.0, True, True  # type: ignore[attr-defined]
    t, y, phase, since, turn, found = 0.0, np.array([angle, 0.0]), "swing", 0.0, angle, list[tuple[float, str]]()
    while t < end:
        last, event = (min(since + 0.13, end), None) if phase == "pull" else (end, at_turn)
        event = at_angle if phase == "brake" else event
        options: dict[str, Any] = {"rtol": 1e-13, "atol": 1e-14, "method": "DOP853", "args": (phase, since, turn)}
        if event is not None:  # beyond what it begins with
            run = solve_ivp(rate, (t, t + 1e-5), y, **options)
            t, y = t + 1e-5, run.y[:, -1]
        run = solve_ivp(rate, (t, last), y, events=event, **options)
        t, y = float(run.t[-1]), run.y[:, -1]
        if t < end:
            phase = {"swing": "pull", "pull": "brake", "brake": "swing"}[phase]
            since, turn = t, float(y[0]) if phase == "pull" else turn
            found.append((t, phase))
    return found, y


@pytest.mark.parametrize("integrator", [mbd.RungeKutta853(), mbd.HHT(), mbd.RadauIIA()], ids=repr)
def test_timers_end_at_their_instant_and_laws_know_the_time_in_the_state(integrator: Any) -> None:
    model = knee()
    run = mbd.simulate(model, mbd.assemble(model, {"knee.angle": 0.8}), integrator, dt=0.005, until=0.72)
    turned, braked = (event.time for event in run.events[:2])
    assert abs(braked - turned - 0.13) < 4e-16
    time, phase = run.time, run["phase"]
    inside = (time > turned) & (time < braked)
    assert set(phase[inside]) == {"pull"} and phase[0] == "swing" and phase[-1] == "brake"
    np.testing.assert_allclose(run["phase.time"][inside], time[inside] - turned, atol=1e-15)
    np.testing.assert_allclose(run["phase.turn"][inside], run.at(turned)["knee.angle"], atol=1e-12)
    assert run.at(0.5 * (turned + braked))["phase"] == "pull"
    np.testing.assert_array_equal(run["phase.index"], [("swing", "pull", "brake").index(each) for each in phase])


def test_a_lagrangian_has_modes_too() -> None:
    theta = mbd.Coordinate("theta")

    def drive(theta: Any, theta_rate: Any, phase: Any, phase_time: Any, phase_turn: Any) -> Any:
        pull = -3.0 * (theta - phase_turn) + phase_time - 0.04 * theta_rate
        return mbd.where(phase < 0.5, -0.05 * theta_rate, mbd.where(phase < 1.5, pull, -0.15 * theta_rate))

    model = mbd.Lagrangian(
        "knee", [theta], kinetic=0.5 * 0.11 * theta.v**2,
        potential=lambda theta: -2.0 * G * 0.2 * mbd.cos(theta), forces={theta: drive},
    )  # fmt: skip
    model.apply(mbd.Mode("phase", ("swing", "pull", "brake"), transitions=[
        mbd.Transition("swing", "pull", when=theta.v, direction=1),
        mbd.Transition("pull", "brake", after=0.13),
        mbd.Transition("brake", "swing", when=theta.q - 0.1),
    ], remembers={"turn": {"pull": "theta"}}))  # fmt: skip
    run = mbd.simulate(model, mbd.assemble(model, {"theta": 0.8}), mbd.RungeKutta853(), dt=0.01, until=4.0)
    wanted, (q, v) = oracle(4.0, 0.8)
    np.testing.assert_allclose([event.time for event in run.events], [time for time, _ in wanted], atol=1e-10)
    np.testing.assert_allclose([run.final.q[0], run.final.v[0]], [q, v], atol=1e-9)
    assert set(run["phase"]) == {"swing", "pull", "brake"}


@pytest.mark.parametrize(("name", "value", "message"), [
    ("stop.stifness", 1.0, "no parameter named 'stop.stifness'; did you mean 'stop.stiffness'"),
    ("stop.stiffness", -1.0, "'stop.stiffness.b': .*-1 does not push"),
    ("stop.restitution", 0.5, "no parameter named 'stop.restitution'"),
])  # fmt: skip
def test_what_a_mode_of_a_lagrangian_sets_is_checked(name: str, value: float, message: str) -> None:
    x = mbd.Coordinate("x", unit="m")
    model = mbd.Lagrangian("ball", [x], kinetic=0.5 * x.v**2, potential=9.81 * x.q)
    model.constrain(mbd.Penalty("stop", x.q, stiffness=1e3), mode(sets={name: {"b": value}}))
    with pytest.raises(ModelError, match=message):
        model.require_valid()


def test_energy_is_balanced_though_a_clutch_moves_what_a_spring_stores() -> None:
    model = mbd.Model("clutch")
    rod = mbd.Link("rod", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start)
    model.connect(hinge)
    model.apply(
        mbd.TorsionSpring("spring", hinge, stiffness=5.0, rest=0.3),
        mbd.Mode("clutch", ("on", "off"), transitions=[
            mbd.Transition("on", "off", when="hinge.rate", direction=1), mbd.Transition("off", "on", after=0.2),
        ], sets={"spring.stiffness": {"off": 0.0}, "spring.rest": {"off": 0.8}}),
    )  # fmt: skip
    run = mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 1.0}), mbd.RungeKutta853(), dt=0.01, until=1.0)
    assert len(run.events) >= 2
    assert np.max(np.abs(run.energy.numerical)) < 1e-9
    row = run.events[0].row
    off = run["spring.energy"][row]
    assert off == 0.0 < run["spring.energy"][row - 1]


def test_a_start_names_a_state_and_what_it_remembers() -> None:
    model = knee()
    start = mbd.assemble(model, {"knee.angle": 0.3, "phase": "pull", "phase.turn": 0.5})
    assert start["phase"] == "pull" and start["phase.turn"] == 0.5 and start["phase.time"] == 0.0
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.2)
    assert [event.name for event in run.events] == ["phase: pull to brake"]
    assert run["drive.torque"][0] == pytest.approx(-3.0 * (0.3 - 0.5), rel=1e-14)
    with pytest.raises(ModelError, match="'phase': no state named 'pul'"):
        mbd.assemble(model, {"phase": "pul"})
    with pytest.raises(ModelError, match="position of 'phase.turn'"):
        mbd.assemble(model, {"phase.turn": "far"})


def test_springs_and_dampers_take_numbers_by_state() -> None:
    """As with `sets`, to the bit; and energy is balanced."""

    def clutch(by: bool) -> mbd.Trajectory:
        model = mbd.Model("clutch")
        rod = mbd.Link("rod", mass=2.0, length=0.4, center=0.2, inertia=0.03)
        loss = mbd.Viscous({"on": 0.3, "off": 0.05}, by="clutch") if by else mbd.Viscous(0.3)
        hinge = mbd.Revolute("hinge", model.ground.origin, rod.start, loss=loss)
        model.connect(hinge)
        sets = {"hinge loss.coefficient": {"off": 0.05}, "spring.stiffness": {"off": 0.0}, "spring.rest": {"off": 0.8},
                "rope.length": {"off": 0.3}}  # fmt: skip
        corner = model.ground.point(0.5, 0.1)
        if by:
            model.apply(
                mbd.TorsionSpring("spring", hinge, stiffness={"on": 5.0}, rest={"on": 0.3, "off": 0.8}, by="clutch"),
                mbd.Spring("rope", rod.end, corner, stiffness=30.0, length={"on": 0.2, "off": 0.3}, by="clutch"),
            )
        else:
            model.apply(mbd.TorsionSpring("spring", hinge, stiffness=5.0, rest=0.3))
            model.apply(mbd.Spring("rope", rod.end, corner, stiffness=30.0, length=0.2))
        model.apply(mbd.Mode("clutch", ("on", "off"), transitions=[
            mbd.Transition("on", "off", when="hinge.rate"), mbd.Transition("off", "on", after=0.2),
        ], sets={} if by else sets))  # fmt: skip
        return mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 1.3}), mbd.RungeKutta853(), dt=0.01, until=1.5)

    one, other = clutch(by=True), clutch(by=False)
    assert len(one.events) >= 3
    np.testing.assert_array_equal(one.final.q, other.final.q)
    np.testing.assert_array_equal(one["spring.torque"], other["spring.torque"])
    assert one.parameters["spring.stiffness.on"] == 5.0
    assert np.max(np.abs(one.energy.numerical)) < 1e-9


def test_effects_of_a_machine_are_left_out_with_what_it_sets_of_them() -> None:
    model = knee()
    bare = model.without("knee loss")
    assert bare.check() == [] and model.check() == []
    assert "knee loss.coefficient.pull" not in bare.parameters
    assert {"drive", "knee loss"} <= set(map(str, model.cost().effects))


def test_a_mode_sets_the_loss_of_an_ankle_that_a_motor_drives_through_a_spring() -> None:
    """The spring is a word of its own, and has no rest."""
    model, foot = mbd.Model("leg"), mbd.RigidBody("foot", 0.8, 0.003)
    size = {"stiffness": 300.0, "inertia": 0.05, "mass": 0.3, "loss": mbd.Viscous(0.2)}
    mbd.parts.series_elastic_ankle(model, "ankle", model.ground.origin, foot.origin, torque=0.0, **size)
    changes = [mbd.Transition("a", "b", after=1.0)]
    model.apply(mbd.Mode("m", ("a", "b"), transitions=changes, sets={"ankle loss.coefficient": {"b": 1.0}}))
    assert model.check() == []


def test_derivatives_go_through_transitions_timers_and_memories() -> None:
    model = knee()
    names = ("knee.angle", "phase.pull to brake.after", "knee loss.coefficient.pull", "shank.mass")
    of = ("knee.angle", "knee.rate", "phase.turn", "phase.time", "phase: pull to brake.time")

    def ends(name: str, change: float) -> Any:
        start = mbd.assemble(model, {"knee.angle": 0.8 + (change if name == "knee.angle" else 0.0)})
        values = {} if name == "knee.angle" else {name: model.parameters[name] + change}
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=2.5, parameters=values)
        braked = next(event.time for event in run.events if event.name == "phase: pull to brake")
        return np.array([*(run[each][-1] for each in of[:-1]), braked])

    start = mbd.assemble(model, {"knee.angle": 0.8})
    found = mbd.sensitivities(model, start, mbd.RungeKutta853(), dt=0.01, until=2.5, wrt=list(names), of=list(of))
    for name in names:
        near, far = (ends(name, h) - ends(name, -h) for h in (1e-4, 2e-4))
        wanted = (8.0 * near - far) / 12e-4
        np.testing.assert_allclose([found[each, name] for each in of], wanted, rtol=1e-8, atol=1e-9)


def hopper(*transitions: mbd.Transition, **more: Any) -> tuple[mbd.Model, mbd.State]:
    """A mass that falls on the floor, waits, and is thrust up for a time."""
    model, body = one_body(mbd.PointMass("body", mass=80.0), mbd.Prismatic, "rail", title="hopper", axis="y")
    rail = model.joints[0]
    model.constrain(
        mbd.Unilateral("floor", mbd.height(body.origin)),
        mbd.Mode(
            "leg", ("flight", "wait", "thrust"),
            transitions=transitions or [
                mbd.Transition("flight", "wait", on="floor"),
                mbd.Transition("wait", "thrust", after=0.05),
                mbd.Transition("thrust", "flight", after="leg.push time"),
            ],
            numbers={"push time": 0.1}, remembers={"speed": {"thrust": "rail.rate"}}, **more,
        ),
    )  # fmt: skip
    model.apply(mbd.Motor("drive", rail, force={"thrust": 80.0 * (G + 20.0)}, by="leg"))
    return model, mbd.assemble(model, {"rail.displacement": 0.5})


def test_a_contact_closes_waits_for_a_timer_and_is_thrust_off_for_a_time() -> None:
    model, start = hopper()
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.9)
    landed = np.sqrt(2.0 * 0.5 / G)
    wanted = [(landed, "floor"), (landed, "leg: flight to wait"), (landed + 0.05, "leg: wait to thrust"),
              (landed + 0.05, "floor"), (landed + 0.15, "leg: thrust to flight")]  # fmt: skip
    assert [event.name for event in run.events] == [name for _, name in wanted]
    np.testing.assert_allclose([event.time for event in run.events], [time for time, _ in wanted], atol=1e-13)
    assert run.events[3].kind == "opened"
    np.testing.assert_allclose(run.at(landed + 0.15)["rail.rate"], 2.0, rtol=1e-12)
    longer = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.9, parameters={"leg.push time": 0.2})
    np.testing.assert_allclose(longer.events[4].time, landed + 0.25, atol=1e-13)
    ended = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until="leg: thrust")
    assert ended.final.time == longer.events[2].time


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("order", ["", "before", "with", "after"])
def test_a_mode_of_closings_and_openings_is_that_of_the_contact(order: str, restitution: float) -> None:
    """Also where it opens as it closes: in a rebound, or as an impulse lifts it or keeps it from striking."""
    model, ball = one_body(mbd.PointMass("ball", mass=1.0), mbd.Prismatic, "rail", axis=(0, 1, 0))
    changes = [mbd.Transition("off", "on", on="floor"), mbd.Transition("on", "off", on="floor opened")]
    model.constrain(
        mbd.Unilateral("floor", mbd.height(ball.origin), restitution=restitution),
        mbd.Mode("stance", ("off", "on"), transitions=changes),
        *([mbd.Impulse("kick", ball.origin, 1.0, on="floor", direction=(0, 1), order=order)] if order else []),
    )
    state, names = mbd.assemble(model, {"rail.displacement": 0.1}), list[str]()
    for until in np.linspace(0.05, 1.5, 30):
        run = mbd.simulate(model, state, mbd.RungeKutta853(), dt=0.02, until=float(until))
        state, names = run.final, names + [event.name for event in run.events]
        assert run["stance"][-1] == ("on" if "floor" in state.mode.closed else "off")
    assert names.count("stance: off to on") >= 1
    assert names.count("stance: off to on") - names.count("stance: on to off") == int("floor" in state.mode.closed)


def test_modes_follow_each_other_at_one_instant_in_order() -> None:
    model, start = hopper()
    model.constrain(
        mbd.Mode("count", ("even", "odd"), transitions=[
            mbd.Transition("even", "odd", on="leg: thrust"), mbd.Transition("odd", "even", on="leg: thrust")]),
        mbd.Mode("light", ("off", "on"), transitions=[
            mbd.Transition("off", "on", on="count: odd"), mbd.Transition("on", "off", on="count")]),
    )  # fmt: skip
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=2.0)
    thrusts = [event.time for event in run.events if event.name == "leg: wait to thrust"]
    assert len(thrusts) >= 3
    for number, time in enumerate(thrusts):
        here = [event.name for event in run.events if event.time == time and event.kind == "event"]
        there, light = ("even to odd", "off to on") if number % 2 == 0 else ("odd to even", "on to off")
        assert here == ["leg: wait to thrust", f"count: {there}", f"light: {light}"]


def test_a_transition_waits_while_its_condition_does_not_hold() -> None:
    model, start = hopper(
        mbd.Transition("flight", "wait", on="floor"),
        mbd.Transition("wait", "thrust", after=0.05, only_while="floor"),
        mbd.Transition("thrust", "flight", when="rail.displacement", only_while=mbd.measure("rail.rate")),
        mbd.Transition("thrust", "flight", when=mbd.measure(lambda y: y - 0.2, "rail.displacement"),
                       only_while="leg: thrust"),
    )  # fmt: skip
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.6)
    assert [event.name for event in run.events][-1] == "leg: thrust to flight (2)"
    np.testing.assert_allclose(run["rail.displacement"][run.events[-1].row], 0.2, atol=1e-12)


@pytest.mark.parametrize("condition", [None, mbd.measure(lambda t: t - 10.0, "t")])
def test_a_timer_that_has_ended_when_a_run_begins_is_due_at_once(condition: Any) -> None:
    model, _ = hopper()
    ways = [mbd.Transition("a", "b", after=0.5, only_while=condition), mbd.Transition("b", "a", after=0.1)]
    model.apply(mbd.Mode("clock", ("a", "b"), transitions=ways), mbd.SampledLaw("law", 0.25, {"u": lambda t: t}, "t"))
    start = mbd.assemble(model, {"rail.displacement": 9.0})
    first = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.3)
    shorter = {"clock.a to b.after": 0.2}
    for begun, values, time in (first.final, shorter, 0.3), (replace(start, time=0.7), {}, 0.7):
        run = mbd.simulate(model, begun, mbd.RungeKutta853(), dt=0.01, until=0.9, parameters=values)
        found = [event.time for event in run.events if event.name == "clock: a to b"]
        assert found[:1] == ([time] if condition is None else [])
        assert max((run.time - run["law.u"])[run.time > time]) < 0.25 + 1e-9


@pytest.mark.parametrize("backend", ["llvm", "python"])
@pytest.mark.parametrize("height", [9.0, 0.6, 0.2])
def test_a_timer_of_a_quantity_that_is_shorter_than_its_state_has_lasted_is_due_at_once(
    height: float, backend: str
) -> None:
    """One that is longer ends as the quantity says, while the ball falls."""
    model, _ = hopper()
    ways = [mbd.Transition("a", "b", after="rail.displacement"), mbd.Transition("b", "a", after=9.0)]
    model.apply(mbd.Mode("clock", ("a", "b"), transitions=ways))
    start = replace(mbd.assemble(model, {"rail.displacement": 9.0}), time=0.3)
    begun = replace(start, q=np.array([height]))
    run = mbd.simulate(model, begun, mbd.RungeKutta853(), dt=0.01, until=0.6, backend=backend)
    found = [event.time for event in run.events if event.name == "clock: a to b"]
    left = max(height - 0.3, 0.0)  # of which the quantity loses g t²/2
    ends = 0.3 + (np.sqrt(1.0 + 2.0 * 9.81 * left) - 1.0) / 9.81
    assert found == pytest.approx([] if height > 8.0 else [ends], abs=1e-12)


def test_transitions_without_end_are_named() -> None:
    model, start = hopper()
    model.constrain(
        mbd.Mode("a", ("0", "1"), transitions=[mbd.Transition("0", "1", on="b"), mbd.Transition("1", "0", on="b"),
                                               mbd.Transition("0", "1", on="floor")]),
        mbd.Mode("b", ("0", "1"), transitions=[mbd.Transition("0", "1", on="a"), mbd.Transition("1", "0", on="a")]),
    )  # fmt: skip
    with pytest.raises(SimulationError, match="transitions follow each other without end at one instant.*'b: "):
        mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=1.0)


def test_contacts_are_watched_only_in_a_state() -> None:
    model, start = hopper()
    shelf = mbd.measure(lambda y: y - 0.02, "rail.displacement")
    model.constrain(mbd.Unilateral("shelf", shelf, only_while="leg: thrust"))
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.9)
    assert run.events[0].name == "floor"  # through the shelf
    model.constrain(mbd.Unilateral("other", mbd.measure("rail.displacement"), only_while="leg: trust"))
    with pytest.raises(ModelError, match="no contact named 'leg: trust'"):
        mbd.assemble(model, {"rail.displacement": 0.5})


def test_a_contact_opens_as_a_state_is_entered() -> None:
    model, start = hopper()
    ceiling = mbd.measure(lambda y: y - 0.1, "rail.displacement")
    release = mbd.When("leg: flight")
    model.constrain(mbd.Unilateral("latch", ceiling, only_while="leg: flight", release=release))
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=1.0)
    assert [event.name for event in run.events] == ["latch"]  # which holds it above the floor, whatever its force
    model = model.without("leg")
    cycle = [mbd.Transition("wait", "flight", after=0.4), mbd.Transition("flight", "wait", when="rail.rate")]
    model.constrain(mbd.Mode("leg", ("wait", "flight", "thrust"), transitions=[
        *cycle, mbd.Transition("wait", "thrust", on="floor")], numbers={"push time": 0.1}))  # fmt: skip
    model = model.without("latch")
    model.constrain(mbd.Unilateral("latch", ceiling, release=release))
    start = mbd.assemble(model, {"rail.displacement": 0.1 + 0.5 * G * 0.3**2})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.5)
    wanted = [(0.3, "latch", "closed"), (0.4, "leg: wait to flight", "event"), (0.4, "latch", "opened")]
    assert [event[1:] for event in wanted] == [(event.name, event.kind) for event in run.events[:3]]
    np.testing.assert_allclose([event.time for event in run.events[:3]], [time for time, _, _ in wanted], atol=1e-12)
    assert run.final["rail.displacement"] < 0.1 - 0.4 * G * 0.1**2


T = mbd.Transition


@pytest.mark.parametrize(("make", "message"), [
    (lambda: mbd.Mode("m", ("a",)), "two states at least"),
    (lambda: mbd.Mode("m", ("a", "b"), transitions=[T("a", "c", after=1.0)]), "no state named 'c'"),
    (lambda: mbd.Mode("m", ("a", "b"), start="c"), "no state named 'c'"),
    (lambda: mbd.Mode("m", ("a", "b")), "never leaves 'a'"),
    (lambda: mbd.Mode("m", ("a", "b", "c"), transitions=[T("a", "b", after=1.0)]), "lead from 'a' to 'c'"),
    (lambda: T("a", "b", after=0.0), "after 0 s is not positive"),
    (lambda: T("a", "b", after=-1.0), "after -1 s is not positive"),
    (lambda: T("a", "b"), "takes one cause, on=, when= or after=; got none"),
    (lambda: T("a", "b", after=1.0, on="foot"), "got on and after"),
    (lambda: T("a", "b", when=3.0), "when is a measure"),
    (lambda: mode(T("a", "b", after="m.t"), numbers={"t": -0.1}), "'m.t' is the time of a timer, but -0.1 s"),
    (lambda: mode(remembers={"time": "t"}), "names two things"),
    (lambda: mode(sets={"x.y": {"c": 1.0}}), "sets 'x.y' in"),
])  # fmt: skip
def test_bad_modes_are_errors_by_name(make: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        make()


def mode(*transitions: mbd.Transition, **more: Any) -> mbd.Mode:
    return mbd.Mode("m", ("a", "b"), transitions=transitions or [T("a", "b", after=1.0)], **more)


@pytest.mark.parametrize(("words", "message"), [
    ([lambda j: mode(sets={"loss.coefficient": {"b": -0.5}}), lambda j: mbd.Damper(
        "loss", mbd.Model("n").ground.origin, j.child, mbd.Viscous(0.1))], "'loss.coefficient.b': .* is negative"),
    ([lambda j: mode(sets={"drive.u": {"b": 2.0}}), lambda j: mbd.Motor("drive", j, force=1.0, by="m")],
     "'drive' has by='m', but nothing by state"),
    ([lambda j: mode(T("a", "b", on="n: d"), T("b", "a", after=1.0)), lambda j: mbd.Mode(
        "n", ("c", "d"), transitions=[T("c", "d", on="m: b"), T("d", "c", after=1.0)])], "'m: a to b' never happens"),
    ([lambda j: mode(T("a", "b", on="n: c")), lambda j: mbd.Mode(
        "n", ("c", "d"), transitions=[T("c", "d", after=1.0)])], "waits for 'n: c', which nothing else causes"),
    ([lambda j: mode(), lambda j: mbd.Event("e", on="f"), lambda j: mbd.Event("f", on="e")], "'e' never happens"),
    ([lambda j: mode(T("a", "b", on="foor"))], "on: no contact, event or mode named 'foor'"),
    ([lambda j: mode(T("a", "b", after=1.0, only_while="m: c"))], "only_while: no contact or state named 'm: c'"),
    ([lambda j: mode(T("a", "b", when="rail.displcement"))], "no quantity named 'rail.displcement'"),
    ([lambda j: mode(remembers={"x": "rail.acceleration"})], "'rail.acceleration' is a result"),
    ([lambda j: mode(sets={"body.mass": {"a": 2.0}})], "body.mass"),
    ([lambda j: mode(sets={"drive.trque": {"a": 2.0}})], "sets 'drive.trque'"),
    ([lambda j: mbd.Motor("drive", j, force={"a": 1.0})], "name the mode too: by="),
    ([lambda j: mode(), lambda j: mbd.TorsionSpring("k", j, 1.0, {"a": 1.0}, by="m")], "no value for 'b' of 'm'"),
    ([lambda j: mode(), lambda j: mbd.Motor("drive", j, force={"c": 1.0}, by="m")], "no state named 'c'"),
    ([lambda j: mode(), lambda j: mbd.Motor("drive", j, force={"a": 1.0}, by="n")], "no mode named 'n'"),
    ([lambda j: mbd.Motor("one", j, force=lambda x: x, arguments=["two.force"]),
      lambda j: mbd.Motor("two", j, force=lambda x: x, arguments=["one.force"])], "'two.force' is what a law gives"),
])  # fmt: skip
def test_bad_names_of_modes_are_errors_at_build(words: Any, message: str) -> None:
    model, _ = one_body(mbd.PointMass("body", mass=1.0), mbd.Prismatic, "rail", title="slider")
    rail = model.joints[0]

    def built() -> mbd.State:
        model.apply(*(make(rail) for make in words))
        return mbd.assemble(model, {"rail.displacement": 0.0})

    with pytest.raises(ModelError, match=message):
        built()


@pytest.mark.parametrize("wait", [-0.4, 0.0, 0.05])
def test_a_remembered_time_that_is_not_positive_is_due_at_once(wait: float) -> None:
    """States that last 0.3 s and the remembered time, by turns."""
    model, _ = one_body(mbd.PointMass("body", mass=1.0), mbd.Prismatic, "rail", title="slider")
    stored = mbd.measure(lambda x, wait: wait + 0.0 * x, "rail.displacement", "m.wait")
    changes = [T("a", "b", after=0.3), T("b", "a", after="m.stored")]
    model.apply(mbd.Mode("m", ("a", "b"), transitions=changes, remembers={"stored": stored}, numbers={"wait": wait}))
    run = mbd.simulate(model, mbd.assemble(model), mbd.HHT(), dt=0.01, until=1.0)
    lasts = [0.3, max(wait, 0.0)] * 3
    assert [event.time for event in run.events] == pytest.approx(np.cumsum(lasts)[: len(run.events)], abs=1e-14)
    assert len(run.events) == (5 if wait > 0.0 else 6)


@pytest.mark.parametrize("after", ["m.stored", "rail.displacement"])
@pytest.mark.parametrize("speed", [-2.0, 0.0, 2.0])
@pytest.mark.parametrize("wait", [-0.4, 0.0, 0.05])
@pytest.mark.parametrize("integrator", [mbd.HHT(), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
def test_a_time_that_is_not_positive_on_entry_is_due_at_once_also_as_a_run_begins(integrator, wait, speed, after):
    """The slider moves evenly, x = wait + speed t: a timer of x, begun at s, ends at once or where t − s = x(t)."""
    model, _ = one_body(mbd.PointMass("body", mass=1.0), mbd.Prismatic, "rail", title="slider")
    stored = mbd.measure(lambda x, wait: wait + 0.0 * x, "rail.displacement", "m.wait")
    changes = [T("a", "b", after=0.3), T("b", "a", after=after)]
    model.apply(mbd.Mode(
        "m", ("a", "b"), start="b", transitions=changes, remembers={"stored": stored}, numbers={"wait": wait}
    ))  # fmt: skip
    start = mbd.assemble(model, {"rail.displacement": wait}, {"rail.rate": speed})
    run = mbd.simulate(model, start, integrator, dt=0.01, until=0.98)
    expected, now = list[float](), 0.0
    while now < 1.0:
        moved = speed if after == "rail.displacement" else 0.0
        left = wait + moved * now
        if left > 0.0:  # of t − s = wait + moved t
            left = left / (1.0 - moved) if moved < 1.0 else math.inf
        now += max(left, 0.0)
        expected += [now, now + 0.3]
        now += 0.3
    expected = [each for each in expected if each < 0.98]
    assert [event.time for event in run.events] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(("direction", "expected"), [
    (0, [0.7, 1.0, 1.7, 2.0, 2.7, 3.0]), (1, [0.7, 1.3, 2.0, 2.3, 3.0]), (-1, [0.7, 1.0, 1.7, 2.0, 2.7, 3.0]),
])  # fmt: skip
@pytest.mark.parametrize("integrator", [mbd.HHT(), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
def test_the_time_in_another_mode_is_watched_as_any_quantity(integrator, direction, expected) -> None:
    """It is past 0.3 s as 'a' is entered: it falls back as the other mode changes each second, and then rises."""
    model = mbd.Model("slider")
    model.connect(mbd.Prismatic("rail", model.ground.origin, mbd.PointMass("body", mass=1.0).origin))
    late = mbd.measure(lambda t: t - 0.3, "n.time")
    changes = [T("b", "a", after=0.7), T("a", "b", when=late, direction=direction)]
    other = [T("c", "d", after=1.0), T("d", "c", after=1.0)]
    model.apply(mbd.Mode("n", ("c", "d"), transitions=other), mbd.Mode("m", ("b", "a"), transitions=changes))
    run = mbd.simulate(model, mbd.assemble(model), integrator, dt=0.01, until=3.1)
    found = [event.time for event in run.events if event.name.startswith("m")]
    assert found == pytest.approx(expected, abs=1e-14)


def test_the_second_of_two_timers_of_equal_length_is_an_error() -> None:
    back = T(("b", "c"), "a", after=1.0)
    for time, said in (0.3, "0.3 s"), ("m.t", "'m.t'"):
        both = [T("a", "b", after=time), T("a", "c", after=time)]
        with pytest.raises(
            ModelError, match=f"never goes from 'a' to 'c' after {said}: the transition to 'b' is first"
        ):
            mbd.Mode("m", ("a", "b", "c"), transitions=[*both, back], numbers={"t": 0.3})
        first = T("a", "b", after=time, only_while="other: on")
        mode = mbd.Mode("m", ("a", "b", "c"), transitions=[first, both[1], back], numbers={"t": 0.3})
        assert mode.states == ("a", "b", "c")


def test_a_law_that_compares_the_number_of_a_state_with_its_name_is_an_error() -> None:
    model = knee()
    hinge = next(joint for joint in model.joints if joint.name == "knee")
    model.apply(mbd.Motor("other", hinge, lambda s: mbd.where(s == "pull", 1.0, 0.0), arguments=["phase"]))
    with pytest.raises(mbd.TraceError, match="compared with the text 'pull', which no number equals"):
        mbd.assemble(model)


def test_states_that_undo_each_other_are_named() -> None:
    """A leg that is drawn up as its foot stands, and pushed down as it does not."""
    model, body, foot = mbd.Model("hopper"), mbd.PointMass("body", mass=10.0), mbd.PointMass("foot", mass=0.5)
    trunk = mbd.Prismatic("trunk", model.ground.origin, body.origin, axis="y")
    slide = mbd.Prismatic("slide", body.origin, foot.origin, axis=(0, -1, 0), stiffness=4e3, rest=0.5)
    model.connect(trunk, slide)
    model.constrain(mbd.Unilateral("toe", mbd.height(foot.origin)))
    turns = [mbd.Transition("air", "ground", on="toe"), mbd.Transition("ground", "air", on="toe opened")]
    model.apply(
        mbd.Mode("leg", ("air", "ground"), transitions=turns),
        mbd.Motor("drive", slide, force={"ground": -9000.0, "air": 9000.0}, by="leg"),
    )
    start = mbd.assemble(model, {"trunk.displacement": 0.7, "slide.displacement": 0.5})
    with pytest.raises(SimulationError, match="since the states 'ground' and 'air' of 'leg' undo each other; restrict"):
        mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=2.0)
