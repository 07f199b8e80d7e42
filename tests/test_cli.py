"""The command line, called as a user calls it."""

import json
import os
import re
import subprocess
import sys
import warnings
from functools import partial
from hashlib import sha256

import numpy as np
import pytest

import mbd
from mbd import cli, scripts
from mbd.errors import SimulationError
from mbd.view.parser import writable
from tests.view.handmade_runs import walker

WALK = '''"""A walk made by hand."""
from tests.view.handmade_runs import walker

def main():
    return walker(steps=5)
'''

PENDULUM = '''"""A pendulum."""
import mbd

model = mbd.Model("pendulum")
rod = mbd.Link("rod", mass=1.0, length=1.0, center=1.0)
model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start))
start = mbd.assemble(model, position={"pivot.angle": 0.3})
integrator = mbd.HHT(alpha=0.05)
dt, until = 0.01, 0.5
'''


@pytest.fixture
def script(tmp_path, monkeypatch):
    """Write a script into an empty folder, which is also where the command runs."""
    monkeypatch.chdir(tmp_path)

    def write(text: str, name: str = "my_walk.py"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


def test_run_writes_plots_page_run_and_record(script, tmp_path, capsys):
    assert cli.main(["run", script(WALK)]) == 0
    out = tmp_path / "mbd-runs" / "my-walk"
    kinds = {path.name for path in out.iterdir()}
    assert kinds == {
        "page.html",
        "run.mbd.npz",
        "coordinates.png",
        "energy.png",
        "phase.png",
        "forces.png",
        "record.json",
    }
    text = capsys.readouterr().out
    assert "Trajectory of 'walker'" in text and "length [m]" in text and "page.html" in text
    again = mbd.load(out / "run.mbd.npz")
    np.testing.assert_array_equal(again["left foot.force"], walker(steps=5)["left foot.force"])


def test_the_record_tells_how_the_run_came_about(script, tmp_path, capsys):
    assert cli.main(["run", script(WALK), "--out", str(tmp_path / "here")]) == 0
    record = json.loads((tmp_path / "here" / "record.json").read_text())
    assert record["versions"]["mbd"] == mbd.__version__ and record["versions"]["numpy"] == np.__version__
    assert record["settings"]["dt"] == 0.01 and record["statistics"]["steps"] > 0 and record["success"] is True
    assert record["machine"]["architecture"] and set(record["wall_times"]) == {"load", "simulate"}
    assert [step["foot"] for step in record["steps"]] == ["right foot", "left foot", "right foot", "left foot"]
    assert sum(v for k, v in record["energy"].items() if k != "change") == pytest.approx(record["energy"]["change"])
    capsys.readouterr()


def test_run_simulates_what_a_script_defines(script, tmp_path, capsys):
    assert cli.main(["run", script(PENDULUM, "pendulum.py"), "--until", "0.2", "--out", "out"]) == 0
    run = mbd.load(tmp_path / "out" / "run.mbd.npz")
    assert run.time[-1] == pytest.approx(0.2) and run.settings["dt"] == 0.01
    assert run.energy.drift < 1e-3
    capsys.readouterr()


def test_a_failed_run_is_told_and_kept(script, tmp_path, capsys):
    text = "from mbd.errors import SimulationError\nfrom tests.view.handmade_runs import ball\ndef main():\n"
    text += "    raise SimulationError('t = 1 s: Newton stalled; try a smaller dt', ball())\n"
    assert cli.main(["run", script(text), "--out", "out"]) == 1
    told = capsys.readouterr()
    assert told.err == "error: t = 1 s: Newton stalled; try a smaller dt\n"
    assert (tmp_path / "out" / "run.mbd.npz").is_file() and (tmp_path / "out" / "page.html").is_file()


def test_debug_shows_where_an_error_came_from(script):
    path = script("from mbd.errors import SimulationError\ndef main():\n    raise SimulationError('stalled')\n")
    with pytest.raises(SimulationError):
        cli.main(["run", path, "--debug"])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("model = 1\n", "my_walk.py does not define start, dt, until; a script defines"),
        ("def main():\n    return 3\n", "main() of my_walk.py must return the run of mbd.simulate, got int"),
        ("x = 1\ny = x / 0\n", "line 2 of my_walk.py: ZeroDivisionError: division by zero"),
        ("def main(:\n", "SyntaxError: "),
    ],
)
def test_a_wrong_script_is_told_in_one_line(script, capsys, text, told):
    assert cli.main(["run", script(text)]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"error: {told}") and error.count("\n") == 1


