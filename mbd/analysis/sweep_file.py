"""A file of finished runs: a sweep that was ended, or killed, goes on where it was.

The file is text, a line of JSON each: first what the sweep is (names, titles, settings, parameters of the model), then
a run, with its values, results and message, as soon as it is over. A last line that a kill has cut short counts as a
run that was not made.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from mbd.analysis.sweep_runs import Row, Runs
from mbd.errors import ModelError
from mbd.results.archive import named_file

__all__ = ["SweepFile", "whole_lines"]

FORMAT = "mbd sweep 1"


class SweepFile:
    """The rows that a file holds, and the file, to which more are added.

    Raises
    ------
    ModelError
        for a file that is none of a sweep, and one of another sweep, by what differs.
    """

    def __init__(self, path: Any, runs: Runs, parameters: Mapping[str, float]) -> None:
        self.path = named_file(path, ".jsonl")
        self.rows: dict[str, Row] = {}
        head = _head(runs, parameters)
        if self.path.exists() and self.path.stat().st_size:
            self._read(head)
        else:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._add(head)

    def row(self, case: Sequence[Any]) -> Row | None:
        """What came of a case, if the file has it."""
        return self.rows.get(_key(case))

    def keep(self, case: Sequence[Any], row: Row) -> None:
        """Add a run that is over."""
        self.rows[_key(case)] = row
        self._add({"case": _key(case), "results": row.results, "success": row.success, "message": row.message})

    def _add(self, line: Mapping[str, Any]) -> None:
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def _read(self, head: Mapping[str, Any]) -> None:
        lines = list(whole_lines(self.path))
        if not lines or lines[0].get("format") != FORMAT:
            raise ModelError(f"file: {str(self.path)!r} is no file of a sweep; give another name")
        differs = [name for name in head if lines[0].get(name) != head[name]]
        if differs:
            raise ModelError(
                f"file: {str(self.path)!r} belongs to another sweep; its {', '.join(differs)} differ: give another name"
            )
        for line in lines[1:]:
            self.rows[line["case"]] = Row(list(line["results"]), line["success"], line["message"])


def whole_lines(path: Path) -> Iterator[dict[str, Any]]:
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


def _key(case: Sequence[Any]) -> str:
    return json.dumps([value if isinstance(value, float | int) else repr(value) for value in case])


def _head(runs: Runs, parameters: Mapping[str, float]) -> dict[str, Any]:
    settings = {name: repr(value) for name, value in runs.settings.items() if name != "parameters"}
    given = {**parameters, **(runs.settings.get("parameters") or {})}
    return {
        "format": FORMAT, "model": str(getattr(runs.model, "name", "")), "names": list(runs.names),
        "results": list(runs.results), "settings": settings, "parameters": {k: float(v) for k, v in given.items()},
    }  # fmt: skip
