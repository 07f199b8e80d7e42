"""Multipliers of the first steps of index 3: told where they are off, by about as much as they are."""

import re

import numpy as np
import pytest

import mbd


def driven(amplitude: float, omega: float) -> tuple[mbd.Model, mbd.State]:
    """A rod whose hinge is driven by a sine from its middle."""
    model = mbd.Model("driven rod")
    rod = mbd.Link("rod", mass=1.5, length=0.4, center=0.2, inertia=0.02)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start)
    model.connect(hinge)
    model.constrain(mbd.Bilateral("drive", hinge, value=lambda t: amplitude * mbd.sin(omega * t)))
    return model, mbd.assemble(model)


def off(run: mbd.Trajectory, amplitude: float, omega: float) -> float:
    """The largest error of the torque, over its largest value."""
    q = amplitude * np.sin(omega * run.time)
    exact = -(0.02 + 1.5 * 0.2**2) * omega**2 * q + 1.5 * 9.81 * 0.2 * np.sin(q)
    return float(np.max(np.abs(run["drive.torque"] - exact)) / np.max(np.abs(run["drive.torque"])))


@pytest.mark.parametrize("scheme", [mbd.GeneralizedAlpha, mbd.HHT])
@pytest.mark.parametrize(("amplitude", "omega"), [(0.5, 9.0), (0.2, 20.0)])
@pytest.mark.parametrize("dt", [1e-2, 2e-3, 1e-4])
def test_multipliers_of_index_3_that_are_off_are_told_with_their_error(scheme, amplitude, omega, dt):
    model, start = driven(amplitude, omega)
    for formulation in ("index3", "ggl"):
        run = mbd.simulate(model, start, scheme(formulation=formulation), dt=dt, until=0.4)
        told = [note for note in run.stats["notes"] if "multipliers of the first steps" in note]
        error = off(run, amplitude, omega)
        assert bool(told) == (error > 0.02) or 0.01 < error < 0.04
        if told:
            share = float(re.search(r"by (\d+) %", told[0])[1]) / 100.0
            assert "'drive'" in told[0] and share == pytest.approx(error, rel=0.5, abs=0.01)


@pytest.mark.parametrize("dt", [3e-7, 1e-6, 3e-6, 1e-5, 1e-4])
def test_multipliers_that_are_round_off_of_positions_over_tiny_steps_are_told(dt):
    """A pendulum by rows on positions, in place of a joint: its tension errs by ε over dt²."""
    model = mbd.Model("pendulum", cut="all")
    bob = mbd.RigidBody("bob", 1.0, 0.1)
    model.connect(mbd.Revolute("hinge", model.ground.point(0.3, 0.2), bob.point(0.1, 0.9)))
    start = mbd.assemble(model, {"hinge.angle": 0.7})
    run = mbd.simulate(model, start, mbd.HHT(0.3, formulation="index3"), dt=dt, until=20 * dt)
    told = [note for note in run.stats["notes"] if "takes round-off of positions" in note]
    ggl = mbd.simulate(model, start, mbd.HHT(0.3), dt=dt, until=20 * dt)
    force, exact = run["hinge.reaction_force"][1:], ggl["hinge.reaction_force"][1:]
    error = float(np.max(np.abs(force - exact)) / np.max(np.abs(exact)))
    assert bool(told) == (error > 1e-3)