def test_check_wants_a_model(script, capsys):
    assert cli.main(["check", script("model = 3\n")]) == 1
    assert "model of my_walk.py must be an mbd.Model" in capsys.readouterr().err


def test_effects_of_a_script_with_a_tolerance_ask_for_a_step(script, capsys):
    assert cli.main(["effects", script("model = start = 1\ntol, until = 1e-6, 1.0\n")]) == 1
    assert "give --dt SECONDS" in capsys.readouterr().err


def test_another_step_is_refused_where_main_chooses_it(script, capsys):
    assert cli.main(["run", script(WALK), "--dt", "0.1"]) == 1
    said = capsys.readouterr().err
    assert "runs its own main(), so dt must be changed in the script; nothing was run" in said
    assert "give main the argument dt" in said


def test_an_unknown_example_gets_the_nearest_name(monkeypatch, tmp_path, capsys):
    (tmp_path / "kneed_walker.py").write_text('"""A walker with knees.\n\nMore."""\n')
    monkeypatch.setattr(scripts, "folder", lambda: tmp_path)
    assert cli.main(["run", "kneed-waker"]) == 1
    assert "no example named 'kneed-waker'; did you mean 'kneed-walker'?" in capsys.readouterr().err
    assert cli.main(["examples"]) == 0
    assert "kneed-walker  A walker with knees." in capsys.readouterr().out
    assert cli.find("kneed_walker") == cli.find("kneed-walker") == tmp_path / "kneed_walker.py"


