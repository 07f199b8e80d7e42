"""Non-smooth steps on whole scenes: chatter, walkers, moving grounds, friction; who chooses them, what stops them."""

import runpy
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import mbd
from mbd.kernel.codes import NO_IMPACT
from mbd.kernel.events import handling as kernel_events
from tests.simulation.mechanisms import G, ball, falling, kneed_walker, kneed_walker_start, point, run, two_balls

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def nonsmooth(model, position=None, velocity=None, **more):
    return run(model, position, velocity, contact="nonsmooth", **more)


# many contacts ------------------------------------------------------------------------------------------------------
@cache
def balls(count, turned=False):
    """Balls of radius 0.05 m in a box 0.6 m wide: walls and every pair."""
    model = mbd.Model("balls")
    contacts = []
    for k in range(count):
        body = mbd.PointMass(f"ball {k}", mass=1.0 + 0.1 * k)
        model.connect(mbd.Translation(f"p{k}", model.ground.origin, body.origin))
        walls = {"floor": lambda x, y: y - 0.05, "west": lambda x, y: x - 0.05, "east": lambda x, y: 0.55 - x}
        for wall, gap in walls.items():
            contacts.append(mbd.Unilateral(f"{wall} {k}", mbd.measure(gap, f"p{k}.x", f"p{k}.y"), restitution=0.5))
        for j in range(k):
            apart = mbd.measure(
                lambda a, b, c, d: mbd.sqrt((a - c) ** 2 + (b - d) ** 2) - 0.1,
                f"p{k}.x",
                f"p{k}.y",
                f"p{j}.x",
                f"p{j}.y",
            )
            contacts.append(mbd.Unilateral(f"pair {j} {k}", apart, restitution=0.5))
    model.constrain(*(contacts[::-1] if turned else contacts))
    return model


