"""Impulses of the user's as contacts close: push-off beside the impact of a strike."""

import math
from functools import cache

import numpy as np
import pytest

import mbd
from tests.cases.walkers import compass, standing
from tests.problems import case

ALPHA, INERTIA, PUSH = math.pi / 8.0, 0.3, 0.8


def wheel(order: str = "before", **more) -> tuple[mbd.Model, mbd.State]:
    """A rimless wheel of eight spokes on level ground, pushed along its trailing spoke at each strike."""
    model, hub = mbd.Model("rimless wheel"), mbd.RigidBody("hub", mass=1.0, inertia=INERTIA)
    model.connect(mbd.Planar("float", model.ground.origin, hub.origin))
    way = [(math.cos(a), math.sin(a)) for a in (-math.pi / 2.0 + 2.0 * ALPHA * k for k in range(8))]
    for k, (x, y) in enumerate(way):
        model.constrain(mbd.Unilateral(f"spoke {k}", mbd.touchdown(hub.point(x, y, name=f"tip {k}"))))
    for k in range(8):
        x, y = way[k - 1]
        push = {"size": PUSH, "on": f"spoke {k}", "order": order, "axes": hub.origin} | more
        model.constrain(mbd.Impulse(f"push {k}", hub.origin, direction=(-x, -y), **push))
    velocity = {"float.angle": -2.0, "float.x": 2.0, "float.y": 0.0}
    return model, mbd.assemble(model, {"float.y": 1.0}, velocity, closed=["spoke 0"])


def speeds(run: mbd.Trajectory) -> np.ndarray:
    """ω⁻ at each strike."""
    times = [event.time for event in run.events if event.kind == "closed"]
    return -np.array(run.at(times, side="left")["float.angle.rate"])


@pytest.mark.parametrize("order", ["before", "with"])
def test_a_rimless_wheel_goes_to_the_speed_of_its_push(order):
    """``(J + l²) ω⁺ = (J + l² cos 2α) ω⁻ + P l sin 2α``: the multiplier, cos 2α for J = 0, and ``ω = P/(l tan α)``."""
    run = mbd.simulate(*wheel(order), mbd.RungeKutta853(), dt=0.02, until=2.0)
    w, factor = speeds(run), (INERTIA + math.cos(2.0 * ALPHA)) / (INERTIA + 1.0)
    expected = factor * w[:-1] + PUSH * math.sin(2.0 * ALPHA) / (INERTIA + 1.0)
    assert len(w) >= 5
    np.testing.assert_allclose(w[1:], expected, atol=1e-11)
    assert np.all(np.diff(np.abs(w - PUSH / math.tan(ALPHA))) < 0.0)


def test_a_push_after_the_strike_lifts_the_wheel_off_its_new_spoke():
    """It has a part along the new spoke, which cannot pull: beside a strike without a push all of P/m is added."""
    jumps = []
    for size in (PUSH, 0.0):
        run = mbd.simulate(*wheel("after", size=size), mbd.RungeKutta853(), dt=0.02, until=0.2)
        instant = next(event.time for event in run.events if event.kind == "closed")
        row = run.at([instant])
        jumps.append(np.array([row[f"float.{name}.rate"][0] for name in ("x", "y", "angle")]))
        turned = row["float.angle"][0] - math.pi / 2.0  # of the trailing spoke
    push = PUSH * np.array([-math.cos(turned), -math.sin(turned), 0.0])
    np.testing.assert_allclose(jumps[0] - jumps[1], push, atol=1e-11)
    assert run.events[-1].kind != "opened"


@pytest.mark.parametrize("order", ["before", "with", "after"])
def test_the_ledger_closes_and_names_pushes_and_strikes(order):
    run = mbd.simulate(*wheel(order), mbd.RungeKutta853(), dt=0.02, until=1.0)
    parts = {part.name: part for part in run.energy.parts}
    assert parts["push 1"].kind == "force"
    assert parts["push 1"].energy[-1] > 0.0
    assert parts["spoke 1 impact"].energy[-1] < 0.0
    assert np.max(np.abs(run.energy.numerical)) < 1e-11
    if order == "before":  # P²/2m of a wheel that is at rest along its spoke
        assert parts["push 1"].energy[-1] == pytest.approx(0.5 * PUSH**2, rel=1e-12)
    kinds = [(event.kind, event.name) for event in run.events[:4]]
    assert ("pushed", "push 1") in kinds and ("closed", "spoke 1") in kinds and ("opened", "spoke 0") in kinds


