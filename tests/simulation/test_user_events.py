"""Users' own events: crossings by direction, resets, ends of runs."""

import re

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import G, ball, falling, pendulum, run

DROP = np.sqrt(2.0 / G)


def oscillator(*events):
    """A point on a spring with a period of 1 s, starting at 1 m."""
    model = mbd.Model("oscillator")
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=(2 * np.pi) ** 2))
    model.constrain(*events)
    return model


def bouncing(reset, **settings):
    model, body = falling()
    model.constrain(mbd.Event("bounce", mbd.height(body.origin), direction=-1, reset=reset))
    return run(model, {"fall.displacement": 1.0}, **settings)


@pytest.mark.parametrize(
    ("direction", "expected"),
    [(-1, [0.25, 1.25, 2.25]), (1, [0.75, 1.75, 2.75]), (0, [0.25, 0.75, 1.25, 1.75, 2.25, 2.75])],
)
def test_an_event_fires_at_every_crossing_in_its_direction(direction, expected):
    model = oscillator(mbd.Event("zero", mbd.measure("slide.displacement"), direction=direction))
    trajectory = run(model, {"slide.displacement": 1.0}, dt=1e-3, until=3.0)
    np.testing.assert_allclose([event.time for event in trajectory.events], expected, atol=2e-4)
    assert {event.kind for event in trajectory.events} == {"event"}
    rows = [event.row for event in trajectory.events]
    assert np.abs(trajectory["slide.displacement"][rows]).max() < 1e-12
    np.testing.assert_array_equal(trajectory.record.v[rows], trajectory.record.v[np.array(rows) - 1])


def test_an_event_without_consequence_leaves_the_motion_alone():
    plain = run(oscillator(), {"slide.displacement": 1.0}, dt=1e-3, until=2.0)
    watched = run(
        oscillator(mbd.Event("zero", mbd.measure("slide.displacement"))),
        {"slide.displacement": 1.0},
        dt=1e-3,
        until=2.0,
    )
    np.testing.assert_allclose(watched.record.q[-1], plain.record.q[-1], atol=2e-5)


def test_a_guard_on_a_velocity_fires_at_the_turning_point():
    model = pendulum()
    model.constrain(mbd.Event("turn", mbd.measure("hinge.rate"), direction=1))
    trajectory = run(model, {"hinge.angle": 0.5}, dt=1e-3, until=2.0)
    (event,) = trajectory.events
    assert trajectory["hinge.angle"][event.row] == pytest.approx(-0.5, abs=1e-4)


def test_a_guard_of_time_fires_at_its_time():
    model = pendulum()
    model.constrain(mbd.Event("tick", mbd.measure(lambda t: t - 0.12345, "t")))
    trajectory = run(model, {"hinge.angle": 0.5}, dt=0.01)
    assert [event.time for event in trajectory.events] == [pytest.approx(0.12345, abs=1e-14)]


BEFORE = [1e-6, 1e-9, 1e-10, 1e-12, 1e-15]
"""Distances of a start from the surface of an event [m]."""


@pytest.mark.parametrize("backend", ["llvm", "python"])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("distance", BEFORE)
def test_a_start_just_before_the_surface_fires_at_once(distance, side, backend):
    model = oscillator(mbd.Event("zero", mbd.measure("slide.displacement")))
    start, speed = {"slide.displacement": side * distance}, {"slide.rate": -side}
    events = run(model, start, speed, dt=1e-2, until=0.6, backend=backend).events
    assert [event.time for event in events] == [pytest.approx(distance, abs=1e-15), pytest.approx(0.5, abs=2e-3)]
    away = run(model, start, {"slide.rate": side}, dt=1e-2, until=0.6, backend=backend).events
    assert [event.time for event in away] == [pytest.approx(0.5, abs=2e-3)]


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_a_start_on_the_surface_has_crossed_it(speed):
    model = oscillator(mbd.Event("zero", mbd.measure("slide.displacement")))
    (event,) = run(model, {"slide.displacement": 0.0}, {"slide.rate": speed}, dt=1e-2, until=0.6).events
    assert event.time == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize("place", [0.4, -0.4])
def test_a_start_at_rest_on_the_surface_fires_as_it_comes_back(place):
    model = oscillator(mbd.Event("back", mbd.measure(lambda x: x - place, "slide.displacement"), direction=0))
    model.constrain(mbd.Event("turn", mbd.measure("slide.rate")))
    events = run(model, {"slide.displacement": place}, dt=1e-3, until=0.9).events
    assert [event.name for event in events] == ["turn"] and events[0].time == pytest.approx(0.5, abs=1e-3)


