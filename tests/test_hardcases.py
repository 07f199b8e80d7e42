"""The hard cases as tests, and the command that judges them."""

import copy
import math
import re
import signal
from pathlib import Path

import pytest

import mbd
from mbd import cli
from mbd.errors import UnknownNameError
from mbd.hardcases import CASES, case as cases, command, frictions, judging
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import deviation, second_order
from mbd.hardcases.judging import Judged, chosen, judged, ratio, short
from mbd.hardcases.known import KNOWN, reason
from mbd.hardcases.schemes import (
    DAMPED,
    EVERY as EVERY_SCHEME,
    SCHEMES,
    has_own_forces,
    holds_positions_only,
    is_explicit,
    is_undamped,
    scheme,
)
from mbd.hardcases.table import BEGIN, END, as_markdown, as_text, figure_text, worst_by_scheme, write_markdown
from mbd.progress import counted
from mbd.simulation.arguments import CHOICES

PAGE = Path(__file__).resolve().parents[1] / "docs" / "hardcases.md"
EXPLAINED = PAGE.with_name("hardcases-explained.md")

LONG = {(case, name) for case in ("b2-N10", "g3", "j1", "j4", "j5", "j17") for name in ("RadauIIA", "RungeKutta853")}
LONG |= {("j4", "HHT"), ("j4", "HHT-index3"), ("j4", "generalized-alpha-index3"), ("b2-N10", "HHT-index3")}
LONG |= {("j6", "RadauIIA")}
"""Cases that take seconds with schemes that others judge quickly."""


ALONE = {"a4", "a4c", "b2-N2", "b4", "d3", "h1", "h1b", "j2", "j3", "j3b", "j4", "j5", "j6", "j13", "j14", "j16", "j17"}
"""Cases whose laws no file of `tests/cases` tries with other numbers or schemes."""


def quick(place: int, case: HardCase) -> set[str]:
    """The scheme that judges every other case here, by turns so that each scheme has some; CI judges all by
    ``mbd hardcases``, `pytest -m slow` here."""
    names = [name for name in case.schemes if (short(case), name) not in LONG]
    return set() if case.slow or (place % 2 and short(case) not in ALONE) else {names[place % len(names)]}


def marks(case: HardCase, name: str, chosen: set[str]) -> list:
    """Strict where it is known not to hold: once it does, the list has to be shortened."""
    known = [pytest.mark.xfail(strict=True, reason=reason(case.id, name))] if reason(case.id, name) else []
    return known + ([] if name in chosen else [pytest.mark.slow])


EVERY = [
    pytest.param(case, name, id=f"{short(case)}-{name}", marks=marks(case, name, quick(place, case)))
    for place, case in enumerate(CASES)
    for name in case.schemes
]


def test_every_scheme_judges_cases_by_turns():
    assert set().union(*(quick(place, case) for place, case in enumerate(CASES))) == set(SCHEMES)


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("case", "name"), EVERY)
def test_what_must_hold_in_a_hard_case_holds(case: HardCase, name: str):
    outcome = case.judge(scheme(name))
    assert any(figure.is_judged for figure in outcome.figures), f"the judge of {case.id} measured nothing"
    assert outcome.curves, f"{case.id} shows no curve"
    broken = [figure_text(figure) for figure in outcome.figures if not figure.passed]
    assert not broken, f"{case.must}\n{case.id} with {name}: value of limit\n" + "\n".join(broken)


