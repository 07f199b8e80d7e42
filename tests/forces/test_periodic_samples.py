"""Signals that repeat: data of a gait cycle drive many cycles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd


def pushed(push: mbd.Samples, scheme: mbd.Integrator | None = None, **how: float) -> mbd.Trajectory:
    """A point of 1 kg on a rail under a signal."""
    model, point = mbd.Model("rail", gravity=(0.0, 0.0, 0.0)), mbd.PointMass("point", mass=1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, point.origin, axis="x"))
    model.apply(mbd.Applied("push", point.origin, force=(push, 0.0, 0.0)))
    return mbd.simulate(model, mbd.assemble(model), scheme or mbd.Newmark(), **how)


@settings(max_examples=12, deadline=None)
@given(
    shape=st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=6),
    begin=st.floats(-1.0, 1.0),
    kind=st.sampled_from(["hold", "linear", "monotone"]),
)
def test_a_signal_that_repeats_is_that_of_its_samples_laid_end_to_end(
    shape: list[float], begin: float, kind: str
) -> None:
    values, period = [*shape, shape[0]], 0.31
    time = begin + np.linspace(0.0, period, len(values))
    repeated = pushed(mbd.Samples(time, values, kind, periodic=True), dt=1e-3, until=2.0)
    first = int(np.floor(-begin / period)) - 2
    places = [
        time[0] + (k + j / (len(values) - 1)) * period for k in range(first, first + 12) for j in range(len(shape))
    ]
    laid = pushed(mbd.Samples(places, shape * 12, kind), dt=1e-3, until=2.0)
    at = np.linspace(0.0, 2.0, 97)
    np.testing.assert_allclose(repeated.at(at)["rail.rate"], laid.at(at)["rail.rate"], atol=2e-5)


@pytest.mark.parametrize("begin", [0.3, -0.47, 1e4 + 0.3])
@pytest.mark.parametrize("scheme", [mbd.Newmark(), mbd.RungeKutta4(), mbd.RungeKutta853()], ids=repr)
def test_what_is_held_in_a_signal_that_repeats_is_held_from_the_first_step_behind_each_sample(
    begin: float, scheme: mbd.Integrator
) -> None:
    phases, values = np.array([0.0, 0.2, 0.45, 0.7, 0.8, 1.0]), np.array([1.0, 3.0, -2.0, 0.5, 2.0, 1.0])
    run = pushed(mbd.Samples(begin + phases, values, "hold", periodic=True), scheme, dt=0.013, until=3.0)
    knots = np.sort(np.concatenate([begin % 1.0 + phases[:-1] + turn for turn in range(-2, 5)]))
    edges = np.concatenate([[0.0], knots[(knots > 0.0) & (knots < 3.0)], [3.0]])
    forces = values[np.searchsorted(phases, (0.5 * (edges[1:] + edges[:-1]) - begin) % 1.0, side="right") - 1]
    speeds = np.concatenate([[0.0], np.cumsum(forces * np.diff(edges))])
    np.testing.assert_allclose(run["rail.rate"], np.interp(run.time, edges, speeds), atol=1e-10)


def test_steps_end_at_every_kink_of_a_signal_that_repeats() -> None:
    run = pushed(mbd.Samples([0.0, 0.1234, 0.3], [0.0, 1.0, 0.0], "linear", periodic=True), dt=0.01, until=1.0)
    for kink in (0.1234, 0.3, 0.4234, 0.6, 0.7234, 0.9):
        assert np.abs(run.time - kink).min() < 1e-12


@pytest.mark.parametrize("values", [[0.0, 1.0], [0.0, 1.0, 2.0]])
def test_a_signal_that_repeats_ends_as_it_begins(values: list[float]) -> None:
    with pytest.raises(mbd.ModelError, match="need three values at least, of which the last is the first"):
        mbd.Samples(np.arange(len(values)), values, periodic=True)
