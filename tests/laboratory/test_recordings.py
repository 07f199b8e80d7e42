"""Files of other programs: right numbers from every spelling, a named error from what is damaged, and round trips."""

import math

import numpy as np
import pytest

import mbd

TRC = """PathFileType\t4\t(X/Y/Z)\twalk.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
100\t100\t3\t2\tmm\t100\t1\t3
Frame#\tTime\tR ASI\t\t\tHEEL\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.00\t100\t200\t300\t1\t2\t3
2\t0.01\t110\t200\t300\t\t\t
3\t0.02\t120\t200\t300\t3\t2\t1
"""
STO = """gait
version=1
nRows=3
nColumns=4
inDegrees=yes
endheader
time\tknee_angle_r\tpelvis_tx\tground_force_vy
0.0\t90\t1.5\t700
0.1\t45\t1.6\t710
0.2\t0\t1.7\t720
"""
CSV = """time [s],knee [deg],HEEL.x [mm],HEEL.y [mm],HEEL.z [mm]
0,90,1000,2000,3000
0.1,45,1100,2000,3000
0.2,,1200,2000,
"""


def written(folder, name, text):
    path = folder / name
    path.write_bytes(text.encode("utf-8") if isinstance(text, str) else text)
    return path


TRC_VARIANTS = {
    "as it is": TRC,
    "CRLF": TRC.replace("\n", "\r\n"),
    "meters": TRC.replace("\tmm\t", "\tm\t").replace("100\t200\t300", "0.1\t0.2\t0.3").replace("110\t200", "0.11\t0.2")
    .replace("\t300\t\t\t", "\t0.3\t\t\t").replace("120\t200\t300", "0.12\t0.2\t0.3")
    .replace("\t1\t2\t3\n", "\t0.001\t0.002\t0.003\n").replace("\t3\t2\t1\n", "\t0.003\t0.002\t0.001\n"),
    "comma decimals": TRC.replace("0.00\t", "0,00\t").replace("0.01\t", "0,01\t").replace("0.02\t", "0,02\t"),
    "NaN gaps": TRC.replace("300\t\t\t\n", "300\tNaN\tnan\tNaN\n"),
    "zeros are gaps": TRC.replace("300\t\t\t\n", "300\t0\t0.0\t0\n"),
    "short rows": TRC.replace("300\t\t\t\n", "300\n"),
    "no empty line": TRC.replace("Z2\n\n", "Z2\n"),
    "trailing tabs": TRC.replace("\n", "\t\t\n").replace("\t\t\n", "\t\n", 3),
    "with a mark": b"\xef\xbb\xbf" + TRC.encode(),
    "UTF-16": TRC.encode("utf-16"),
    "no times": TRC.replace("0.00\t", "\t").replace("0.01\t", "\t").replace("0.02\t", "\t"),
    "other counts in the header": TRC.replace("100\t100\t3\t2", "100\t100\t5\t3"),
    "a spreadsheet's commas": "\n".join(f"{line}{',' * 3}" for line in TRC.replace("\t", ",").splitlines()),
    "millimeters": TRC.replace("\tmm\t", "\tMillimeters\t"),
    "exponents": TRC.replace("100\t200\t300", "1e2\t2.0E+2\t.3e3"),
}  # fmt: skip


@pytest.mark.parametrize("variant", TRC_VARIANTS)
def test_markers_are_read_from_every_spelling_of_a_trc(tmp_path, variant):
    found = mbd.read(written(tmp_path, "walk.trc", TRC_VARIANTS[variant]))
    assert found.time == pytest.approx([0.0, 0.01, 0.02])
    assert list(found.markers) == ["R ASI", "HEEL"]
    assert found["R ASI"] == pytest.approx(np.array([[0.1, 0.2, 0.3], [0.11, 0.2, 0.3], [0.12, 0.2, 0.3]]), abs=1e-15)
    assert np.isnan(found["HEEL"][1]).all()
    assert found["HEEL"][[0, 2]] == pytest.approx(np.array([[1e-3, 2e-3, 3e-3], [3e-3, 2e-3, 1e-3]]), abs=1e-18)
    assert found.gaps == {"HEEL": [(pytest.approx(0.01), pytest.approx(0.01))]}


def test_a_note_names_a_rate_that_the_times_contradict(tmp_path):
    assert mbd.read(written(tmp_path, "walk.trc", TRC)).notes == ("units: mm in the file",)
    found = mbd.read(written(tmp_path, "slow.trc", TRC.replace("100\t100\t3\t2\tmm", "50\t50\t3\t2\tmm")))
    assert found.time == pytest.approx([0.0, 0.01, 0.02])
    assert "the header promises 50 frames a second, the times tell 100; the times count" in found.notes


