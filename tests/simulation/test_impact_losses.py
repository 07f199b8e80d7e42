"""Events of an impact tell the energy that it took; contacts with a rule in every law; index 3 beside an impact."""

from functools import cache

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start
from tests.simulation.wild import wild_scene


@cache
def folding(order=(0, 1), friction=0.4, loss=None):
    """Two bars hinged with friction that stand on one foot; the far ends of both come down together."""
    model = mbd.Model("folding")
    body = mbd.RigidBody("body", mass=1.0, inertia=0.1)
    arms = [mbd.Link(f"arm {side}", mass=0.5, length=0.4, center=0.2, inertia=0.02) for side in ("left", "right")]
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    for k, arm in enumerate(arms):
        model.connect(mbd.Revolute(f"hinge {k}", body.point(0.3 * (2 * k - 1), 0.0), arm.start, loss=loss))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.point(0.0, -0.1)), friction=friction))
    model.constrain(*(mbd.Unilateral(f"hand {k}", mbd.touchdown(arms[k].end), friction=friction) for k in order))
    return model


def folded(model, law, contact):
    """From the foot on the ground, moving on, the arms falling at the same angle from the vertical to either side."""
    angle = 0.5 * np.pi - 0.1
    start = mbd.assemble(
        model, position={"place.y": 0.1, "hinge 0.angle": -angle, "hinge 1.angle": angle},
        velocity={"place.x": 0.5, "hinge 0.rate": 4.0, "hinge 1.rate": -4.0}, closed="foot", open=["hand 0", "hand 1"],
    )  # fmt: skip
    return mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.3, impact=law, contact=contact)


@pytest.mark.covering
@pytest.mark.parametrize("law", ["newton", "poisson", "sequential"])
@pytest.mark.parametrize(
    ("loss", "contact"), [(None, "events"), (None, "nonsmooth"), (mbd.PinFriction(0.4, 0.05), "events")], ids=repr
)
def test_events_tell_all_that_an_impact_took_with_pins_and_a_foot_that_rub(law, loss, contact):
    """Not with rows of pins in non-smooth steps: lifting positions out of the ground leaves ḣ of O(dt) in these."""
    told = []
    for order in (0, 1), (1, 0):
        run = folded(folding(order, loss=loss), law, contact)
        rows = sorted({event.row for event in run.events if event.impulse.any()})
        assert rows
        for row in rows:
            lost = run.energy.kinetic[row - 1] - run.energy.kinetic[row]
            losses = [event.energy_loss for event in run.events if event.row == row]
            # the force in a pin is rounded below 1e-9 N, its friction below 2e-11 N m
            assert sum(losses) == pytest.approx(lost, rel=1e-9, abs=2e-10)
        told.append(sorted((event.name, round(event.energy_loss, 9)) for event in run.events if event.row == rows[0]))
    assert told[0] == told[1]


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
def test_feet_and_locks_with_a_rule_strike_in_the_sequential_law_as_in_newtons(contact):
    model = kneed_walker()
    start = kneed_walker_start(model)
    runs = [
        mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.8, impact=law, contact=contact)
        for law in ("newton", "sequential")
    ]
    told = [[(event.name, event.kind, round(event.time, 9)) for event in run.events] for run in runs]
    assert told[0] == told[1] and any(event.impulse.any() for event in runs[0].events)
    np.testing.assert_allclose(runs[0].final.v, runs[1].final.v, rtol=1e-9, atol=1e-12)


def test_no_stored_force_pulls_where_multipliers_of_index_3_ring():
    scene = wild_scene(88)
    assert "index3" in repr(scene.integrator) and scene.options["contact"] == "nonsmooth"
    run = scene.run()
    assert any(event.impulse.any() for event in run.events)
    assert np.min(run["corner 0.force"]) >= 0.0