# round-off ----------------------------------------------------------------------------------------------------------
WATCHED = (mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8, formulation="index3"), mbd.RadauIIA(), mbd.RungeKutta853())


@pytest.mark.parametrize("scheme", WATCHED, ids=repr)
@pytest.mark.parametrize("size", [1.0, 1e-9, 1e-100])
@pytest.mark.parametrize("guard", ["slide.displacement", "slide.rate"])
def test_a_motion_of_any_size_crosses_as_often(guard, size, scheme):
    model = oscillator(
        mbd.Event("zero", mbd.measure(guard)), mbd.Event("tiny", mbd.measure(lambda x: 1e-30 * x, guard))
    )
    events = run(model, {"slide.displacement": size}, dt=4e-3, until=5.2, integrator=scheme).events
    assert [event.name for event in events].count("zero") == [event.name for event in events].count("tiny") == 10


def watching_rates(model, names):
    """The model with an event on the rate of each of these coordinates, and on their sum."""
    model.constrain(
        *(mbd.Event(f"rate {k}", mbd.measure(f"{name}.rate")) for k, name in enumerate(names)),
        mbd.Event("sum", mbd.measure(lambda *rates: sum(rates), *(f"{name}.rate" for name in names))),
    )
    return model


def hanging(seed):
    """Links of any size that hang at rest from each other, from a base anywhere, turned by whole turns."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("hanging")
    end, position = model.ground.point(*rng.normal(size=2), name="base"), {}
    for k in range(rng.integers(1, 5)):
        length, mass = np.exp(rng.normal(size=2))
        link = mbd.Link(f"link {k}", mass=mass, length=length, center=0.4 * length, inertia=0.1 * mass * length**2)
        model.connect(mbd.Revolute(f"hinge {k}", end, link.start))
        position[f"hinge {k}.angle"] = 2.0 * np.pi * rng.integers(-2, 3)
        end = link.end
    return watching_rates(model, list(position)), {"position": position}


def resting(seed):
    """A body on its two feet, somewhere on the floor, at rest."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("resting")
    width, height, mass = np.exp(rng.normal(size=3))
    body = mbd.RigidBody("box", mass, (mass * width**2,) * 3)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    for side, name in ((-0.5, "left"), (0.5, "right")):
        foot = body.point(side * width, -0.5 * height, name=name)
        model.constrain(mbd.Unilateral(name, mbd.touchdown(foot), friction=0.6 if seed % 2 else 0))
    return watching_rates(model, ["place.x", "place.y", "place.angle"]), {
        "position": {"place.y": 0.5 * height, "place.x": rng.normal()}, "closed": ["left", "right"],
    }  # fmt: skip


def landing(seed):
    """The same body, dropped flat and not far: its feet close without a rebound, and stay."""
    model, start = resting(seed)
    start["position"]["place.y"] += 0.02
    return model, {"position": start["position"]}


@pytest.mark.parametrize("scheme", WATCHED, ids=repr)
@pytest.mark.parametrize("seed", range(6))
def test_what_has_landed_crosses_nothing(seed, scheme):
    model, start = landing(seed)
    found = mbd.simulate(model, mbd.assemble(model, **start), scheme, dt=2e-3, until=0.5)
    landed = max(event.time for event in found.events if event.kind == "closed")
    assert [event.name for event in found.events if event.kind == "event" and event.time > landed] == []


@pytest.mark.covering
@pytest.mark.parametrize("scheme", WATCHED, ids=repr)
@pytest.mark.parametrize("make", [hanging, resting])
@pytest.mark.parametrize("seed", range(6))
def test_what_rests_crosses_nothing(make, seed, scheme):
    model, start = make(seed)
    found = mbd.simulate(model, mbd.assemble(model, **start), scheme, dt=2e-3, until=0.4)
    assert [event.name for event in found.events] == []
    assert found.stats["restarts"] <= 2


# resets -------------------------------------------------------------------------------------------------------------
RESETS = {
    "function of named values": lambda named: {"fall.rate": -0.5 * named["fall.rate"]},
    "mapping of functions": {"fall.rate": lambda named: -0.5 * named["fall.rate"]},
    "by coordinate": {"fall.displacement.rate": lambda named: -0.5 * named["fall.displacement.rate"]},
}


