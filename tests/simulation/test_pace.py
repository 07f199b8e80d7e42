"""Runs whose steps follow their error end by name where they get no further."""

import pytest

import mbd
from mbd.simulation.run import pace


def spinning_up(power: float) -> tuple[mbd.Model, mbd.State]:
    """A wheel on which a torque acts that grows without bound towards t = 1 s."""
    model, wheel = mbd.Model("wheel"), mbd.RigidBody("wheel", 1.0, 1.0)
    axle = mbd.Revolute("axle", model.ground.origin, wheel.origin)
    model.connect(axle)
    model.apply(mbd.Motor("motor", axle, torque=lambda t: (1.0 - t) ** -power, arguments=["t"]))
    return model, mbd.assemble(model)


def test_a_run_that_needs_a_billion_steps_ends_by_name(monkeypatch):
    """A frictionless coin that came to lie flat took 1.8 million steps of 1e-10 s, with no end."""
    monkeypatch.setattr(pace, "LOOK_STEPS", 20)
    model, start = spinning_up(3.0)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=1.0, on_failure="return")
    assert not run.success
    assert "steps have taken the run" in run.message and 0.99 < run.final.time < 1.0
    assert run["axle.rate"][-1] == pytest.approx(0.5 * (1.0 - run.final.time) ** -2.0 - 0.5, rel=1e-6)


def test_a_run_whose_steps_become_short_for_a_while_goes_on(monkeypatch):
    monkeypatch.setattr(pace, "LOOK_STEPS", 20)
    model, start = spinning_up(0.5)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=0.999)
    assert run["axle.rate"][-1] == pytest.approx(2.0 - 2.0 * 0.001**0.5, rel=1e-7)