@pytest.mark.parametrize("order", ["before", "with", "after"])
def test_the_ledger_closes_where_rows_take_an_impulse(order):
    """A guide takes all that pushes across it, the floor the fall."""
    model, ball = mbd.Model("guided"), mbd.PointMass("ball", 1.0)
    model.connect(mbd.Translation("place", model.ground.origin, ball.origin))
    model.constrain(
        mbd.Unilateral("floor", mbd.height(ball.origin)), mbd.Bilateral("guide", mbd.measure("place.x")),
        mbd.Impulse("kick", ball.origin, 1.0, "floor", direction=(1, 0), order=order),
    )  # fmt: skip
    run = mbd.simulate(model, mbd.assemble(model, {"place.y": 0.5}), mbd.RungeKutta853(), dt=0.01, until=0.5)
    assert abs(run.final["place.x.rate"]) < 1e-12 and np.max(np.abs(run.energy.numerical)) < 1e-12


@pytest.mark.parametrize("order", ["before", "after"])
def test_the_ledger_closes_where_friction_takes_a_part_of_an_impulse(order):
    """A sledge on a belt is pressed down as a ball strikes; friction takes what that costs, and follows its load.

    Nothing of it is that of an impulse on a body apart.
    """
    model = mbd.Model("pressed")
    sledges, apart = [mbd.PointMass(name, 1.0) for name in ("sledge", "ball")], mbd.PointMass("apart", 1.0)
    model.connect(mbd.Prismatic("apart", model.ground.origin, apart.origin))
    model.constrain(mbd.Impulse("push", apart.origin, 1.0, "ball floor", direction=(1, 0), order=order))
    for sledge in sledges:
        model.connect(mbd.Translation(f"{sledge.name} place", model.ground.origin, sledge.origin))
        belt = mbd.touchdown(sledge.origin, mbd.Plane(velocity=(-1.0, 0.0)))
        model.constrain(mbd.Unilateral(f"{sledge.name} floor", belt, friction=0.3))
    model.constrain(mbd.Impulse("kick", sledges[0].origin, 1.0, "ball floor", direction=(1, -2), order=order))
    model.apply(mbd.Applied("load", sledges[0].origin, (0.0, lambda t: -3.0 * mbd.sin(20.0 * t))))
    start = mbd.assemble(model, {"ball place.y": 0.5}, {"sledge place.x": 2.0}, closed="sledge floor")
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until="ball floor")
    gained = (1.0 - 0.3 * 2.0) / 5.0**0.5
    before = 2.0 - 0.3 * (9.81 * (end := run.events[-1].time) + 0.15 * (1.0 - math.cos(20.0 * end)))
    assert run.final["sledge place.x.rate"] == pytest.approx(before + gained, rel=1e-12)
    assert np.max(np.abs(run.energy.numerical)) < 1e-11
    assert run.energy["push"][-1] == pytest.approx(0.5, rel=1e-12)
    between = run.at(0.5 * (run.time[:9] + run.time[1:10]))
    np.testing.assert_allclose(between["sledge floor.friction"], -0.3 * between["sledge floor.force"], rtol=1e-12)


def test_a_size_may_follow_the_motion_and_is_a_parameter():
    doubled = mbd.simulate(
        *wheel(), mbd.RungeKutta4(), dt=0.01, until=0.7, parameters={f"push {k}.size": 0.4 for k in range(8)}
    )
    model, start = wheel(size=lambda rate: -0.2 * rate, arguments=("float.angle.rate",))
    run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=0.01, until=0.5)
    first = speeds(run)[0]
    gained = (run.at([run.events[0].time])["float.angle.rate"][0],)
    expected = ((INERTIA + math.cos(2 * ALPHA)) * first + 0.2 * first * math.sin(2 * ALPHA)) / (INERTIA + 1.0)
    assert -gained[0] == pytest.approx(expected, rel=1e-12)
    assert speeds(doubled)[1] < speeds(mbd.simulate(*wheel(), mbd.RungeKutta4(), dt=0.01, until=0.7))[1]


