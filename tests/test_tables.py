"""Runs as tables: what `at` gives is what `run.at` gives, every time once, with units and words."""

import random
import sys

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.errors import TrajectoryError
from tests.helpers import one_body

xarray = pytest.importorskip("xarray")


def bouncing(until: float = 1.2) -> mbd.Trajectory:
    model, point = one_body(mbd.PointMass("mass", mass=1.0), mbd.Translation, "flight", title="ball", axes="xy")
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(point.origin), restitution=0.5))
    start = mbd.assemble(model, position={"flight.y": 1.0}, velocity={"flight.x.rate": 0.3})
    return mbd.simulate(model, start, dt=1e-2, until=until, backend="python")


@pytest.fixture(scope="module")
def run() -> mbd.Trajectory:
    return bouncing()


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_a_table_at_times_is_the_run_at_these_times(run, seed):
    rng = random.Random(seed)
    events = [event.time for event in run.events]
    times = sorted({*(rng.uniform(0.0, run.time[-1]) for _ in range(5)), *rng.sample(events, 2)})
    names = [*rng.sample(list(run.names), 3), "mass.origin"]
    for side, word in (("right", "after"), ("left", "before")):
        there = run.at(times, side=side)
        table, data = run.to_dataframe(names, at=times, side=word), run.to_xarray(names, at=times, side=word)
        assert list(table.index) == times
        for name in names[:3]:
            np.testing.assert_array_equal(table[name], there[name])
            np.testing.assert_array_equal(data[name], there[name])
        np.testing.assert_array_equal(data["mass.origin"], there["mass.origin"])
        np.testing.assert_array_equal(there["flight.y"], run.at(times, side=word)["flight.y"])


def test_each_time_is_there_once_with_the_side_that_was_chosen(run):
    both = run.to_dataframe(["flight.y.rate"])
    after, before = (run.to_dataframe(["flight.y.rate"], side=side) for side in ("after", "before"))
    assert not both.index.is_unique and after.index.is_unique and before.index.is_unique
    assert list(after.index) == list(before.index) == sorted(set(run.time))
    bounce = run.events[0].time
    np.testing.assert_allclose(after["flight.y.rate"][bounce], -0.5 * before["flight.y.rate"][bounce], rtol=1e-6)
    for side, rates in (("after", after), ("before", before)):
        data = run.to_xarray(["flight.y.rate"], side=side)
        near = data.sel(time=bounce + 1e-7, method="nearest")["flight.y.rate"]
        assert float(near) == rates["flight.y.rate"][bounce]


@pytest.mark.parametrize("dt", [0.1, 0.07, 1.2, 5.0])
def test_equal_intervals_begin_at_the_start_and_end_within_the_run(run, dt):
    time = run.to_dataframe(["flight.y"], at=dt).index.to_numpy()
    np.testing.assert_allclose(time, dt * np.arange(len(time)), atol=1e-12)
    assert time[-1] <= run.time[-1] < time[-1] + dt * (1.0 + 1e-9)


def test_units_and_words_go_with_the_columns(run):
    names = ["flight.y", "flight.y.rate", "floor.force", "floor.gap_rate", "mass.origin", "kinetic_energy", "t"]
    data, table = run.to_xarray(names, at=0.1), run.to_dataframe(names, at=0.1)
    assert [data[name].attrs["units"] for name in names] == ["m", "m/s", "N", "m/s", "m", "J", "s"]
    assert table.attrs["units"]["mass.origin.x"] == "m" and table.attrs["units"]["time"] == "s"
    assert data["floor.force"].attrs["long_name"] == table.attrs["long_names"]["floor.force"] == "force of floor"
    assert data["flight.y.rate"].attrs["long_name"] == "rate of place of flight along y"


def test_datasets_go_there_and_back(run):
    data = run.to_xarray(["flight.y", "mass.origin"], at=0.05)
    again = xarray.Dataset.from_dict(data.to_dict())
    xarray.testing.assert_identical(data, again)
    np.testing.assert_array_equal(
        data["flight.y"].to_dataframe()["flight.y"], run.to_dataframe(["flight.y"], at=0.05)["flight.y"]
    )


def test_runs_from_files_give_the_same_tables(run, tmp_path):
    again = mbd.load(run.save(tmp_path / "ball"))
    table = run.to_dataframe(at=0.05, side="before")
    assert again.to_dataframe(at=0.05, side="before").equals(table)
    assert again.to_dataframe(at=0.05).attrs["units"] == table.attrs["units"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"at": 0.0}, "a number above 0 s"),
        ({"at": float("nan")}, "a number above 0 s"),
        ({"at": 1e-12}, "would make 1.2e\\+12 rows"),
        ({"at": [0.2, 0.1]}, "in order, each once; 0.1 s comes after 0.2 s"),
        ({"at": [0.1, 0.1]}, "each once"),
        ({"at": [0.1, float("nan")]}, "each once"),
        ({"at": "soon"}, "a distance in time or times in order"),
        ({"at": [0.0, 99.0]}, "outside the run"),
        ({"side": "left"}, "'before' or 'after'"),
        ({"names": "flight.y"}, r"names are a list, such as \['flight.y'\]"),
        ({"names": ["flight.z"]}, "no result named 'flight.z'"),
    ],
)
def test_a_wrong_request_is_named(run, options, words):
    for table in run.to_dataframe, run.to_xarray:
        with pytest.raises((TrajectoryError, mbd.UnknownNameError), match=words):
            table(**options)


