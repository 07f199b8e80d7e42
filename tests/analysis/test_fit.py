"""Parameters from measured motion: those that made it are found, with honest errors, and faults have names."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import mbd
from mbd.analysis.fitting.data import Data
from mbd.analysis.fitting.fit import _Search, instants_of
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

TIMES = np.linspace(0.05, 2.0, 40)


@cache
def pendulum():
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.2, length=1.3, center=1.3)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.2)))
    return model, mbd.assemble(model, {"pin.angle": 0.4})


def seen(**parameters):
    model, start = pendulum()
    run = mbd.simulate(model, start, mbd.Newmark(), dt=0.02, until=2.0, parameters=parameters)
    return np.array(run.at(TIMES)["pin.angle"])


def found(values, parameters, **more):
    model, start = pendulum()
    return mbd.fit(model, start, {"time": TIMES, "pin.angle": values}, parameters, mbd.Newmark(), 0.02, **more)


def test_a_walker_is_found_from_angles_and_instants_of_its_heel_strikes():
    model = kneed_walker()
    start = kneed_walker_start(model)
    truth = {name: 1.05 * model.parameters[name] for name in ("hip.mass", "right shank.mass")}
    times = np.linspace(0.05, 0.59, 20)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.6, parameters=truth)
    data = {"time": times, "left hip.angle": run.at(times)["left hip.angle"]}
    events = {name: instants_of(run)[name] for name in ("right foot.time", "right knee lock.time")}
    guess = {name: model.parameters[name] for name in truth}
    fitted = mbd.fit(model, start, data, guess, mbd.HHT(0.05), 2e-3, events=events, until=0.6)  # fmt: skip
    assert fitted.converged and fitted.alike == ()
    np.testing.assert_allclose([fitted.values[name] for name in truth], list(truth.values()), rtol=1e-7)
    assert all(abs(residual).max() < 1e-6 for residual in fitted.residuals.values())


def test_derivatives_are_those_of_the_residuals_through_an_impact():
    model = kneed_walker()
    start = kneed_walker_start(model)
    times = np.linspace(0.011, 0.7, 45)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.8)
    data = {"time": times, "left hip.angle": np.zeros(45), "trunk.x": np.arange(45.0), "right hip.rate": np.ones(45)}
    known = Data.read(data, {"right foot.time": instants_of(run)["right foot.time"]}, None)
    search = _Search(model, start, known, ("hip.mass", "left thigh.mass"), mbd.HHT(0.05), 2e-3, 0.8, "auto")
    search.check()
    values, h = np.array([model.parameters[name] for name in search.names]), 1e-5
    exact = search.slopes(values)
    central = np.transpose([
        (search.residuals(values + h * unit) - search.residuals(values - h * unit)) / (2 * h) for unit in np.eye(2)
    ])  # fmt: skip
    away = np.ones(len(exact), dtype=bool)
    away[:-1] = np.tile(np.min(np.abs(times[:, None] - [event.time for event in run.events]), axis=1) > 4e-3, 3)
    np.testing.assert_allclose(exact[away], central[away], rtol=2e-5, atol=2e-5 * np.abs(central).max())


@pytest.mark.slow
def test_errors_of_estimates_are_those_of_the_noise():
    noise = 1e-3 * np.random.default_rng(7).standard_normal((12, len(TIMES)))
    fits = [found(seen() + each, {"rod.center": 1.0, "pin loss.coefficient": 0.3}, sigma={"pin.angle": 1e-3})
            for each in noise]  # fmt: skip
    off = np.array([(fit.values["rod.center"] - 1.3) / fit.errors["rod.center"] for fit in fits])
    assert np.abs(off).max() < 4.0 and 0.4 < np.std(off) < 1.9
    assert 0.8 < np.mean([fit.noise for fit in fits]) < 1.2
    low, high = fits[0].interval("rod.center")
    assert low < fits[0].values["rod.center"] < high and "rod.center" in repr(fits[0])


def test_what_the_data_cannot_tell_apart_is_named():
    """All forces of a pendulum grow with its mass: mass and damping count as their ratio alone."""
    both = found(seen(), {"rod.mass": 1.0, "pin loss.coefficient": 0.3})
    assert set(*both.alike) == {"rod.mass", "pin loss.coefficient"}
    assert np.isinf(list(both.errors.values())).all() and "cannot tell apart" in repr(both)
    assert both.values["pin loss.coefficient"] / both.values["rod.mass"] == pytest.approx(0.2 / 1.2, rel=1e-6)


def test_bounds_hold_and_values_may_be_missing():
    values = seen()
    values[::3] = np.nan
    bounded = found(values, {"rod.center": (1.0, 0.9, 1.1)})
    assert bounded.values["rod.center"] == pytest.approx(1.1)
    assert len(bounded.residuals["pin.angle"]) == np.isfinite(values).sum()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"data": {"pin.angle": [1.0]}}, "column 'time'"),
        ({"data": {"time": [0.0, 0.0], "pin.angle": [1.0, 2.0]}}, "increasing times"),
        ({"data": {"time": [0.1, 0.2], "pin.angle": [1.0]}}, "for every time"),
        ({"data": None}, "nothing to fit to"),
        ({"sigma": {"pin.angel": 0.1}}, "'pin.angel', which is not among the data"),
        ({"sigma": {"pin.angle": 0.0}}, "must be positive"),
        ({"data": {"time": [0.1], "pin.angel": [1.0]}}, "did you mean 'pin.angle'"),
        ({"parameters": {"rod.centre": 1.0}}, "did you mean 'rod.center'"),
        ({"parameters": {"rod.center": (1.0, 2.0, 3.0)}}, "guess, lowest, highest"),
        ({"until": 0.5}, "not before the last value"),
        ({"events": {"floor.time": 0.3}}, "does not reach the data: there is no 'floor.time'"),
        ({"integrator": mbd.RadauIIA(), "dt": -1.0}, "dt must be"),
    ],
    ids=str,
)
def test_faults_have_names(change, said):
    model, start = pendulum()
    given = {"data": {"time": TIMES, "pin.angle": seen()}, "parameters": {"rod.center": 1.0}, "dt": 0.05, **change}
    with pytest.raises(mbd.MbdError, match=said):
        mbd.fit(model, start, **given)