STO_VARIANTS = {
    "as it is": STO,
    "CRLF": STO.replace("\n", "\r\n"),
    "spaces": STO.replace("\t", "   "),
    "a spreadsheet's commas": "\n".join(f"{line}{',' * 3}" for line in STO.replace("\t", ",").splitlines()),
    "radians": STO.replace("inDegrees=yes", "inDegrees=no").replace("\t90\t", f"\t{math.pi / 2}\t")
    .replace("\t45\t", f"\t{math.pi / 4}\t"),
    "comma decimals": STO.replace("0.1\t", "0,1\t").replace("0.2\t", "0,2\t").replace("1.5", "1,5")
    .replace("1.6", "1,6").replace("1.7", "1,7"),
    "SIMM's header": STO.replace("nRows=3\nnColumns=4\ninDegrees=yes", "datacolumns 4\ndatarows 3\ninDegrees=yes"),
    "spaces about =": STO.replace("inDegrees=yes", "inDegrees = Yes "),
    "empty lines": STO.replace("endheader\n", "endheader\n\n"),
    "another count": STO.replace("nRows=3", "nRows=99"),
}  # fmt: skip


@pytest.mark.parametrize("variant", STO_VARIANTS)
@pytest.mark.parametrize("end", [".sto", ".mot"])
def test_channels_are_read_from_every_spelling_of_a_storage_file(tmp_path, variant, end):
    found = mbd.read(written(tmp_path, f"gait{end}", STO_VARIANTS[variant]))
    assert found["knee_angle_r"] == pytest.approx([math.pi / 2, math.pi / 4, 0.0])
    assert found["pelvis_tx"] == pytest.approx([1.5, 1.6, 1.7])
    assert found["ground_force_vy"] == pytest.approx([700.0, 710.0, 720.0])


@pytest.mark.parametrize("end", [".sto", ".csv"])
def test_a_storage_file_with_commas_between_its_cells_is_read(tmp_path, end):
    """As the CSV writer of OpenSim makes it."""
    found = mbd.read(written(tmp_path, f"gait{end}", STO.replace("\t", ",").replace("gait\n", "")))
    assert found["knee_angle_r"] == pytest.approx([math.pi / 2, math.pi / 4, 0.0])
    assert found["pelvis_tx"] == pytest.approx([1.5, 1.6, 1.7])


@pytest.mark.parametrize(("name", "swing", "doubted"), [
    ("knee_angle_r", 60.0, True), ("knee_angle_r", 1.05, False), ("wheel.length", 60.0, False),
])  # fmt: skip
def test_angles_in_degrees_under_a_header_of_radians_are_doubted(tmp_path, name, swing, doubted, recwarn):
    rows = [f"{k / 100}\t{swing * math.sin(k / 5) ** 2}" for k in range(60)]
    head = STO.partition("time\t")[0].replace("inDegrees=yes", "inDegrees=no")
    mbd.read(written(tmp_path, "gait.sto", head + f"time\t{name}\n" + "\n".join(rows) + "\n"))
    said = [str(each.message) for each in recwarn]
    assert [f"{name!r} swings to and fro by 60 rad, 9.5 turns; it is probably in degrees" in text for text in said] == (
        [True] if doubted else []
    )


@pytest.mark.parametrize(("name", "last", "doubted"), [
    ("knee_angle_r", 64.0, True), ("left hip.flexion", 35.0, True), ("hip flexion [deg]", 64.0, False),
    ("hip.flexion [rad]", 1.2, False), ("wheel.angle", 64.0, False), ("knee moment", 64.0, False),
])  # fmt: skip
def test_half_a_swing_of_a_joint_in_degrees_without_a_unit_is_doubted(tmp_path, name, last, doubted, recwarn):
    rows = [f"{k / 100},{5.0 + (last - 5.0) * k / 59}" for k in range(60)] if last > 2.0 else ["0,0", "0.1,1.2"]
    mbd.read(written(tmp_path, "swing.csv", f"time,{name}\n" + "\n".join(rows) + "\n"))
    said = [str(each.message) for each in recwarn]
    assert ["turns by" in text and "probably in degrees" in text for text in said] == ([True] if doubted else [])


CSV_VARIANTS = {
    "as it is": CSV,
    "semicolons and commas": CSV.replace(",", ";").replace(".1;", ",1;").replace("0.2;", "0,2;"),
    "tabs": CSV.replace(",", "\t"),
    "round brackets": CSV.replace("[", "(").replace("]", ")"),
    "underscores": CSV.replace("HEEL.", "HEEL_"),
    "a comment": "# made by a camera\n" + CSV,
    "quotes": CSV.replace("knee [deg]", '"knee [deg]"'),
    "capitals": CSV.replace("time [s]", "Time [s]"),
}


