"""A file to which a study of many runs adds what is done: ended or killed, it goes on where it was.

The file is text, a line of JSON each: first what the study is, then a part of it as soon as it is done. Each line has a
seal, a hash of the first line and of its own content, so that a line of another study and a changed digit are found. A
last line that a kill has cut short counts as a part that was not done.
"""

import json
import os
from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from mbd.errors import ModelError
from mbd.notes import doubt
from mbd.results.archive import named_file, writing

SEAL = "seal"
"""The member of each line that is a hash of the others."""


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
        for a file of something else, one of another study, by what differs, and one that was changed by hand.
    TrajectoryError
        for a file that cannot be written.
    """

    def __init__(self, path: Any, kind: str, head: Mapping[str, Any]) -> None:
        self.path, self.kind = Path(named_file(path, ".jsonl")), kind
        self.parts: list[dict[str, Any]] = []
        self.writes = True
        head = {"format": f"mbd {kind} 3", **head}
        self._head = _seal("", head)
        with writing(self.path):
            begun = self.path.exists() and _begun(self.path)
            if begun:
                self.parts = self._read(head)
            else:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._write({**head, SEAL: self._head}, "w")

    def add(self, part: Mapping[str, Any]) -> None:
        """Write a part that is done; it is on the disk as this returns.

        Where the disk is full, an `MbdWarning` says so, and the study continues without the file.
        """
        if not self.writes:
            return
        try:
            self._write({**part, SEAL: _seal(self._head, part)}, "a")
        except OSError as error:
            self.writes = False
            doubt(
                f"file: {str(self.path)!r} cannot be written any more ({error.strerror or error}); what is done from "
                f"here on is in the result of this {self.kind} alone"
            )

    def _write(self, line: Mapping[str, Any], mode: str) -> None:
        with self.path.open(mode, encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            if self.path.is_file():
                os.fsync(file.fileno())

    def _read(self, head: Mapping[str, Any]) -> list[dict[str, Any]]:
        lines = _lines(self.path)
        first = next(lines, None)
        formats = first.get("format") if first else None
        if formats in (f"mbd {self.kind} 1", f"mbd {self.kind} 2"):
            raise ModelError(
                f"file: {str(self.path)!r} was written by an earlier mbd, which told less of a study from another; "
                "give another name"
            )
        if first is None or formats != head["format"]:
            raise ModelError(f"file: {str(self.path)!r} is no file of a {self.kind}; give another name")
        if first.pop(SEAL, None) != _seal("", first):
            raise self._changed(1)
        differs = [name for name in head if _text(first.get(name)) != _text(head[name])]
        if differs:
            raise ModelError(
                f"file: {str(self.path)!r} belongs to another {self.kind}, with other {', '.join(differs)}; "
                "give another name"
            )
        parts = []
        for number, line in enumerate(lines, 2):
            if line is None or line.pop(SEAL, None) != _seal(self._head, line):
                raise self._changed(number)
            parts.append(line)
        return parts

    def _changed(self, number: int) -> ModelError:
        cure = "take the line out, so that its part is done again, or give another name"
        return ModelError(
            f"file: line {number} of {str(self.path)!r} is not as it was written; "
            f"{'give another name' if number == 1 else cure}"
        )


def _text(value: Any) -> str:
    return json.dumps(value, sort_keys=True)


def _seal(head: str, part: Mapping[str, Any]) -> str:
    """The hash of a part of the study with this head."""
    return sha256(f"{head} {json.dumps(part)}".encode()).hexdigest()[:16]


def _begun(path: Path) -> bool:
    """Whether a file has anything; a device, and a first line that a kill has cut short, have nothing."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        first = file.readline()
    return bool(first) and (first.endswith(b"\n") or not first.startswith(b'{"format": "mbd '))


def _lines(path: Path) -> Iterator[dict[str, Any] | None]:
    """The lines of a file, None for one that is no JSON; a last one of several that was cut short is taken out."""
    whole = 0
    with path.open("rb") as file:
        for raw in file:
            if not raw.endswith(b"\n"):
                break
            whole += len(raw)
            try:
                line = json.loads(raw)
            except (ValueError, RecursionError):
                line = None
            yield line if isinstance(line, dict) else None
    if 0 < whole < path.stat().st_size:
        os.truncate(path, whole)
