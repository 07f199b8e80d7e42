"""Impacts of penalty contacts take the steps that they need: nothing passive gains energy, whatever dt."""

import functools

import numpy as np
import pytest

import mbd
from mbd.kernel.stepping import contact_step

SCHEMES = [mbd.HHT(), mbd.HHT(0.3), mbd.Newmark(), mbd.GeneralizedAlpha(0.5), mbd.HHT(0.1, formulation="index3"),
           mbd.RadauIIA(), mbd.RungeKutta853()]  # fmt: skip
NAMES = [f"{type(scheme).__name__}-{k}" for k, scheme in enumerate(SCHEMES)]
LAWS = [{}, {"exponent": 1.5}, {"damping": 30.0, "release": "pull"}, {"exponent": 1.5, "restitution": 0.7}]


@functools.cache
def rod(**law):
    """A rod that falls on two mats with its ends, one of them on an arm that turns on a hinge."""
    model = mbd.Model("rod")
    body, arm = mbd.RigidBody("rod", mass=1.5, inertia=0.1), mbd.Link("arm", mass=0.5, length=0.4, center=0.2)
    hinge = mbd.Revolute("hinge", body.point(0.4, 0.0), arm.start)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin), hinge)
    for name, point in ("left", body.point(-0.4, 0.0)), ("right", arm.end):
        model.constrain(mbd.Penalty(name, mbd.height(point), stiffness=1e4, **law))
    return model


@pytest.mark.covering
@pytest.mark.parametrize("law", LAWS, ids=str)
@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_nothing_passive_gains_in_blows_whatever_the_step(scheme, law):
    model, rng = rod(**law), np.random.default_rng(5)
    for dt in 10.0 ** rng.uniform(-3.0, -1.0, 3):
        stiffness = 10.0 ** rng.uniform(3.0, 8.0)
        parameters = {f"{name}.stiffness": stiffness for name in ("left", "right")}
        position = {"place.y": 0.7, "place.angle": rng.uniform(-0.4, 0.4)}
        start = mbd.assemble(model, position=position, velocity={"hinge.angle": rng.uniform(-2.0, 2.0)})
        run = mbd.simulate(model, start, scheme, dt=dt, until=0.4, parameters=parameters, on_failure="return")
        assert run.success or "'" in run.message
        total, acts = run.energy.total, run.record.closed.any(axis=1)
        began = np.flatnonzero(~acts[:-1] & acts[1:])
        assert len(began)
        for row in began:  # of free flight steps of dt make what they make
            ends = row + 1 + np.flatnonzero(~acts[row + 1 :])
            if len(ends):
                assert total[ends[0]] - total[row] < 2e-3 * run.energy.kinetic[row]


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_a_blow_gives_back_what_its_law_says_whatever_the_step(scheme, contact):
    model = mbd.Model("mat", gravity=(0.0, 0.0, 0.0))
    ball = mbd.PointMass("ball", mass=2.0)
    model.connect(mbd.Translation("flight", model.ground.origin, ball.origin, axes="y"))
    model.constrain(mbd.Penalty("mat", mbd.height(ball.origin), stiffness=1e6, exponent=1.5, restitution=0.8))
    for steps in 8.0, 1.5, 0.3, 1e-3:  # in the time of the impact, some 2.5 ms
        dt = 2.5e-3 / steps
        start = mbd.assemble(model, position={"flight.y": 1.37 * dt}, velocity={"flight.y": -1.0})
        run = mbd.simulate(model, start, scheme, dt=dt, until=4.0 * dt + 0.02, contact=contact)
        assert run["flight.y.rate"][-1] == pytest.approx(0.8, abs=0.01)


def test_steps_become_long_again_where_a_contact_rests():
    model = mbd.Model("mat")
    ball = mbd.PointMass("ball", mass=2.0)
    model.connect(mbd.Translation("flight", model.ground.origin, ball.origin, axes="y"))
    model.constrain(mbd.Penalty("mat", mbd.height(ball.origin), stiffness=1e6, damping=600.0))
    start = mbd.assemble(model, position={"flight.y": 1e-3})
    run = mbd.simulate(model, start, dt=0.05, until=20.0)
    assert run["mat.force"][-1] == pytest.approx(2.0 * 9.81, rel=1e-6)
    assert run.stats["steps"] < 20.0 / 0.05 + 40 * contact_step.WINDOW_STEPS


def test_a_contact_far_too_stiff_for_the_step_is_refused_by_name():
    model = rod()
    start = mbd.assemble(model, position={"place.y": 0.7})
    with pytest.raises(mbd.SimulationError, match=r"'(left|right)' is so stiff that its impact .*softer stiffness"):
        mbd.simulate(model, start, dt=1e-2, until=1.0, parameters={"left.stiffness": 1e22, "right.stiffness": 1e22})


def test_a_resolved_blow_keeps_the_steps_of_the_run():
    model = rod()
    start = mbd.assemble(model, position={"place.y": 0.42})
    run = mbd.simulate(model, start, dt=1e-3, until=0.1)
    assert run.stats["notes"] == [] and np.max(np.diff(run.time)) == pytest.approx(1e-3)


def test_without_shorter_steps_a_blow_would_lose_energy_that_its_law_gives_back(monkeypatch):
    """What the law above guards against, in the kernel as it runs interpreted."""
    model = mbd.Model("mat", gravity=(0.0, 0.0, 0.0))
    ball = mbd.PointMass("ball", mass=2.0)
    model.connect(mbd.Translation("flight", model.ground.origin, ball.origin, axes="y"))
    model.constrain(mbd.Penalty("mat", mbd.height(ball.origin), stiffness=2e4))
    start = mbd.assemble(model, position={"flight.y": 0.01}, velocity={"flight.y": -1.0})

    def backs():
        runs = [
            mbd.simulate(model, start, mbd.HHT(0.3), dt=dt, until=0.3, backend="python") for dt in (1e-2, 2e-2, 5e-2)
        ]
        return np.array([run["flight.y.rate"][-1] for run in runs])

    assert np.all(np.abs(backs() - 1.0) < 0.01)
    monkeypatch.setattr(contact_step, "pace_of", lambda K, c: K.dt)
    assert np.max(np.abs(backs() - 1.0)) > 0.1
