"""Arguments of ``mbd effects``."""

from __future__ import annotations

from argparse import ArgumentParser

__all__ = ["describe"]


def describe(parser: ArgumentParser) -> None:
    """Add them to a parser."""
    parser.add_argument(
        "script",
        metavar="SCRIPT-or-EXAMPLE",
        help="a Python file that defines model, start, dt and until, or an example",
    )
    parser.add_argument(
        "--tolerance", type=float, default=1e-3, metavar="CHANGE",
        help="change of an output that is allowed, over its range (default: 0.001)",
    )  # fmt: skip
    parser.add_argument("--output", action="append", metavar="NAME", help="a result to judge by; may be given again")
    parser.add_argument("--out", metavar="DIR", help="folder for table and plot (default: mbd-runs/NAME)")
    parser.add_argument("--until", type=float, metavar="SECONDS", help="another end time than the script's")
    parser.add_argument("--dt", type=float, metavar="SECONDS", help="another step size than the script's")
