"""Recordings to files of other programs."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mbd.errors import TrajectoryError
from mbd.laboratory.comma_separated import write_csv
from mbd.laboratory.motion_capture import write_c3d
from mbd.laboratory.recording import Recording
from mbd.laboratory.storage import save_storage
from mbd.laboratory.trc import write_trc
from mbd.results.archive import named_file, write_whole
from mbd.results.opensim import KINDS

TEXTS: dict[str, Callable[[Recording, Path], str]] = {".trc": write_trc, ".csv": write_csv}


def write(recording: Recording, path: str | Path) -> Path:
    """Write a recording in the format that the end of the name says, see `Recording.save`."""
    target = named_file(path)
    if target.suffix == ".c3d":

        def fill(partial: Any) -> None:
            with TemporaryDirectory() as folder:  # ezc3d wants its own ending
                whole = Path(folder) / "whole.c3d"
                write_c3d(recording, whole, target.name)
                Path(partial).write_bytes(whole.read_bytes())

        write_whole(target, fill)
        return target
    if target.suffix in KINDS:
        return save_storage(recording, target)
    if target.suffix not in TEXTS:
        raise TrajectoryError(
            f"a recording ends in .trc, .mot, .sto, .csv or .c3d, such as 'walk.trc'; got {str(path)!r}"
        )
    text = TEXTS[target.suffix](recording, target)
    write_whole(target, lambda partial: Path(partial).write_text(text, encoding="utf-8", newline="\n"))
    return target
