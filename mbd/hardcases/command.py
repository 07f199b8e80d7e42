"""``mbd hardcases``: judge, print the table, write the page."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from mbd.errors import ModelError
from mbd.hardcases import CASES
from mbd.hardcases.judging import chosen, judged, named_schemes, short, with_schemes
from mbd.hardcases.page import write_page
from mbd.hardcases.table import as_text, write_markdown
from mbd.view.progress import counted

__all__ = ["run"]


def run(
    names: Sequence[str] = (),
    schemes: Sequence[str] | None = None,
    slow: bool = False,
    out: str | Path = "mbd-runs",
    markdown: str | Path | None = None,
) -> int:
    """Judge the cases; 0 if all hold, else 1.

    Parameters
    ----------
    names : of cases; all without
    schemes : of integrators; those that each case asks for without
    slow : whether cases that take long are judged too
    out : folder of the page
    markdown : a page of docs into which the table goes
    """
    only = named_schemes(schemes)
    wanted = chosen(CASES, names, slow)
    able = [case for case in wanted if with_schemes(case, only)]
    if not able:
        raise ModelError(
            f"none of {', '.join(map(short, wanted))} is judged with {', '.join(only or ())}; leave --scheme out"
            if wanted else "there is no case to judge; add --slow"
        )  # fmt: skip
    verdicts = [judged(case, only) for case in counted(able, lambda case: case.id)]
    print(as_text(verdicts, min(max(shutil.get_terminal_size((120, 24)).columns, 90), 160)))
    if find_spec("matplotlib") is None:
        print("no plots: matplotlib is not installed; try pip install 'mbd[plot]'", file=sys.stderr)
    written = [write_page(verdicts, Path(out) / "hardcases.html")]
    written += [write_markdown(verdicts, markdown)] if markdown else []
    print("wrote " + ", ".join(str(path) for path in written))
    return 0 if all(verdict.passed for verdict in verdicts) else 1