def thrown(count, turned=False, **more):
    rng = np.random.default_rng(3)
    position = {f"p{k}.x": 0.1 + 0.14 * (k % 4) for k in range(count)}
    position |= {f"p{k}.y": 0.1 + 0.15 * (k // 4) for k in range(count)}
    velocity = {f"p{k}.{axis}": float(rng.normal()) for k in range(count) for axis in "xy"}
    return run(balls(count, turned), position, velocity, until=1.5, dt=5e-3, **more)


def test_many_balls_in_a_box_are_stepped_over_and_never_overlap():
    """18 contacts."""
    trajectory = thrown(4, contact="nonsmooth")
    gaps = np.array([trajectory[f"{contact.name}.gap"] for contact in balls(4).constraints])
    assert gaps.min() > -1e-10
    assert len(trajectory.events) > 15 and trajectory.stats["steps"] < 320
    mechanical = trajectory.energy.kinetic + trajectory.energy.potential
    assert mechanical[-1] < mechanical[0]
    for event in trajectory.events:
        if event.kind == "closed":
            kinetic = trajectory.energy.kinetic[event.row - 1 : event.row + 1]
            assert kinetic[1] <= kinetic[0] + 1e-12


def test_the_order_in_which_balls_are_named_changes_nothing():
    one, other = (thrown(4, turned, contact="nonsmooth") for turned in (False, True))
    np.testing.assert_allclose(one.record.q[-1], other.record.q[-1], rtol=0, atol=1e-9)
    assert sorted((e.time, e.name) for e in one.events) == sorted((e.time, e.name) for e in other.events)


def test_contacts_are_located_and_only_what_differs_from_that_is_printed():
    for contact, said in ("auto", ""), ("events", "contact='events', as asked"), ("nonsmooth", "contact='nonsmooth',"):
        trajectory = run(ball(), {"fall.displacement": 1.0}, contact=contact, backend="python")
        assert trajectory.settings["contact"] == ("events" if contact == "auto" else contact)
        assert said in str(trajectory)
        assert bool(said) == ("contact  " in str(trajectory)) == (not trajectory.settings["contact_reason"])
    model, _ = falling()
    assert "contact  " not in str(run(model, until=0.1, backend="python"))


# ground that moves --------------------------------------------------------------------------------------------------
def shaken(amplitude, restitution=0.0):
    model, _body = falling(1.0)
    table = mbd.measure(lambda y, t: y - amplitude * mbd.sin(90.0 * t), "fall.displacement", "t")
    model.constrain(mbd.Unilateral("table", table, restitution=restitution))
    return model


@pytest.mark.parametrize(("amplitude", "restitution"), [(1.5e-3, 0.0), (1.5e-3, 0.6), (4e-3, 0.0), (4e-3, 0.6)])
def test_a_mass_on_a_shaken_table_chatters_in_bounded_work_and_never_sinks(amplitude, restitution):
    model = shaken(amplitude, restitution)
    for dt in 2e-3, 5e-4:
        trajectory = nonsmooth(model, {"fall.displacement": 5e-3}, until=1.0, dt=dt)
        assert trajectory["table.gap"].min() > -1e-12
        assert len(trajectory.events) > 4 and trajectory.stats["steps"] < 1.1 / dt


def test_a_mass_that_stays_on_the_table_feels_its_acceleration():
    trajectory = nonsmooth(shaken(1e-3), {"fall.displacement": 0.0}, {"fall.displacement": 0.09}, closed=["table"])
    exact = G - 8.1 * np.sin(90.0 * trajectory.time)
    fine = nonsmooth(shaken(1e-3), {"fall.displacement": 0.0}, {"fall.displacement": 0.09}, closed=["table"], dt=5e-4)
    assert not fine.events and np.abs(fine["table.gap"]).max() < 1e-15
    error = np.abs(fine["table.force"] - (G - 8.1 * np.sin(90.0 * fine.time))).max()
    assert error < 0.02 < np.abs(trajectory["table.force"] - exact).max()


@pytest.mark.parametrize("friction", [None, 0.3])
def test_a_rider_and_a_cart_keep_their_momentum(friction):
    model = mbd.Model("onto a cart")
    cart, rider = mbd.PointMass("cart", mass=3.0), mbd.PointMass("rider", mass=1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, cart.origin))
    model.connect(mbd.Translation("jump", model.ground.origin, rider.origin))
    deck = mbd.Plane(offset=0.5, frame=cart.origin)
    model.constrain(mbd.Unilateral("feet", mbd.touchdown(rider.origin, deck), friction=friction))
    trajectory = nonsmooth(model, {"jump.y": 1.0}, {"jump.x": 2.0})
    np.testing.assert_allclose(trajectory.record.v[:, :2] @ [3.0, 1.0], 2.0, atol=1e-12)
    assert trajectory["rail.rate"][-1] == pytest.approx(0.5, abs=1e-12)


def test_a_belt_carries_off_what_falls_on_it():
    for dt in 1e-2, 2e-3:
        model, body = point()
        belt = mbd.Plane(velocity=(-1.2, 0.0))
        model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin, belt), friction=0.4))
        trajectory = nonsmooth(model, {"place.y": 0.1}, dt=dt)
        fall = np.sqrt(0.2 / G)
        slip = 1.2 / (0.4 * G) - fall  # friction acts from the impact on, whose impulse is μ m √(2 g h)
        assert trajectory["place.x.rate"][-1] == pytest.approx(-1.2, abs=1e-12)
        assert [event.kind for event in trajectory.events] == ["closed", "stuck"]
        assert trajectory.events[0].time == pytest.approx(fall, abs=dt)
        assert trajectory.events[1].time == pytest.approx(fall + slip, abs=2 * dt)


