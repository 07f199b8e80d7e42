"""Names that mean something to matplotlib, to a terminal or to a file are shown as they are, or refused."""

import io
import json
import warnings
import zipfile
from functools import cache
from pathlib import Path
from unicodedata import category

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.bodies.values import printable
from mbd.results import archive
from mbd.results.at_state import instant
from mbd.view.page import html
from tests.comparisons import at_least, compared
from tests.view.pages import Elements

ODD = ("_left", "$m", "$a$ b_c^{", r"50 \frac", "a & b < c", "колено", "膝")
CONTROL = ("a\x1b[2Jb", "a\nb", "a\rb", "a\x00", "a\u202eb", "a\x9b", "a\u2028b", "\ud800x")


def ball(name: str) -> mbd.Trajectory:
    model = mbd.Model(name)
    body = mbd.PointMass(f"{name} body", mass=1.0)
    model.connect(mbd.Translation(name, model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral(f"{name} floor", mbd.touchdown(body.origin)))
    model.apply(mbd.Applied(f"{name} air", body.origin, force=lambda v: (-0.3 * v[0], 0, 0), arguments=(body.origin,)))
    return mbd.simulate(model, mbd.assemble(model, {f"{name}.x": 0.3, f"{name}.y": 0.1}), dt=5e-3, until=0.3)


@pytest.mark.parametrize("name", ODD[:3])
def test_odd_names_are_drawn_as_they_are(name, tmp_path):
    pytest.importorskip("matplotlib")
    run = ball(name)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*Glyph.*")
        warnings.filterwarnings("error", message=".*legend.*")
        figure = run.plot(path=tmp_path / "plot.png")
        run.energy.plot(path=tmp_path / "energy.svg")
        figure.canvas.draw()
    shown = [text.get_text().replace(r"\$", "$").strip() for text in figure.axes[0].get_legend().get_texts()]
    assert shown == [f"{name}.x", f"{name}.y"]
    assert all("$" not in text.get_text().replace(r"\$", "") for text in figure.axes[-1].get_yticklabels())


@pytest.mark.parametrize("name", CONTROL, ids=ascii)
def test_names_with_control_characters_are_refused(name):
    ground = mbd.Model("ground").ground.origin
    words = (
        lambda: mbd.Model(name), lambda: mbd.PointMass(name, mass=1.0), lambda: mbd.Translation(name, ground, ground),
        lambda: mbd.Lagrangian(name, ["q"], lambda q_rate: q_rate**2), lambda: mbd.Coordinate(name),
        lambda: mbd.PointMass("b", mass=1.0).point(1.0, 0.0, name=name), lambda: mbd.Event(name, mbd.height(ground)),
    )  # fmt: skip
    for word in words:
        with pytest.raises(mbd.ModelError, match="control characters") as told:
            word()
        assert str(told.value).isprintable()


def test_ordinary_names_of_any_language_are_kept():
    for name in (*ODD, "left knee", "نیم\u200cفاصله", "e\u0301", "non\u00a0breaking"):
        assert printable(name, "Model") == name


def test_a_file_whose_names_a_terminal_would_obey_is_refused(tmp_path):
    path = ball("ball").save(tmp_path / "run")
    with zipfile.ZipFile(path) as source:
        arrays = {name.removesuffix(".npy"): np.load(io.BytesIO(source.read(name))) for name in source.namelist()}
    meta = json.loads(arrays.pop("meta").tobytes())
    del arrays["hash"]
    archive.write(path, arrays, meta)
    assert mbd.load(path).success
    meta["facts"]["model"] = "ball\x1b]0;title\x07"
    archive.write(path, arrays, meta)
    with pytest.raises(mbd.TrajectoryError, match="control characters") as told:
        mbd.load(path)
    assert "\x1b" not in str(told.value)


HARMFUL = (
    "</script>",
    "<!--",
    "-->",
    "&lt;",
    "'",
    '"',
    "`",
    "$",
    "\\",
    "/",
    "..",
    "${x}",
    "%s",
    "{0}",
    "</td>",
    "]]>",
    "_",
)
NAMES = st.lists(st.sampled_from(HARMFUL) | st.characters(), min_size=1, max_size=8).map("".join)


def posed(name: str) -> mbd.Trajectory:
    """A mechanism all of whose parts have a name, as a run of one row."""
    model = mbd.Model(name)
    body = mbd.PointMass(f"{name} body", mass=1.0)
    model.connect(mbd.Translation(f"{name} joint", model.ground.origin, body.point(0.0, 0.0, name=name)))
    model.constrain(mbd.Unilateral(f"{name} foot", mbd.touchdown(body.origin)))
    return instant(model, mbd.assemble(model))


@cache
def tags_of_a_plain_name() -> tuple[list[str], list[str]]:
    run = posed("plain")
    return Elements(html(run)).names, Elements(run._repr_html_()).names


@at_least(10)
@settings(max_examples=25, deadline=None)
@given(name=NAMES)
def test_any_name_is_refused_or_kept_in_pages_tables_and_files(name, tmp_path_factory):
    """Markup in a name adds no element, and the name that comes back is the one that was given."""
    try:
        run = posed(name)
    except mbd.ModelError as refused:
        told = str(refused)
        assert told.splitlines() == [told] and not any(category(sign) in ("Cc", "Cs") for sign in told)
        return
    compared()
    page, shown = Elements(html(run)), Elements(run._repr_html_())
    assert (page.names, shown.names) == tags_of_a_plain_name()
    assert page.texts[page.names.index("title")].startswith(name)
    data = json.loads(page.scripts[0])
    assert data["name"] == name and data["points"][0]["name"] == f"{name} body.{name}"
    assert any(name in text for text in shown.texts)
    loaded = mbd.load(run.save(tmp_path_factory.mktemp("named") / "run"))
    assert (loaded.name, loaded.names) == (run.name, run.names)


@pytest.mark.parametrize("kind", ["page", "plot", "save"])
def test_a_page_that_fails_while_it_is_written_leaves_the_one_before(kind, tmp_path, monkeypatch):
    run = ball("ball")
    path = tmp_path / {"page": "page.html", "plot": "plot.png", "save": "run.npz"}[kind]
    write = {"page": run.page, "plot": lambda place: run.plot(path=place), "save": run.save}[kind]
    write(path)
    before = path.read_bytes()

    def full(partial, *_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        write(path)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
