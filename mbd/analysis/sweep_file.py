"""A file of the finished runs of a sweep: names, titles, settings and parameters of the model, then the runs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from mbd.analysis.sweep_runs import Row, Runs
from mbd.compile.mechanism import Mechanism
from mbd.results.identity import identity, identity_of_model
from mbd.results.study_file import StudyFile

__all__ = ["SweepFile"]


class SweepFile:
    """The rows that a file holds, and the file, to which more are added.

    Raises
    ------
    ModelError
        for a file that is none of a sweep, and one of another sweep, by what differs.
    """

    def __init__(self, path: Any, runs: Runs, mechanism: Mechanism) -> None:
        self.file = StudyFile(path, "sweep", _head(runs, mechanism))
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
    return json.dumps([_word(value) for value in case])


def _word(value: Any) -> Any:
    """A setting as it is read in the file: a number, or the text of it with the digest of what it is."""
    if isinstance(value, float | int | str) or value is None:
        return value if isinstance(value, float | int) else repr(value)
    return f"{type(value).__name__} {identity(value)}"


def _head(runs: Runs, mechanism: Mechanism) -> dict[str, Any]:
    """What makes a sweep another one."""
    settings = {name: _word(value) for name, value in runs.settings.items() if name != "parameters"}
    given = {**getattr(runs.model, "parameters", {}), **(runs.settings.get("parameters") or {})}
    functions = runs.results.values() if isinstance(runs.results, Mapping) else ()
    of_model = identity_of_model(runs.model, mechanism)
    return {
        "name": str(getattr(runs.model, "name", "")), "names": list(runs.names), "results": list(runs.results),
        "settings": settings, "parameters": {k: float(v) for k, v in given.items()}, "start": identity(runs.start),
        "functions of the run": identity(*functions), **of_model,
    }  # fmt: skip
