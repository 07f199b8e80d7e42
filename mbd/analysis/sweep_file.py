"""A file of the finished runs of a sweep: names, titles, settings and parameters of the model, then the runs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from mbd.analysis.sweep_runs import Row, Runs
from mbd.results.study_file import StudyFile

__all__ = ["SweepFile"]


class SweepFile:
    """The rows that a file holds, and the file, to which more are added.

    Raises
    ------
    ModelError
        for a file that is none of a sweep, and one of another sweep, by what differs.
    """

    def __init__(self, path: Any, runs: Runs, parameters: Mapping[str, float]) -> None:
        self.file = StudyFile(path, "sweep", _head(runs, parameters))
        self.rows = {
            line["case"]: Row(list(line["results"]), line["success"], line["message"]) for line in self.file.parts
        }

    def row(self, case: Sequence[Any]) -> Row | None:
        """What came of a case, if the file has it."""
        return self.rows.get(_key(case))

    def keep(self, case: Sequence[Any], row: Row) -> None:
        """Add a run that is over."""
        self.rows[_key(case)] = row
        self.file.add({"case": _key(case), "results": row.results, "success": row.success, "message": row.message})


def _key(case: Sequence[Any]) -> str:
    return json.dumps([value if isinstance(value, float | int) else repr(value) for value in case])


def _head(runs: Runs, parameters: Mapping[str, float]) -> dict[str, Any]:
    settings = {name: repr(value) for name, value in runs.settings.items() if name != "parameters"}
    given = {**parameters, **(runs.settings.get("parameters") or {})}
    return {
        "model": str(getattr(runs.model, "name", "")), "names": list(runs.names), "results": list(runs.results),
        "settings": settings, "parameters": {k: float(v) for k, v in given.items()},
    }  # fmt: skip