@cache
def strut(space, beside=""):
    """A bar hangs from a pin and comes down on a foot, on its way to the vertical, at an angle of arccos 0.9.

    A ball falls beside it, which a thread may join to the bar.
    """
    model = mbd.Model("strut")
    bar = mbd.RigidBody("bar", 2.0, (0.2, 0.25, 0.3) if space else 0.3)
    pin = mbd.Revolute("pin", model.ground.point(0.1, 0.9), bar.point(0.0, 0.4), axis=(0.6, 0.0, 0.8) if space else "z")
    model.connect(pin)
    floor = mbd.Plane(normal=(0.0, 1.0, 0.0)) if space else None
    foot = mbd.touchdown(bar.point(0.0, -0.6), floor)
    model.constrain(mbd.Unilateral("foot", foot, restitution=0.5, friction=1.0))
    if beside:
        ball = mbd.PointMass("ball", 0.3)
        model.connect(mbd.Translation("fall", model.ground.origin, ball.origin))
        model.constrain(mbd.Unilateral("floor", mbd.touchdown(ball.origin), restitution=0.6))
    if beside == "joined":
        model.apply(mbd.Spring("thread", bar.origin, ball.origin, 1e-9))
    return model


@pytest.mark.parametrize("beside", ["apart", "joined"])
@pytest.mark.parametrize("law", ["newton", "poisson", "sequential"])
def test_a_ball_beside_a_strut_that_jams_gets_nothing_of_its_work(law, beside):
    given = {"position": {"pin.angle": 0.5}, "velocity": {"pin.rate": -2.0}}
    how = {"dt": 1e-3, "until": 0.03, "impact": law}
    alone = mbd.simulate(strut(False), mbd.assemble(strut(False), **given), mbd.RungeKutta853(), **how)
    given["position"] = {"pin.angle": 0.5, "fall.x": 1.0, "fall.y": 0.5 * 9.81 * alone.events[0].time ** 2}
    model = strut(False, beside)
    run = mbd.simulate(model, mbd.assemble(model, **given), mbd.RungeKutta853(), **how)
    struck = {event.name: event for event in reversed(run.events)}
    assert struck["floor"].time == struck["foot"].time and struck["floor"].row == struck["foot"].row
    assert struck["floor"].impulse[0] == pytest.approx(0.3 * 1.6 * 9.81 * alone.events[0].time, rel=1e-9)
    assert struck["foot"].impulse == pytest.approx(alone.events[0].impulse, rel=1e-9)


@pytest.mark.parametrize(("space", "contact"), [(False, "events"), (False, "nonsmooth"), (True, "nonsmooth")])
@pytest.mark.parametrize("law", ["newton", "poisson", "sequential"])
def test_a_strut_that_friction_jams_stops_with_finite_impulses_and_forces_in_the_cone(space, law, contact):
    rng = np.random.default_rng(5)
    for scheme in (mbd.HHT(0.05), mbd.GeneralizedAlpha(0.7, formulation="index3")):
        values, rate = {"foot.mu": np.tan(np.arccos(0.9)) * rng.uniform(1.02, 3.0)}, rng.uniform(0.5, 4.0)
        start = mbd.assemble(strut(space), position={"pin.angle": 0.5}, velocity={"pin.rate": -rate}, parameters=values)
        how = {"dt": 4e-3, "until": rng.uniform(0.13, 0.17), "contact": contact, "impact": law}
        run = mbd.simulate(strut(space), start, scheme, parameters=values, **how)
        lost, row = run.energy.kinetic[run.events[0].row - 1], run.events[0].row
        assert sum(event.energy_loss for event in run.events) == pytest.approx(lost, rel=1e-9)
        # by the moment of momentum about the pin, of what pushes alone
        assert 0.0 < run.events[0].impulse[0] < 2.0 * np.sqrt(2.0 * lost / 0.62) * 0.62 / np.sqrt(0.19)
        assert np.all(run.energy.kinetic[row:] < 1e-24)
        parts = ["friction.forward", "friction.sideways"] if space else ["friction"]
        pull = np.linalg.norm([run[f"foot.{part}"] for part in parts], axis=0)
        assert np.all(pull <= values["foot.mu"] * run["foot.force"] * (1.0 + 1e-9))
        assert run["foot.force"][-1] > 1.0
