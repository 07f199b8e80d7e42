"""Reports of gaits: figures of a known walk, balances over a stride, symmetry, files, and what is refused."""

import runpy
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import mbd
from mbd import cli
from mbd.analysis.gait_report.curves import forces_at
from mbd.analysis.gait_report.measures import Measure, largest
from mbd.analysis.gait_report.report import symmetry_of
from mbd.analysis.gait_report.strides import sides_of
from mbd.errors import ModelError, TrajectoryError, UnknownNameError
from tests.simulation.mechanisms import falling, kneed_walker, kneed_walker_start


@cache
def walk():
    model = kneed_walker()
    return mbd.simulate(model, kneed_walker_start(model), mbd.HHT(alpha=0.05), dt=1e-3, until=3.0)


@cache
def report():
    return mbd.gait_report(walk())


def weight():
    values = walk().parameters
    bodies = [name.removesuffix(".mass") for name in values if name.endswith(".mass")]
    return sum(values[f"{body}.mass"] for body in bodies), -values["gravity.y"]


def test_a_symmetric_walker_has_equal_sides():
    first = report().walks[0]
    for quantity in ("step length", "stride time", "stance", "clearance", "peak normal force"):
        left, right = first[quantity].values()
        assert left == pytest.approx(right, rel=1e-3), quantity
    assert first["step length"]["left"] == pytest.approx(0.4727, abs=2e-4)
    assert first["stride length"]["left"] == pytest.approx(2.0 * first["step length"]["right"], rel=1e-3)
    assert first["stance"]["left"] + first["swing"]["left"] == pytest.approx(100.0)
    assert first["double support"] == {"left": 0.0, "right": 0.0}  # one foot lets go as the other strikes


def test_the_ground_carries_the_weight_over_a_stride():
    """Momentum along the normal repeats itself: the normal impulses of both feet are m g_n T."""
    mass, normal = weight()
    both = sum(report()["normal impulse"].values())
    assert both == pytest.approx(mass * normal * report()["stride time"]["left"], rel=2e-4)


def rolling_compass():
    """Two legs in the plane on round feet, which roll without slip."""
    model, reach = mbd.Model("rolling compass", gravity=mbd.on_slope(0.03)), 0.3
    hip = mbd.PointMass("hip", 45.0)
    model.connect(mbd.Translation("place", model.ground.origin, hip.origin))
    legs = {side: mbd.Link(f"{side} leg", 12.0, 1.0 - reach, 0.36, 0.5) for side in ("left", "right")}
    feet = {side: leg.end for side, leg in legs.items()}
    for side, other in ("left", "right"), ("right", "left"):
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
        ahead = mbd.measure(lambda this, that: this[0] - that[0] - 0.1, feet[side], feet[other])
        edge, release = mbd.touchdown(feet[side], mbd.Plane(offset=reach)), mbd.When(f"{other} foot")
        model.constrain(mbd.Unilateral(f"{side} foot", edge, friction=0, release=release, only_while=ahead))
        model.constrain(mbd.Rolling(f"{side} grip", feet[side], reach, only_while=f"{side} foot"))
    start = mbd.assemble(
        model,
        closed="left foot",
        position={"left hip.angle": 0.326, "right hip.angle": -0.317},
        velocity={"left hip.angle": -1.127, "right hip.angle": -0.560},
    )
    return model, start


def kneed():
    model = kneed_walker()
    return model, kneed_walker_start(model)


@pytest.mark.parametrize("walker", [kneed, rolling_compass])
def test_impulses_of_a_gait_with_those_of_all_impacts_are_the_weight_and_its_part_down_the_slope(walker):
    """A foot that stands is pushed as a knee locks; feet that roll are held as they strike."""
    model, start = walker()
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    run = mbd.simulate(model, gait.state, mbd.RungeKutta853(), dt=2e-3, until=4.1 * gait.period)
    found = mbd.gait_report(run)
    mass = sum(value for name, value in run.parameters.items() if name.endswith(".mass"))
    for axis, quantity in ("x", "forward impulse"), ("y", "normal impulse"):
        half = -0.5 * mass * run.parameters[f"gravity.{axis}"] * found["stride time"]["left"]
        assert list(found[quantity].values()) == pytest.approx([half, half], rel=1e-8), quantity
    forward = [each for each in found.walks[0].curves if each.quantity == "forward force"]
    assert all(np.max(np.abs(each.mean)) > 0.1 for each in forward)


@cache
def rocking():
    """A walk in space on disk feet that roll, from its limit cycle."""
    names = runpy.run_path(str(cli.examples()["walker-in-space"]))
    return mbd.simulate(names["model"], names["start"], names["integrator"], dt=names["dt"], until=4.0)


