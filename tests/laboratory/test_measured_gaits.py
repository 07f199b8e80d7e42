"""Reports of measured gaits: beside the simulation that they come from, from events alone, with a band behind."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mbd
from mbd import cli
from mbd.errors import TrajectoryError
from mbd.laboratory.command import measured, model_of_file
from mbd.scripts import folder


@cache
def walked():
    """The walker of the example, and what plates under its feet measured."""

    source = (folder() / "from_the_laboratory.py").read_text().partition("# the trial, which a laboratory has")[0]
    names = {"__name__": "words"}
    exec(compile(source, "from_the_laboratory.py", "exec"), names)
    model, start = names["walker"](0.8, 160.0)
    for side in "left", "right":
        for name, part, place in (
            ("KNE", "shank", (0.0, 0.0)),
            ("TIB", "shank", (0.05, -0.2)),
            ("TOE", "foot", (0.1, -0.06)),
        ):
            mbd.Marker(f"{side[0].upper()}{name}", model.bodies[f"{side} {part}"], place)
    mbd.Marker("HIP", model.bodies["hip"].origin)
    feet = [model.bodies[name].points[f"{name}.ball"] for name in ("left foot", "right foot")]
    film = mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=1e-3, until=4.0)
    time = np.arange(0.0, 4.0, 0.001)
    seen = film.at(time)
    plates = []
    for number, foot in enumerate(feet, 1):
        force = np.column_stack([seen[f"{foot.body.name[:-5]} ball.{part}"] for part in ("friction", "force")])
        force = np.nan_to_num(np.column_stack([force, 0.0 * time]))
        center = seen[foot.full_name] * [1.0, 0.0, 1.0]
        record = mbd.PlateRecord.at(f"plate {number}", time, force, center, height=0.0)
        plates.append(mbd.ForcePlate(f"plate {number}", foot, record))
    motion = {"time": time} | {c.name: seen[c.name] for c in film.record.equations.coordinates}
    return model, film, mbd.inverse_dynamics(model, motion, plates=plates)


def test_what_was_measured_stands_beside_what_was_simulated():
    _, film, moments = walked()
    report = mbd.gait_report(moments, film, names=("measured", "simulated"), mass=70.0, strides=1)
    measured, simulated = report.walks
    for quantity, least in (("step length", 1e-6), ("stride time", 3e-3), ("stance", 0.5), ("speed", 3e-3)):
        for side in ("left", "right"):
            assert measured[quantity][side] == pytest.approx(simulated[quantity][side], abs=least), quantity
    assert measured["normal impulse"]["left"] == pytest.approx(simulated["normal impulse"]["left"], rel=0.1)
    curves = {(c.side, c.subject, c.quantity): c for c in simulated.curves}
    compared = 0
    for curve in measured.curves:
        other = curves[curve.side, curve.subject, curve.quantity]
        assert curve.unit == other.unit
        if curve.quantity == "angle":
            assert np.abs(curve.mean - other.mean)[2:-2].max() < 1.0
            compared += 1
        if curve.quantity in ("moment", "power") and curve.subject == "knee" and curve.side == "right":
            swing = slice(72, 88)  # between impacts
            assert np.abs(curve.mean - other.mean)[swing].max() < 0.03
            compared += 1
    assert compared >= 6
    assert "measured: strides" in str(report) and "–" in str(report)


def recording():
    """Both feet strike in turn, a heel stands where it struck."""
    time = np.arange(0.0, 3.2, 0.01)
    strikes = {"left": (0.3, 1.4, 2.5), "right": (0.85, 1.95, 3.05)}
    markers, channels, events, plates = {}, {}, [], []
    for side, own in strikes.items():
        heel = np.zeros((len(time), 3))
        heel[:, 0] = np.interp(time, own, [0.66 * 2 * k + (0.66 if side == "right" else 0.0) for k in range(3)])
        markers[f"{side[0].upper()}HEE"] = heel
        phase = (time - own[0]) / 1.1 * 2.0 * np.pi
        channels[f"knee_angle_{side[0]}"] = np.radians(30.0 - 30.0 * np.cos(phase))
        events += [(t, f"{side.title()} Foot Strike") for t in own] + [
            (t + 0.66, f"{side.title()} Foot Off") for t in own
        ]
        force = np.zeros((len(time), 3))
        for t in own:
            force[(time >= t) & (time < t + 0.66), 1] = 700.0
        plates.append(mbd.PlateRecord.at(f"plate {side}", time, force, heel, height=0.0))
    return mbd.Recording(time, markers, channels, tuple(plates), events=tuple(sorted(e for e in events if e[0] < 3.2)))


def test_a_recording_alone_reports_its_events_angles_and_plates():
    report = mbd.gait_report(recording(), strides=1)
    (walk,) = report.walks
    assert walk["stride time"]["left"] == pytest.approx(1.1)
    assert walk["step time"] == pytest.approx({"left": 0.55, "right": 0.55})
    assert walk["stride length"]["left"] == pytest.approx(1.32)
    assert walk["stance"]["right"] == pytest.approx(60.0)
    assert walk["double support"]["left"] == pytest.approx(20.0)
    assert walk["normal impulse"]["left"] == pytest.approx(700.0 * 0.66, rel=0.02)
    knee = next(c for c in walk.curves if (c.side, c.subject, c.quantity) == ("left", "knee", "angle"))
    assert knee.mean[50] == pytest.approx(60.0, abs=0.1) and knee.unit == "°"
    with pytest.raises(mbd.MbdError, match=r"strikes were none; .* plates: mbd gait FILE --model leg.osim"):
        mbd.gait_report(replace(recording(), events=()))


def band_file(folder, text=None):
    path = folder / "normal.csv"
    lines = ["stride [%],knee angle low [deg],knee angle high [deg],hip moment mean,hip moment sd"]
    lines += [f"{p},{5 + 20 * np.sin(p / 30)},{15 + 22 * np.sin(p / 30)},{0.2},{0.1}" for p in range(0, 101, 2)]
    path.write_text("\n".join(lines) if text is None else text)
    return path


def test_a_band_lies_behind_the_curves_with_its_source(tmp_path):
    pytest.importorskip("matplotlib")
    band = mbd.read_band(band_file(tmp_path), source="invented for this test")
    assert band.curves["hip", "moment"][1] == pytest.approx(np.full(51, 0.1))
    assert "knee angle" in repr(band) and "invented" in repr(band)
    assert band.of("hip", "moment", "N m") is None and band.of("hip flexion", "moment", "N m/kg") is not None
    report = mbd.gait_report(recording(), band=band, mass=70.0)
    figure = report.plot()
    assert "invented for this test" in figure.legends[0].get_texts()[-1].get_text()
    assert "invented for this test" in str(report)
    assert "invented for this test" in report.page(tmp_path / "gait.html").read_text(encoding="utf-8")
    schwartz = {"Invented2026": {"Free": {"KneeAngles": {"X": [[0, 3.0, 1.0], [50, 2.0, 4.0], [100, 1.0, 3.0]]}}}}
    (tmp_path / "normal.json").write_text(json.dumps(schwartz))
    read = mbd.read_band(tmp_path / "normal.json")
    assert read.source == "Invented2026, Free"
    np.testing.assert_array_equal(read.curves["knee", "angle"][1], [1.0, 2.0, 1.0])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a\n1\n2", "has no column beside the percent"),
        ("%,knee angle low\n0,1\n100,2", "needs the columns low and high"),
        ("%,knee low,knee high\n0,1,2\n100,1,2", "called like 'knee angle low'"),
        ("%,knee angle low,knee angle high\n0,1,x\n100,2,3", "line 2: 3 numbers"),
        ("%,knee angle low,knee angle high\n0\n100,2,3", "line 2: 3 numbers"),
        ("%,knee angle low,knee angle high\n0,4,1\n100,2,3", "low ≤ high"),
    ],
)
def test_a_table_that_is_no_band_is_named(text, sentence, tmp_path):
    with pytest.raises(mbd.ModelError, match=sentence):
        mbd.read_band(band_file(tmp_path, text))


def test_what_a_measured_gait_lacks_is_named():
    _, _, moments = walked()
    with pytest.raises(TrajectoryError, match="no plate under a foot of the side 'sound'"):
        mbd.gait_report(moments, sides=("sound", "prosthetic"))
    with pytest.raises(TrajectoryError, match="'Left Foot Strike'"):
        mbd.gait_report(replace(recording(), events=()))
    with pytest.raises(mbd.ModelError, match="band of gait_report"):
        mbd.gait_report(recording(), band="Schwartz")


def test_the_command_reports_a_recording(tmp_path, capsys):
    pytest.importorskip("ezc3d")
    recording().save(tmp_path / "walk.c3d")
    band = band_file(tmp_path)
    code = cli.main(["gait", str(tmp_path / "walk.c3d"), "--out", str(tmp_path / "out"), "--band", str(band)])
    printed = capsys.readouterr().out
    assert code == 0, printed
    assert "walk: strides" in printed and "stride time [s]" in printed
    assert "energy of a stride" not in printed  # which markers do not tell
    assert {file.name for file in (tmp_path / "out").iterdir()} >= {"gait.html"}


def test_the_command_takes_a_model_for_moments(tmp_path, capsys):
    """Markers and plates in two files, and a script that defines the model and its feet."""
    script = tmp_path / "person.py"
    script.write_text("import mbd\nmodel = mbd.Model('block')\nfeet = []\n")
    recording().save(tmp_path / "walk.trc")
    assert cli.main(["gait", str(tmp_path / "walk.trc"), "--model", str(script), "--out", str(tmp_path / "out")]) != 0
    assert "has no force plates, and no .mot or .sto lies beside it" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_goes_from_a_c3d_and_an_osim_to_moments(tmp_path, capsys):
    """The walker as OpenSim would have it, filmed into a file that ezc3d writes: the moments of the simulation."""
    pytest.importorskip("ezc3d")
    model, film, moments = walked()
    markers = [f"{side}{name}" for side in "LR" for name in ("KNE", "TIB", "TOE")]
    mbd.film(film, ["HIP", *markers], rate=200.0).save(tmp_path / "walk.c3d")
    without = [word.name for word in model.constraints] + ["right knee loss", "right ankle loss", "right ankle spring"]
    mbd.write_model(model.without(*without), tmp_path / "leg.osim")
    arguments = [
        "gait",
        str(tmp_path / "walk.c3d"),
        "--model",
        str(tmp_path / "leg.osim"),
        "--out",
        str(tmp_path / "out"),
    ]
    assert cli.main(arguments) == 0
    printed = capsys.readouterr().out
    assert "7 bodies and 7 joints" in printed and "feet: 'left_foot', 'right_foot'" in printed
    assert "step length [m]" in printed and "walk: strides" in printed
    found = measured(str(tmp_path / "walk.c3d"), *model_of_file(str(tmp_path / "leg.osim"), None))
    for joint in "right ankle", "right knee", "left knee":
        truth = np.interp(found.time, moments.time, moments[f"{joint}.net_moment"])
        off = found[f"{joint.replace(' ', '_')}.moment"] - truth
        assert np.median(np.abs(off)) < 0.03 * np.ptp(truth), joint  # the filter blurs the time around impacts
    assert cli.main([*arguments, "--feet", "calcn_r"]) != 0
    assert "--feet: " in capsys.readouterr().err
