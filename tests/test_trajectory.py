"""Results by name, values between the rows, files and tables."""

import json
import zipfile
from itertools import pairwise

import numpy as np
import pytest

import mbd
from mbd.errors import TrajectoryError, UnknownNameError
from mbd.results import summary
from mbd.results.interpolation import Grid
from mbd.results.record import Record
from mbd.results.trajectory import Trajectory
from mbd.results.units import unit
from tests.view.handmade_runs import ball, oscillation, oscillator, record, walker


def orders(errors: list[float]) -> list[float]:
    return [float(np.log2(a / b)) for a, b in pairwise(errors)]


# names ------------------------------------------------------------------------------------------------------------


def test_a_name_gives_its_column_and_a_vector_three():
    run = ball()
    assert run["flight.y"].shape == run.time.shape
    assert run["ball.origin"].shape == (len(run), 3)
    np.testing.assert_array_equal(run["ball.origin"][:, 1], run["flight.y"])
    assert "flight.y.rate" in run.names and "ball.origin" in run and "ball.middle" not in run


def test_a_wrong_name_is_answered_with_the_nearest():
    with pytest.raises(UnknownNameError, match=r"no result named 'flight.z'; did you mean 'flight\.[xy]'"):
        ball()["flight.z"]
    with pytest.raises(UnknownNameError, match=r"did you mean 'ball.origin'"):
        ball()["ball.orign"]


def test_columns_cannot_be_changed_by_accident():
    run = ball()
    with pytest.raises(ValueError, match="read-only"):
        run["flight.x"][0] = 1.0


def test_the_contact_force_pushes_only_while_closed():
    run = ball()
    force = run["floor.force"]
    assert np.all(force[run.record.closed[:, 0] == 0] == 0.0)
    np.testing.assert_allclose(force[run.record.closed[:, 0] == 1], 20.0)


def test_names_of_solve_ivp_work_too():
    run = oscillator()
    assert run.t is run.time and run.status == 0 and run.success and run.message == "reached the end"
    failed = Trajectory(record(run.record.equations, run.time, run.record.q, run.record.v, run.record.a, success=False))
    assert failed.status == -1


def test_a_terminal_event_is_a_success_with_its_own_status():
    run = ball()
    end = mbd.results.trajectory.EventRecord(float(run.time[-1]), "event", "fell", row=len(run) - 1)
    fell = Trajectory(
        record(
            run.record.equations,
            run.time,
            run.record.q,
            run.record.v,
            run.record.a,
            closed=run.record.closed,
            events=[end],
            message=f"ended by 'fell' at t = {end.time:.6g} s",
        )
    )
    assert fell.success and fell.status == 1


def test_an_event_at_the_end_has_not_ended_the_run():
    model = mbd.Model("fall")
    ball = mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Prismatic("fall", model.ground.origin, ball.origin, axis=(0.0, 1.0, 0.0)))
    model.constrain(mbd.Event("passes", mbd.measure(lambda y: y, "fall.displacement")))
    start = mbd.assemble(model, {"fall.displacement": 1.0})
    ended = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.1, until="passes")
    reached = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.1, until=float(ended.time[-1]))
    assert [event.name for event in reached.events] == ["passes"] and reached.time[-1] == ended.time[-1]
    assert (ended.status, reached.status) == (1, 0)


def test_units_follow_from_names():
    facts = walker().facts
    assert unit("left hip.angle", facts) == "rad"
    assert unit("left hip.rate", facts) == unit("left hip.angle.rate", facts) == "rad/s"
    assert unit("trunk.x.acceleration", facts) == "m/s²"
    assert unit("left foot.gap", facts) == "m" and unit("left foot.force", facts) == "N"
    assert unit("left knee.reaction_force.x", facts) == "N" and unit("left shank.end.x", facts) == "m"
    assert unit("something", facts) == ""


def test_a_record_with_missing_rows_is_refused():
    good = oscillator().record
    with pytest.raises(ValueError, match=r"needs v of shape \(201, n\)"):
        record(good.equations, good.time, good.q, good.v[1:], good.a)


# between the rows -------------------------------------------------------------------------------------------------


