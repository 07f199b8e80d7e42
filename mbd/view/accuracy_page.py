"""The accuracy lab as one self-contained HTML page: no network, no libraries, our own small script."""

from __future__ import annotations

import math
from dataclasses import asdict
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.view.report import machine, versions
from mbd.view.style import CYCLE
from mbd.view.template import filled, written

if TYPE_CHECKING:
    from mbd.analysis.accuracy import Accuracy, Point

__all__ = ["content", "write"]


def write(found: Accuracy, path: str | Path) -> Path:
    """Write the page; see `Accuracy.page`."""
    return written(html(found), path)


def html(found: Accuracy) -> str:
    """The page as text."""
    known = versions()
    made = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    told = f"mbd {known['mbd']}, Python {known['python']}, numpy {known['numpy']}, {machine()['processor']}; {made}"
    parts = {
        "<!--title-->": escape(found.model),
        "<!--advice-->": "".join(f"<p>{escape(line)}</p>" for line in found.recommendation),
        "<!--notes-->": "".join(f"<li>{escape(note)}</li>" for note in found.notes),
        "<!--origin-->": escape(found.origin),
        "<!--made-->": escape(told),
        "<!--rows-->": "\n".join(_row(p, not k) for scheme in found.schemes for k, p in enumerate(found.of(scheme))),
        "<!--heads-->": _heads(),
    }
    return filled("lab", content(found), parts)


def _heads() -> str:
    from mbd.analysis.accuracy.result import HEADS

    return "".join(f"<th>{escape(head)}</th>" for head in HEADS)


def _row(point: Point, leads: bool) -> str:
    """A point as a row of the table; the first of a scheme has its name."""
    from mbd.analysis.accuracy.result import HEADS, cells, remark

    first, dt, *rest = cells(point)
    head = f"<td>{escape(first) if leads else ''}</td><td>{escape(dt)}</td>"
    if point.failure:
        kind, told = " first" if leads else "", f"failed: {escape(point.failure)}"
        return f'<tr class="failed{kind}">{head}<td colspan="{len(HEADS) - 2}">{told}</td></tr>'
    note = f' title="{escape(remark(point))}"' if remark(point) else ""
    kind = ' class="first"' if leads else ""
    return f"<tr{kind}{note}>{head}{''.join(f'<td>{escape(text)}</td>' for text in rest)}</tr>"


def content(found: Accuracy) -> dict[str, Any]:
    """What the script draws, as plain lists."""
    bound = {} if found.reference is None else found.reference.bound
    return {
        "quantities": list(found.quantities),
        "target": found.target,
        "bound": {name: _finite(value) for name, value in bound.items()},
        "schemes": [
            {"name": scheme, "color": CYCLE[number % len(CYCLE)], "points": [_point(p) for p in found.of(scheme)]}
            for number, scheme in enumerate(found.schemes)
        ],
    }


def _point(point: Point) -> dict[str, Any]:
    """A point as JSON has it: what is not finite is not known."""
    return {
        key: {name: _finite(each) for name, each in value.items()} if isinstance(value, dict)
        else _finite(value) if isinstance(value, float) else value
        for key, value in asdict(point).items()
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