def test_examples_are_listed_in_lines_of_a_terminal(capsys):
    assert cli.main(["examples"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100 and len(lines) > len(scripts.examples())


def test_a_missing_script_is_named(capsys):
    assert cli.main(["run", "absent.py"]) == 1
    assert capsys.readouterr().err == "error: no script at 'absent.py'\n"


def test_check_lists_every_fault(script, capsys):
    good = script(PENDULUM, "good.py")
    assert cli.main(["check", good]) == 0
    assert "no faults" in capsys.readouterr().out
    bad = PENDULUM.replace("mass=1.0", "mass=-1.0").partition("start =")[0]
    bad += 'model.connect(mbd.Revolute("pivot", rod.end, mbd.PointMass("bob", mass=-2.0).origin))\n'
    assert cli.main(["check", script(bad, "bad.py")]) == 1
    told = capsys.readouterr()
    assert told.err == "" and "rod" in told.out and "bob" in told.out and "pivot" in told.out
    assert f"{told.out.count(chr(10) + '- ') + 1} faults" in told.out


LINKAGE = '''"""A linkage with a redundant crank."""
import mbd
from tests.cases.linkages import four_bar, parallel_cranks

model = parallel_cranks()
'''


def test_check_tells_the_degrees_of_freedom_and_the_redundant_rows(script, capsys):
    assert cli.main(["check", script(LINKAGE)]) == 0
    told = capsys.readouterr().out
    assert "no faults found\nparallel cranks: 1 degree of freedom, where Grübler counts 0\n" in told
    assert "'pin 2' (y) depends on 'pin 1' (x), 'pin 1' (y), 'pin 2' (x)" in told


def test_check_fails_where_constraints_conflict_and_tells_what_to_relax(script, capsys):
    assert cli.main(["check", script(LINKAGE.replace("parallel_cranks()", "four_bar((0.2, 0.2, 0.2), 1.0)"))]) == 1
    told = capsys.readouterr().out
    assert "in conflict: constraints cannot be satisfied: closure error 0.4 m at joint 'c'" in told
    assert "change a length in the loop" in told


def test_check_looks_at_the_start_of_the_script(script, capsys):
    flat = "\nfrom tests.cases.linkages import four_bars, upright\nmodel = four_bars(1)\n"
    flat += "start = upright(model, 1, angle=1.5707963267948966)\n"
    assert cli.main(["check", script(LINKAGE + flat)]) == 0
    assert "singular here: rank 1, 2 at postures nearby" in capsys.readouterr().out


def test_check_tells_what_the_integrator_does_not_go_with(script, capsys):
    rod = 'model.constrain(mbd.Bilateral("tie", mbd.distance(model.ground.point(1.0, 0.0), rod.end), value=1.2))\n'
    text = PENDULUM.partition("start =")[0] + rod + 'integrator = mbd.Newmark(formulation="index3")\n'
    assert cli.main(["check", script(text)]) == 1
    assert "use formulation='ggl'" in (told := capsys.readouterr().out) and "(rows on positions: 'tie')" in told


def test_info_names_versions_machine_backend_and_cache(capsys):
    assert cli.main(["info"]) == 0
    text = capsys.readouterr().out
    for word in ("mbd", "python", "numpy", "processor", "backend", "code cache", "examples"):
        assert f"\n{word}" in f"\n{text}"


def test_a_bar_is_shown_on_a_terminal_only(monkeypatch):
    with cli.progress_bar() as bar:
        assert bar is None
    written: list[str] = []

    class Terminal:
        encoding = "utf-8"

        def isatty(self) -> bool:
            return True

        def write(self, text: str) -> int:
            written.append(text)
            return len(text)

        def flush(self) -> None:
            pass

        def fileno(self) -> int:
            raise OSError

    monkeypatch.setattr(sys, "stderr", Terminal())
    with cli.progress_bar() as bar:
        assert bar is not None
        bar(0.0, 6.0)
        bar(3.0, 6.0)
        bar(6.0, 6.0)
    assert any("of 6.00 s" in text for text in written)


def test_the_page_opens_when_asked(script, monkeypatch, capsys):
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert cli.main(["run", script(WALK), "--open"]) == 0
    assert opened[0].startswith("file://") and opened[0].endswith("page.html")
    capsys.readouterr()


def test_the_kneed_walker_walks(tmp_path, capsys):
    """The main job: ten steps of V. F. Hsu Chen's walker, with the period and length of its fixed point."""
    assert cli.main(["run", "kneed-walker", "--out", str(tmp_path)]) == 0
    steps = json.loads((tmp_path / "record.json").read_text())["steps"]
    assert len(steps) == 10 and {step["foot"] for step in steps} == {"left foot", "right foot"}
    assert steps[-1]["period"] == pytest.approx(0.5643282, abs=1e-5)
    assert steps[-1]["length"] == pytest.approx(0.4726568, abs=1e-5)
    assert steps[-1]["deviation"] < 1e-4
    assert "0.56433" in capsys.readouterr().out
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert len(page) < 1_000_000 and '"left knee lock"' in page
    run = mbd.load(tmp_path / "run.mbd.npz")
    standing = run["left foot.force"][run.record.closed[:, 0] == 1]
    assert standing.min() > 0.0 and abs(run.energy.sums["numerical"]) < 1e-3


def test_a_script_may_ask_for_a_tolerance_and_the_command_line_for_a_step(script, tmp_path, capsys):
    asked = script(PENDULUM.replace("dt, until = 0.01, 0.5", "tol, until = 1e-6, 0.5"))
    assert cli.main(["run", asked, "--out", str(tmp_path / "one")]) == 0
    assert "estimated error of coordinates" in capsys.readouterr().out
    assert cli.main(["run", asked, "--dt", "0.01", "--out", str(tmp_path / "two")]) == 0
    assert "dt = 0.01" in capsys.readouterr().out


def test_a_tolerance_takes_the_place_of_the_step_of_a_script(script, tmp_path, capsys):
    assert cli.main(["run", script(PENDULUM), "--tol", "1e-5", "--until", "0.2"]) == 0
    told = capsys.readouterr().out
    assert "tol = 1e-05" in told and "reached t = 0.2 s" in told
    assert cli.main(["run", script(PENDULUM), "--tol", "1e-5", "--dt", "1e-3"]) == 1
    assert "not both" in capsys.readouterr().err


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_reader_that_stops_reading_ends_a_command_quietly(unbuffered):
    program = "import sys; from mbd import cli; sys.exit(cli.main(['examples']))"
    read, write = os.pipe()
    os.close(read)
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    ended = subprocess.run(
        [sys.executable, "-c", program], stdout=write, stderr=subprocess.PIPE, env=environment, timeout=300
    )
    os.close(write)
    assert (ended.returncode, ended.stderr) == (141, b"")


# first steps and slips --------------------------------------------------------------------------------------------


def test_a_new_script_checks_runs_and_writes_its_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["new", "my-leg"]) == 0
    assert cli.main(["check", "my-leg.py"]) == 0
    assert cli.main(["run", "my-leg.py", "--until", "0.2"]) == 0
    assert (tmp_path / "mbd-runs" / "my-leg" / "page.html").is_file()
    assert cli.main(["new", "my-leg"]) == 1
    assert "'my-leg.py' exists; give another name" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["rnu", "kneed-walker"], "did you mean 'run'?"),
        (["run", "kneed-walker", "--tl", "1e-3"], "did you mean '--tol'?"),
        (["run", "--outt", "x", "kneed-walker"], "did you mean '--out'?"),
        (["run", "kneed-walker", "--unti", "1"], "unrecognized arguments: --unti"),
        (["run", "kneed-walker", "--ot", "x"], "unrecognized arguments: --ot"),
    ],
)
def test_misspelt_words_are_no_abbreviations(words, answer, capsys):
    with pytest.raises(SystemExit):
        cli.main(words)
    assert answer in capsys.readouterr().err


