"""What mbd says without being asked: to the logger, as warnings at the user's line, once, and on a terminal."""

import logging
import sys
import warnings

import pytest

import mbd
from mbd import notes, progress
from mbd.compile import backend as backends
from mbd.compile.mechanisms import mechanism_of
from tests.simulation.mechanisms import ball


def hinged_twice() -> mbd.Model:
    model, rod = mbd.Model("twice"), mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    model.connect(mbd.Revolute("again", model.ground.origin, rod.start))
    return model


def sunk() -> tuple[mbd.Model, mbd.State]:
    """A ball below a floor that is left out on purpose, of which runs have a note."""
    model = ball()
    return model, mbd.assemble(model, position={"fall.displacement": -0.1}, open=["floor"])


def test_a_doubt_about_a_model_comes_once_at_the_line_of_the_user_and_stays_with_its_runs():
    model = hinged_twice()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert model.check() == []
        start = mbd.assemble(model)
        run = mbd.simulate(model, start, dt=0.1, until=0.1, backend="python")
    assert [warning.filename for warning in caught] == [__file__]
    [told] = [note for note in run.stats["notes"] if "hold the same points" in note]
    assert told in " ".join(str(run).split())


def test_notes_of_a_run_go_to_the_logger_once_and_not_to_warnings(caplog):
    model, start = sunk()
    with warnings.catch_warnings(), caplog.at_level(logging.INFO, "mbd"):
        warnings.simplefilter("error")
        run = mbd.simulate(model, start, dt=1e-2, until=0.1, backend="python")
    [note] = run.stats["notes"]
    assert [(r.name, r.levelname, r.getMessage()) for r in caplog.records] == [("mbd", "INFO", f"ball: {note}")]


def test_nothing_is_printed_where_nobody_listens(capfd):
    model, start = sunk()
    mbd.simulate(model, start, dt=1e-2, until=0.1, backend="python")
    assert capfd.readouterr() == ("", "")


def test_a_result_in_doubt_is_a_warning_that_filters_silence():
    model = mbd.Model("stiff", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=1e9))
    start = mbd.assemble(model, position={"slide.displacement": 0.1})
    settings = {"dt": 1e-4, "until": 1e-2, "backend": "python"}
    with pytest.warns(mbd.MbdWarning, match="dt = 0.0001 s does not resolve its fastest motion"):
        run = mbd.simulate(model, start, **settings)
    assert "does not resolve" in run.message
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", mbd.MbdWarning)
        mbd.simulate(model, start, **settings)


def test_without_machine_code_a_hint_comes_once(monkeypatch):
    monkeypatch.setattr(backends, "find_spec", lambda name: None)
    monkeypatch.setattr(notes, "_TOLD", type(notes._TOLD)())
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mechanism_of(ball())
        mechanism_of(ball())
    [hint] = [str(warning.message) for warning in caught if warning.category is mbd.MbdWarning]
    assert "100 to 300 times slower than machine code: pip install 'mbd[fast]'" in hint


class Terminal:
    encoding = "utf-8"

    def __init__(self):
        self.text = ""

    def isatty(self):
        return True

    def write(self, text):
        self.text += text

    def flush(self):
        pass


@pytest.mark.parametrize("library", ["tqdm", None])
@pytest.mark.parametrize(("late", "shown"), [(0.0, True), (1e9, False)])
def test_a_slow_run_shows_a_bar_after_a_while(monkeypatch, library, late, shown):
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    monkeypatch.setattr(progress, "BAR_DELAY", late)
    if library is None:
        monkeypatch.setattr(progress, "find_spec", lambda name: None)
    model = ball()
    start = mbd.assemble(model, position={"fall.displacement": 9.0})
    mbd.simulate(model, start, dt=1e-2, until=0.5, backend="python")
    assert ("100" in terminal.text) is shown
    terminal.text = ""
    mbd.simulate(model, start, dt=1e-2, until=0.5, backend="python", progress=False)
    assert not terminal.text


def test_a_bar_that_is_wanted_needs_no_library(monkeypatch):
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    monkeypatch.setattr(progress, "find_spec", lambda name: None)
    model = ball()
    mbd.simulate(model, mbd.assemble(model, {"fall.displacement": 9.0}), dt=1e-2, until=0.5, progress=True)
    assert "100 % of 0.5 s" in terminal.text and terminal.text.endswith("\n")


def test_a_contact_that_jumps_below_its_surface_is_told():
    model = mbd.Model("ledge", gravity=(0, 0, 0))
    ball = mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Translation("root", model.ground.origin, ball.origin))
    gap = mbd.measure(
        lambda p: mbd.where(p[0] < 0.5, p[1] + 0.3, p[1] - 0.15), ball.origin
    )  # a step, which no rate tells
    model.constrain(mbd.Unilateral("ledge", gap))
    start = mbd.assemble(model, position={"root.y": 0.05}, velocity={"root.x": 1.0})
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-2, until=1.0)
    assert any("'ledge' closed 0.1 m below its surface at t = 0.5 s" in note for note in run.stats["notes"])