BOTH = {
    "parameters": {"push": 3.0},
    "functions": {"push": lambda size: {"left push.size": size, "right push.size": size}},
}
"""One size of both feet's pushes."""


@cache
def pushed_gait() -> mbd.LimitCycle:
    """Case k5 in bodies: the trailing foot is pushed along its leg as the other one strikes."""
    reference = case("k5-compass-pushoff-level")
    model = compass(reference.definition)
    for side, other in (("left", "right"), ("right", "left")):
        leg = model.bodies[f"{other} leg"]
        push = mbd.Impulse(f"{other} push", leg.end, direction=(0, 1), size=3.0, on=f"{side} foot", axes=leg.end)
        model.constrain(push)
    angle, *rates = np.round(reference["state just after heel strike"].value, 3)
    start = standing(model, [angle, -angle, *rates], 0.0)
    return mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"), **BOTH)


def test_the_gait_of_a_push_off_is_that_of_the_case():
    reference, gait = case("k5-compass-pushoff-level"), pushed_gait()
    names = ("left hip.angle", "left hip.rate", "right hip.rate")
    found = np.array([gait.state[name] for name in names])
    assert np.max(np.abs(found - reference["state just after heel strike"].value)) < 1e-9
    assert abs(gait.period - reference["phase durations"].value[0]) < 1e-10
    real, imaginary = reference["Floquet"].value
    assert max(np.min(np.abs(real + 1j * imaginary - value)) for value in gait.multipliers) < 2e-8
    by = reference["d(period, step length, speed, largest |multiplier|) / d(push-off impulse P)"].value
    assert abs(gait.derivatives["period", "push"] - by[0]) < 1e-8


def test_the_push_of_one_foot_is_refused_wherever_a_mirrored_gait_takes_it_and_right_over_a_stride():
    gait = pushed_gait()
    model, start = gait.map.model, gait.state
    step = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    calls = [
        lambda name: step.derivatives["speed", name],
        lambda name: step.derivatives["largest multiplier", name],
        lambda name: step.at({name: 3.03}),
        lambda name: mbd.branch(step, name, to=3.03),
        lambda name: mbd.optimize(step, {name: (3.0, 2.9, 3.1)}, maximize="speed", progress=False),
        lambda name: mbd.basin(model, step, {name: [3.0, 3.1]}, workers=1, progress=False),
        lambda name: mbd.limit_cycle(
            model, start, section="right foot", mirror=("left", "right"), parameters={name: 3.03}
        ),
    ]
    for name in ("left push.size", "right push.size"):
        for call in calls:
            with pytest.raises(mbd.ModelError, match="mirror=.*(differently|another one).*mirror=None"):
                call(name)
    both = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"), dt=0.02, **BOTH)
    stride = mbd.limit_cycle(model, start, section="right foot", dt=0.02)
    sides = sum(stride.derivatives["speed", f"{side} push.size"] for side in ("left", "right"))
    assert sides == pytest.approx(both.derivatives["speed", "push"], rel=1e-8)


def test_an_impulse_about_a_joint_and_one_on_a_coordinate_are_alike():
    ends = []
    for name in ("joint", "coordinate"):
        model, ball, rod = mbd.Model("kick"), mbd.PointMass("ball", 1.0), mbd.Link("rod", 1.0, 0.5, 0.25, 0.05)
        model.connect(mbd.Translation("p", model.ground.origin, ball.origin))
        pin = mbd.Revolute("pin", ball.origin, rod.start)
        model.connect(pin)
        model.constrain(mbd.Unilateral("floor", mbd.height(ball.origin), friction=0.0))
        at = pin if name == "joint" else "pin.angle"
        model.constrain(mbd.Impulse("kick", at, size=0.3, on="floor", order="with"))
        start = mbd.assemble(model, position={"p.y": 0.1})
        ends.append(mbd.simulate(model, start, mbd.RungeKutta4(), dt=1e-2, until=0.3)["pin.angle"][-1])
    assert ends[0] == ends[1] != 0.0


