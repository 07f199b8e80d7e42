"""`mbd.batch`: the runs of `simulate`, many at a time."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.testing.mechanisms import random_scene, random_tree
from tests.comparisons import at_least, compared
from tests.gait.walkers import simplest, simplest_start
from tests.simulation.mechanisms import ball, falling
from tests.simulation.test_many_runs import SCHEMES, same, starts_of


@settings(max_examples=14)
@given(
    seed=st.integers(0, 300), scheme=st.sampled_from(SCHEMES), workers=st.sampled_from([1, 2]), spatial=st.booleans(),
    contact=st.sampled_from(["events", "nonsmooth"]),
)  # fmt: skip
def test_a_batch_is_the_runs_of_simulate(seed, scheme, workers, spatial, contact):
    model = random_tree(seed, 3, True, 4) if spatial else random_scene(seed, 2)
    starts = starts_of(model, np.random.default_rng(seed), 3)
    energies = ["kinetic_energy", f"{starts[0].velocity_names[0]}"]
    how = {"until": 0.4, "contact": contact if isinstance(scheme, mbd.HHT) and not spatial else "auto"}
    found = mbd.batch(model, starts, scheme, 0.02, results=energies, workers=workers, **how)
    for k, start in enumerate(starts):
        alone = mbd.simulate(model, start, scheme, 0.02, on_failure="return", **how)
        assert found.success[k] == alone.success
        if alone.success:
            assert same(found.final(k), alone.final)
            assert found.message(k) in alone.message
            assert found.steps[k] == alone.stats["steps"] and found.events[k] == len(alone.events)
            for name in energies:
                np.testing.assert_allclose(found.results[name][k], alone[name][-1], rtol=1e-12, atol=1e-12)


def test_columns_of_starts_and_parameters_are_those_of_single_runs():
    model = ball()
    start = mbd.assemble(model, position={"fall.displacement": 1.0})
    heights, masses = np.linspace(0.5, 2.0, 20), np.linspace(1.0, 3.0, 20)
    found = mbd.batch(
        model, (start, {"fall.displacement": heights}), mbd.RungeKutta853(), 0.05, until=("floor", 5.0),
        parameters={"gravity.y": -5.0 * masses}, workers=2,
    )  # fmt: skip
    np.testing.assert_allclose(found.time, np.sqrt(2.0 * heights / (5.0 * masses)), rtol=1e-12)
    assert set(found.stopped_by) == {"floor"}
    assert found.final(3).parameters == {"gravity.y": -5.0 * masses[3]}
    assert same(found.run(3).final, found.final(3))
    assert "20 × ended by 'floor'" in repr(found)
    assert len(found.to_dataframe()) == 20


def test_resets_of_the_event_that_ends_runs_are_those_of_single_runs():
    model, _ = simplest()
    starts = [simplest_start(model, theta, -theta) for theta in (0.19, 0.2, 0.21, 0.3)]
    found = mbd.batch(model, starts, mbd.RungeKutta853(), 0.05, until=("heel strike", 6.0))
    assert found.how == ""
    for k, start in enumerate(starts):
        alone = mbd.simulate(model, start, mbd.RungeKutta853(), 0.05, until=("heel strike", 6.0))
        assert same(found.final(k), alone.final)
        assert found.message(k) == alone.message


def test_runs_that_need_python_are_made_one_by_one():
    model = ball()
    push = mbd.Controller("push", lambda t, values, state: None, period=0.1, reads=("fall.displacement",))
    model.apply(push)
    start = mbd.assemble(model, position={"fall.displacement": 1.0})
    found = mbd.batch(model, [start, start], dt=0.01, until=0.2)
    assert "'push' is called in Python" in found.how
    assert same(found.final(0), mbd.simulate(model, start, dt=0.01, until=0.2).final)


@cache
def base() -> tuple[mbd.Model, mbd.State]:
    model = ball()
    return model, mbd.assemble(model, position={"fall.displacement": 1.0})


def test_a_run_that_fails_is_a_row_of_its_own():
    model, start = base()
    below = mbd.State(0.0, np.array([-0.1]), start.v, start.z, start.mode, start.armed, start.anchors, start.names,
                      start.velocity_names)  # fmt: skip
    found = mbd.batch(model, [start, below, start], dt=0.01, until=0.1)
    assert list(found.outcome) == ["end", "refused", "end"]
    assert "inside its surface" in found.message(1)
    assert np.isnan(found.q[1]).all()
    with pytest.raises(mbd.SimulationError, match="was refused"):
        found.final(1)
    with pytest.raises(mbd.SimulationError, match="was refused"):
        found.run(1)


@at_least(3)
@settings(max_examples=12)
@given(seed=st.integers(0, 200))
def test_starts_that_break_their_constraints_are_refused_as_simulate_refuses_them(seed):
    """Of starts moved at random off their rows and into surfaces; the sentence is made where somebody asks for it."""
    model, rng = random_scene(seed, bodies=2), np.random.default_rng(seed)
    base = mbd.assemble(model)
    starts = [replace(base, q=base.q + off * rng.normal(size=len(base.q))) for off in (0.0, 1e-9, 1e-4, 0.3, 1.0)]
    try:
        found = mbd.batch(model, starts, dt=0.01, until=0.02)
    except mbd.ModelError:  # no orientation, or an angle beyond all
        return
    for k, start in enumerate(starts):
        words = ""
        try:
            mbd.simulate(model, start, dt=0.01, until=0.02, on_failure="return")
        except mbd.MbdError as error:
            words = str(error)
        assert (found.outcome[k] == "refused") == bool(words)
        if words:
            compared()
            assert np.isnan(found.q[k]).all() and np.isnan(found.time[k])
            assert found.message(k) == words
            with pytest.raises(mbd.SimulationError, match="was refused"):
                found.final(k)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"starts": []}, "starts must be a list"), ({"starts": 3}, "starts must be a list"),
        ({"starts": (0, {"fall.displacement": [1.0]})}, "starts must be"),
        ({"parameters": {"ball.mass": [1.0, float("nan")]}}, "finite"),
        ({"parameters": {"ball.mass": [1.0, -2.0]}}, "run 1"),
        ({"parameters": {"ball.mas": [1.0, 2.0]}}, "ball.mas"),
        ({"parameters": {"ball.mass": [[1.0], [2.0]]}}, "dimension"),
        ({"parameters": 3}, "must map names"), ({"results": ["fall.x"]}, "fall.x"), ({"results": 3}, "results lists"),
        ({"workers": 0}, "workers"), ({"workers": 1.5}, "workers"), ({"dt": 0.0}, "dt"), ({"until": "flor"}, "floor"),
        ({"progress": "yes"}, "progress"), ({"integrator": 3}, "integrator"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_said_before_the_first_run(wrong, words):
    model, start = base()
    right = {"starts": [start, start], "dt": 0.01, "until": 0.1, "workers": 1, **wrong}
    with pytest.raises(mbd.MbdError, match=words):
        mbd.batch(model, **right)


def test_names_of_columns_are_coordinates_and_rates():
    model, start = base()
    with pytest.raises(mbd.UnknownNameError, match=r"fall\.displacement"):
        mbd.batch(model, (start, {"fall.place": [1.0]}), dt=0.01, until=0.1)
    with pytest.raises(mbd.ModelError, match="2 starts and 3 values"):
        mbd.batch(model, [start, start], dt=0.01, until=0.1, parameters={"ball.mass": [1.0, 2.0, 3.0]})


def test_values_that_the_model_folds_into_its_equations_may_be_columns():
    model = mbd.Model("swing")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.0)))
    start = mbd.assemble(model, position={"pin.angle": 0.5})
    values = [0.0, 0.5]
    found = mbd.batch(model, start, dt=0.01, until=0.3, parameters={"pin loss.coefficient": values}, workers=1)
    for k, value in enumerate(values):
        alone = mbd.simulate(model, start, dt=0.01, until=0.3, parameters={"pin loss.coefficient": value})
        assert abs(found.q[k, 0] - alone.final.q[0]) < 1e-14
    assert found.q[0, 0] != found.q[1, 0]


def test_a_step_that_fails_names_its_run_and_leaves_the_others_alone():
    model, body = falling()
    arguments = ("fall.displacement",)
    pit = mbd.Applied(
        "pit", body.origin, force=lambda y: (0.0, mbd.where(y < 0.5, mbd.log(y - 2.0), 0.0)), arguments=arguments
    )
    model.apply(pit)
    start = mbd.assemble(model, position={"fall.displacement": 1.0})
    found = mbd.batch(model, (start, {"fall.displacement": [0.6, 5.0, 0.55]}), dt=0.01, until=0.3)
    assert list(found.outcome) == ["not finite", "end", "not finite"]
    assert "t = " in found.message(0) and found.message(0) == found.run(0).message
    assert same(found.final(1), mbd.simulate(model, found.start(1), dt=0.01, until=0.3).final)
    assert found.time[0] < 0.3