@pytest.mark.parametrize("variant", CSV_VARIANTS)
def test_tables_are_read_from_every_spelling_of_a_csv(tmp_path, variant):
    found = mbd.read(written(tmp_path, "gait.csv", CSV_VARIANTS[variant]))
    assert found["knee"][:2] == pytest.approx([math.pi / 2, math.pi / 4]) and math.isnan(found["knee"][2])
    assert found["HEEL"][:2] == pytest.approx(np.array([[1.0, 2.0, 3.0], [1.1, 2.0, 3.0]]))
    assert np.isnan(found["HEEL"][2]).all()


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.trc", "hello\n", "line 1: a marker file begins"),
        ("a.trc", TRC.replace("\tmm\t", "\tfurlong\t"), "line 3: units of length"),
        ("a.trc", TRC.replace("HEEL", "R ASI"), "line 4: two markers are called 'R ASI'"),
        ("a.trc", TRC.replace("110", "abc"), "line 8: column 3 holds 'abc'"),
        ("a.trc", TRC.replace("0.02", "0.01"), "line 9: the time does not increase"),
        ("a.trc", TRC.replace("\t3\t2\t1\n", "\t3\t2\t1\t7\n"), "line 9: 9 cells where the header has 8"),
        ("a.trc", TRC.replace("Z2\n", "Z2\tX3\tY3\tZ3\n"), "line 5: 9 columns of coordinates stand under 2 markers"),
        ("a.trc", TRC[: TRC.index("1\t0.00")], "no frames follow"),
        ("a.trc", TRC.replace("110", "1e999"), "no float can hold"),
        ("a.trc", TRC.replace("110", "1_000"), "holds '1_000'"),
        ("a.sto", STO.replace("endheader\n", ""), "a header that ends with 'endheader'"),
        ("a.sto", STO.replace("time\t", "frame\t"), "line 7: the first column must be called 'time'"),
        ("a.sto", STO.replace("pelvis_tx", "knee_angle_r"), "two columns are called 'knee_angle_r'"),
        ("a.sto", STO.replace("0.1\t", "\t"), "line 9: the time is missing"),
        ("a.csv", CSV.replace("time [s]", "frame"), "no column is called 'time'"),
        ("a.csv", CSV[CSV.index("\n") + 1 :], "a line with the names"),
        ("a.csv", "", "the file is empty"),
        ("a.csv", CSV.replace("1100", "x"), "line 3: column 3 holds 'x'"),
        ("a.txt", CSV, "a recording ends in .c3d"),
        ("a.csv", b"\0\0\0", "no text file"),
    ],
)
def test_what_is_wrong_in_a_file_is_named_with_its_line(tmp_path, name, text, words):
    with pytest.raises(mbd.TrajectoryError, match=words.replace("(", r"\(")):
        mbd.read(written(tmp_path, name, text))


def trial(rng, gaps=True):
    time = 0.25 + np.arange(40) / 100.0
    markers = {f"M{k}": rng.normal(size=(40, 3)) for k in range(5)}
    if gaps:
        markers["M2"][7:9] = np.nan
    fine = 0.25 + np.arange(400) / 1000.0
    force = np.abs(rng.normal(size=(400, 3))) * 100.0 + 20.0
    center = np.column_stack([rng.normal(size=400), np.zeros(400), rng.normal(size=400)])
    plate = mbd.PlateRecord.at("plate 1", fine, force, center, rng.normal(size=400))
    return mbd.Recording(time, markers, {"knee_angle_r": rng.normal(size=40)}, (plate,), events=((0.3, "Foot Strike"),))


@pytest.mark.parametrize("end", [".trc", ".csv"])
def test_markers_come_back_to_the_last_digit(tmp_path, end):
    given = trial(np.random.default_rng(0))
    found = mbd.read(given.save(tmp_path / f"walk{end}"))
    assert np.array_equal(found.time, given.time)
    for name, track in given.markers.items():
        assert np.array_equal(found[name], track, equal_nan=True)


@pytest.mark.parametrize("end", [".sto", ".csv"])
def test_channels_come_back_to_the_last_digit(tmp_path, end):
    given = trial(np.random.default_rng(1))
    found = mbd.read(given.save(tmp_path / f"walk{end}"))
    assert np.array_equal(found["knee_angle_r"], given["knee_angle_r"])


def test_plates_come_back_from_columns_of_forces_and_points(tmp_path):
    given = trial(np.random.default_rng(2))
    found = mbd.read(given.save(tmp_path / "walk.sto"))
    (plate,), (own,) = found.plates, given.plates
    assert plate.force == pytest.approx(own.force[::10], rel=1e-12)
    assert plate.moment == pytest.approx(own.moment[::10], rel=1e-9, abs=1e-9)
    assert found["plate 1.center"] == pytest.approx(own.center()[::10], rel=1e-9)
    assert found["plate 1.free_moment"] == pytest.approx(own.free_moment()[::10], rel=1e-7, abs=1e-9)


