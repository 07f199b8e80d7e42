"""What notebooks show: tables that can be read aloud, formulas, an animation; names are names, whatever is in them."""

import copy
import json
import pickle
import re
import sys
from contextlib import contextmanager
from functools import cache
from html.parser import HTMLParser
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.analysis.accuracy.points import Point
from mbd.analysis.effects.contribution import Change, Contribution
from mbd.hardcases.case import HardCase, Outcome
from mbd.hardcases.judging import Judged, Verdict
from mbd.notebook import Faults, Text, Values, block, table

NASTY = "<b onclick='x'>&amp; $a$ \"q\""
"""A name with markup, an entity, a formula and quotes."""

VOID = {"meta", "br", "input", "link"}


class Page(HTMLParser):
    """Elements in order, each closed in its turn, and the texts in them."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.cells: list[list[str]] = []
        self.texts: list[str] = []
        self._open: list[str] = []
        self.feed(html)
        self.close()
        assert not self._open, f"not closed: {self._open}"

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self._open.append(tag)
        if tag == "tr":
            self.cells.append([])
        if tag in ("td", "th"):
            self.cells[-1].append("")

    def handle_endtag(self, tag):
        assert self._open and self._open.pop() == tag, f"</{tag}> closes something else"

    def handle_data(self, data):
        self.texts.append(data)
        if self._open and self._open[-1] in ("td", "th"):
            self.cells[-1][-1] += data

    def tags(self, name):
        return [attributes for tag, attributes in self.elements if tag == name]


@cache
def scene() -> tuple[mbd.Model, mbd.State, mbd.Trajectory]:
    model = mbd.Model(f"model {NASTY}")
    rod = mbd.Link(f"rod {NASTY}", mass=1.0, length=1.0, center=0.5)
    pin = mbd.Revolute(f"pin {NASTY}", model.ground.origin, rod.start, loss=mbd.Viscous(0.1))
    model.connect(pin)
    model.constrain(mbd.Unilateral(f"stop {NASTY}", mbd.extension(pin), restitution=0.3))
    start = mbd.assemble(model, position={f"pin {NASTY}.angle": 0.5})
    return model, start, mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=5e-3, until=1.0)


def shown() -> dict[str, object]:
    model, start, run = scene()
    swept = mbd.sweep(model, {"dt": [0.01, 0.02]}, start, [f"pin {NASTY}.angle"], until=0.05)
    points = (Point(f"scheme {NASTY}", 0.02, error=1e-3, at_most=1e-3, seconds=1e-3), Point("a", 0.01, failure=NASTY))
    accuracy = mbd.Accuracy(run.name, (f"pin {NASTY}.angle",), points, None)
    contribution = Contribution(
        f"pin {NASTY} loss", "loss", 3, "always", None, 0.1, 0.5, Change({f"pin {NASTY}.angle": 0.1})
    )
    effects = mbd.Effects(run.name, (f"pin {NASTY}.angle",), 1e-3, (contribution,), 10, 0, None, run)
    case = HardCase("x", f"holds {NASTY}", lambda scheme: Outcome([]))
    return {
        "model": model, "state": start, "run": run, "events": run.events, "event": run.events[0], "stats": run.stats,
        "settings": run.settings, "parameters": run.parameters, "energy": run.energy, "cost": model.cost(),
        "linearization": mbd.linearize(model, start), "sweep": swept, "accuracy": accuracy,
        "effects": effects, "verdict": Verdict(case, [Judged("HHT", Outcome([]), 0.1, error=f"no {NASTY}")]),
        "faults": Faults([f"two joints are named 'pin {NASTY}'"]),
    }  # fmt: skip


KINDS = (
    "model", "state", "run", "events", "event", "stats", "settings", "parameters", "energy", "cost", "linearization",
    "sweep", "accuracy", "effects", "verdict", "faults",
)  # fmt: skip


@pytest.fixture(scope="module")
def values():
    return shown()


@pytest.mark.parametrize("kind", KINDS)
def test_a_value_is_a_table_with_titles_whose_names_stay_names(kind, values):
    page = Page(values[kind]._repr_html_())
    assert {tag for tag, _ in page.elements} <= {
        "table", "caption", "thead", "tbody", "tr", "th", "td", "p", "details", "summary",
    }  # fmt: skip
    tables = page.tags("table")
    assert tables and len(page.tags("caption")) == len(tables)
    assert all(attributes["scope"] in ("row", "col") for attributes in page.tags("th"))
    assert all("tex2jax_ignore" in attributes["class"] for attributes in tables)  # no formula between dollar signs
    text = "".join(page.texts)
    assert "onclick" not in "".join(str(attributes) for _, attributes in page.elements)
    if kind not in ("settings", "stats"):
        assert "<b onclick" in text and "&amp; $a$" in text
    styles = " ".join(attributes.get("style") or "" for _, attributes in page.elements)
    assert "background" not in styles and "#" not in styles  # as dark or light as the page


def test_an_animation_is_the_page_in_a_frame_that_reaches_nothing_outside():
    run = scene()[2]
    (attributes,) = Page(run.animate(height=500)._repr_html_()).tags("iframe")
    assert attributes["sandbox"] == "allow-scripts allow-downloads" and "height:500px" in attributes["style"]
    assert attributes["title"] == f"model {NASTY}, animated"
    inner = attributes["srcdoc"]
    assert inner.startswith("<!doctype html>") and "Content-Security-Policy" in inner
    data = inner.partition('type="application/json">')[2].partition("</script>")[0]
    assert json.loads(data)["name"] == f"model {NASTY}"
    with pytest.raises(mbd.ModelError, match="height of an animation must be a number of pixels from 200 on"):
        run.animate(height=20)


def test_equations_are_formulas_with_names_as_they_are():
    bundle = scene()[0].equations()._repr_mimebundle_()
    formulas = bundle["text/latex"]
    assert bundle["text/plain"] == scene()[0].equations() and "text/html" not in bundle
    assert formulas.startswith("$$\\begin{aligned}\n") and formulas.endswith("\n\\end{aligned}$$")
    assert "\n\n" not in formulas and "<" not in formulas and formulas.count("$") - formulas.count("\\$") == 4
    assert "M_{1\\,1} &= " in formulas and r"\$a\$" in formulas


def test_formulas_that_are_too_many_stay_text(monkeypatch):
    equations = scene()[0].equations()
    monkeypatch.setattr("mbd.equations.printing.MAX_FORMULAS", 3)
    bundle = equations._repr_mimebundle_()
    assert set(bundle) == {"text/plain", "text/html"} and Page(bundle["text/html"]).tags("pre")


def test_texts_faults_and_values_are_what_they_were():
    model, _, run = scene()
    assert isinstance(model.describe(), str) and model.describe()._repr_mimebundle_()["text/plain"] == model.describe()
    assert model.check() == [] and repr(model.check()) == "[]" and "no faults" in model.check()._repr_html_()
    assert run.events == list(run.record.events) and json.dumps(run.parameters) == json.dumps(dict(run.parameters))
    for value in (model.describe(), model.equations(), model.check(), run.stats, run.parameters):
        assert pickle.loads(pickle.dumps(value)) == value == copy.copy(value)
    assert len(pickle.loads(pickle.dumps(run.events))) == len(run.events)


def test_many_events_are_the_first_and_the_last():
    event = scene()[2].events[0]
    many = type(scene()[2].events)([event] * 1000)
    page = Page(many._repr_html_())
    assert len(page.cells) == 41 and "960 more between the first 20 and the last" in page.texts


@settings(max_examples=25)
@given(st.lists(st.lists(st.text(max_size=12), min_size=3, max_size=3), max_size=4), st.text(max_size=12))
def test_a_table_gives_back_what_it_was_made_of(rows, caption):
    page = Page(table(caption, ("one", "two <i>", "three"), rows))
    whole = [["one", "two <i>", "three"], *rows]
    clean = [[cell.replace("\r\n", "\n").replace("\r", "\n") for cell in row] for row in whole]
    assert [[cell.replace("\r\n", "\n").replace("\r", "\n") for cell in row] for row in page.cells] == clean


def test_numbers_stand_at_the_right_and_words_at_the_left():
    page = Page(table("", ("name", "value", "kind"), [("a", 1.5, "x"), ("b", None, "2 m"), ("c", -3e-5, "")]))
    assert [attributes["style"] for attributes in page.tags("td")] == [
        "text-align:right;white-space:nowrap",
        "text-align:left",
    ] * 3
    assert page.cells[1:] == [["a", "1.5", "x"], ["b", "–", "2 m"], ["c", "-3e-05", ""]]


def test_a_text_keeps_its_lines():
    assert "".join(Page(block("a  <b>\n  c")).texts) == "a  <b>\n  c"
    assert Page(Text("x")._repr_mimebundle_()["text/html"]).tags("pre")
    assert "".join(Page(Values("v", {"a": [1, 2.0], "b": {"c": True}})._repr_html_()).texts).count("1; 2") == 1


def test_a_notebook_shows_a_figure_once(monkeypatch):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    figure, other = scene()[2].plot(), scene()[2].plot()
    try:
        figure._repr_mimebundle_()
        assert pyplot.fignum_exists(figure.number)  # in a window it stays
        monkeypatch.setattr("mbd.view.windows.get_backend", lambda: "module://matplotlib_inline.backend_inline")
        assert figure._repr_mimebundle_() == {}  # the value of a cell: a picture follows, and none at the cell's end
        assert not pyplot.fignum_exists(figure.number) and pyplot.fignum_exists(other.number)
        assert len(pickle.loads(pickle.dumps(figure)).axes) == len(figure.axes)
    finally:
        pyplot.close("all")


@pytest.mark.parametrize("widgets", [False, True])
def test_a_notebook_shows_bars(widgets, monkeypatch, capsys):
    pytest.importorskip("tqdm")
    made = []

    class Bar:
        n = start_t = 0.0

        def __init__(self, **options):
            made.append(options)

        def update(self, step):
            self.n += step

        def close(self):
            made.append("closed")

    kernel = SimpleNamespace(config={"IPKernelApp": {}})
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: kernel))
    monkeypatch.setattr("mbd.progress.find_spec", lambda name: None if name == "ipywidgets" and not widgets else name)
    monkeypatch.setattr(import_module("tqdm.auto" if widgets else "tqdm"), "tqdm", Bar)
    model, start, _ = scene()
    mbd.simulate(model, start, dt=5e-3, until=0.2, progress=True)
    options, end = made
    assert end == "closed" and options["total"] == 0.2 and (options["file"] is None) is widgets
    assert capsys.readouterr().err == ""
    made.clear()
    mbd.simulate(model, start, dt=5e-3, until=0.2)
    assert not made


@pytest.mark.slow
def test_a_notebook_of_the_docs_shows_what_they_say(tmp_path):
    """The page's cells in a kernel: each shows one thing, also a figure that is not the value of its cell."""
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    page = (Path(__file__).parents[1] / "docs" / "notebook.md").read_text(encoding="utf-8")
    codes = [*re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL), "run.plot()\nx = 1", "figure"]
    cells = [nbformat.v4.new_code_cell(code) for code in codes]
    notebook = nbformat.v4.new_notebook(cells=cells)
    client = nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    )
    with patched_path():
        client.execute()
    shown = [[*output.get("data", {}), output.get("name", "")] for cell in notebook.cells for output in cell.outputs
             if "widget" not in "".join(output.get("data", {})) and output.get("name") != "stderr"]  # fmt: skip
    kinds = ("text/html", "text/latex", "text/html", "stdout", "image/png", "image/png", "text/html", "image/png",
             "image/png")  # fmt: skip
    assert len(shown) == len(kinds) and all(kind in each for kind, each in zip(kinds, shown, strict=True)), shown


@contextmanager
def patched_path():
    """Kernels find this checkout, and draw in cells."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parents[1]))
        patch.delenv("MPLBACKEND", raising=False)
        yield
