"""The pages of docs/ and the README: every Python block runs, and prints what the comment beside it says."""

import ast
import logging
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]

BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+\.\d+")
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)")


@dataclass(frozen=True)
class Printed:
    """A ``print(…)`` of a block: its last line, and the output that the comments beside or below it promise."""

    end: int
    expected: str | None


def blocks(page: Path) -> Iterator[tuple[int, str]]:
    """(lines before the block, its text) of every Python block of a page."""
    text = page.read_text(encoding="utf-8")
    for match in BLOCK.finditer(text):
        yield text.count("\n", 0, match.start(1)), match.group(1)


def prints(code: str) -> dict[int, Printed]:
    """Every print of a block by each of its lines."""
    lines, found = code.splitlines(), {}
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print":
            end = node.end_lineno or node.lineno
            printed = Printed(end, promised(lines, end, node.end_col_offset or 0))
            found |= {line: printed for line in range(node.lineno, end + 1)}
    return found


def promised(lines: list[str], end: int, column: int) -> str | None:
    """The comment behind the print, else the comment lines below it."""
    beside = lines[end - 1].encode()[column:].decode().strip()
    if beside.startswith("#"):
        return beside.removeprefix("#").strip()
    below = []
    for line in lines[end:]:
        if not line.lstrip().startswith("#"):
            break
        below.append(line.strip().removeprefix("#").strip())
    return "\n".join(below) if below else None


def agrees(expected: str, came: str) -> bool:
    """Equal but for white space and the last digits of numbers with a point; '…' stands for anything."""
    wanted, got = " ".join(expected.split()), " ".join(came.split())
    *texts, end = NUMBER.split(wanted)
    pattern = "".join(anything(text) + f"({NUMBER.pattern})" for text in texts) + anything(end)
    match = re.fullmatch(pattern, got, re.DOTALL)
    return match is not None and all(map(close, NUMBER.findall(wanted), match.groups()))


def anything(text: str) -> str:
    return ".*?".join(map(re.escape, text.split("…")))


def close(wanted: str, came: str) -> bool:
    """To four digits, or to one unit of the last digit."""
    last = 10.0 ** -len(wanted.partition(".")[2])
    return abs(float(wanted) - float(came)) <= max(1e-4 * abs(float(wanted)), 1.01 * last)


def run_block(page: Path, before: int, code: str, namespace: dict[str, Any]) -> list[str]:
    """Execute a block; what it printed differently from its comments."""
    known, said = prints(code), {}

    def show(*values: Any) -> None:
        line = sys._getframe(1).f_lineno - before
        said.setdefault(known[line], []).append(" ".join(map(str, values)))

    namespace["print"] = show
    exec(compile("\n" * before + code, str(page), "exec", dont_inherit=True), namespace)
    differ = []
    for printed in dict.fromkeys(known.values()):
        came = "\n".join(said.get(printed, ["nothing"]))
        if printed.expected is None:
            differ.append(f"{page.name}:{before + printed.end}: say in a comment that this prints\n{came}")
        elif not agrees(printed.expected, came):
            differ.append(f"{page.name}:{before + printed.end}: promises\n{printed.expected}\nbut prints\n{came}")
    return differ


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_block_of_a_page_runs_and_prints_what_it_says(page, tmp_path, monkeypatch, request):
    log = logging.getLogger("mbd")
    request.addfinalizer(partial(log.setLevel, log.level))
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, Any] = {"__name__": "page"}
    monkeypatch.setitem(sys.modules, "page", type(sys)("page"))  # where the classes of a page live
    differ = [line for before, code in blocks(page) for line in run_block(page, before, code, namespace)]
    assert not differ, "\n\n".join(differ)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_to_a_file(page):
    targets = [target for target in LINK.findall(page.read_text(encoding="utf-8")) if "://" not in target]
    assert [target for target in targets if not (page.parent / target).exists()] == []


def test_a_changed_output_is_noticed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```python\nx = 2\nprint(x)  # 3\nprint(f'{x} m')\n# 2 m\nprint(x)\n```\n", encoding="utf-8")
    differ = [line for before, code in blocks(page) for line in run_block(page, before, code, {})]
    assert len(differ) == 2
    assert "promises\n3\nbut prints\n2" in differ[0]
    assert "say in a comment" in differ[1]


@pytest.mark.parametrize(
    ("expected", "came", "same"),
    [
        ("a  b", "a b", True),
        ("a … c", "a b\nb c", True),
        ("1.23456 m", "1.23451 m", True),
        ("1.23456 m", "1.23556 m", False),
        ("0.12", "0.13", True),
        ("12 of 3.0", "13 of 3.0", False),
        ("x = … N", "x = 3.2 m", False),
    ],
)
def test_what_counts_as_the_same_output(expected, came, same):
    assert agrees(expected, came) is same
