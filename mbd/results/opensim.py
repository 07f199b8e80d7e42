"""Tables of numbers as OpenSim's storage files (.sto, .mot): a header, then columns separated by tabs.

The header has a name, ``version=1``, ``nRows``, ``nColumns``, ``inDegrees`` and ``endheader``; the first column is the
time (S. L. Delp et al., OpenSim, IEEE Trans. Biomed. Eng. 54 (2007) 1940, and the file formats of its user's guide).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbd.arrays import Vector
from mbd.bodies.values import flag, shown
from mbd.errors import TrajectoryError
from mbd.results.archive import named_file, write_whole
from mbd.results.units import unit

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory

KINDS = (".sto", ".mot")
"""Endings of the files: in radians, and of motions in degrees."""


def storage_file(
    run: Trajectory, path: str | Path, names: Sequence[str] | None, at: ArrayLike | None, degrees: bool | None
) -> Path:
    """A run as a storage file, see `Trajectory.to_sto`."""
    from mbd.results.tables import columns_of

    target = _target(path)
    time, columns = columns_of(run, names, at, "after", in_words=False)
    turned = target.suffix == ".mot" if degrees is None else flag(degrees, "degrees of to_sto")
    for name in columns:
        if turned and _is_angular(run, name):
            columns[name] = np.rad2deg(columns[name])
    return write_storage(target, run.name, time, columns, turned)


def _is_angular(run: Trajectory, name: str) -> bool:
    """Whether a result is an angle or a rate of one, of cut joints too: 'knee.rate' beside 'knee.angle'."""
    joint, _, last = name.rpartition(".")
    known = unit(name, run.facts)
    return known.startswith("rad") or (
        not known and last in ("rate", "acceleration") and run.columns.knows(f"{joint}.angle")
    )


def write_storage(
    path: str | Path, name: str, time: Vector, columns: Mapping[str, Vector], degrees: bool, notes: Sequence[str] = ()
) -> Path:
    """Write columns over time; spaces in their names become underscores, as in OpenSim's own names.

    Raises
    ------
    TrajectoryError
        for another ending than .sto or .mot, and for names that would be the same.
    """
    target = _target(path)
    labels = ["_".join(label.split()) for label in columns]
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        raise TrajectoryError(f"two columns of {target.name} would be {twice[0]!r}; leave one out (names=[…] of a run)")
    header = [
        " ".join(name.split()) or "motion", "version=1", f"nRows={len(time)}", f"nColumns={1 + len(columns)}",
        f"inDegrees={'yes' if degrees else 'no'}", *notes, "endheader", "\t".join(["time", *labels]),
    ]  # fmt: skip
    table = np.column_stack([time, *columns.values()])

    def lines(partial: Any) -> None:
        with Path(partial).open("w", encoding="utf-8", newline="\n") as file:
            file.write("\n".join(header) + "\n")
            np.savetxt(file, table, fmt="%.17g", delimiter="\t")

    write_whole(target, lines)
    return target


def _target(path: str | Path) -> Path:
    target = named_file(path)
    if target.suffix not in KINDS:
        raise TrajectoryError(f"files of OpenSim end in .sto or .mot, such as 'gait.sto'; got {shown(str(path))}")
    return target
