"""Sweeps whose values change together, designs that fill ranges, and files from which a sweep goes on."""

import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, strategies as st

import mbd
from mbd.analysis.sweep import SweepFile
from tests.simulation.mechanisms import G, falling

RANGE = st.tuples(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6)).map(lambda pair: (pair[0], pair[0] + pair[1]))


def swept(values, results=None, **settings):
    model, _ = falling()
    start = mbd.assemble(model, position={"fall.displacement": 1.0})
    fixed = {name: value for name, value in {"dt": 5e-2, "until": 0.1, **settings}.items() if name not in values}
    results = {"speed": lambda run: run["fall.rate"][-1]} if results is None else results
    return mbd.sweep(model, values, start, results, backend="python", **fixed)


def test_names_in_a_tuple_change_together_and_others_with_every_pair():
    table = swept({("gravity.y", "ball.mass"): [(-G, 1.0), (-2.0 * G, 3.0)], "until": [0.1, 0.2]})
    assert table.names == ("gravity.y", "ball.mass", "until") and len(table) == 4
    np.testing.assert_allclose(table["speed"], [-0.1 * G, -0.2 * G, -0.2 * G, -0.4 * G], rtol=1e-12)
    data = table.to_xarray()
    assert data["speed"].dims == ("gravity.y, ball.mass", "until") and data["speed"].shape == (2, 2)
    np.testing.assert_array_equal(data["ball.mass"], [1.0, 3.0])
    assert float(data["speed"].sel(until=0.2)[1]) == table["speed"][3]


def test_schemes_are_text_in_a_dataset():
    data = swept({"integrator": [mbd.HHT(0.05), mbd.Newmark()], "ball.mass": [1.0, 2.0, 3.0]}).to_xarray()
    assert data["ball.mass"].attrs == {"units": "kg"}
    assert data["speed"].shape == (2, 3) and "HHT" in str(data["integrator"].values[0])
    assert data["success"].all()


def test_what_a_function_gives_has_no_unit_by_its_title():
    """It may be an angle in degrees, a speed in km/h."""
    functions = {name: lambda run: 3.6 for name in ("angle", "speed", "x", "force", "time of flight.time")}
    assert swept({"ball.mass": [1.0]}, functions).units == {"ball.mass": "kg"}
    assert swept({"dt": [0.05]}, ["fall.rate"]).units == {"dt": "s", "fall.rate": "m/s"}


@given(ranges=st.dictionaries(st.sampled_from(["a", "b", "c.d"]), RANGE, min_size=1), count=st.integers(1, 33))
def test_a_latin_hypercube_has_a_point_in_every_slice_of_every_range(ranges, count):
    [(names, values)] = mbd.latin_hypercube(ranges, count, seed=3).items()
    assert names == tuple(ranges) and len(values) == count
    for name, column in zip(names, np.transpose(values), strict=True):
        low, high = ranges[name]
        slices = np.floor((column - low) / (high - low) * count + 1e-6 * (np.arange(count) < 0)).astype(int)
        inside = (column >= low) & (column <= high)
        assert inside.all() and (
            high - low < 1e-6 * abs(low) or sorted(slices.clip(0, count - 1)) == list(range(count))
        )


@given(ranges=st.dictionaries(st.sampled_from(["a", "b"]), RANGE, min_size=1), power=st.integers(0, 6))
def test_sobol_points_fill_halves_and_begin_alike(ranges, power):
    few, more = (next(iter(mbd.sobol(ranges, count).values())) for count in (2**power, 2**power + 1))
    assert len(more) == len(few) + 1 and more[: len(few)] == few
    if power:
        for (low, high), column in zip(ranges.values(), np.transpose(few), strict=True):
            assert np.sum(column < low + (high - low) / 2) == len(few) / 2


def test_a_design_is_swept():
    table = swept(mbd.latin_hypercube({"gravity.y": (-11.0, -9.0), "ball.mass": (1.0, 2.0)}, 5, seed=1))
    np.testing.assert_allclose(table["speed"], 0.1 * table["gravity.y"], rtol=1e-12)
    assert table.to_xarray()["speed"].dims == ("gravity.y, ball.mass",)