# a check that cannot fail is a defect ------------------------------------------------------------------------------
SPOILED = {
    "a4": "turning angles", "a4c": "turning angles", "b4": "P3", "b5": "slider height", "d1": "contact point P",
    "d2": "[x, y](t)", "d3": "acceleration", "g1": "impact times", "g2": "velocities, simultaneous",
    "g2b": "momentum", "g3": "(amplitude, impact time)", "g4": "sticking: [vx", "g5": "tip impact times",
    "g6": "impulses", "g7": "impulses", "h1": "event times", "h1b": "max hyperextension", "j2": "crank angle",
    "j3b": "crank angle", "j5": "period", "j6": "contact duration", "j7": "wall at d(1 - 0.001)", "j8": "Zeno time",
    "j9": "corner impulses", "j9b": "velocity after", "j10": "first lift-off time", "j11": "minimum-norm leg forces",
    "j11b": "three contacts", "j13": "A for the two", "j14": "tension", "j15": "smallest closure error",
    "j16": "x and v", "j18": "hip torque", "j19": "knee torque", "j20": "angle",
}  # fmt: skip
"""One reference of each case that is spoiled by a thousandth; those of long runs are left out."""


def nudged(value, share: float):
    return [nudged(each, share) for each in value] if isinstance(value, list) else value * (1.0 + share)


def judged_with(monkeypatch, case: HardCase, data: dict) -> Outcome:
    read = cases.read
    monkeypatch.setattr(cases, "read", lambda id: data if id == case.id else read(id))
    return case.judge(scheme("HHT"))


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", SPOILED)
def test_a_reference_that_is_off_by_a_thousandth_is_noticed(name: str, monkeypatch):
    (case,) = chosen(CASES, [name], slow=True)
    data = copy.deepcopy(definition(case.id))
    entry = next(each for each in data["quantities"] if each["name"].startswith(SPOILED[name]))
    entry["value"] = nudged(entry["value"], 1e-3)
    assert not judged_with(monkeypatch, case, data).passed


@pytest.mark.parametrize(
    ("number", "wrong", "noticed"),
    [
        (0, {"Coulomb": lambda torque, known=mbd.Coulomb: known(1.001 * torque)}, "order"),
        (1, {"PinFriction": lambda mu, radius, known=mbd.PinFriction: known(1.002 * mu, radius)}, "order"),
        (2, {"numbers": lambda id, known=frictions.numbers: known(id) | {"mu": 1.2}}, "no impulse stops"),
    ],
)
def test_a_judge_notices_another_law(number, wrong, noticed, monkeypatch):
    """A torque or coefficient off by a part in a thousand, a rod that does not jam."""
    for name, replacement in wrong.items():
        monkeypatch.setattr(frictions if hasattr(frictions, name) else mbd, name, replacement)
    frictions.pendulum.cache_clear()
    outcome = frictions.CASES[number].judge(scheme("HHT"))
    frictions.pendulum.cache_clear()
    assert any(noticed in figure.what for figure in outcome.figures if not figure.passed)


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
    steps = [0.4, 0.2, 0.1]

    def passes(errors, limit=1.0, floor=1e-12, better=False):
        return all(figure.passed for figure in second_order("x [m]", steps, errors, limit, floor, better))

    assert passes([1e-2, 2.5e-3, 6.3e-4]) and passes([2e-13, 3e-13, 1e-13]) and passes([1e-10, 3e-13, 2e-13])
    assert not passes([1e-2, 5e-3, 2.5e-3]) and not passes([1e-2, 1e-2, 1e-2]) and not passes([1e-2, 1e-3, 1e-4])
    assert not passes([1e-2, 2.5e-3, math.nan]) and not passes([math.nan] * 3)
    assert not passes([1e-2, 2.5e-3, 6.3e-4], limit=1e-4)
    assert passes([1e-2, 1.2e-3, 1.5e-4], better=True) and not passes([1e-2, 5e-3, 2.5e-3], better=True)
    assert not passes([1e-13, 1e-3, 1e-13]), "what rises from round-off and falls back is no error of second order"
    assert deviation([0.1, 0.01], [1e-11, 1e-14], 1e-12) == 0.0, "a fall by a hundred leads into round-off"


