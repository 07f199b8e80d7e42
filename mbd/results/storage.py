"""A run as one file: numpy's ``.npz`` with JSON for everything that is not an array; nothing is pickled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mbd.bodies.values import names_of
from mbd.dataclass import dataclass
from mbd.results.archive import Arrays, Members, named_file, read, write
from mbd.results.columns import Alias, Columns, SavedColumns, StoredColumns
from mbd.results.content import arrays_of_run, expect
from mbd.results.expressions import arrays_of_expressions, read_expressions, write_expressions
from mbd.results.facts import Facts
from mbd.results.ledger import Ledger, Part
from mbd.results.record import EventRecord, Record
from mbd.results.states import pack_state, unpack
from mbd.results.violation import Violation
from mbd.state import State, malformed

FORMAT, VERSION = "mbd run", 1

SUFFIX = ".mbd.npz"
"""Added to a path without an extension."""

ROWS = ("time", "q", "v", "z", "a", "s", "lam", "closed", "phase", "parameters")


@dataclass(frozen=True, eq=False)
class Archive:
    """What a file holds besides the record."""

    columns: Columns
    ledger: Ledger
    violation: Violation
    facts: Facts

    @classmethod
    def of(cls, run: Any) -> Archive:
        """That of a trajectory."""
        return cls(run.columns, run.energy, run.violation, run.facts)


def save(record: Record, run: Archive, path: str | Path, names: Sequence[str] | None = None) -> Path:
    """Write a run; see `Trajectory.save`."""
    target = named_file(path, SUFFIX)
    write(target, *contents(record, run, names))
    return target


def contents(record: Record, run: Archive, names: Sequence[str] | None = None) -> tuple[Arrays, dict[str, Any]]:
    """Arrays and words of the file of a run; no array is a view of what a later call may change."""
    from mbd.results.capsule import packed

    arrays: Arrays = {name: getattr(record, name) for name in ROWS}
    arrays["anchors"], q_rate = run.columns.anchors, run.columns.q_rate
    if q_rate is not record.v:
        arrays["q_rate"] = q_rate
    model = run.columns.between_rows
    if model is not None and model.times_beside_jumps is not None:
        arrays["beside_jumps"] = model.times_beside_jumps
    meta: dict[str, Any] = {
        "format": FORMAT, "version": VERSION, "facts": run.facts.as_json(),
        "parameter_names": list(record.parameter_names), "stats": record.stats, "settings": record.settings,
        "success": record.success, "message": record.message,
        "failure": None if record.failure is None else packed(record.failure, arrays),
        "events": [_event(event) for event in record.events], "violation": asdict(run.violation),
        "changes": [row for row, _ in record.parameter_changes], "final": pack_state(record.final, arrays),
    }  # fmt: skip
    for number, (_, values) in enumerate(record.parameter_changes):
        arrays[f"change {number}"] = values
    shown = [name for name in run.facts.drawn if run.columns.knows(name)]
    meta["aliases"], meta["values"], meta["names"] = _columns(run.columns, names, shown, arrays)
    meta["expressions"] = _expressions(run.columns, [*meta["names"], *shown], run.facts, arrays)
    meta["parts"], meta["stored"] = _ledger(run.ledger, arrays)
    meta["withheld"] = [[part.name, part.withheld] for part in run.ledger.parts if part.withheld]
    return arrays, meta


def _event(event: EventRecord) -> dict[str, Any]:
    return {
        "time": event.time, "kind": event.kind, "name": event.name, "impulse": event.impulse,
        "energy_loss": event.energy_loss, "row": event.row, "impulses": dict(event.impulses),
    }  # fmt: skip


def _read_event(event: Mapping[str, Any]) -> EventRecord:
    """An event; older files have its own impulse only."""
    own = np.asarray(event["impulse"], dtype=np.float64)
    impulses = {name: np.asarray(values, dtype=np.float64) for name, values in event.get("impulses", {}).items()}
    return EventRecord(**{**event, "impulse": own, "impulses": impulses})


def _columns(
    columns: Columns, names: Sequence[str] | None, shown: Sequence[str], arrays: Arrays
) -> tuple[dict[str, Alias], dict[str, int], list[str]]:
    """Each wanted scalar as a place in the state or as a numbered array; equal expressions are stored once.

    `shown` are for pictures, and not among the names of the run.
    """
    asked = None if names is None else names_of(names, "names of save")
    wanted = columns.names if asked is None else [part for name in asked for part in columns.components(name)]
    aliases, values = {}, {}
    keys: dict[Any, int] = {}
    fresh: list[str] = []
    for name in dict.fromkeys([*wanted, *shown]):
        alias, key = columns.identity(name)
        if alias is not None:
            aliases[name] = alias
            continue
        if key not in keys:
            keys[key] = len(keys)
            fresh.append(name)
        values[name] = keys[key]
    for number, value in enumerate(columns.at_rows(fresh)):
        constant = len(value) > 0 and bool(np.all(value == value[0]))
        arrays[f"value {number}"] = np.array(value[:1]) if constant else value
    return aliases, values, list(dict.fromkeys(wanted))


def _expressions(columns: Columns, names: Sequence[str], facts: Facts, arrays: Arrays) -> dict[str, Any] | None:
    """What the columns need between their rows, and net moments for reports; None for those of an older file."""
    model = columns.between_rows
    if model is None:
        return None
    found = [*names, *(name for name in facts.heights if model.knows(name))]
    if any(contact.place for contact in facts.contacts):  # of what may walk
        joints = (f"{name}.net_moment" for name, unit in facts.coordinates[: facts.coordinate_count] if unit == "rad")
        found += [name for name in joints if model.knows(name)]
    return write_expressions(model.equations, {name: model.node(name) for name in found}, arrays)


def _ledger(ledger: Ledger, arrays: Arrays) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Names and kinds of what changed the energy, and of what stores it."""
    arrays["kinetic"], arrays["potential"] = ledger.kinetic, ledger.potential
    for title, parts in (("part", ledger.parts), ("store", ledger.stored)):
        arrays.update({f"{title} {number}": part.energy for number, part in enumerate(parts)})
    return [(part.name, part.kind) for part in ledger.parts], [(part.name, part.kind) for part in ledger.stored]