def stored(path) -> tuple[dict[str, str], list[str], np.ndarray]:
    """Header, labels and numbers of a storage file, read by its own words."""
    head, _, rest = path.read_text(encoding="utf-8").partition("endheader\n")
    words = dict(line.split("=") for line in head.splitlines()[1:] if "=" in line)
    labels, *lines = rest.splitlines()
    return words, labels.split("\t"), np.array([[float(cell) for cell in line.split("\t")] for line in lines])


def test_a_storage_file_gives_back_the_numbers_of_the_run(run, tmp_path):
    names = ["flight.y", "mass.origin"]
    words, labels, numbers = stored(run.to_sto(tmp_path / "ball.sto", names, at=0.1))
    table = run.to_dataframe(names, at=0.1)
    assert words == {"version": "1", "nRows": str(len(table)), "nColumns": "5", "inDegrees": "no"}
    assert labels == ["time", *table.columns]
    np.testing.assert_array_equal(numbers, np.column_stack([table.index, table]))
    words, labels, numbers = stored(run.to_sto(tmp_path / "all.sto"))
    assert len(labels) == int(words["nColumns"]) and np.all(np.diff(numbers[:, 0]) > 0.0)


def test_a_motion_has_its_angles_in_degrees(tmp_path):
    model, _ = one_body(mbd.Link("rod", mass=1.0, length=1.0, center=1.0), mbd.Revolute, "left hip", title="pendulum")
    swing = mbd.simulate(model, mbd.assemble(model, {"left hip.angle": 0.3}), dt=0.05, until=0.5, backend="python")
    names = ["left hip.angle", "left hip.rate", "rod.end.x"]
    for ending, factor, said in ((".mot", 180.0 / np.pi, "yes"), (".sto", 1.0, "no")):
        words, labels, numbers = stored(swing.to_sto(tmp_path / f"swing{ending}", names))
        assert words["inDegrees"] == said and labels[1:] == ["left_hip.angle", "left_hip.rate", "rod.end.x"]
        np.testing.assert_allclose(numbers[:, 1], factor * swing["left hip.angle"], rtol=1e-15)
        np.testing.assert_allclose(numbers[:, 2], factor * swing["left hip.rate"], rtol=1e-15)
        np.testing.assert_array_equal(numbers[:, 3], swing["rod.end.x"])


@pytest.mark.parametrize("kind", ["Universal", "Cylindrical", "Planar", "Spherical", "Revolute", "Prismatic"])
def test_a_joint_has_the_same_units_whether_it_is_cut_or_not(kind):
    units = []
    for cut in ("auto", "all"):
        model, body = (
            mbd.Model("one joint", gravity=(0.0, 0.0, 0.0), cut=cut),
            mbd.RigidBody("body", 1.0, (0.1, 0.2, 0.3)),
        )
        model.connect(getattr(mbd, kind)("joint", model.ground.origin, body.origin))
        run = mbd.simulate(model, mbd.assemble(model), dt=0.1, until=0.1, backend="python")
        named = run.to_dataframe().attrs["units"]
        units.append({name: named.get(name, "") for name in run.names if name.startswith("joint.")})
    both = [name for name in units[0] if name in units[1] and name not in ("joint.rate", "joint.acceleration")]
    assert len(both) >= 6
    assert {name: units[0][name] for name in both} == {name: units[1][name] for name in both}


@pytest.mark.parametrize("cut", ["auto", "all"])
def test_rates_of_a_motion_are_in_degrees_whichever_joints_are_cut(tmp_path, cut):
    model = mbd.Model("pendulum", cut=cut)
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=1.0)
    model.connect(mbd.Revolute("left hip", model.ground.origin, rod.start))
    start = mbd.assemble(model, {"left hip.angle": 0.3}, project=True)
    swing = mbd.simulate(model, start, dt=0.05, until=0.5, backend="python")
    names = [f"left hip.{last}" for last in (
        "angle", "rate", "acceleration", "angle.rate", "angle.acceleration", "reaction_torque.z")]  # fmt: skip
    assert [swing.to_dataframe(names).attrs["units"].get(name) for name in names[3:]] == ["rad/s", "rad/s²", "N m"]
    _, _, numbers = stored(swing.to_sto(tmp_path / "swing.mot", names))
    for k, name in enumerate(names):
        factor = 1.0 if "torque" in name else 180.0 / np.pi
        np.testing.assert_allclose(numbers[:, 1 + k], factor * swing[name], rtol=1e-14)


def test_other_files_and_names_are_refused(run, tmp_path):
    for path, names, text in (("ball.txt", None, "end in .sto or .mot"), ("ball.sto", ["flight.z"], "flight.z")):
        with pytest.raises(mbd.MbdError, match=text):
            run.to_sto(tmp_path / path, names)
    assert not list(tmp_path.iterdir())


def test_csv_files_are_those_of_pandas_and_need_none(tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    model = mbd.Model("arm")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    model.connect(pin := mbd.Revolute("pin", model.ground.origin, rod.start))
    model.constrain(mbd.Mode("phase", ("up", "down"), transitions=[mbd.Transition("up", "down", after=0.05)]))
    model.apply(mbd.Motor("drive", pin, lambda t: 1e-9 * t, arguments=("t",)))
    run = mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 0.5}), dt=1e-2, until=0.1)
    names = ["pin.angle", "phase", "rod.end"]
    expected = run.to_dataframe(names).to_csv(lineterminator="\n")
    monkeypatch.setitem(sys.modules, "pandas", None)
    assert run.to_csv(tmp_path / "run", names).read_text() == expected
