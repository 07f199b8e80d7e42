"""Penalty feet that may not pull do at no stored row, however long the steps are, whatever joints are cut."""

import numpy as np
import pytest

import mbd
from tests.fuzz.judge import judge
from tests.fuzz.scenes import scene
from tests.fuzz.verdict import run_of

SCHEMES = {
    "tolerance": (mbd.RungeKutta853(), "auto", [2, 9, 15, 18]),
    "long steps": (mbd.RadauIIA(), "auto", [4, 7]),
    "index 3": (mbd.HHT(0.05, formulation="index3"), "all", [2, 14, 20, 24]),
}
"""Schemes, joints that are cut, seeds."""
EXACT = 1e-9
"""Pull over the largest push of a run that is round-off [-]."""


def thrown(seed, cut):
    """A body with an arm above the ground, on two feet that open as they would pull."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("thrown", cut=cut)
    body = mbd.RigidBody("body", rng.uniform(0.5, 2.0), rng.uniform(0.02, 0.2))
    model.connect(mbd.Planar("flight", model.ground.origin, body.origin))
    arm = mbd.Link("arm", rng.uniform(0.3, 1.0), rng.uniform(0.3, 0.8), 0.2, 0.02)
    place, spring = body.point(rng.uniform(-0.2, 0.2), 0.1), rng.uniform(2.0, 20.0)
    model.connect(mbd.Revolute("hinge", place, arm.start, stiffness=spring, loss=mbd.Viscous(0.1)))
    for k, sole in enumerate((body.point(-0.3, -0.2), body.point(0.3, -0.2))):
        stiffness, damping = 10.0 ** rng.uniform(3.0, 4.5), rng.uniform(2.0, 20.0)
        model.constrain(mbd.Penalty(f"foot {k}", mbd.touchdown(sole), stiffness, damping=damping, release="pull"))
    places = "flight.y", "flight.angle", "hinge.angle"
    return model, dict(zip(places, rng.uniform([0.3, -0.5, -1.0], [0.5, 0.5, 1.0]), strict=True))


@pytest.mark.parametrize("kind", SCHEMES)
def test_no_penalty_pulls_that_opens_before(kind):
    scheme, cut, seeds = SCHEMES[kind]
    for seed in seeds:
        model, start = thrown(seed, cut)
        draw = np.random.default_rng(1000 + seed).random()
        pace = {"tol": 10.0 ** (-4.0 + 2.0 * draw)} if kind == "tolerance" else {"dt": 10.0 ** (-3.0 + 1.2 * draw)}
        run = mbd.simulate(model, mbd.assemble(model, position=start), scheme, until=1.0, **pace)
        forces = np.stack([run[f"foot {k}.force"] for k in range(2)])
        assert np.max(forces) > 1.0, seed
        assert np.min(forces) >= -EXACT * np.max(forces), seed


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_a_pad_from_which_an_impact_throws_a_body_opens_as_it_happens(scheme, contact):
    model, body = mbd.Model("pad and wall"), mbd.PointMass("body", 1.0)
    model.connect(mbd.Translation("flight", model.ground.origin, body.origin))
    model.constrain(mbd.Penalty("pad", mbd.touchdown(body.origin), 500.0, 40.0, release="pull"))
    wall = mbd.touchdown(body.origin, mbd.Plane((-0.6, 0.8), offset=-0.1))
    model.constrain(mbd.Unilateral("wall", wall, restitution=0.7, friction=0.0))
    velocity = {"flight.x": 8.0, "flight.y": -1.0}
    start = mbd.assemble(model, {"flight.x": -0.2, "flight.y": -0.001}, velocity, closed="pad")
    how, name, step = {"dt": 2e-3, "until": 0.07, "contact": contact}, "pad.damping", 1e-3
    run = mbd.simulate(model, start, scheme, **how)
    assert [(event.name, event.row) for event in run.events] == [(name, run.events[0].row) for name in ("wall", "pad")]
    assert np.min(run["pad.force"]) >= 0.0
    if contact == "events":
        rate = mbd.sensitivities(model, start, scheme, wrt=[name], of=["flight.y"], **how).matrix[0, 0]
        ends = [mbd.simulate(model, start, scheme, parameters={name: 40.0 + d}, **how) for d in (-step, step)]
        assert rate == pytest.approx((ends[1].final.q[1] - ends[0].final.q[1]) / (2.0 * step), rel=1e-5)


@pytest.mark.parametrize("number", [10524, 10858, 23384])
def test_fuzzed_feet_do_not_pull_just_before_they_open(number):
    made = scene(number)
    run = run_of(made)
    faults = judge(run, made.model, made.parameters).faults
    assert not faults, list(map(str, faults))


def backlash(seed):
    """A rotor that rattles in the dead band of a load, by meshes that release as they would pull, in any unit."""
    rng = np.random.default_rng(seed)
    unit = 10.0 ** rng.uniform(-3.0, 3.0)
    damping, stiffness = unit * 10.0 ** rng.uniform(-0.6, 0.0), unit * 10.0 ** rng.uniform(3.0, 3.7)
    model = mbd.Model("backlash", gravity=(0, 0, 0))
    rotor = mbd.RigidBody("rotor", 0.1 * unit, (0.001 * unit,) * 3)
    load = mbd.RigidBody("load", 0.1 * unit, (0.05 * unit,) * 3)
    gap = mbd.Revolute("gap", load.origin, rotor.origin)
    model.connect(mbd.Revolute("out", model.ground.origin, load.origin, loss=mbd.Viscous(0.02 * unit)), gap)
    law = {"stiffness": stiffness, "damping": damping, "release": "pull"}
    model.constrain(mbd.Penalty("lower", mbd.extension(gap, -0.02), **law))
    model.constrain(mbd.Penalty("upper", mbd.flexion(gap, -0.02), **law))
    motor = mbd.Applied("motor", rotor.origin, torque=lambda t: (0.0, 0.0, 0.3 * unit * mbd.sin(20 * t)))
    model.apply(motor)
    return model


@pytest.mark.parametrize("tol", [1e-5, 1e-7, 1e-8])
def test_meshes_that_release_as_they_would_pull_rattle_as_often_with_any_step(tol):
    for seed in range(4):
        model = backlash(seed)
        start = mbd.assemble(model)
        runs = [
            mbd.simulate(model, start, scheme, until=0.3, **step)
            for scheme, step in ((mbd.RungeKutta853(), {"tol": tol}), (mbd.RungeKutta853(), {"dt": 1e-4}))
        ]
        names = [[(event.name, event.kind) for event in run.events] for run in runs]
        assert names[0] == names[1] and len(names[0]) > 3, seed
        times = [[event.time for event in run.events] for run in runs]
        np.testing.assert_allclose(*times, atol=200.0 * tol)  # what a place errs by, over a slow closing speed
        assert runs[0]["out.angle"][-1] == pytest.approx(runs[1]["out.angle"][-1], abs=20.0 * tol)