def _read_ledger(record: Record, arrays: Arrays, meta: Mapping[str, Any]) -> Ledger:
    """The ledger of a file; older ones do not tell what stores energy."""
    reasons = dict(meta.get("withheld", ()))
    parts, stored = (
        tuple(
            Part(name, kind, arrays[f"{title} {k}"], reasons.get(name, ""))
            for k, (name, kind) in enumerate(meta.get(key, ()))
        )
        for title, key in (("part", "parts"), ("store", "stored"))
    )
    marks = tuple((event.time, event.name) for event in record.events if event.kind != "opened")
    stride = record.settings.get("store", 1)
    return Ledger(record.time, arrays["kinetic"], arrays["potential"], parts, stride, stored, marks)


def load(path: str | Path) -> tuple[Record, Archive]:
    """Read a run; see `mbd.load`."""
    return read(Path(path), FORMAT, VERSION, "run.save(…)", _wanted, _run)


def _wanted(meta: Mapping[str, Any], members: Members) -> set[str]:
    """Names of the arrays that the words call for."""
    return arrays_of_run(meta, members) | arrays_of_expressions(meta.get("expressions"), members)


def _run(meta: dict[str, Any], arrays: Arrays) -> tuple[Record, Archive]:
    """A run from the words and arrays of a file."""
    record = _record(arrays, meta)
    expect(bool(np.all(np.isfinite(record.time)) and np.all(np.diff(record.time) >= 0.0)), "'time'")
    expect(bool(np.all(record.closed <= 1) and np.all(record.closed >= 0)), "'closed'")
    values = {name: arrays[f"value {number}"] for name, number in meta["values"].items()}
    aliases = {name: (part, index) for name, (part, index) in meta["aliases"].items()}
    anchors, q_rate = arrays["anchors"], arrays.get("q_rate", record.v)
    words, model = meta.get("expressions"), None
    if words is not None:
        expressions = read_expressions(words, arrays, len(record.parameters))
        model = SavedColumns(record, expressions, anchors, q_rate, arrays.get("beside_jumps"))
    columns = StoredColumns(record, aliases, values, meta["names"], anchors, q_rate, model)
    ledger = _read_ledger(record, arrays, meta)
    return record, Archive(columns, ledger, Violation(**meta["violation"]), Facts.read(meta["facts"]))


def _record(arrays: Arrays, meta: Mapping[str, Any]) -> Record:
    from mbd.results.capsule import unpacked

    failure = meta["failure"]  # older files have its sentence only
    failure = unpacked(failure, arrays) if isinstance(failure, dict) else failure
    events = tuple(_read_event(event) for event in meta["events"])
    final = unpack(meta["final"], arrays)
    expect(final is None or (isinstance(final, State) and not malformed(final)), "its final state")
    changes = tuple((row, arrays[f"change {number}"]) for number, row in enumerate(meta["changes"]))
    return Record(
        equations=None, parameter_names=tuple(meta["parameter_names"]), events=events, stats=meta["stats"],
        success=meta["success"], message=meta["message"], failure=failure,
        final=final, settings=meta["settings"], parameter_changes=changes,
        **{name: arrays[name] for name in ROWS if name in arrays},  # older files do not tell what frictions do
    )  # fmt: skip