# friction -----------------------------------------------------------------------------------------------------------
def test_a_pushed_block_sticks_slips_and_turns_within_coulombs_limit():
    model, body = point()
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=0.5))
    model.apply(mbd.Applied("push", body.origin, force=(lambda t: 8.0 * mbd.sin(3.0 * t), 0.0, 0.0)))
    exact = run(model, closed=["foot"], until=4.0, dt=5e-4, contact="events")
    errors = []
    for dt in 2e-2, 5e-3, 1.25e-3:
        trajectory = nonsmooth(model, closed=["foot"], until=4.0, dt=dt)
        normal, drag = -trajectory.record.lam[:, 0], np.abs(trajectory.record.lam[:, 1])
        assert np.all(drag <= 0.5 * normal * (1.0 + 1e-9))
        assert [event.kind for event in trajectory.events] == [event.kind for event in exact.events]
        found = [event.time for event in trajectory.events]
        np.testing.assert_allclose(found, [event.time for event in exact.events], atol=1.5 * dt, rtol=0)
        errors.append(abs(trajectory["place.x"][-1] - exact["place.x"][-1]))
    assert errors[0] < 5e-3 and errors[1] < errors[0] / 3.0 and errors[2] < errors[1] / 3.0


def test_stacked_boxes_with_friction_come_to_rest_on_a_slope():
    """Four contacts that share their load, tangents that depend on each other."""
    model, below, position = mbd.Model("stack", gravity=mbd.on_slope(0.2)), mbd.Plane(), {}
    for k in range(2):
        body = mbd.RigidBody(f"box {k}", mass=1.0 + k, inertia=0.02)
        model.connect(mbd.Planar(f"p{k}", model.ground.origin, body.origin))
        for name, x in ("left", -0.2), ("right", 0.2):
            foot = mbd.touchdown(body.point(x, -0.1), below)
            model.constrain(mbd.Unilateral(f"{name} {k}", foot, friction=0.5, restitution=0.3))
        below = mbd.Plane(offset=0.1, frame=body.origin)
        position |= {f"p{k}.y": 0.12 + 0.22 * k, f"p{k}.angle": 0.02 * (-1) ** k}
    trajectory = nonsmooth(model, position, until=0.6, dt=5e-3)
    gaps = [trajectory[f"{contact.name}.gap"].min() for contact in model.constraints]
    assert min(gaps) > -1e-10
    assert np.abs(trajectory.record.v[-1]).max() < 1e-9
    pushes = sum(trajectory[f"{name} 0.force"][-1] for name in ("left", "right"))
    assert pushes == pytest.approx(3.0 * G * np.cos(0.2), rel=1e-6)


# walkers ------------------------------------------------------------------------------------------------------------
def strikes(trajectory):
    return np.array([e.time for e in trajectory.events if e.kind == "closed" and "foot" in e.name])


def test_a_kneed_walker_walks_and_its_strikes_are_those_of_located_ones_to_first_order():
    model = kneed_walker()
    start = kneed_walker_start(model)
    exact = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=4.0, contact="events")
    kinds = [(event.name, event.kind) for event in exact.events]
    errors = []
    for dt in 4e-3, 1e-3, 2.5e-4:
        trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=dt, until=4.0, contact="nonsmooth")
        assert [(event.name, event.kind) for event in trajectory.events][:20] == kinds[:20]
        errors.append(np.abs(strikes(trajectory)[:5] - strikes(exact)[:5]).max())
        assert errors[-1] < 10.0 * dt
    assert errors[2] < errors[0] / 8.0


@pytest.mark.parametrize("name", ["compass_gait", "rimless_wheel"])
def test_walkers_of_the_examples_walk(name):
    """Feet that are watched only ahead of the other, and that let go of each other."""
    script = runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="read")
    common = {"dt": 2e-3, "until": 5.0}
    runs = [
        mbd.simulate(script["model"], script["start"], script["integrator"], contact=contact, **common)
        for contact in ("events", "nonsmooth")
    ]
    events, stepped = ([e.time for e in each.events if e.kind == "closed"] for each in runs)
    assert len(events) == len(stepped) > 4
    np.testing.assert_allclose(stepped, events, atol=0.03, rtol=0)


