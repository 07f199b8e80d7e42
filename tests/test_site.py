"""What the README, the metadata and the site promise agrees with the repository."""

import re
import tomllib
from pathlib import Path

import pytest

import mbd
from mbd.cli import examples
from website.reference import GROUPS, OF_INTEREST

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
COLUMNS = {"mbd": "mbd, call"}
"""Columns of the README's table that the page of peers calls otherwise."""


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def tables(text: str) -> dict[str, dict[str, str]]:
    """Cells of the first row of each label, in brackets or not, by the label, then by column."""
    found: dict[str, dict[str, str]] = {}
    head: list[str] = []
    for line in text.splitlines():
        if not line.startswith("|"):
            head = []
        elif not head:
            head = cells(line)
        elif (label := re.search(r"S\w+ ≤ [\d.e-]+", line)) is not None:
            found.setdefault(label[0], dict(zip(head, cells(line), strict=True)))
    return found


def test_figures_of_the_readme_are_those_of_the_page_of_peers():
    peers = tables((ROOT / "docs" / "peers.md").read_text(encoding="utf-8"))
    shown = tables(README)
    assert len(shown) == 3
    for row, figures in shown.items():
        own = {name: cell for name, cell in list(figures.items())[1:] if cell}
        assert own == {name: peers[row].get(COLUMNS.get(name, name)) for name in own}, row


def test_the_readme_fits_a_screen_and_sets_everything_up_in_two_commands():
    block = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert block is not None and len([line for line in block[1].splitlines() if line]) == 10
    commands = [line for line in README.splitlines() if line.startswith("python -m pip install")]
    assert len(commands) == 2 and commands[1].startswith("python -m pip install -e ")
    name = commands[0].split()[-1]
    assert name in examples()
    assert len(README.splitlines()) <= 80


def test_versions_and_authors_agree():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {mbd.__version__}\n" in citation and f"\nlicense: {PROJECT['license']}\n" in citation
    assert [author["name"] for author in PROJECT["authors"]] == re.findall(r"  - name: (.*)", citation)


def test_every_public_name_is_in_the_reference_once():
    names = [name for group in GROUPS.values() for name in group.split()]
    assert sorted(names) == sorted(set(mbd.__all__) - {"__version__"})
    assert set(OF_INTEREST) <= set(GROUPS)


def test_every_page_has_its_place_in_the_site():
    listed = set(re.findall(r": ([\w-]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
    assert {page.name for page in (ROOT / "docs").glob("*.md")} <= listed


@pytest.mark.parametrize(("text", "folder", "wanted"), [
    ("[guide](docs/guide.md#a), [far](https://a.b)", "", "[guide](guide.md#a), [far](https://a.b)"),
    ("[a test](../tests/test_docs.py)", "docs", "a test"),
    ("[us](../README.md) [leg](../examples/four_bar.py)", "docs", "[us](index.md) [leg](gallery/four-bar.md)"),
    ("![drawn](docs/pictures/walk.svg) [all](examples)", "", "![drawn](pictures/walk.svg) [all](gallery/index.md)"),
    ("`run[a](b)` stays [here](#there)", "", "`run[a](b)` stays [here](#there)"),
])  # fmt: skip
def test_links_out_of_the_docs_lead_to_pages_of_the_site(text, folder, wanted):
    from website.links import relinked

    assert relinked(text, folder) == wanted


def test_docstrings_become_markdown():
    from website.markdown import to_markdown

    text = "A `Link` of `simulate`.\n\nParameters\n----------\na, b : two\n    things [m]; c : 'one'\n\n"
    text += "Raises\n------\nModelError\n    always.\n\n>>> 1 + 1\n2\n\nThe end."
    assert to_markdown(text, own="simulate") == (
        "A [`Link`][mbd.Link] of `simulate`.\n\n**Parameters**\n\n- `a`, `b`: two things [m]\n- `c`: 'one'\n\n\n"
        "**Raises**\n\n- [`ModelError`][mbd.ModelError]: always.\n\n\n```pycon\n>>> 1 + 1\n2\n```\n\nThe end."
    )


def test_every_page_has_its_place_in_the_navigation():
    listed = re.findall(r": ([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
    written = [page.name for page in (ROOT / "docs").glob("*.md")]
    made = [f"reference/{title.lower().replace(' ', '-')}.md" for title in GROUPS]
    assert {*written, *made} <= set(listed) and len(listed) == len(set(listed))