def test_a_run_comes_back_as_a_recording(tmp_path):
    model = mbd.Model("leg")
    rod = mbd.Link("shank", mass=1.0, length=1.0, center=0.5)
    model.connect(mbd.Revolute("knee", model.ground.origin, rod.start))
    run = mbd.simulate(model, mbd.assemble(model, position={"knee.angle": 0.5}), dt=1e-2, until=0.3)
    for name in ("swing.mot", "swing.sto"):
        found = mbd.read(run.to_sto(tmp_path / name, ["knee.angle", "shank.end"]))
        assert found["knee.angle"] == pytest.approx(run["knee.angle"], rel=1e-14)
        assert found["shank.end.x"] == pytest.approx(run["shank.end.x"], rel=1e-14)
    moved = mbd.inverse_dynamics(model, {"time": found.time, "knee.angle": found["knee.angle"]})
    assert np.abs(moved["knee.moment"][3:-3]).max() < 2e-3


def test_a_center_of_pressure_is_where_the_force_has_no_moment_but_a_vertical_one():
    plate = trial(np.random.default_rng(3)).plates[0]
    about = plate.moment - np.cross(plate.center(), plate.force)
    assert about[:, [0, 2]] == pytest.approx(np.zeros((400, 2)), abs=1e-9)
    assert about[:, 1] == pytest.approx(plate.free_moment(), abs=1e-9)


def test_short_gaps_are_filled_and_long_ones_stay():
    time = np.arange(100) / 100.0
    track = np.column_stack([np.sin(3.0 * time), np.cos(2.0 * time), time])
    true = track.copy()
    track[20:24], track[50:80], track[97:] = np.nan, np.nan, np.nan
    found = mbd.Recording(time, {"M": track}).filled(0.1)
    assert found["M"][20:24] == pytest.approx(true[20:24], abs=2e-6)  # max|x⁗| h⁴/384 = 81 · 0.05⁴/384 = 1.3e-6
    assert np.isnan(found["M"][50:80]).all() and np.isnan(found["M"][97:]).all()
    assert [note for note in found.notes if "1 gaps filled" in note] and [
        n for n in found.notes if "2 gaps longer" in n
    ]


@pytest.mark.parametrize(
    ("up", "forward", "vector"),
    [("z", "x", (1, 3, -2)), ("z", "y", (2, 3, 1)), ("-y", "z", (3, -2, 1)), ("x", "-z", (-3, 1, -2))],
)
def test_the_axes_of_a_file_are_turned_to_x_forward_and_y_up(tmp_path, up, forward, vector):
    given = mbd.Recording([0.0, 0.1], {"M": [(1.0, 2.0, 3.0)] * 2})
    found = mbd.read(given.save(tmp_path / "m.trc"), up=up, forward=forward)
    assert found["M"][0] == pytest.approx(vector)
    assert any("axes:" in note for note in found.notes)


@pytest.mark.parametrize("seed", range(2))
def test_a_c3d_comes_back_with_the_digits_that_it_has(tmp_path, seed):
    pytest.importorskip("ezc3d")
    given = trial(np.random.default_rng(seed))
    found = mbd.read(given.save(tmp_path / "walk.c3d"), forward="x")
    assert found.time == pytest.approx(given.time, rel=1e-6)
    for name, track in given.markers.items():
        assert found[name] == pytest.approx(track, rel=1e-5, abs=1e-6, nan_ok=True)
    assert found["plate 1.force"] == pytest.approx(given["plate 1.force"], rel=1e-5, abs=1e-3)
    assert found["plate 1.moment"] == pytest.approx(given["plate 1.moment"], rel=1e-4, abs=1e-2)
    assert found["plate 1.center"] == pytest.approx(given["plate 1.center"], rel=1e-3, abs=1e-3)
    assert found.events == ((pytest.approx(0.3), "Foot Strike"),)


def test_forward_of_a_c3d_is_where_the_markers_go(tmp_path):
    pytest.importorskip("ezc3d")
    time = np.arange(50) / 100.0
    track = np.column_stack([-2.0 * time, 0.1 + 0.0 * time, 0.3 + 0.0 * time])
    found = mbd.read(mbd.Recording(time, {"M": track}).save(tmp_path / "walk.c3d"))
    assert found["M"][-1] == pytest.approx([0.98, 0.1, -0.3], abs=1e-6)
    assert any("its -x forward, along which the markers move" in note for note in found.notes)


def test_without_its_library_a_c3d_names_the_extra(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "ezc3d", None)
    path = written(tmp_path, "walk.c3d", "x")
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'mbd\[c3d\]'"):
        mbd.read(path)
