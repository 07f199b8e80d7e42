"""A file of blocks of starts that are decided.

Each has its first number, a letter for the kind of each start (`mbd.gait.basin.kinds`), attractors, steps and times;
one that Ctrl-C has cut short also the places of the starts that are left.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbd.gait.basin.kinds import LETTERS
from mbd.gait.basin.walks import Decided, Numbers
from mbd.results.study_file import StudyFile

__all__ = ["Store", "digest_of"]


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
        self.file = StudyFile(path, "basin", head)
        self._blocks = {line["first"]: line for line in self.file.parts}

    def fill(self, first: int, block: Decided) -> Numbers:
        """Note what became of a block of starts as far as the file has it; the places of those that are left."""
        line = self._blocks.get(first)
        if line is None or len(line["kinds"]) != len(block.kind):
            return np.arange(len(block.kind))
        block.kind[:] = [LETTERS.index(letter) for letter in line["kinds"]]
        block.attractor[:], block.steps[:], block.time[:] = line["attractors"], line["steps"], line["times"]
        return np.array(line.get("left", []), dtype=np.int64)

    def keep(self, first: int, block: Decided, left: Numbers) -> None:
        """Add a block that is decided but for the starts at the places `left`."""
        self.file.add({
            "first": first, "kinds": "".join(LETTERS[kind] for kind in block.kind.tolist()),
            "attractors": block.attractor.tolist(), "steps": block.steps.tolist(), "times": block.time.tolist(),
            **({"left": left.tolist()} if len(left) else {}),
        })  # fmt: skip
