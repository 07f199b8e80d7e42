"""``mbd gait``: report how the walkers of some scripts walk, print tables, write them, a picture and a page."""

from __future__ import annotations

import webbrowser
from argparse import Namespace
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from mbd.analysis.gait_report.band import read_band
from mbd.analysis.gait_report.report import gait_report

__all__ = ["run"]


def run(runs: Sequence[Any], names: Sequence[str], out: Path, arguments: Namespace) -> int:
    """Report runs, one beside the other.

    Parameters
    ----------
    runs, names : trajectories and what to call them; out : folder for ``gait.csv``, ``gait.png`` and ``gait.html``
    arguments : sides, symmetry, mass, strides, band, open
    """
    band = None if arguments.band is None else read_band(arguments.band)
    found = gait_report(
        *runs, names=names, sides=arguments.sides, symmetry=arguments.symmetry, mass=arguments.mass,
        strides=arguments.strides, band=band,
    )  # fmt: skip
    print(found)
    written = []
    if find_spec("pandas") is None:
        print("no tables: pandas is not installed; try pip install 'mbd[data]'")
    else:
        written.append(found.to_csv(out / "gait.csv"))
    if find_spec("matplotlib") is None:
        print("no picture: matplotlib is not installed; try pip install 'mbd[plot]'")
    else:
        found.plot(out / "gait.png")
        written.append(out / "gait.png")
    written.append(found.page(out / "gait.html"))
    print("\nwrote        " + "\n             ".join(str(path) for path in written))
    if arguments.open:
        webbrowser.open(written[-1].resolve().as_uri())
    return 0
