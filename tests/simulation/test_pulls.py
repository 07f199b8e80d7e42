"""No contact pulls that may not: in rows, in impulses, by its friction; what a rule lets pull is reported."""

import numpy as np
import pytest

import mbd
from mbd.kernel.events.handling import same_instant
from mbd.kernel.records import Kernel
from tests.helpers import one_body
from tests.simulation.judging import complaints
from tests.simulation.wild import wild_scene

SCHEMES = [mbd.HHT(), mbd.Newmark(), mbd.GeneralizedAlpha(0.8), mbd.HHT(0.1, formulation="index3"), mbd.RadauIIA(),
           mbd.RungeKutta853()]  # fmt: skip
NAMES = [f"{type(scheme).__name__}-{k}" for k, scheme in enumerate(SCHEMES)]
WILD = [21, 40, 84, 109, 113, 261, 370, pytest.param(372, marks=pytest.mark.slow), 711]
"""Scenes of 1400 whose closed contacts pulled, or had impulses that did, before consistent multipliers were asked."""


def rider(rule=None, friction=0.3, hill=lambda x: -0.5 * x * x):
    """A point on a hill, held there by a rule that waits for a contact which never closes."""
    model = mbd.Model("rider")
    point, cart = mbd.PointMass("point", mass=1.0), mbd.PointMass("cart", mass=1.0)
    model.connect(
        mbd.Translation("place", model.ground.origin, point.origin),
        mbd.Prismatic("rail", model.ground.origin, cart.origin),
    )
    model.constrain(
        mbd.Unilateral("stop", mbd.measure(lambda x: 1.0 - x, "rail.displacement"), friction=0.0),
        mbd.Unilateral("foot", mbd.touchdown(point.origin, hill), friction=friction, release=rule),
    )
    return model


def ridden(model, scheme, speed, dt=1e-3, until=0.05, **more):
    start = mbd.assemble(model, position={"place.x": 0.1}, velocity={"place.x": speed}, closed="foot")
    return mbd.simulate(model, start, scheme, dt=dt, until=until, **more)


@pytest.mark.covering
@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_friction_of_a_foot_that_pulls_takes_no_energy_and_gives_none(scheme, contact):
    rng = np.random.default_rng(7)
    model = rider(mbd.When("stop"))
    for speed in rng.uniform(4.0, 12.0, 3):
        run = ridden(model, scheme, speed, contact=contact)
        pulls = run["foot.force"] < 0.0
        assert pulls.any()
        assert not run["foot.friction"][pulls].any()
        assert np.max(run["foot.friction"] * run["place.x.rate"]) <= 0.0
        assert np.max(run.energy.total - run.energy.total[0]) < 1e-4 * run.energy.total[0]
        (note,) = run.stats["notes"]
        assert f"'foot' pulled with up to {-np.min(run['foot.force']):.3g} N" in note


def test_the_note_tells_the_impulse_and_the_time_of_a_pull():
    run = ridden(rider(mbd.When("stop"), friction=0.0), mbd.HHT(), 10.0)
    impulse = np.trapezoid(-run["foot.force"], run.time)
    (note,) = run.stats["notes"]
    assert f"{impulse:.3g} N s in all from 0 to 0.05 s" in note
    assert ridden(rider(mbd.When("stop", may_pull=True)), mbd.HHT(), 10.0).stats["notes"] == []


@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_with_a_rule_that_forbids_to_pull_a_foot_leaves_as_one_without_a_rule(scheme):
    rules = mbd.When("stop", may_pull=False), None
    runs = [ridden(rider(rule, hill=lambda x: -(x**4)), scheme, 3.0, until=0.3) for rule in rules]
    assert [(event.kind, event.time) for event in runs[0].events] == [(e.kind, e.time) for e in runs[1].events]
    assert runs[0].events[0].kind == "opened"
    assert np.array_equal(runs[0].record.q, runs[1].record.q)


def test_a_foot_that_may_not_pull_still_opens_as_the_other_closes():
    model = rider(mbd.When("stop", may_pull=False), friction=0.0, hill=lambda x: 0.5 * x * x)  # a valley holds it
    start = mbd.assemble(
        model,
        position={"rail.displacement": 0.9},
        velocity={"place.x": 0.1, "rail.displacement.rate": 1.0},
        closed="foot",
    )
    run = mbd.simulate(model, start, dt=1e-2, until=0.2)
    assert [(event.name, event.kind) for event in run.events] == [("foot", "opened"), ("stop", "closed")]
    with pytest.raises(mbd.ModelError, match="may_pull of When"):
        mbd.When("stop", may_pull="never")


def test_one_rule_that_forbids_to_pull_is_enough():
    rules = (mbd.When("stop"), mbd.When("stop", after_impact=True, may_pull=False))
    assert [event.kind for event in ridden(rider(rules), mbd.HHT(), 10.0).events] == ["opened"]


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", WILD)
def test_no_row_and_no_impulse_of_a_wild_scene_pulls(seed):
    assert complaints(wild_scene(seed, interpreted=()).run()) == []


