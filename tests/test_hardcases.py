"""The hard cases as tests, and the command that judges them."""

from __future__ import annotations

import copy
import math
import re
from pathlib import Path

import pytest

from mbd import cli
from mbd.errors import UnknownNameError
from mbd.hardcases import CASES, command, grazes, measuring
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.judging import Judged, chosen, judged, ratio, short
from mbd.hardcases.schemes import SCHEMES, scheme
from mbd.hardcases.table import BEGIN, END, figure_text, write_markdown
from mbd.simulation.arguments import CHOICES
from mbd.view.progress import counted

PAGE = Path(__file__).resolve().parents[1] / "docs" / "hardcases.md"

EVERY = [
    pytest.param(case, name, id=f"{short(case)}-{name}", marks=[pytest.mark.slow] if case.slow else [])
    for case in CASES
    for name in case.schemes
]


@pytest.mark.parametrize(("case", "name"), EVERY)
def test_what_must_hold_in_a_hard_case_holds(case: HardCase, name: str):
    outcome = case.judge(scheme(name))
    assert outcome.figures, f"the judge of {case.id} measured nothing"
    broken = [figure_text(figure) for figure in outcome.figures if not figure.passed]
    assert not broken, f"{case.must}\n{case.id} with {name}: value of limit\n" + "\n".join(broken)


# a check that cannot fail is a defect ------------------------------------------------------------------------------
SPOILED = {
    "g1": "impact times", "g2": "velocities, simultaneous", "g2b": "momentum", "g3": "(amplitude, impact time)",
    "g4": "sticking: [vx", "g5": "tip impact times", "g6": "impulses", "h1": "event times", "h1b": "max hyperextension",
    "j6": "contact duration", "j7": "wall at d(1 - 0.001)", "j8": "Zeno time", "j9": "corner impulses",
    "j9b": "velocity after", "j10": "first lift-off time",
}  # fmt: skip
"""One reference of each case that is spoiled by a thousandth."""


def nudged(value, share: float):
    return [nudged(each, share) for each in value] if isinstance(value, list) else value * (1.0 + share)


def judged_with(monkeypatch, case: HardCase, data: dict) -> Outcome:
    for module in (measuring, grazes):
        monkeypatch.setattr(module, "definition", lambda id: data)
    return case.judge(scheme("HHT"))


@pytest.mark.parametrize("name", SPOILED)
def test_a_reference_that_is_off_by_a_thousandth_is_noticed(name: str, monkeypatch):
    (case,) = chosen(CASES, [name], slow=True)
    data = copy.deepcopy(definition(case.id))
    entry = next(each for each in data["quantities"] if each["name"].startswith(SPOILED[name]))
    entry["value"] = nudged(entry["value"], 1e-3)
    assert not judged_with(monkeypatch, case, data).passed


def test_another_ball_is_judged_by_its_own_numbers(monkeypatch):
    """The bouncing ball of g1 with numbers and references worked out here."""
    (case,) = chosen(CASES, ["g1"], slow=True)
    data = copy.deepcopy(definition(case.id))
    h, g, e, m = 0.37, 3.7, 0.55, 2.9
    data["definition"] |= {"h": h, "g": g, "e": e, "m": m}
    data["initial_conditions"] |= {"y": h}
    first = math.sqrt(2.0 * h / g)
    times = [first * (1.0 + 2.0 * sum(e**k for k in range(1, n))) for n in range(1, 13)]
    values = (times, [h * e ** (2 * k) for k in range(12)], first * (1 + e) / (1 - e), m * g, m * g * first * (1 + e))
    for entry, value in zip(data["quantities"], values, strict=True):
        entry["value"] = value
    broken = [figure_text(figure) for figure in judged_with(monkeypatch, case, data).figures if not figure.passed]
    assert not broken


def test_the_law_of_a_cradle_is_judged_by_its_own_reference():
    (case,) = chosen(CASES, ["g2"], slow=True)
    told = " ".join(figure.what for figure in case.judge(scheme("HHT")).figures)
    assert "newton law" in told
    assert ("sequential law" in told) == ("sequential" in CHOICES["impact"])


def test_a_figure_that_is_not_a_number_fails_and_ranks_first():
    nothing, fine = Figure("a", math.nan, 1.0), Figure("b", 0.9, 1.0)
    assert not nothing.passed and ratio(nothing) == math.inf and ratio(fine) == 0.9
    assert ratio(Figure("count", 0.0, 0.0)) == 0.0 and ratio(Figure("count", 1.0, 0.0)) == math.inf
    assert Judged("HHT", Outcome([fine, nothing]), 0.0).worst is nothing
    assert not Outcome([]).passed


def test_an_error_is_noticed_to_be_of_second_order_round_off_or_neither():
    def passes(errors, limit=1.0, floor=1e-12):
        return all(figure.passed for figure in measuring.second_order("x [m]", errors, limit, floor))

    assert passes([1e-2, 2.5e-3, 6.3e-4]) and passes([2e-13, 3e-13, 1e-13]) and passes([1e-10, 3e-13, 2e-13])
    assert not passes([1e-2, 5e-3, 2.5e-3]) and not passes([1e-2, 1e-2, 1e-2]) and not passes([1e-2, 1e-3, 1e-4])
    assert not passes([1e-2, 2.5e-3, math.nan]) and not passes([math.nan] * 3)
    assert not passes([1e-2, 2.5e-3, 6.3e-4], limit=1e-4)