@pytest.mark.parametrize("reset", RESETS.values(), ids=RESETS)
def test_a_ball_bounces_by_reset(reset):
    trajectory = bouncing(reset, until=1.35)
    expected = DROP + 2 * DROP * np.cumsum([0.0, *0.5 ** np.arange(1, 8)])
    np.testing.assert_allclose([event.time for event in trajectory.events], expected, atol=1e-9)
    first = trajectory.events[0].row
    assert trajectory["fall.rate"][first] == pytest.approx(-0.5 * trajectory["fall.rate"][first - 1], rel=1e-12)
    assert trajectory["fall.displacement"].min() > -1e-12


@pytest.mark.parametrize("dt", [1e-3, 0.05, 0.4])
def test_bounces_by_reset_that_crowd_together_are_never_missed(dt):
    trajectory = bouncing(RESETS["mapping of functions"], dt=dt, until=1.5, on_failure="return")
    assert not trajectory.success, "a reset cannot bring the ball to rest"
    assert re.search("more than|again and again", trajectory.message) and "'bounce' happened" in trajectory.message
    assert trajectory["fall.displacement"].min() > -1e-9
    assert trajectory.time[-1] == pytest.approx(3.0 * DROP, abs=1e-6)
    assert len(trajectory.events) < 100


@pytest.mark.parametrize("backend", ["llvm", "python"])
@pytest.mark.parametrize(
    "reset", [{"phase.displacement": 1.0}, {"phase.rate": lambda named: named["slide.displacement"]}]
)
@pytest.mark.parametrize("direction", [-1, 0, 1])
def test_a_reset_that_leaves_its_own_guard_at_zero_happens_once(direction, reset, backend):
    for seed, scheme in enumerate(WATCHED if backend == "llvm" else WATCHED[:1]):
        rng = np.random.default_rng(seed)
        turn = mbd.Event("turn", mbd.measure(lambda v: 0.1 * v, "slide.rate"), direction=direction, reset=reset)
        model = oscillator(turn)
        other = mbd.PointMass("other", mass=1.0)
        model.connect(mbd.Prismatic("phase", model.ground.origin, other.origin))
        phase = rng.uniform(0.1, 0.4)  # of a period of 1 s, in which the point moves backward at first
        place, speed = np.cos(2 * np.pi * phase), -2 * np.pi * np.sin(2 * np.pi * phase)
        start = {"slide.displacement": place, "phase.displacement": 0.0}
        found = run(model, start, {"slide.rate": speed}, integrator=scheme, dt=4e-3, until=2.2 - phase, backend=backend)
        turns = {-1: [1.0, 2.0], 0: [0.5, 1.0, 1.5, 2.0], 1: [0.5, 1.5]}[direction]
        np.testing.assert_allclose([event.time for event in found.events], np.array(turns) - phase, atol=2e-3)


@pytest.mark.parametrize("back", [0.2, -1e-3, -1e-6])
def test_a_reset_moves_its_guard_away_from_zero_in_any_unit(back):
    times = []
    for size in (1.0, 1e-9, 1e-50, 1e6):
        reset = {"slide.displacement": back * size}
        model = oscillator(mbd.Event("zero", mbd.measure("slide.displacement"), reset=reset))
        events = run(model, {"slide.displacement": size}, integrator=mbd.RungeKutta853(), dt=1e-2, until=0.6).events
        times.append([event.time for event in events])
    assert 1 <= len(times[0]) < 30
    for each in times[1:]:
        np.testing.assert_allclose(each, times[0], rtol=1e-12)


def test_a_reset_to_a_number_sets_it():
    model = pendulum()
    model.constrain(mbd.Event("bottom", mbd.measure("hinge.angle"), direction=-1, reset={"hinge.rate": -1.0}))
    trajectory = run(model, {"hinge.angle": 1.0}, until=0.6, dt=1e-3)
    assert trajectory["hinge.rate"][trajectory.events[0].row] == -1.0


def test_a_reset_of_a_position_moves_the_mechanism():
    model, body = falling()
    model.constrain(mbd.Event("floor", mbd.height(body.origin), reset={"fall.displacement": 2.0}))
    trajectory = run(model, {"fall.displacement": 1.0}, until=0.5)
    (event,) = trajectory.events
    assert trajectory["fall.displacement"][event.row] == 2.0
    assert trajectory["fall.rate"][event.row] == pytest.approx(-G * DROP, rel=1e-9)