def test_the_impulses_of_a_walk_that_repeats_itself_are_its_weight_in_equal_parts():
    """Forces jump where a foot lets go, anywhere between two samples."""
    run = rocking()
    mass = sum(value for name, value in run.parameters.items() if name.endswith(".mass"))
    found = mbd.gait_report(run)
    for axis, quantity in ("x", "forward impulse"), ("y", "normal impulse"):
        half = -0.5 * mass * run.parameters[f"gravity.{axis}"] * found["stride time"]["left"]
        assert list(found[quantity].values()) == pytest.approx([half, half], rel=1e-6), quantity


def test_forces_of_feet_that_roll_are_what_moves_the_center_of_mass():
    """The change of momentum between two strikes is the impulse of both feet and of the weight."""
    run, (begin, end) = rocking(), (0.9, 1.4)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    times = begin + (end - begin) * (nodes + 1.0) / 2.0
    masses = {name: value for name, value in run.parameters.items() if name.endswith(".mass")}
    for axis, quantity in ("x", "forward force"), ("y", "normal force"):
        feet = [SimpleNamespace(name=side, contacts=(f"{side} foot",)) for side in ("left", "right")]
        forces = sum(forces_at(run, foot, times)[quantity] for foot in feet)
        given = 0.5 * (end - begin) * (weights @ forces) + sum(masses.values()) * run.parameters[f"gravity.{axis}"] * (
            end - begin
        )
        first, last = (
            sum(m * run.at(t)[f"{name.removesuffix('.mass')}.center.v{axis}"] for name, m in masses.items())
            for t in (begin, end)
        )
        assert last - first == pytest.approx(given, rel=1e-9)
    curves = [each for each in mbd.gait_report(run).walks[0].curves if each.quantity == "forward force"]
    assert len(curves) == 2 and all(np.max(np.abs(each.mean)) > 1.0 for each in curves)


def test_energy_by_side_and_cause_is_what_gravity_gives():
    mass, _ = weight()
    first = report().walks[0]
    given = mass * walk().parameters["gravity.x"] * first["stride length"]["left"]
    assert sum(first.spent().values()) == pytest.approx(-given, rel=2e-3)
    assert first.spent()["left", "impact"] == pytest.approx(first.spent()["right", "impact"], rel=2e-2)


def test_net_moments_are_those_of_inverse_dynamics():
    """The moment of a locked knee turns the shank against the thigh as Newton and Euler have it: that of its lock."""
    curves = {(curve.side, curve.title): curve for curve in report().walks[0].curves}
    moment, angle = (curves["left", f"knee {quantity}"].mean for quantity in ("moment", "angle"))
    locked = np.abs(angle) < 1e-6
    locked[[0, -1]] = False
    stride = mbd.gait_report(walk(), strides=1).walks[0]
    time = stride.sides[0].strides[0]
    shares = np.array([0.1, 0.25, 0.4])
    lock = walk().at(time.begin + shares * time.duration)["left knee lock.force"]
    here = {(curve.side, curve.title): curve for curve in stride.curves}["left", "knee moment"].mean
    np.testing.assert_allclose(here[[10, 25, 40]], lock, rtol=1e-6)  # in the sense of flexion
    assert np.max(np.abs(moment[~locked][1:-1])) <= np.max(np.abs(moment))
    assert np.all(curves["left", "hip moment"].mean == 0.0)


@pytest.mark.parametrize("side", ["left", "right"])
def test_flexion_of_a_knee_is_positive(side):
    """The opposite of the coordinate, which is negative where the knee bends; power stays moment times rate."""
    stride = mbd.gait_report(walk(), strides=1).walks[0]
    curves = {(curve.side, curve.title): curve.mean for curve in stride.curves}
    times = stride.sides[["left", "right"].index(side)].strides[0]
    shares = np.array([0.2, 0.5, 0.6, 0.7])
    bent = walk().at(times.begin + shares * times.duration)
    np.testing.assert_allclose(
        curves[side, "knee angle"][[20, 50, 60, 70]], -np.rad2deg(bent[f"{side} knee.angle"]), atol=1e-9
    )
    assert np.max(curves[side, "knee angle"]) > 20.0 and np.min(curves[side, "knee angle"]) > -1e-6
    moment, power = (curves[side, f"knee {quantity}"][[20, 60]] for quantity in ("moment", "power"))
    np.testing.assert_allclose(power, -moment * bent[f"{side} knee.angle.rate"][[0, 2]], atol=1e-9)