def test_a_lagrangian_takes_impulses_on_its_coordinates():
    """A ball on a floor, kicked upwards by m v: it leaves with the speed of the kick."""
    height = mbd.Coordinate("height")
    model = mbd.Lagrangian("ball", [height], kinetic=0.5 * height.v**2, potential=9.81 * height.q)
    model.constrain(mbd.Unilateral("floor", mbd.measure("height")))
    model.constrain(mbd.Impulse("kick", "height", size=2.0, on="floor", order="after"))
    start = mbd.assemble(model, {"height": 0.1})
    run = mbd.simulate(model, start, mbd.RungeKutta4(), dt=1e-2, until=0.3)
    assert run.at([run.events[0].time])["height.rate"][0] == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (
            lambda body, pin: mbd.Impulse("kick", body.origin, size=1.0, on="foot"),
            "'kick' at a point needs a direction",
        ),
        (
            lambda body, pin: mbd.Impulse("kick", body.origin, direction=(0, 0), size=1.0, on="foot"),
            "direction of 'kick' is",
        ),
        (lambda body, pin: mbd.Impulse("kick", pin, direction=(0, 1), size=1.0, on="foot"), "has no direction"),
        (lambda body, pin: mbd.Impulse("kick", pin, size=1.0, on=""), "on of Impulse 'kick' is the name of a contact"),
        (lambda body, pin: mbd.Impulse("kick", pin, size=1.0, on="foot", order="then"), "'before', 'with' or 'after'"),
    ],
)
def test_wrong_impulses_are_refused_by_name(make, told):
    body = mbd.RigidBody("body", 1.0, (1, 1, 1))
    pin = mbd.Revolute("pin", mbd.Model("m").ground.origin, body.origin)
    with pytest.raises(mbd.ModelError, match=told):
        make(body, pin)


def test_contacts_that_are_none_and_strategies_that_locate_no_strike_are_refused_by_name():
    model, start = wheel()
    with pytest.raises(mbd.CapabilityError, match="contact='nonsmooth' locates no strike at which 'push 0'"):
        mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=0.1, contact="nonsmooth")
    hub = model.bodies["hub"]
    model.constrain(mbd.Impulse("lost", hub.origin, direction=(0, 1), size=1.0, on="spok 1"))
    assert "spoke 1" in " ".join(model.check())


def ball(size, order, arguments=("t",)):
    """A ball that falls on a floor with restitution and is kicked there."""
    model, body = mbd.Model("ball"), mbd.PointMass("ball", 1.0)
    model.connect(mbd.Translation("flight", model.ground.origin, body.origin, axes="y"))
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin), restitution=0.5))
    kick = mbd.Impulse("kick", body.origin, size, "floor", direction=(0, 1), order=order, arguments=arguments)
    model.constrain(kick)
    return model, mbd.assemble(model, {"flight.y": 0.5})


def test_a_contact_that_is_pressed_on_after_each_strike_ends_by_name():
    """v ↦ e |v| − P has no end at one instant: no limit of it is taken, as of strikes alone."""
    with pytest.raises(mbd.SimulationError, match="'kick' pushed.*let the impulse act with order='before' or 'with'"):
        mbd.simulate(*ball(-1.0, "after"), mbd.RungeKutta853(), dt=0.01, until=0.6)
    for order in "before", "with":
        run = mbd.simulate(*ball(-1.0, order), mbd.RungeKutta853(), dt=0.01, until=0.4)
        speed = np.sqrt(9.81) + 1.0  # restitution acts on the velocity with the impulse
        instant = np.sqrt(1.0 / 9.81)
        assert run["flight.y.rate"][-1] == pytest.approx(0.5 * speed - 9.81 * (0.4 - instant), abs=1e-12)


def test_an_impulse_without_a_number_is_named():
    model, start = ball(lambda y: mbd.sqrt(y - 1.0), "before", ["flight.y"])
    with pytest.raises(mbd.SimulationError, match="size of impulse 'kick' is not finite"):
        mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.6)
