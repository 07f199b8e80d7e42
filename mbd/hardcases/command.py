"""``mbd hardcases``: judge, print the table, write the page."""

import shutil
import signal
import sys
import threading
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from types import FrameType

from mbd.errors import ModelError
from mbd.hardcases import CASES
from mbd.hardcases.case import HardCase
from mbd.hardcases.judging import Verdict, chosen, judged, named_schemes, short, with_schemes
from mbd.hardcases.page import write_page
from mbd.hardcases.table import as_text, write_markdown
from mbd.progress import counted


def run(
    names: Sequence[str] = (),
    schemes: Sequence[str] | None = None,
    slow: bool = False,
    out: str | Path = "mbd-runs",
    markdown: str | Path | None = None,
) -> int:
    """Judge the cases; 0 if all hold, else 1. Ctrl-C shows what was judged until then and gives 130.

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
    verdicts, stopped = _until_stopped(able, only)
    note = f" Stopped after {len(verdicts)} of {len(able)} cases." if stopped else ""
    if verdicts:
        print(as_text(verdicts, min(shutil.get_terminal_size((120, 24)).columns, 160)))
        if find_spec("matplotlib") is None:
            print("no plots: matplotlib is not installed; try pip install 'mbd[plot]'", file=sys.stderr)
        written = [write_page(verdicts, Path(out) / "hardcases.html", note)]
        written += [write_markdown(verdicts, markdown)] if markdown and not stopped else []
        print("wrote " + ", ".join(str(path) for path in written))
    if stopped:
        kept = f"; {markdown} is left as it was" if markdown else ""
        print(f"stopped after {len(verdicts)} of {len(able)} cases{kept}", file=sys.stderr)
        return 130  # the exit code of a command that was stopped by Ctrl-C
    return 0 if all(verdict.passed for verdict in verdicts) else 1


def _until_stopped(cases: Sequence[HardCase], only: Sequence[str] | None) -> tuple[list[Verdict], bool]:
    """Verdicts on the cases one by one, and whether Ctrl-C ended that; the case it fell into is left out.

    A run that is interrupted ends in order and its judge goes on with what it has, so the signal itself is noted.
    """
    verdicts: list[Verdict] = []
    pressed: list[int] = []
    usual = signal.getsignal(signal.SIGINT)

    def note(number: int, frame: FrameType | None) -> None:
        pressed.append(number)
        signal.default_int_handler(number, frame)

    mine = threading.current_thread() is threading.main_thread() and usual is signal.default_int_handler
    if mine:
        signal.signal(signal.SIGINT, note)
    try:
        for case in counted(cases, lambda case: case.id):
            verdict = judged(case, only, between=lambda: bool(pressed))
            if pressed:
                break
            verdicts.append(verdict)
    except KeyboardInterrupt:
        pressed.append(signal.SIGINT)
    finally:
        if mine:
            signal.signal(signal.SIGINT, usual)
    return verdicts, bool(pressed)
