"""A file to which a study of many runs adds what is done: ended or killed, it goes on where it was.

The file is text, a line of JSON each: first what the study is, then a part of it as soon as it is done. A last line
that a kill has cut short counts as a part that was not done.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from mbd.errors import ModelError
from mbd.results.archive import named_file

__all__ = ["StudyFile"]


class StudyFile:
    """The parts that a file holds, and the file, to which more are added.

    Parameters
    ----------
    path : the file's name, with or without '.jsonl'
    kind : of the study, 'sweep'
    head : what tells one study from another, of words, numbers, lists and tables

    Attributes
    ----------
    parts : those that the file held as it was opened

    Raises
    ------
    ModelError
        for a file of something else, and one of another study, by what differs.
    """

    def __init__(self, path: Any, kind: str, head: Mapping[str, Any]) -> None:
        self.path, self.kind = Path(named_file(path, ".jsonl")), kind
        self.parts: list[dict[str, Any]] = []
        head = {"format": f"mbd {kind} 1", **head}
        if self.path.exists() and self.path.stat().st_size:
            self.parts = self._read(head)
        else:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.add(head)

    def add(self, part: Mapping[str, Any]) -> None:
        """Write a part that is done; it is on the disk as this returns."""
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(part) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def _read(self, head: Mapping[str, Any]) -> list[dict[str, Any]]:
        lines = list(_whole_lines(self.path))
        if not lines or lines[0].get("format") != head["format"]:
            raise ModelError(f"file: {str(self.path)!r} is no file of a {self.kind}; give another name")
        differs = [name for name in head if _text(lines[0].get(name)) != _text(head[name])]
        if differs:
            raise ModelError(
                f"file: {str(self.path)!r} belongs to another {self.kind}; its {', '.join(differs)} differ: "
                "give another name"
            )
        return lines[1:]


def _text(value: Any) -> str:
    return json.dumps(value, sort_keys=True)


def _whole_lines(path: Path) -> Iterator[dict[str, Any]]:
    """Lines of a file that are whole; one that was cut short is taken out of it."""
    whole = 0
    with path.open("rb") as file:
        for raw in file:
            try:
                line = json.loads(raw) if raw.endswith(b"\n") else None
            except ValueError:
                line = None
            if not isinstance(line, dict):
                break
            whole += len(raw)
            yield line
    if whole and whole < path.stat().st_size:
        os.truncate(path, whole)