def test_a_reset_that_breaks_a_constraint_is_refused_and_the_run_kept():
    model, body = falling()
    model.constrain(
        mbd.Bilateral("rail", mbd.measure(lambda y, t: y - 1.0 + t, "fall.displacement", "t")),
        mbd.Event("half", mbd.measure(lambda p: p[1] - 0.5, body.origin), reset={"fall.rate": 3.0}),
    )
    with pytest.raises(mbd.SimulationError, match="breaks constraints: 'rail' is violated by") as failed:
        run(model, {"fall.displacement": 1.0})
    assert failed.value.run.time[-1] == pytest.approx(0.5)


BAD_RESETS = {
    "wrong name": ({"fall.rat": 0.0}, "fall.rate"),
    "not a number": ({"fall.rate": "up"}, "'up'; give a finite number"),
    "nan": (lambda named: {"fall.rate": float("nan")}, "nan"),
    "raises": (lambda named: 1 / 0, "ZeroDivisionError"),
    "asks for a wrong name": (lambda named: {"fall.rate": named["fal.rate"]}, "fall.rate"),
}


@pytest.mark.parametrize(("reset", "said"), BAD_RESETS.values(), ids=BAD_RESETS)
def test_a_bad_reset_ends_the_run_with_a_reason_and_keeps_it(reset, said):
    with pytest.raises(mbd.MbdError, match=said) as failed:
        bouncing(reset)
    if isinstance(failed.value, mbd.SimulationError):
        assert "'bounce'" in str(failed.value)
        assert failed.value.run.time[-1] == pytest.approx(DROP)
        assert failed.value.run.success is False


# ends ---------------------------------------------------------------------------------------------------------------
def test_a_terminal_event_ends_the_run_with_its_name_and_both_rows():
    model, body = falling()
    model.constrain(mbd.Event("landed", mbd.height(body.origin), terminal=True))
    trajectory = run(model, {"fall.displacement": 1.0})
    assert trajectory.success and "'landed'" in trajectory.message and trajectory.status == 1
    assert trajectory.time[-1] == trajectory.time[-2] == trajectory.final.time == pytest.approx(DROP)
    assert trajectory.events[-1].row == len(trajectory.time) - 1


def test_a_terminal_reset_shows_in_the_last_row():
    model, body = falling()
    model.constrain(mbd.Event("caught", mbd.height(body.origin), terminal=True, reset={"fall.rate": 0.0}))
    trajectory = run(model, {"fall.displacement": 1.0})
    assert trajectory["fall.rate"][-1] == trajectory.final["fall.rate"] == 0.0
    assert trajectory["fall.rate"][-2] == pytest.approx(-G * DROP, rel=1e-9)


@pytest.mark.parametrize(("until", "happened"), [("floor", True), (("floor", 0.3), False), (("floor", 0.6), True)])
def test_a_run_ends_at_the_first_closing_of_a_contact_or_at_its_latest_time(until, happened):
    trajectory = run(ball(restitution=0.5), {"fall.displacement": 1.0}, until=until)
    assert trajectory.success
    assert trajectory.time[-1] == pytest.approx(DROP if happened else 0.3)
    assert ("did not happen" in trajectory.message) == (not happened)
    assert trajectory.status == int(happened)


def test_a_run_until_a_contact_that_rests_at_the_start_ends_there():
    trajectory = run(ball(), {"fall.displacement": 0.0}, until="floor")
    assert trajectory.time[-1] == 0.0 and "ended by 'floor'" in trajectory.message


def test_a_run_that_waits_for_an_event_in_vain_has_failed():
    """With a latest time it has reached that; a name alone asks for the event. A batch tells the same of each run."""
    model = oscillator(mbd.Event("high", mbd.measure(lambda x: x - 1.5, "slide.displacement"), direction=1))
    start = mbd.assemble(model, {"slide.displacement": 1.0})
    run = mbd.simulate(model, start, dt=0.01, until=("high", 2.0))
    assert run.success and run.message == "'high' did not happen before t = 2 s"
    settings = {"dt": 1e-3, "until": "high"}
    with pytest.raises(
        mbd.SimulationError, match=r"^'high' did not happen before t = 1000 s, in 1000000 steps; .*until="
    ):
        mbd.simulate(model, start, store=10_000, **settings)
    waited = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-2, until="high", on_failure="return")
    assert "before t = 1000 s, up to which a run with tol= waits; " in waited.message
    found = mbd.batch(model, [start, mbd.assemble(model, {"slide.displacement": 2.0})], **settings)
    assert list(found.outcome) == ["no event", "event"] and list(found.success) == [False, True]
