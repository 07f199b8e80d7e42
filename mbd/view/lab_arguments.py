"""Arguments of ``mbd accuracy``."""

from __future__ import annotations

from argparse import ArgumentParser

__all__ = ["describe"]


def describe(parser: ArgumentParser) -> None:
    """Add them to a parser."""
    parser.add_argument(
        "script", metavar="SCRIPT-or-EXAMPLE", help="a Python file that defines model, start and until, or an example"
    )
    parser.add_argument("--target", type=float, metavar="ERROR", help="wanted error over the range of each quantity")
    parser.add_argument("--out", metavar="DIR", help="folder for table, plot and page (default: mbd-runs/NAME)")
    parser.add_argument("--until", type=float, metavar="SECONDS", help="another end time than the script's")
    parser.add_argument("--dt", type=float, action="append", metavar="SECONDS", help="a step; may be given again")
    parser.add_argument("--tol", type=float, action="append", metavar="ERROR", help="a tolerance [m, rad]; likewise")
    parser.add_argument("--quantity", action="append", metavar="NAME", help="a result to judge; may be given again")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