# together with what stays located -----------------------------------------------------------------------------------
def test_penalties_and_user_events_are_located_beside_contacts_that_are_not():
    model, a, b = two_balls()
    model.constrain(
        mbd.Penalty("mat", mbd.height(a.origin), stiffness=1e4, damping=20.0, release="pull"),
        mbd.Unilateral("floor", mbd.height(b.origin), restitution=0.5),
        mbd.Event("half", mbd.measure(lambda y: y - 0.5, "b.displacement")),
        mbd.Event("under", mbd.measure(lambda y: y + 1e-3, "b.displacement")),
    )
    trajectory = nonsmooth(model, {"a.displacement": 0.3, "b.displacement": 1.0}, dt=7e-3, until=0.6)
    times = {(event.name, event.kind): event.time for event in trajectory.events}
    assert times["half", "event"] == pytest.approx(np.sqrt(1.0 / G), abs=1e-9)
    assert times["mat", "closed"] == pytest.approx(np.sqrt(0.6 / G), abs=1e-9)
    assert 0.0 <= times["floor", "closed"] - np.sqrt(2.0 / G) <= 7e-3
    assert ("under", "event") not in times, "it lies behind the surface"
    assert trajectory["floor.gap"].min() > -1e-12


# stopping and going on ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("until_works", [1, 2, 3, 4])
def test_a_step_whose_end_has_no_impulses_is_tried_down_to_an_eighth(monkeypatch, until_works):
    """The impact law refuses the first attempts; the state is what it was, and nothing of them is stored."""
    refused, rebound = [], kernel_events.rebound

    def refuse(K):
        if len(refused) < until_works:
            refused.append(float(K.time))
            return NO_IMPACT
        return rebound(K)

    monkeypatch.setattr(kernel_events, "rebound", refuse)
    trajectory = nonsmooth(
        ball(restitution=0.5), {"fall.displacement": 1.0}, {"fall.displacement": -50.0}, dt=0.17, until=0.34,
        backend="python", on_failure="return",
    )  # fmt: skip
    assert trajectory["floor.gap"].min() > -1e-12 and np.all(np.diff(trajectory.time) >= 0.0)
    assert len(refused) == until_works
    if until_works == 4:
        assert not trajectory.success and "no forces or impulses" in trajectory.message
    else:
        assert trajectory.success and trajectory.stats["shortened"] == until_works
        assert any("halved where no impulses" in note for note in trajectory.stats["notes"])
        assert sum(event.kind == "closed" for event in trajectory.events) == 1
    np.testing.assert_allclose(refused, [0.17, 0.085, 0.0425, 0.02125][:until_works], rtol=1e-12)


# feet whose corners depend on each other ------------------------------------------------------------------------------
def two_feet(random):
    """A body on two feet of four corners in a plane, on universal ankles, askew over the ground."""
    model = mbd.Model("two feet")
    upper = mbd.RigidBody("upper", 2.0, (0.02, 0.03, 0.025))
    model.connect(mbd.Free("float", model.ground.origin, upper.origin))
    for side in (-1, 1):
        foot = mbd.RigidBody(f"foot {side}", 1.0, (0.003, 0.003, 0.001))
        model.connect(mbd.Universal(f"ankle {side}", upper.point(0.0, -0.3, 0.1 * side), foot.origin))
        a, b, c, d = random.uniform(0.03, 0.15, 4)
        corners = [foot.point(x, -0.08, z) for x, z in ((-a, -b), (c, -b), (d, a), (-b, c))]
        mbd.parts.polygon_foot(model, f"sole {side}", corners, friction=0.8)
    tilt = ("zxy", tuple(random.uniform(-0.1, 0.1, 3)))
    height, speed = 0.4 + random.uniform(0.005, 0.03), random.uniform(-0.3, 0.3)
    return model, mbd.assemble(model, {"float.y": height, "float.orientation": tilt}, {"float.x": speed})


@pytest.mark.parametrize("scheme", [mbd.HHT(alpha=0.05), mbd.RadauIIA()], ids=str)
def test_soles_of_four_corners_come_down_on_all_of_them(scheme):
    """Four gaps of a rigid sole depend on three: all there is of them at the end of a correction is round-off."""
    random = np.random.default_rng(8)
    for _ in range(4):
        model, start = two_feet(random)
        run = mbd.simulate(model, start, scheme, dt=2e-3, until=0.3, contact="nonsmooth")
        lowest = min(run[f"{contact.name}.gap"].min() for contact in model.constraints)
        assert run.success and lowest > -1e-9
