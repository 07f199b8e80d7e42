"""Pages of ``mbd accuracy`` and ``mbd effects``: one file each, without a network; their scripts do what they say."""

from pathlib import Path

import pytest

import mbd
from mbd.analysis.accuracy import Accuracy, Point
from mbd.analysis.effects import Effects
from mbd.analysis.effects.contribution import Change, Contribution, Together
from mbd.analysis.effects.timing import Timing
from mbd.view.effects_page import content
from tests.view.pages import opened


@pytest.fixture(scope="module")
def study() -> Effects:
    """Three effects: one that carries much, one that nothing needs, one without which the run ends otherwise."""
    model = mbd.Model("<swing> & spring")
    rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    run = mbd.simulate(model, mbd.assemble(model), dt=0.1, until=0.2, backend="python")
    same = Change({"pin.angle": 0.0}, 0.2, identical=True)
    moved = Change({"pin.angle": 0.3, "tip": 0.02}, 0.2)
    fell = Change({"pin.angle": 0.5}, 0.1, differs_at=0.1, ends="ended by 'fall' at t = 0.1 s")
    contributions = (
        Contribution("gravity", "gravity", 2, "always", Timing(500.0, 30.0, 5.0, 5), 9.0, 0.9, moved),
        Contribution("idle", "joint loss", 5, "while sliding", None, 0.0, 0.0, same),
        Contribution("stop", "penalty", 8, "while closed", None, 1.0, 0.1, fell),
    )
    together = Together(("idle",), (), same, 55)
    return Effects("<swing> & spring", ("pin.angle", "tip"), 1e-3, contributions, 60, 0, together, run)


def lab() -> Accuracy:
    """Two schemes: a clear error, one that is below what can be determined, and a failure."""
    errors = {"errors": {"pin.angle": 1e-3}, "end_errors": {"pin.angle": 5e-4}}
    points = (
        Point("a", 0.1, 1e-3, 1e-3, seconds=0.01, steps=10, **errors),
        Point("b", 0.1, None, 1e-9, seconds=0.02, steps=10, note="no clear error"),
        Point("b", 0.2, failure="<fell>"),
    )
    return Accuracy("swing", ("pin.angle",), points, None)


def assert_alone(page: str) -> None:
    """Nothing is loaded from elsewhere; the only address is the name of a drawing's language."""
    assert page.count("://") == 1 and "http://www.w3.org/2000/svg" in page
    assert "src=" not in page and "href=" not in page and "<!--" not in page and "/*" not in page


def test_a_page_of_effects_is_one_file_with_every_effect(study: Effects, tmp_path: Path) -> None:
    page = study.page(tmp_path / "made" / "effects.html").read_text(encoding="utf-8")
    assert_alone(page)
    assert "&lt;swing&gt; &amp; spring" in page and "<swing>" not in page
    assert all(f">{each.name}</td>" in page for each in study.contributions)
    assert page.count("<p>") == len(study.recommendation)


def test_a_page_of_effects_draws_what_the_study_found(study: Effects) -> None:
    gravity, idle, stop = content(study)["effects"]
    assert study.droppable == ("idle",) and idle["droppable"] and not gravity["droppable"] and not stop["droppable"]
    assert not stop["comparable"] and stop["ends"] and stop["differs_at"] == 0.1 and stop["mark"] == "*"
    assert gravity["added"] == 30.0 and gravity["change"] == 0.3 and idle["added"] is None


@pytest.mark.slow
def test_the_script_of_effects_sorts_selects_and_tells(study: Effects, tmp_path: Path) -> None:
    with opened(study.page(tmp_path / "effects.html")) as tab:
        names = tab.locator("#chart .name")
        assert names.all_text_contents() == ["gravity", "idle", "stop"]
        tab.select_option("#order", "operations")
        assert names.all_text_contents() == ["stop", "idle", "gravity"]
        assert tab.locator("tbody td:first-child").all_text_contents() == ["stop", "idle", "gravity"]
        tab.select_option("#order", "change")
        assert names.all_text_contents() == ["stop", "gravity", "idle"]
        notes = tab.locator("#chart .step")
        assert {"nothing, to the bit", "0.5 until 0.1 s", "2 (30 ns)"} <= set(notes.all_text_contents())
        tab.select_option("#output", "tip")
        assert "0.02" in notes.all_text_contents()
        tab.locator("#chart .field").first.hover()
        assert "ended by 'fall' at t = 0.1 s" in tab.inner_text("#tip")
        tab.set_viewport_size({"width": 420, "height": 800})
        tab.wait_for_timeout(100)
        assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")


@pytest.mark.slow
def test_the_script_of_the_lab_draws_clear_errors_and_what_others_are_below(tmp_path: Path) -> None:
    page = lab().page(tmp_path / "accuracy.html")
    assert_alone(page.read_text(encoding="utf-8"))
    with opened(page) as tab:
        points, tip = tab.locator("#chart .point"), tab.locator("#tip")
        assert points.count() == 2 and tab.locator("#chart .hollow").count() == 1
        tab.locator("#chart .hollow").hover()
        assert "below 1.0e-9" in tip.inner_text()
        tab.select_option("#quantity", "pin.angle")
        tab.select_option("#which", "end_errors")
        assert points.count() == 1
        points.hover()
        assert "5.0e-4" in tip.inner_text() and "<fell>" in tab.inner_text("tr.failed")