def test_a_wrong_value_of_an_option_makes_the_option_no_misspelling(capsys):
    with pytest.raises(SystemExit):
        cli.main(["run", "kneed-walker", "--set", "knee"])
    told = capsys.readouterr().err
    assert "expected NAME=VALUE" in told and "did you mean" not in told


def test_a_doubt_names_a_line_of_a_script_only(script):
    place = script("import mbd")
    told = partial(cli._warning, warnings.formatwarning, "a doubt", mbd.MbdWarning)
    assert told("<frozen runpy>", 88) == told("/usr/bin/env", 8) == "warning: a doubt\n"
    assert told(place, 1).startswith(f"{place}:1: MbdWarning: a doubt\n")


def test_a_folder_that_cannot_be_made_is_refused_before_the_script_runs(script, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert cli.main(["run", script("1 / 0"), "--out", "file/runs"]) == 1
    assert "is a file, not a folder; give another folder" in capsys.readouterr().err


def test_misspelt_settings_of_a_script_are_named(script, capsys):
    assert cli.main(["run", script(PENDULUM.replace("dt, until", "dt, untill"))]) == 1
    assert "does not define until; did you mean 'until' by 'untill'?" in capsys.readouterr().err
    assert cli.main(["run", script(PENDULUM + "stores = 10\n")]) == 0
    assert "defines 'stores', which is no setting; did you mean 'store'?" in capsys.readouterr().err


def test_the_record_knows_the_script_by_the_hash_of_its_text(script, tmp_path):
    path = script(PENDULUM)
    assert cli.main(["run", path]) == 0
    record = json.loads((tmp_path / "mbd-runs" / "my-walk" / "record.json").read_text())
    assert record["script"] == "my_walk.py"
    assert record["script_sha256"] == sha256(PENDULUM.encode()).hexdigest()


def test_the_package_is_a_command_too():
    answer = subprocess.run(
        [sys.executable, "-m", "mbd", "--version"], capture_output=True, text=True, check=True, timeout=60
    )
    assert answer.stdout.strip() == f"mbd {mbd.__version__}"


@pytest.mark.parametrize("command", ["run", "accuracy", "effects", "hardcases"])
@pytest.mark.parametrize(
    ("folder", "told"),
    [
        ("file", "'file' is a file, not a folder; give another folder"),
        ("file/inside", "is a file, not a folder; give another folder"),
        ("", "names no folder"),
        ("x" * 300, "nothing can be written there (File name too long)"),
        ("nul\0", "no control characters"),
        ("two\nlines", "no control characters"),
    ],
    ids=["file", "inside a file", "empty", "long", "nul", "lines"],
)
def test_a_folder_that_cannot_be_written_is_told_before_any_work(script, tmp_path, capsys, command, folder, told):
    path = script("raise SystemExit('work was done')\n")
    (tmp_path / "file").write_text("")
    assert cli.main([command, "g1" if command == "hardcases" else path, "--out", folder]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: --out ") and told in error
    assert {each.name for each in tmp_path.iterdir()} == {"file", "my_walk.py"}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("folder", ["a b/ü\"'<x>&", "$a 'b'"])
def test_a_folder_of_any_other_name_is_written_to(script, tmp_path, capsys, folder):
    assert cli.main(["run", script(WALK), "--out", folder]) == 0
    assert (tmp_path / folder / "record.json").is_file() and capsys.readouterr().err == ""


def test_the_total_is_the_sum_of_the_times_before_it(script, capsys):
    assert cli.main(["run", script(WALK), "--out", "out"]) == 0
    [line] = [line for line in capsys.readouterr().out.splitlines() if line.startswith("wall time")]
    times = [float(word) for word in re.findall(r"[a-z] ([0-9.]+) s", line)]
    assert line.count("total") == 1 and len(times) == 4 and sum(times[:-1]) == pytest.approx(times[-1], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "told"), [("", "a name for the script is expected"), ("none/leg", "no folder 'none'")]
)
def test_a_new_script_that_has_no_place_is_told(script, capsys, name, told):
    script("")
    assert cli.main(["new", name]) == 1
    assert told in capsys.readouterr().err


@pytest.mark.parametrize("name", ['x"y<z', "it's", 'all""" of it', "back\\slash", "{curly}", "%s"])
def test_a_script_of_any_name_can_be_read(script, name):
    script("")
    assert cli.main(["new", name]) == 0
    model = cli.Script.load(f"{name}.py").names["model"]
    assert model.name == name and model.check() == []


def test_home_is_home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert writable("~/runs") == tmp_path / "runs"


def test_the_script_that_new_writes_runs_and_has_nothing_to_note(script, tmp_path, capsys):
    script("")
    assert cli.main(["new", "my leg"]) == 0
    assert "mbd run 'my leg.py'" in capsys.readouterr().out
    made = cli.Script.load("my leg.py")
    run = made.run(None, {})
    assert run.success and run.stats["notes"] == []
    assert abs(run.energy.numerical[-1]) < 0.05  # of some 20 J that the motor puts in


def test_mbd_alone_lists_its_commands(capsys):
    assert cli.main([]) == 0
    told = capsys.readouterr().out
    assert all(f"\n    {name}" in told for name in ("run", "show", "new", "check", "gait", "hardcases", "info"))


def test_a_script_needs_no_integrator(script, tmp_path, capsys):
    text = PENDULUM.replace("integrator = mbd.HHT(alpha=0.05)\n", "")
    assert cli.main(["run", script(text), "--out", "out", "--no-plots"]) == 0
    assert mbd.load(tmp_path / "out" / "run.mbd.npz").settings["integrator"].startswith("HHT")
    assert not list((tmp_path / "out").glob("*.png"))
    capsys.readouterr()


def test_a_script_that_has_simulated_is_shown_and_not_simulated_again(script, tmp_path, capsys):
    text = PENDULUM.replace("dt, until = 0.01, 0.5", "run = mbd.simulate(model, start, tol=1e-4, until=0.3)")
    assert cli.main(["run", script(text), "--out", "out", "--no-plots"]) == 0
    assert mbd.load(tmp_path / "out" / "run.mbd.npz").time[-1] == pytest.approx(0.3)


def test_settings_reach_the_simulation_of_a_script(script, tmp_path, capsys):
    text = PENDULUM.replace(
        "dt, until = 0.01, 0.5",
        "run = mbd.simulate(model, start, None, 0.01, until=0.3, parameters={'rod.mass': 3.0, 'gravity.y': -5.0})",
    )
    given = ["--until", "0.2", "--tol", "1e-4", "--set", "rod.mass=2"]
    assert cli.main(["run", script(text), *given, "--out", "out", "--no-plots"]) == 0
    run = mbd.load(tmp_path / "out" / "run.mbd.npz")
    assert run.time[-1] == pytest.approx(0.2) and run.settings["tol"] == 1e-4
    assert run.parameters["rod.mass"] == 2.0 and run.parameters["gravity.y"] == -5.0


@pytest.mark.parametrize(
    ("calls", "told"),
    [
        ("one = mbd.simulate(a, b)\ntwo = mbd.simulate(a, b)", "simulates by itself, 2 times, so until must be"),
        ("for k in range(2):\n    run = mbd.simulate(a, b)", "simulates by itself, in a loop, so until must be"),
    ],
)
def test_settings_that_reach_no_one_simulation_are_refused_before_the_script_runs(script, capsys, calls, told):
    assert cli.main(["run", script(f"print('computed')\n{calls}\n"), "--until", "0.1"]) == 1
    said = capsys.readouterr()
    assert told in said.err and "nothing was run" in said.err and "computed" not in said.out


def test_a_parameter_is_set_from_the_command_line(script, tmp_path, capsys):
    name = script(PENDULUM, "pendulum.py")
    assert cli.main(["run", name, "--set", "gravity.y=-1.62", "--set", "rod.mass=2", "--out", "out", "--no-plots"]) == 0
    run = mbd.load(tmp_path / "out" / "run.mbd.npz")
    assert run.parameters["gravity.y"] == -1.62 and run.parameters["rod.mass"] == 2.0
    assert cli.main(["run", name, "--set", "rod.mas=2"]) == 1
    assert "did you mean 'rod.mass'?" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        cli.main(["run", name, "--set", "rod.mass"])
    assert "expected NAME=VALUE" in capsys.readouterr().err


def test_a_stored_run_is_shown_and_reported_without_its_script(script, tmp_path, capsys):
    """Net moments of the joints too, which the file has as expressions."""
    assert cli.main(["run", "prosthetic-leg", "--until", "6", "--out", "leg", "--no-plots"]) == 0
    stored = str(tmp_path / "leg" / "run.mbd.npz")
    assert cli.main(["show", stored, "--out", "again", "--no-plots"]) == 0
    assert (tmp_path / "again" / "page.html").is_file()
    assert "Trajectory of 'prosthetic leg'" in capsys.readouterr().out
    assert cli.main(["gait", stored, "--out", "stored"]) == 0
    assert cli.main(["gait", "prosthetic-leg", "--until", "6", "--out", "made"]) == 0
    made, kept = (
        pages.read_text().split('<p class="about">')[0].replace("prosthetic-leg", "leg")
        for pages in (tmp_path / "made" / "gait.html", tmp_path / "stored" / "gait.html")
    )
    assert "moment" in made and made == kept
    assert cli.main(["run", stored]) == 1
    assert "is a stored run; show it with: mbd show" in capsys.readouterr().err


def test_what_is_printed_is_at_most_a_hundred_columns_wide(script, capsys):
    assert cli.main(["run", "kneed-walker", "--out", "walk", "--no-plots"]) == 0
    assert cli.main(["info"]) == 0
    told = capsys.readouterr().out.partition("wrote")[0]
    assert max(map(len, told.splitlines())) <= 100