def test_interpolation_has_the_order_of_its_polynomials():
    times = np.linspace(0.013, 1.987, 97)
    exact = oscillation(times)
    errors: dict[str, list[float]] = {"": [], ".rate": [], ".acceleration": []}
    for dt in (0.08, 0.04, 0.02, 0.01):
        values = oscillator(dt).at(times)
        for part, truth in zip(errors, exact, strict=True):
            errors[part].append(float(np.max(np.abs(values[f"slider.displacement{part}"] - truth))))
    assert min(orders(errors[""])) > 3.7 and min(orders(errors[".rate"])) > 3.7
    assert min(orders(errors[".acceleration"])) > 2.7


def test_a_row_is_met_exactly():
    run = oscillator()
    for name in ("slider.displacement", "slider.displacement.rate", "slider.displacement.acceleration", "spring.force"):
        np.testing.assert_array_equal(run.at(run.time)[name], run[name])


def test_both_sides_of_an_impact_are_given_and_nothing_is_blended_across():
    run = ball(restitution=0.8)
    strike = run.events[0].time
    before, after = run.at(strike, side="left"), run.at(strike)
    assert after["flight.y.rate"] == pytest.approx(-0.8 * before["flight.y.rate"], rel=1e-12)
    assert before["flight.y"] == pytest.approx(0.0, abs=1e-12)
    close = run.at([strike - 1e-9, strike + 1e-9])["flight.y.rate"]
    np.testing.assert_allclose(close, [before["flight.y.rate"], after["flight.y.rate"]], rtol=1e-6)
    assert run.at(strike - 1e-9)["floor.force"] == 0.0


def test_a_parabola_is_interpolated_exactly():
    run = ball()
    fall = np.linspace(0.0, run.events[0].time, 333)
    np.testing.assert_allclose(run.at(fall, side="left")["flight.y"], 1.0 - 5.0 * fall**2, atol=1e-14)


def test_one_time_gives_a_float_and_a_vector_three_numbers():
    values = ball().at(0.1)
    assert isinstance(values["flight.y"], float) and values["ball.origin"].shape == (3,)
    assert ball().at([[0.1, 0.2]])["ball.origin"].shape == (1, 2, 3)
    assert set(values) == set(ball().names) and len(dict(values)) == len(values)
    assert "t = 0.1 s" in repr(values)


def test_a_time_outside_the_run_is_refused():
    run = oscillator()
    assert run.at(2.0 + 1e-13)["slider.displacement"] == run["slider.displacement"][-1]
    for wrong in (-0.1, 2.1, np.nan):
        with pytest.raises(TrajectoryError, match="outside the run, which covers 0 s to 2 s"):
            run.at(wrong)
    with pytest.raises(TrajectoryError, match="side is 'left'"):
        run.at(1.0, side="middle")  # type: ignore[arg-type]


def test_a_run_of_one_row_still_answers():
    one = oscillator().record
    run = Trajectory(record(one.equations, one.time[:1], one.q[:1], one.v[:1], one.a[:1]))
    assert run.at(0.0)["slider.displacement"] == one.q[0, 0]
    assert run.energy.change == 0.0 and "Trajectory" in repr(run)


def test_a_chain_of_switches_at_one_instant_has_its_outer_sides():
    grid = Grid(np.array([0.0, 1.0, 1.0, 1.0, 2.0]))
    assert grid.places(1.0, "left").lower[0] == 1 and grid.places(1.0, "right").lower[0] == 3
    between = grid.places([0.5, 1.5])
    assert between.lower.tolist() == [0, 3] and between.upper.tolist() == [1, 4]
    assert grid.cuts.tolist() == [0, 2, 3, 5] or grid.cuts.tolist() == [0, 2, 3, 5]


def test_changed_parameters_hold_from_their_row_on():
    base = ball()
    heavy = base.record.parameters * np.array([3.0, 1.0, 1.0])
    equations = base.record.equations
    assert equations is not None
    mass = equations.tape.input("p", 0)
    output, names = equations.output, equations.output_names
    equations.output = lambda name: mass if name == "ball.mass" else output(name)
    equations.output_names = lambda: (*names(), "ball.mass")
    r = base.record
    changed = Record(
        equations, r.parameters, r.parameter_names, r.time, r.q, r.v, r.z, r.a, r.s, r.lam, r.closed,
        parameter_changes=((50, heavy),),
    )  # fmt: skip
    run = Trajectory(changed)
    assert run["ball.mass"][49] == 2.0 and run["ball.mass"][50] == 6.0
    assert run.at(float(run.time[60]) + 1e-4)["ball.mass"] == 6.0