def test_a_scheme_of_higher_order_is_judged_at_every_step():
    steps = [0.4, 0.2, 0.1]

    def passes(errors, limit, erratic=False):
        judged = second_order("x [m]", steps, errors, limit, 1e-12, order=5, erratic=erratic)
        return all(figure.passed for figure in judged)

    assert passes([1e-4, 3e-6, 1e-7], 1e-5) and passes([1e-13, 3e-13, 2e-13], 1e-5)
    assert not passes([1e-2, 3e-6, 1e-7], 1e-5), "wrong with the largest step, by far more than order 2 allows there"
    assert not passes([1e-6, 1e-6, 1e-6], 1e-5), "no order, though all are small"
    assert passes([1e-6, 2e-6, 1e-6], 1e-5, erratic=True) and not passes([1e-6, 5e-5, 1e-6], 1e-5, erratic=True)


def test_judges_ask_a_scheme_for_what_it_is():
    def which(asked) -> list[str]:
        return [name for name in SCHEMES if asked(scheme(name))]

    assert which(is_undamped) == ["Newmark"] and which(is_explicit) == ["RungeKutta853"]
    assert which(has_own_forces) == ["RadauIIA", "RungeKutta853"]
    assert which(holds_positions_only) == ["HHT-index3", "generalized-alpha-index3"]
    assert set(EVERY_SCHEME) - set(DAMPED) == {"Newmark"}


def test_a_case_that_leaves_a_scheme_out_says_why():
    for case in CASES:
        left = [name for name in EVERY_SCHEME if name not in case.schemes]
        assert not left or case.notes, f"{case.id} is not judged with {left} and does not say why"


def test_a_figure_without_a_limit_is_told_and_not_judged():
    told = Outcome([Figure("share [-]", 0.5, 1.0), Figure("time ratio [-]", 1.5)])
    assert told.passed and not Outcome([Figure("time ratio [-]", 1.5)]).passed
    verdict = judged(HardCase("g1-bouncing-ball", "It runs.", lambda made: told))
    assert worst_by_scheme(verdict) == ["share [-]: 0.5 (all) of 1", "not judged: time ratio [-]: 1.5 (all)"]


def test_the_worst_figure_of_every_scheme_is_told():
    def judge(made) -> Outcome:
        return Outcome([Figure("gap [m]", 2.0 if "HHT" in repr(made) else 0.5, 1.0), Figure("count [-]", 0.0, 0.0)])

    verdict = judged(HardCase("g1-bouncing-ball", "It runs.", judge))
    assert worst_by_scheme(verdict) == ["gap [m]: 2 (HHT), 0.5 (generalized-alpha) of 1"]


def test_what_is_known_not_to_hold_is_told_with_its_reason_and_when_it_holds(monkeypatch):
    monkeypatch.setattr(
        judging, "reason", lambda case, name: "the constraint Jacobian loses rank" if name == "HHT" else ""
    )
    failing = judged(stand_in(3.0))
    assert (
        failing.word == "does not hold"
        and failing.reasons == ["the constraint Jacobian loses rank"]
        and not failing.passed
    )
    assert "does not hold: the constraint Jacobian loses rank" in as_markdown(
        [failing]
    ) and "g1: the constraint Jacobian loses rank" in as_text([failing], 120)
    assert judged(stand_in(0.5)).word == "holds now with HHT: take it from the list of what does not"


# the registry ------------------------------------------------------------------------------------------------------
def test_every_case_has_a_definition_known_schemes_and_a_paragraph():
    text, table = EXPLAINED.read_text(encoding="utf-8"), PAGE.read_text(encoding="utf-8")
    names = [short(case) for case in CASES]
    assert len(set(names)) == len(names)
    for case in CASES:
        assert definition(case.id)["id"] == case.id and case.title
        assert set(case.schemes) <= set(SCHEMES), case.id
        assert re.search(rf"\*\*[^*]*\b{short(case)}\b[^*]*\*\*", text), f"{EXPLAINED.name} leaves out {short(case)}"
    assert BEGIN in table and END in table
    pairs = {(case.id, name) for case in CASES for name in case.schemes}
    assert set(KNOWN) <= pairs and all(len(why) > 20 for why in KNOWN.values())


