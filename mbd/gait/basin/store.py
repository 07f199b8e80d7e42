"""A file of starts that are decided: a study that was ended, or killed, goes on where it was.

The file is text, a line of JSON each: first what the study is, then a block of starts as soon as it is decided: its
first number, a letter for the kind of each (`mbd.gait.basin.kinds`), attractors, steps and times. A last line that a
kill has cut short counts as a block that was not made.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mbd.analysis.sweep_file import whole_lines
from mbd.errors import ModelError
from mbd.gait.basin.kinds import LETTERS
from mbd.gait.basin.walks import Decided
from mbd.results.archive import named_file

__all__ = ["Store", "digest_of"]

FORMAT = "mbd basin 1"


def digest_of(*arrays: Any) -> str:
    """Of numbers, to tell one study from another."""
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array, dtype=float).tobytes())
    return found.hexdigest()[:24]


class Store:
    """The blocks that a file holds, and the file, to which more are added.

    Raises
    ------
    ModelError
        for a file that is none of a basin, and one of another basin, by what differs.
    """

    def __init__(self, path: Any, head: Mapping[str, Any]) -> None:
        self.path = Path(named_file(path, ".jsonl"))
        self._blocks: dict[int, Mapping[str, Any]] = {}
        head = {"format": FORMAT, **head}
        if self.path.exists() and self.path.stat().st_size:
            self._read(head)
        else:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._add(head)

    def block(self, first: int, count: int) -> Decided | None:
        """A block of starts, if the file has it."""
        line = self._blocks.get(first)
        if line is None or len(line["kinds"]) != count:
            return None
        kinds = np.array([LETTERS.index(letter) for letter in line["kinds"]], dtype=np.int64)
        attractor, steps = (np.array(line[name], dtype=np.int64) for name in ("attractors", "steps"))
        return Decided(kinds, attractor, steps, np.array(line["times"], dtype=float))

    def keep(self, first: int, block: Decided) -> None:
        """Add a block that is decided."""
        self._add({
            "first": first, "kinds": "".join(LETTERS[kind] for kind in block.kind.tolist()),
            "attractors": block.attractor.tolist(), "steps": block.steps.tolist(), "times": block.time.tolist(),
        })  # fmt: skip

    def _add(self, line: Mapping[str, Any]) -> None:
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def _read(self, head: Mapping[str, Any]) -> None:
        lines = list(whole_lines(self.path))
        if not lines or lines[0].get("format") != FORMAT:
            raise ModelError(f"file: {str(self.path)!r} is no file of a basin; give another name")
        differs = [name for name in head if lines[0].get(name) != json.loads(json.dumps(head[name]))]
        if differs:
            raise ModelError(
                f"file: {str(self.path)!r} belongs to another basin; its {', '.join(differs)} differ: give another name"
            )
        for line in lines[1:]:
            self._blocks[line["first"]] = line
