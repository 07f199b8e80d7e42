"""The kernel of derivatives takes the same steps as numpy does one by one, compiled and interpreted."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.sensitivity import newmark_rows, radau, runge_kutta
from mbd.sensitivity.derivative import final_state_derivative
from mbd.testing.mechanisms import random_loop, random_scene
from tests.simulation.mechanisms import pendulum

SCHEMES = (
    mbd.HHT(alpha=0.05), mbd.GeneralizedAlpha(0.7), mbd.HHT(0.1, formulation="index3"),
    mbd.Newmark(start="consistent"), mbd.RungeKutta853(),
    mbd.RadauIIA(tolerance=1e-12), mbd.RungeKutta4(),
)  # fmt: skip


def one_by_one(monkeypatch):
    """From now on numpy takes every step."""
    for steps in (newmark_rows, radau, runge_kutta):
        monkeypatch.setattr(steps, "taken", lambda owner, motion, memory, *_: (0, motion, memory))


def both(monkeypatch, run, names):
    with monkeypatch.context() as alone:
        one_by_one(alone)
        wanted = np.vstack(final_state_derivative(run, names))
    return np.vstack(final_state_derivative(run, names)), wanted


@pytest.mark.parametrize("seed", range(12))
def test_steps_of_random_scenes(seed, monkeypatch):
    """With contacts that close, hold and slide; directions of the start and of parameters."""
    model, scheme = random_scene(seed, bodies=2), SCHEMES[seed % len(SCHEMES)]
    try:
        start = mbd.assemble(model)
        run = mbd.simulate(model, start, scheme, dt=5e-3, until=0.4)
        names = [*start.names, *run.record.parameter_names[:6]]
        found, wanted = both(monkeypatch, run, names)
    except (mbd.SimulationError, mbd.AssemblyError, mbd.CapabilityError):
        return  # a scene without a run, or a run without derivatives
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-11 * np.max(np.abs(wanted)))


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_steps_of_closed_loops(scheme, monkeypatch):
    model, place = random_loop(2)
    run = mbd.simulate(model, mbd.assemble(model, place, project=True), scheme, dt=0.01, until=0.2)
    found, wanted = both(monkeypatch, run, ["bar 1.mass", "hinge 1.angle", "bar 2.length"])
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-11 * np.max(np.abs(wanted)))


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