def test_cases_are_in_the_order_of_their_ids():
    names = [short(case) for case in CASES]
    assert names[:7] == ["a4", "a4c", "b2-N1", "b2-N2", "b2-N10", "b2b", "b4"]
    assert names.index("j2") < names.index("j3") < names.index("j3b") < names.index("j10") < names.index("j17")


def test_cases_are_chosen_by_name_group_and_part():
    assert [case.id for case in chosen(CASES, ["g2"], slow=False)] == ["g2-newtons-cradle"]
    assert [short(case) for case in chosen(CASES, ["j9b", "G1"], slow=False)] == ["g1", "j9b"]
    assert {short(case)[0] for case in chosen(CASES, ["h"], slow=False)} == {"h"}
    assert [short(case) for case in chosen(CASES, ["cradle"], slow=False)] == ["g2", "g2b"]
    slow = HardCase("x1-long", "It takes long.", lambda scheme: Outcome([]), slow=True)
    assert chosen([slow], [], slow=False) == [] and chosen([slow], [], slow=True) == chosen([slow], ["x1"], slow=False)
    with pytest.raises(UnknownNameError, match="no hard case named 'g99'"):
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
    assert "does not hold" in told and "x [-]: 3 of 1" in told and "0 of 1 cases hold; not g1" in told
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
    assert verdict.word == "does not hold with HHT" and not verdict.passed and verdict.worst.scheme == "HHT"


def test_a_narrow_terminal_gets_paragraphs_that_fit():
    verdicts = [judged(stand_in(0.5)), judged(stand_in(3.0))]
    lines = as_text(verdicts, 60).splitlines()
    assert max(map(len, lines)) <= 60 and lines[0] == "g1-bouncing-ball" and "1 of 2 cases hold" in lines[-1]
    assert max(map(len, as_text(verdicts, 120).splitlines())) <= 120


def test_an_interrupt_keeps_the_table_so_far_and_the_page_of_the_docs(tmp_path, capsys, monkeypatch):
    def pressed(made) -> Outcome:
        raise KeyboardInterrupt

    stopping = HardCase("g3-rocking-block", "It runs.", pressed)
    monkeypatch.setattr(command, "CASES", (stand_in(0.5), stopping, stand_in(0.7)))
    page = tmp_path / "page.md"
    page.write_text(f"{BEGIN}\nas it was\n{END}\n", encoding="utf-8")
    assert cli.main(["hardcases", "--out", str(tmp_path), "--markdown", str(page)]) == 130
    told = capsys.readouterr()
    assert "1 of 1 cases hold" in told.out and "stopped after 1 of 3 cases" in told.err
    assert "Stopped after 1 of 3 cases." in (tmp_path / "hardcases.html").read_text(encoding="utf-8")
    assert "as it was" in page.read_text(encoding="utf-8")


def test_an_interrupt_that_ends_a_run_in_order_ends_the_command_too(tmp_path, capsys, monkeypatch):
    """A run returns what it has when Ctrl-C comes; its judge would go on."""

    def swallowed(made) -> Outcome:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            return Outcome([Figure("x [-]", 0.0, 1.0)])
        raise AssertionError("no interrupt")

    monkeypatch.setattr(command, "CASES", (stand_in(0.5), HardCase("g3-rocking-block", "It runs.", swallowed)))
    assert cli.main(["hardcases", "--out", str(tmp_path)]) == 130
    assert "stopped after 1 of 2 cases" in capsys.readouterr().err


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


def test_counting_shows_a_bar_on_a_terminal_and_lines_elsewhere(monkeypatch, capsys):
    assert list(counted([1, 2], lambda item: f"item {item}")) == [1, 2]
    assert capsys.readouterr().err == "1/2 item 1\n2/2 item 2\n"
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert list(counted([1, 2], lambda item: f"item {item}")) == [1, 2]
    assert "item 2" in capsys.readouterr().err
