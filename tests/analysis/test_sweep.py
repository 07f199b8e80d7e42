"""Sweeps: every combination once, the same numbers wherever the runs are made, faults before the first run."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import G, falling

DROP = {"speed": lambda run: run["fall.rate"][-1]}


def swept(values, results=DROP, **settings):
    model, _ = falling()
    start = mbd.assemble(model, position={"fall.displacement": 1.0})
    fixed = {name: value for name, value in {"dt": 1e-2, "until": 0.1, **settings}.items() if name not in values}
    return mbd.sweep(model, values, start, results, backend="python", **fixed)


def test_every_combination_is_run_and_gives_its_own_motion():
    table = swept(
        {"gravity.y": [-G, -2.0 * G], "integrator": [mbd.HHT(0.05), mbd.Newmark()], "until": [0.1, 0.2]}, dt=0.05
    )
    expected = [g * t for g in (-G, -2.0 * G) for _ in range(2) for t in (0.1, 0.2)]
    np.testing.assert_allclose(table["speed"], expected, rtol=1e-12)
    assert len(table) == 8 and table["success"].all()
    assert list(table.to_dataframe().columns) == ["gravity.y", "integrator", "until", "speed", "success", "message"]


def test_threads_give_the_table_of_runs_in_turn():
    values = {"ball.mass": [1.0, 2.0, 3.0], "dt": [1e-2, 5e-3]}
    with ThreadPoolExecutor(2) as pool:
        np.testing.assert_array_equal(swept(values, executor=pool)["speed"], swept(values)["speed"])


def test_a_run_that_fails_is_a_line_with_its_message():
    table = swept({"dt": [1e-2, 1e9]}, ["fall.displacement"])
    assert list(table["success"]) == [True, False] and np.isnan(table["fall.displacement"][1])
    assert "1e+09" in table["message"][1] and "failed" in repr(table)


def test_a_result_that_is_not_there_costs_no_other_run():
    """A time after the shorter run, and an event that did not come."""
    results = {"late": lambda run: run.at(0.15)["fall.rate"], "first": lambda run: run.events[0].time, **DROP}
    table = swept({"until": [0.1, 0.2]}, results)
    assert np.isnan(table["late"]).tolist() == [True, False] and np.isnan(table["first"]).all()
    assert np.isfinite(table["speed"]).all() and not table["success"].any()
    assert "'late'" in table["message"][0] and "outside the run" in table["message"][0]
    assert "IndexError" in table["message"][1] and "'late'" not in table["message"][1]


def test_a_start_may_follow_the_parameters():
    model, _ = falling()
    start = lambda p: mbd.assemble(model, position={"fall.displacement": p["ball.mass"]})  # noqa: E731
    table = mbd.sweep(
        model, {"ball.mass": [1.0, 3.0]}, start, ["fall.displacement"], dt=0.1, until=0.0, backend="python"
    )
    np.testing.assert_array_equal(table["fall.displacement"], [1.0, 3.0])


@pytest.mark.parametrize(
    ("values", "more", "said"),
    [
        ({"ball.mas": [1.0]}, {}, "did you mean 'ball.mass'"),
        ({"ball.mass": 1.0}, {}, "must be a list"),
        (5, {}, "must map names"),
        ({"dt": [1.0]}, {"dt": 1.0}, "give it once"),
        ({"ball.mass": [1.0]}, {"results": ["fall.displacment"]}, "did you mean 'fall.displacement'"),
        ({"ball.mass": [1.0]}, {"executor": 4}, "ThreadPoolExecutor"),
        ({"ball.mass": [1.0]}, {"parameters": {"ball.mass": 2.0}}, "in parameters="),
        ({"ball.mass": [1.0]}, {"results": {"success": lambda run: 1.0}}, "title of two columns"),
        ({"ball.mass": [1.0]}, {"results": {"ball.mass": lambda run: 1.0}}, "title of two columns"),
    ],
)
def test_faults_are_told_before_the_first_run(values, more, said):
    settings = {} if values == {"dt": [1.0]} else more
    model, _ = falling()
    start = mbd.assemble(model)
    with pytest.raises(mbd.ModelError, match=said):
        mbd.sweep(model, values, start, **{"until": 0.1, "dt": 1e-2} | settings)


def test_values_in_the_place_of_the_start_are_told_in_one_line():
    model, _ = falling()
    with pytest.raises(mbd.ModelError, match=r"not a State; they come before the start$"):
        mbd.sweep(model, mbd.assemble(model), {"ball.mass": [1.0]}, dt=1e-3, until=0.1)