def test_a_closed_foot_holds_the_place_where_it_touched():
    run = walker(steps=3)
    places = run.columns.anchors
    closed = run.record.closed.astype(bool)
    length = 2.0 * np.sin(0.25)
    np.testing.assert_allclose(places[closed[:, 1], 2], length, atol=1e-12)
    np.testing.assert_allclose(
        np.unique(np.round(places[closed[:, 0], 0], 9)), [0.0, np.round(2.0 * length, 9)], atol=1e-9
    )
    assert run.violation.length < 1e-12 and run.violation.worst.startswith(("left foot", "right foot"))


# files ------------------------------------------------------------------------------------------------------------


def test_a_file_holds_numbers_and_json_only(tmp_path):
    path = walker().save(tmp_path / "run")
    with np.load(path, allow_pickle=False) as file:
        meta = json.loads(file["meta"].tobytes())
        assert all(file[name].dtype.kind in "fiub" for name in file.files)
    assert meta["facts"]["segments"][1] == ["left leg", ["start", "end"]]
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("kind", ["text", "zip", "npz", "npy"])
def test_a_wrong_file_is_named(tmp_path, kind):
    path = tmp_path / f"wrong.{kind}"
    if kind == "text":
        path.write_text("time, angle\n")
    elif kind == "zip":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("readme", "nothing here")
    elif kind == "npz":
        with path.open("wb") as file:
            np.savez(file, time=np.zeros(3))
    else:
        with path.open("wb") as file:
            np.save(file, np.zeros(3))
    with pytest.raises(
        TrajectoryError, match=rf"wrong\.{kind}' is not a run of mbd; expected a file written by run.save"
    ):
        mbd.load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="no run file at"):
        mbd.load(tmp_path / "absent.npz")


# tables and text --------------------------------------------------------------------------------------------------


def test_a_run_becomes_a_table():
    run = ball()
    table = run.to_dataframe(["flight.y", "ball.origin"])
    assert table.index.name == "time" and list(table.columns) == ["flight.y", *(f"ball.origin.{a}" for a in "xyz")]
    np.testing.assert_array_equal(table["flight.y"], run["flight.y"])
    assert set(run.to_dataframe().columns) == set(run.names)


def test_a_run_becomes_a_dataset():
    run = walker()
    data = run.to_xarray(["left hip.angle", "left leg.end"])
    assert data["left leg.end"].dims == ("time", "axis") and data["left hip.angle"].attrs["units"] == "rad"
    np.testing.assert_array_equal(data["left leg.end"].sel(axis="y"), run["left leg.end.y"])


def test_a_run_prints_what_matters():
    text, html = repr(ball()), ball()._repr_html_()
    for word in ("energy", "constraints", " steps", "floor closed", "HHT(alpha=0.05)", "dt = 0.01"):
        assert word in text
    assert html.startswith("<table") and "floor" in html and "energy loss" in html


def test_an_event_reads_as_a_sentence():
    event = ball().events[0]
    assert repr(event).startswith("<0.447214 s: 'floor' closed, impulse 16.") and "energy loss" in repr(event)


def test_a_growth_that_is_not_known_is_not_told():
    known = {"requested": 1e-6, "estimated": 2e-15, "growth": 1.7, "runs": [{"steps": 11}, {"steps": 17}]}
    assert "global over local errors 1.7; runs of 11 + 17 steps" in summary.accuracy(known)
    assert summary.accuracy(known | {"growth": float("nan")}) == (
        "estimated error of coordinates 2e-15, asked for 1e-06; runs of 11 + 17 steps"
    )


def test_two_threads_may_read_one_run():
    """Parts of a quaternion are evaluated together: another thread may take one between a look and the reading."""
    model, body = mbd.Model("top"), mbd.RigidBody("top", 1.0, (0.1, 0.2, 0.25))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    start = mbd.assemble(model, velocity={"float.angular_velocity": (1.0, 2.0, 0.3)})
    columns = mbd.simulate(model, start, dt=0.05, until=0.2).columns
    names = [f"float.orientation.{part}" for part in "wxyz"]
    wanted = [columns.at_rows([name])[0] for name in names]

    class Shared(dict):
        def __contains__(self, name):
            found = super().__contains__(name)
            self.pop(name, None)  # the other thread
            return found

    columns._waiting = Shared()
    for name, values in list(zip(names, wanted, strict=True)) * 3:
        np.testing.assert_array_equal(columns.at_rows([name])[0], values)