def test_mass_divides_loads():
    by = mbd.gait_report(walk(), mass=2.0, strides=1)
    assert by["peak normal force"]["left"] == pytest.approx(report()["peak normal force"]["left"] / 2.0, rel=1e-3)
    units = {measure.quantity: measure.unit for measure in by.walks[0].measures}
    assert units["peak normal force"] == "N/kg" and units["step length"] == "m"


@pytest.mark.parametrize(("name", "value"), [("Robinson", 40.0), ("ratio", 2.0 / 3.0), ("STA", 0.2)])
def test_symmetry_is_as_defined(name, value):
    assert symmetry_of(name)[1](0.6, 0.4) == pytest.approx(value)


@pytest.mark.parametrize("seed", range(5))
def test_the_index_of_robinson_is_never_negative_nor_beyond_200(seed):
    s, p = np.random.default_rng(seed).normal(size=2)
    for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        here = (signs[0] * abs(s), signs[1] * abs(p))
        assert 0.0 <= symmetry_of("Robinson")[1](*here) <= 200.0
        assert abs(symmetry_of("STA")[1](*here)) <= 1.0 and np.sign(symmetry_of("STA")[1](*here)) == np.sign(
            here[0] - here[1]
        )


def test_where_braking_and_driving_cancel_there_is_no_index():
    first, gross = report().walks[0], {"left": 10.0, "right": 10.0}
    for mean, dash in (({"left": 1e-3, "right": -2e-3}, True), ({"left": 0.3, "right": -0.2}, False)):
        measure = Measure("forward impulse", "N s", mean, mean, gross)
        assert np.isnan(report().asymmetry(first, measure)) == dash
    (forward,) = (each for each in first.measures if each.quantity == "forward impulse")
    assert all(forward.gross[side] >= abs(forward.mean[side]) > 0.0 for side in ("left", "right"))


@pytest.mark.parametrize("seed", range(6))
def test_the_largest_value_is_found_between_samples_and_at_jumps(seed):
    rng = np.random.default_rng(seed)
    breaks, place, width = np.sort(rng.uniform(0.0, 1.0, 4)), rng.uniform(0.2, 0.8), rng.uniform(3e-3, 0.1)
    heights = rng.uniform(0.0, 0.5, 5)

    def values(times, at):
        part = np.searchsorted(breaks, times, side="right" if at == "after" else "left")
        return heights[part] * np.exp(-3.0 * times) + np.exp(-(((times - place) / width) ** 2))

    dense = np.concatenate([np.linspace(0.0, 1.0, 400_001), place + width * np.linspace(-0.1, 0.1, 40_001)])
    expected = max(values(dense, "after").max(), values(breaks, "after").max(), values(breaks, "before").max())
    assert largest(values, [(0.0, 1.0)], breaks) == [pytest.approx(expected, rel=1e-7)]


@pytest.mark.parametrize("seed", range(4))
def test_intervals_asked_for_together_have_the_maxima_that_each_has_alone(seed):
    rng = np.random.default_rng(seed)
    breaks = np.sort(rng.uniform(0.0, 3.0, 5))
    intervals = [tuple(np.sort(rng.uniform(0.0, 3.0, 2))) for _ in range(4)]
    calls = []

    def values(times, at):
        calls.append(len(times))
        return np.searchsorted(breaks, times, side="right" if at == "after" else "left") % 3 + np.sin(7.0 * times)

    together, asked = largest(values, intervals, breaks), len(calls)
    assert together == [largest(values, [one], breaks)[0] for one in intervals]
    assert asked == len(calls) - len(intervals) * asked == 10  # twice at first and in each of four refinements
    assert largest(values, [], breaks) == []


def test_a_peak_is_that_of_the_run_at_all_times():
    stride = sides_of(walk(), ("left", "right"), 1)[0].strides[-1]
    side = sides_of(walk(), ("left", "right"), 1)[0]
    rows = walk().time[(walk().time >= stride.begin) & (walk().time <= stride.end)]
    forces = [forces_at(walk(), side, rows[1:-1], at)["normal force"].max() for at in ("before", "after")]
    forces.append(forces_at(walk(), side, rows[:1], "after")["normal force"][0])
    assert mbd.gait_report(walk(), strides=1)["peak normal force"]["left"] >= max(forces) * (1.0 - 1e-9)


@pytest.mark.parametrize("name", ["left\nright", "\x1b[2J", "a\x00"])
def test_names_of_reports_move_no_cursor(name):
    with pytest.raises(ModelError, match="names of gait_report: .* holds no control characters"):
        mbd.gait_report(walk(), names=[name])