# the registry ------------------------------------------------------------------------------------------------------
def test_every_case_has_a_definition_known_schemes_and_a_paragraph():
    text = PAGE.read_text(encoding="utf-8")
    names = [short(case) for case in CASES]
    assert len(set(names)) == len(names)
    for case in CASES:
        assert definition(case.id)["id"] == case.id and case.title
        assert set(case.schemes) <= set(SCHEMES), case.id
        assert re.search(rf"\*\*[^*]*\b{short(case)}\b[^*]*\*\*", text), f"{PAGE.name} does not explain {short(case)}"
    assert BEGIN in text and END in text


def test_cases_are_chosen_by_name_group_and_part():
    assert [case.id for case in chosen(CASES, ["g2"], slow=False)] == ["g2-newtons-cradle"]
    assert [short(case) for case in chosen(CASES, ["j9b", "G1"], slow=False)] == ["g1", "j9b"]
    assert {short(case)[0] for case in chosen(CASES, ["h"], slow=False)} == {"h"}
    assert [short(case) for case in chosen(CASES, ["cradle"], slow=False)] == ["g2", "g2b"]
    slow = HardCase("x1-long", "It takes long.", lambda scheme: Outcome([]), slow=True)
    assert chosen([slow], [], slow=False) == [] and chosen([slow], [], slow=True) == chosen([slow], ["x1"], slow=False)
    with pytest.raises(UnknownNameError, match="no hard case named 'g99'.*There are 'g1'"):
        chosen(CASES, ["g99"], slow=False)


# the command -------------------------------------------------------------------------------------------------------
def stand_in(value: float) -> HardCase:
    """A case of g1 whose only figure has this value, of 1."""
    curve = Curve("error", [0.1, 0.05], [value, value / 4], "step [s]", "error [m]", logarithmic=True)
    return HardCase("g1-bouncing-ball", "It <holds>.", lambda scheme: Outcome([Figure("x [-]", value, 1.0)], [curve]))


def test_the_command_prints_a_table_and_writes_a_page(tmp_path, capsys):
    page, notes = tmp_path / "hardcases.html", tmp_path / "notes.md"
    asked = ["hardcases", "j9b", "--scheme", "hht", "--out", str(tmp_path), "--markdown", str(notes)]
    assert cli.main(asked) == 0
    told = capsys.readouterr().out
    assert "j9b-ball-into-corner" in told and "holds" in told and "1 of 1 cases hold" in told and str(page) in told
    text = page.read_text(encoding="utf-8")
    assert text.count("data:image/png;base64,") == 2 and "momentum balance at impacts" in text
    assert not re.search(r"https?://|@import|<script|<link|url\(", text)
    assert "| j9b | Two walls" in notes.read_text(encoding="utf-8")


def test_a_failing_case_is_told_and_makes_the_exit_code_1(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(command, "CASES", (stand_in(3.0),))
    assert cli.main(["hardcases", "--out", str(tmp_path)]) == 1
    told = capsys.readouterr().out
    assert "fails" in told and "x [-]: 3 of 1" in told and "0 of 1 cases hold; not g1" in told
    text = (tmp_path / "hardcases.html").read_text(encoding="utf-8")
    assert "It &lt;holds&gt;." in text and "<details open>" in text


def test_a_judge_that_stops_is_a_verdict(tmp_path, capsys, monkeypatch):
    def stopped(scheme) -> Outcome:
        raise RuntimeError("the run stopped at t = 0.3 s")

    monkeypatch.setattr(command, "CASES", (HardCase("g1-bouncing-ball", "It runs.", stopped, ("HHT", "Newmark")),))
    assert cli.main(["hardcases", "--out", str(tmp_path)]) == 1
    assert "RuntimeError: the run" in capsys.readouterr().out
    assert "stopped at t = 0.3 s" in (tmp_path / "hardcases.html").read_text(encoding="utf-8")


def test_a_case_that_fails_with_one_scheme_says_with_which():
    case = HardCase("g1-bouncing-ball", "", lambda made: Outcome([Figure("x", float("HHT" in repr(made)), 0.5)]))
    verdict = judged(case)
    assert verdict.word == "fails with HHT" and not verdict.passed and verdict.worst.scheme == "HHT"


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        (["g99"], "no hard case named 'g99'"),
        (["g1", "--scheme", "newmrk"], "no scheme named 'newmrk'; did you mean 'Newmark'"),
    ],
)
def test_a_wrong_name_is_answered_with_the_nearest(asked, told, tmp_path, capsys):
    assert cli.main(["hardcases", *asked, "--out", str(tmp_path)]) == 1
    assert told in capsys.readouterr().err


def test_the_table_goes_between_the_marks_of_a_page_and_nowhere_else(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}\nstale\n{END}\nafter\n", encoding="utf-8")
    write_markdown([judged(stand_in(0.5))], page)
    text = page.read_text(encoding="utf-8")
    assert text.startswith(f"before\n{BEGIN}\n| case") and text.endswith(f"{END}\nafter\n") and "stale" not in text
    page.write_text("no marks\n", encoding="utf-8")
    with pytest.raises(ValueError, match="needs the line"):
        write_markdown([judged(stand_in(0.5))], page)


def test_counting_shows_a_bar_on_a_terminal_only(monkeypatch, capsys):
    assert list(counted([1, 2], str)) == [1, 2]
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert list(counted([1, 2], lambda item: f"item {item}")) == [1, 2]
    assert "item 2" in capsys.readouterr().err