def test_a_sweep_goes_on_from_its_file_and_makes_no_run_twice(tmp_path, monkeypatch):
    made, keep = [], SweepFile.keep

    def counted(self, case, row):
        made.append(case)
        keep(self, case, row)

    def speed(run):
        return run["fall.rate"][-1]

    monkeypatch.setattr(SweepFile, "keep", counted)
    values, path = {"ball.mass": [1.0, 2.0, 3.0], "dt": [5e-2, 1e9]}, tmp_path / "a" / "drops"
    whole = swept(values, {"speed": speed})
    first = swept({**values, "ball.mass": [1.0, 2.0]}, {"speed": speed}, file=path)
    count = len(made)
    file = path.with_suffix(".jsonl")
    lines = file.read_bytes().splitlines(keepends=True)
    assert len(lines) == 1 + len(first)
    file.write_bytes(b"".join(lines[:-1]) + lines[-1][:9])  # as a kill leaves it
    with ThreadPoolExecutor(2) as pool:
        found = swept(values, {"speed": speed}, file=path, executor=pool)
    np.testing.assert_array_equal(found["speed"], whole["speed"])
    assert list(found["message"]) == list(whole["message"])
    assert len(made) - count == 1 + len(whole) - len(first)
    assert json.loads(file.read_text().splitlines()[0])["names"] == ["ball.mass", "dt"]


SCRIPT = """
import os
from mbd.analysis.sweep import SweepFile
from tests.analysis.test_sweep_designs import swept
keep, done = SweepFile.keep, []
def killed(self, case, row):
    done.append(case)
    if len(done) == 3:
        os._exit(9)
    keep(self, case, row)
SweepFile.keep = killed
swept({"ball.mass": [1.0, 2.0, 3.0, 4.0]}, file=%r)
"""


def test_a_killed_sweep_has_lost_no_run_that_was_over(tmp_path):
    path = tmp_path / "drops.jsonl"
    ended = subprocess.run([sys.executable, "-c", SCRIPT % str(path)], timeout=120, check=False)
    assert ended.returncode == 9 and len(path.read_text().splitlines()) == 3
    table = swept({"ball.mass": [1.0, 2.0, 3.0, 4.0]}, file=path)
    np.testing.assert_allclose(table["speed"], -0.1 * G, rtol=1e-12)


def test_a_file_of_another_sweep_or_of_none_is_refused(tmp_path):
    path = tmp_path / "drops.jsonl"
    swept({"ball.mass": [1.0]}, file=path)
    with pytest.raises(mbd.ModelError, match="another sweep, with other names, settings"):
        swept({"gravity.y": [-9.0]}, file=path, dt=2e-2)
    other = tmp_path / "notes.jsonl"
    for text in "shopping\n", "shopping", "shopping\nmore":
        other.write_text(text)
        with pytest.raises(mbd.ModelError, match="no file of a sweep"):
            swept({"ball.mass": [1.0]}, file=other)
        assert other.read_text() == text


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({("ball.mass", "gravity.y"): [(1.0,)]}, "must be tuples of 2"),
        ({("ball.mass", "gravity.y"): [(1.0, -9.0)], "ball.mass": [1.0]}, "'ball.mass' is given twice"),
        ({("ball.mass", "gravity.z.z"): [(1.0, 2.0)]}, "gravity.z.z"),
    ],
    ids=["lengths", "twice", "unknown"],
)
def test_faults_of_values_that_change_together_are_named(values, said):
    with pytest.raises(mbd.MbdError, match=said):
        swept(values)


@pytest.mark.parametrize("design", [mbd.latin_hypercube, mbd.sobol])
def test_faults_of_a_design_are_named_together(design):
    with pytest.raises(mbd.ModelError) as told:
        design({"a": (2.0, 1.0), "b": (0.0, float("inf"))}, 0, -1)
    assert len(told.value.args[0] if isinstance(told.value.args[0], list) else str(told.value).splitlines()) >= 4