def test_no_cell_of_a_table_is_a_formula(tmp_path):
    pandas = pytest.importorskip("pandas")
    mbd.gait_report(walk(), names=["=1+1"], strides=1).to_csv(tmp_path / "gait.csv")
    for file in ("gait.csv", "gait-energy.csv"):
        assert set(pandas.read_csv(tmp_path / file).run) == {"'=1+1"}
    assert pandas.read_csv(tmp_path / "gait-curves.csv").columns[1].startswith("'=1+1")
    model, _ = falling()
    start = mbd.assemble(model, backend="python")
    swept = mbd.sweep(model, {"dt": [0.1]}, start, {"@SUM": lambda run: -1.0}, until=0.1, backend="python")
    lines = swept.to_csv(tmp_path / "sweep.csv").read_text().splitlines()
    assert lines[0] == "dt,'@SUM,success,message" and lines[1].startswith("0.1,-1.0,True")


def test_runs_stand_beside_each_other_and_gaits_for_runs():
    class Gait:
        run = walk()

    both = mbd.gait_report(walk(), Gait(), strides=1)
    first, second = "kneed walker (1)", "kneed walker (2)"
    assert [each.name for each in both.walks] == [first, second]
    assert both.heads[:4] == (
        "quantity",
        f"{first}: left",
        f"{first}: right",
        f"{first}: symmetry index (Robinson) [%]",
    )
    assert both.walks[0]["speed"] == both.walks[1]["speed"]
    assert "energy of a stride" in repr(both) and "<table" in both._repr_html_()


def test_tables_are_written(tmp_path):
    pandas = pytest.importorskip("pandas")
    report().to_csv(tmp_path / "gait.csv")
    numbers = pandas.read_csv(tmp_path / "gait.csv")
    assert set(numbers.side) == {"left", "right", "Robinson"}
    assert pandas.read_csv(tmp_path / "gait-curves.csv").shape[0] == 101
    assert pandas.read_csv(tmp_path / "gait-energy.csv")["energy [J]"].sum() < 0.0


@pytest.mark.slow
def test_picture_and_page_are_written(tmp_path):
    pytest.importorskip("matplotlib")
    report().plot(tmp_path / "gait.png")
    assert (tmp_path / "gait.png").stat().st_size > 10000
    page = report().page(tmp_path / "gait.html").read_text(encoding="utf-8")
    assert "<svg" in page and "step length [m]" in page and "src=" not in page and "<link" not in page


@pytest.mark.slow
def test_the_command_reports_a_script(tmp_path, capsys):
    script = tmp_path / "walker.py"
    script.write_text("from tests.analysis.test_gait_report import walk\n\n\ndef main():\n    return walk()\n")
    assert cli.main(["gait", str(script), "--out", str(tmp_path / "out"), "--strides", "2", "--symmetry", "STA"]) == 0
    assert "walker: strides 2 left, 2 right" in capsys.readouterr().out
    assert {file.name for file in (tmp_path / "out").iterdir()} >= {"gait.csv", "gait.png", "gait.html"}


def test_what_has_no_strides_is_named():
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
    model = mbd.Model("pendulum")
    model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start))
    swing = mbd.simulate(model, mbd.assemble(model), mbd.HHT(), dt=0.1, until=0.2, backend="python")
    with pytest.raises(TrajectoryError, match="no foot of the side 'left'"):
        mbd.gait_report(swing)
    walker = kneed_walker()
    short = mbd.simulate(walker, kneed_walker_start(walker), mbd.HHT(0.05), dt=1e-3, until=0.7)
    with pytest.raises(TrajectoryError, match=r"no whole stride of the side .* strikes were left"):
        mbd.gait_report(short)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"symmetry": "robinson"}, "Robinson"), ({"mass": -1.0}, "mass of gait_report"), ({"strides": 0}, "strides"),
        ({"sides": ("left", "left")}, "sides"), ({"names": ("a", "b")}, "2 names and 1 runs"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_named(given, told):
    with pytest.raises((ModelError, UnknownNameError), match=told):
        mbd.gait_report(walk(), **given)


def test_curves_of_a_report_are_read_back_from_a_storage_file(tmp_path):
    head, _, rest = report().to_sto(tmp_path / "gait.sto").read_text().partition("endheader\n")
    labels, *lines = rest.splitlines()
    numbers = np.array([line.split("\t") for line in lines], dtype=float)
    assert "inDegrees=yes" in head and f"nRows={len(lines)}" in head
    for curve in report().walks[0].curves:
        label = f"{report().walks[0].name} {curve.side} {curve.subject} {curve.quantity}".replace(" ", "_")
        np.testing.assert_array_equal(numbers[:, labels.split("\t").index(label)], curve.mean)