@pytest.mark.covering
@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_no_contact_pulls_at_any_step(scheme, contact):
    """A point thrown onto waves leaves, lands and slides with steps of up to a wave each."""
    model, point = one_body(mbd.PointMass("point", mass=1.0), mbd.Translation, "place", title="waves")
    waves = mbd.touchdown(point.origin, lambda x: 0.02 * mbd.cos(6.0 * x))
    model.constrain(mbd.Unilateral("foot", waves, friction=0.1))
    rng = np.random.default_rng(3)
    for dt in 10.0 ** rng.uniform(-3.5, -1.0, 6):
        start = mbd.assemble(model, position={"place.y": 0.2}, velocity={"place.x": rng.uniform(0.5, 3.0)})
        run = mbd.simulate(model, start, scheme, dt=dt, until=min(100 * dt, 2.0), contact=contact, on_failure="return")
        assert complaints(run) == []


# as many switches as there is to switch -----------------------------------------------------------------------------
@pytest.mark.covering
@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA()], ids=["HHT", "RadauIIA"])
def test_any_number_of_frictions_may_switch_at_one_instant(scheme, contact):
    model = mbd.Model("sliders", gravity=(0.0, 0.0, 0.0))
    for k in range(25):
        slider = mbd.PointMass(f"slider {k}", mass=1.0)
        rail = mbd.Prismatic(f"rail {k}", model.ground.origin, slider.origin, loss=mbd.Coulomb(1.0))
        model.connect(rail)
        model.apply(mbd.Motor(f"motor {k}", rail, lambda t: 3.0 * mbd.sin(20.0 * t)))
    run = mbd.simulate(model, mbd.assemble(model), scheme, dt=1e-2, until=0.05, contact=contact)
    assert [event.kind for event in run.events] == ["slipped"] * 25


@pytest.mark.parametrize("at_start", [False, True])
@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA()], ids=["HHT", "RadauIIA"])
def test_any_number_of_events_may_happen_at_one_instant(scheme, at_start):
    model, _ = one_body(mbd.PointMass("point", mass=1.0), mbd.Prismatic, "fall", axis=(0, 1, 0))
    for k in range(30):
        model.constrain(mbd.Event(f"event {k}", mbd.measure(lambda y: y - 0.5, "fall.displacement")))
    start = mbd.assemble(model, position={"fall.displacement": 0.5 if at_start else 1.0})
    run = mbd.simulate(model, start, scheme, dt=1e-2, until=0.5, contact="nonsmooth")
    assert len(run.events) == (0 if at_start else 30)


def instants(states, limit=100):
    """After how many switches of one instant, each with the next of some states, there were too many; None: never."""
    kernel = Kernel(
        clock=np.zeros(20), state=np.zeros(40, dtype=int), seen=np.zeros(20), closed=[0], armed=[1], sticks=[0],
        slip=[0.0], side=[1.0], q=[0.0], y=np.zeros(1), dt=1.0, max_switches=limit, n_contacts=1, n_frictions=1,
        n_guards=1, n_q=1, n=1,
    )  # fmt: skip
    for count, state in enumerate(states):
        kernel.closed[0], kernel.y[0] = state
        if same_instant(kernel):
            return count
    return None


@pytest.mark.parametrize("length", [1, 2, 3, 7])
def test_switches_that_come_back_are_found_before_there_are_too_many(length):
    cycle = [(k % 2, float(k)) for k in range(length)]
    assert instants([*[(0, -1.0 - k) for k in range(5)], *cycle * 40]) < 100 - 20
    assert instants([(k % 2, 0.5**k) for k in range(100)]) is None  # impacts that become slower come to an end
    assert instants([(k % 2, 0.5**k) for k in range(200)]) == 100


def stopped_chain(rng):
    """Three bodies on ball joints, each within a cone and two stops of twist, thrown about."""
    model, last, speeds = mbd.Model("chain"), None, {}
    last = model.ground.origin
    for k in range(3):
        body = mbd.RigidBody(f"body {k}", rng.uniform(0.5, 4.0), tuple(rng.uniform(0.03, 0.05, 3)))
        ball = mbd.Spherical(f"ball {k}", last, body.point(0.0, rng.uniform(0.2, 0.5), 0.0))
        model.connect(ball)
        limits = rng.uniform(0.3, 0.9, 3)
        stops = {
            "cone": mbd.cone(ball, limits[0]),
            "more": mbd.twist(ball, limits[1]),
            "less": mbd.twist(ball, -limits[2]),
        }
        for name, measure in stops.items():
            model.constrain(mbd.Unilateral(f"{name} {k}", measure, restitution=rng.choice([0.0, 0.5])))
        speeds |= {
            f"ball {k}.angular_velocity.{axis}": speed
            for axis, speed in zip("xyz", 4.0 * rng.normal(size=3), strict=True)
        }
        last = body.point(0.0, -rng.uniform(0.1, 0.4), 0.0)
    return model, mbd.assemble(model, velocity=speeds)


@pytest.mark.parametrize("seeds", [(9, 12), pytest.param(range(60), marks=pytest.mark.slow)])
def test_no_stop_of_a_chain_pulls_in_non_smooth_steps_however_long(seeds):
    for seed in seeds:
        rng = np.random.default_rng(seed)
        model, start = stopped_chain(rng)
        dt = rng.uniform(0.004, 0.02)
        run = mbd.simulate(
            model, start, SCHEMES[seed % 6], dt=dt, until=1.0, contact="nonsmooth", on_failure="return",
        )  # fmt: skip
        forces = np.array([run[f"{each.name}.force"] for each in model.constraints])
        assert np.min(forces) >= -1e-9 * np.max(forces), seed
