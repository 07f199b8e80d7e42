"""An event whose guard reaches zero where a contact strikes happens with it, whatever the guard is written in."""

import math

import numpy as np
import pytest

import mbd

G = 9.81
SCHEMES = (
    (mbd.HHT(), {"dt": 1e-3}), (mbd.RungeKutta853(), {"tol": 1e-8}), (mbd.RungeKutta4(), {"dt": 2e-3}),
    (mbd.RadauIIA(), {"dt": 1e-2}), (mbd.GeneralizedAlpha(0.8, formulation="index3"), {"dt": 1e-3}),
    (mbd.RungeKutta853(), {"dt": 5e-2}),
)  # fmt: skip


def guards(point, scale, base):
    """The height of a point in several words, which differ by round-off, and in any unit."""
    return (
        mbd.measure(lambda p: scale * p[1], point),
        mbd.measure(lambda y: scale * (y + base), "fall.y"),
        mbd.measure(lambda y, x: scale * (y + base) * (1.0 + x * x), "fall.y", "fall.x"),
        mbd.measure(lambda p: scale * (p[1] + p[1] ** 3), point),
    )


def bouncing(seed, **event):
    """A ball that is thrown on a floor; the height it starts from, its restitution, and its speed along the floor."""
    rng = np.random.default_rng(seed)
    restitution, height, base = float(rng.choice([0.0, 0.3, 0.8])), np.exp(rng.normal()), rng.normal()
    sign, speed = rng.choice([1.0, -1.0]), rng.normal()
    model = mbd.Model("ball")
    ball = mbd.PointMass("ball", mass=np.exp(rng.normal()))
    model.connect(mbd.Translation("fall", model.ground.point(0.3, base, name="base"), ball.origin, axes="xy"))
    model.constrain(mbd.Unilateral("floor", mbd.height(ball.origin), restitution=restitution))
    guard = guards(ball.origin, sign * np.exp(3.0 * rng.normal()), base)[seed % 4]
    if event.pop("speeds_up", False):
        event["reset"] = {"fall.x.rate": speed + 1.0}
    model.constrain(mbd.Event("touch", guard, **event))
    start = mbd.assemble(model, {"fall.y": height - base}, {"fall.x.rate": speed})
    falling = np.sqrt(2.0 * height / G)
    return model, start, sign, falling * (1.0 + 2.1 * restitution * (1.0 + restitution)) + 0.05, speed


@pytest.mark.covering
@pytest.mark.parametrize("backend", ["llvm", "python"])
@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("direction", [-1, 0, 1])
def test_an_event_on_the_height_of_a_contact_happens_as_it_strikes(direction, contact, backend):
    for seed in range(24 if backend == "llvm" else 4):
        model, start, sign, end, speed = bouncing(seed, direction=direction, speeds_up=seed % 3 == 0)
        scheme, step = SCHEMES[seed % len(SCHEMES)]
        step = {"dt": 1e-3} if contact == "nonsmooth" else step
        run = mbd.simulate(model, start, scheme, until=end, contact=contact, backend=backend, **step)
        struck = [event.time for event in run.events if event.kind == "closed"]
        touched = [event.time for event in run.events if event.kind == "event"]
        expected = struck if direction * sign <= 0.0 else []
        assert struck and touched == expected, (seed, scheme, step)
        if expected and seed % 3 == 0:
            assert run["fall.x.rate"][-1] == pytest.approx(speed + 1.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_an_event_at_a_contact_ends_the_run_after_the_impact(seed):
    model, start, _, end, _ = bouncing(seed, terminal=True)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-8, until=end)
    assert [event.name for event in run.events] == ["floor", "touch"] and "ended by 'touch'" in run.message
    assert run["fall.y.rate"][-1] >= 0.0


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
def test_an_event_on_the_speed_of_a_block_happens_as_friction_stops_it(scheme):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        friction, speed = rng.uniform(0.2, 0.8), np.exp(rng.normal())
        model = mbd.Model("block")
        block = mbd.PointMass("block", mass=np.exp(rng.normal()))
        model.connect(mbd.Translation("place", model.ground.origin, block.origin, axes="xy"))
        model.constrain(mbd.Unilateral("floor", mbd.touchdown(block.origin), friction=friction))
        model.constrain(mbd.Event("stops", mbd.measure(lambda v: 3.0 * v, "place.x.rate"), direction=-1))
        start = mbd.assemble(model, velocity={"place.x.rate": speed}, closed="floor")
        stop = speed / (friction * G)
        run = mbd.simulate(model, start, scheme, dt=2e-3, until=stop + 0.2)
        assert [event.time for event in run.events if event.name == "stops"] == [pytest.approx(stop, rel=1e-6)]


EVERY_SCHEME = [
    mbd.HHT(0.05), mbd.HHT(0.05, formulation="index3"), mbd.GeneralizedAlpha(0.7), mbd.Newmark(), mbd.RadauIIA(),
    mbd.RungeKutta853(), mbd.RungeKutta4(),
]  # fmt: skip


def wheel(seed):
    """A wheel without a rim on spokes, and an event 'touch' on the gap of the second one."""
    rng = np.random.default_rng(seed)
    spokes, length, slope = int(rng.integers(6, 11)), rng.uniform(0.5, 1.5), rng.uniform(0.08, 0.15)
    half = math.pi / spokes
    gain = 4.0 * G / length * math.sin(half) * math.sin(slope)
    model = mbd.Model("wheel", gravity=mbd.on_slope(slope))
    hub = mbd.RigidBody("hub", rng.uniform(0.5, 2.0), (0.0, 0.0, rng.uniform(0.01, 0.1)))
    model.connect(mbd.Planar("wheel", model.ground.origin, hub.origin))
    tips = [hub.point(length * math.sin(2 * half * k), -length * math.cos(2 * half * k)) for k in range(spokes)]
    for k, tip in enumerate(tips):
        model.constrain(mbd.Unilateral(f"spoke {k + 1}", mbd.touchdown(tip)))
    model.constrain(mbd.Event("touch", mbd.touchdown(tips[1]), direction=-1))
    speed = 1.2 * math.cos(2 * half) * math.sqrt(gain) / math.sin(2 * half)
    return model, mbd.assemble(
        model, closed="spoke 1", position={"wheel.angle": half}, velocity={"wheel.angle": -speed}
    )


@pytest.mark.parametrize("scheme", EVERY_SCHEME, ids=repr)
@pytest.mark.parametrize("seed", range(4))
def test_an_event_on_a_gap_happens_as_the_contact_closes_and_never_while_it_holds(seed, scheme):
    """Newton's method left 2e-13 m of the gap that is held, which a later step took away: an event."""
    model, start = wheel(seed)
    run = mbd.simulate(model, start, scheme, dt=10.0 ** np.random.default_rng(seed).uniform(-3.3, -2.3), until=1.6)
    closed = [event.time for event in run.events if (event.kind, event.name) == ("closed", "spoke 2")]
    assert closed and closed == [event.time for event in run.events if event.kind == "event"]


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA()], ids=repr)
def test_an_event_on_the_gap_of_a_contact_is_a_section_of_a_gait_as_the_contact_is(scheme):
    model, start = wheel(3)
    contact, event = (mbd.limit_cycle(model, start, scheme, dt=4e-3, section=name) for name in ("spoke 2", "touch"))
    assert event.period == pytest.approx(contact.period, rel=1e-9)
    np.testing.assert_allclose(event.multipliers, contact.multipliers, rtol=0, atol=1e-7)
