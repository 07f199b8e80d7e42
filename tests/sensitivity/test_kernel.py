"""The pass over rows has the derivatives of the kernel's own trees, and is the same compiled and interpreted."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from mbd.sensitivity.run_data import unknown
from mbd.sensitivity.walk import Walk
from mbd.testing.mechanisms import random_loop, random_scene
from tests.simulation.mechanisms import pendulum

CLOSE = {"tolerance": 1e-12}
SCHEMES = (
    mbd.HHT(alpha=0.05, **CLOSE), mbd.GeneralizedAlpha(0.7, **CLOSE), mbd.HHT(0.1, formulation="index3", **CLOSE),
    mbd.Newmark(start="consistent", **CLOSE), mbd.RungeKutta853(), mbd.RadauIIA(**CLOSE), mbd.RungeKutta4(),
)  # fmt: skip


def whole(*given):
    raise unknown("left to the kernel with derivatives")


def both(monkeypatch, run, names):
    """Of the pass over rows, and of the kernel with derivatives (`mbd.sensitivity.tangent`)."""
    found = np.vstack(final_state_derivative(run, names))
    with monkeypatch.context() as alone:
        alone.setattr(Walk, "whole", whole)
        return found, np.vstack(final_state_derivative(run, names))


def test_steps_of_random_scenes(monkeypatch):
    """With contacts that close, hold and slide; directions of the start and of parameters."""
    compared = 0
    for seed in range(12):
        model, scheme = random_scene(seed, bodies=2), SCHEMES[seed % len(SCHEMES)]
        try:
            start = mbd.assemble(model)
            run = mbd.simulate(model, start, scheme, dt=5e-3, until=0.4)
            names = [*start.names, *run.record.parameter_names[:6]]
            found, wanted = both(monkeypatch, run, names)
        except (mbd.SimulationError, mbd.AssemblyError, mbd.CapabilityError):
            continue  # a scene without a run, or a run without derivatives
        compared += 1
        assert found == pytest.approx(wanted, rel=1e-7, abs=1e-8 * np.max(np.abs(wanted))), (seed, scheme)
    assert compared >= 6


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_steps_of_closed_loops(scheme, monkeypatch):
    model, place = random_loop(2)
    run = mbd.simulate(model, mbd.assemble(model, place, project=True), scheme, dt=0.01, until=0.2)
    found, wanted = both(monkeypatch, run, ["bar 1.mass", "hinge 1.angle", "bar 2.length"])
    assert found == pytest.approx(wanted, rel=1e-7, abs=1e-8 * np.max(np.abs(wanted)))


@pytest.mark.parametrize("scheme", [SCHEMES[0], *SCHEMES[4:]], ids=repr)
def test_interpreted_as_compiled(scheme):
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    found = [
        np.vstack(
            final_state_derivative(
                mbd.simulate(model, start, scheme, dt=0.05, until=0.5, backend=backend), ["hinge.angle", "rod.center"]
            )
        )
        for backend in ("llvm", "python")
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-12)
