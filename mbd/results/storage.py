"""A run as one file: numpy's ``.npz`` with JSON for everything that is not an array; nothing is pickled."""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mbd.errors import TrajectoryError
from mbd.results.columns import Alias, Columns, StoredColumns
from mbd.results.facts import Facts
from mbd.results.ledger import Ledger, Part
from mbd.results.record import EventRecord, Record
from mbd.results.states import pack_state, unpack
from mbd.results.violation import Violation

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["Archive", "Arrays", "load", "plain", "read", "save", "write"]

FORMAT, VERSION = "mbd run", 1

SUFFIX = ".mbd.npz"
"""Added to a path without an extension."""

COMPRESSION = 1
"""Level of zlib: higher levels take five times as long for a few percent [-]."""

ROWS = ("time", "q", "v", "z", "a", "s", "lam", "closed", "phase", "parameters")

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Archive:
    """What a file holds besides the record."""

    columns: StoredColumns
    ledger: Ledger
    violation: Violation
    facts: Facts


def plain(value: Any) -> Any:
    """A number, list or text for JSON in place of a numpy value; the printed form of anything else."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    return repr(value)


def save(run: Trajectory, path: str | Path, names: Sequence[str] | None = None) -> Path:
    """Write a run; see `Trajectory.save`."""
    from mbd.results.capsule import packed

    target = Path(path)
    if not target.suffix:
        target = target.with_name(target.name + SUFFIX)
    record = run.record
    arrays: Arrays = {name: getattr(record, name) for name in ROWS}
    arrays["anchors"], q_rate = run.columns.anchors, run.columns.q_rate
    if q_rate is not record.v:
        arrays["q_rate"] = q_rate
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
    meta["aliases"], meta["values"], meta["names"] = _columns(run.columns, names, arrays)
    meta["parts"], meta["stored"] = _ledger(run.energy, arrays)
    text = json.dumps(meta, default=plain)
    arrays["meta"] = np.frombuffer(text.encode(), dtype=np.uint8)
    write(target, arrays)
    return target


def write(target: Path, arrays: Arrays) -> None:
    """Write beside the target, then rename, so that a reader never sees half a file."""
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(f".{target.name}.{os.getpid()}")
    try:
        with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=COMPRESSION) as archive:
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, np.ascontiguousarray(array), allow_pickle=False)
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)


def _event(event: EventRecord) -> dict[str, Any]:
    return {
        "time": event.time, "kind": event.kind, "name": event.name, "impulse": event.impulse,
        "energy_loss": event.energy_loss, "row": event.row, "impulses": dict(event.impulses),
    }  # fmt: skip


def _read_event(event: Mapping[str, Any]) -> EventRecord:
    """An event; older files have its own impulse only."""
    own = np.asarray(event["impulse"], dtype=np.float64)
    told = {name: np.asarray(values, dtype=np.float64) for name, values in event.get("impulses", {}).items()}
    return EventRecord(**{**event, "impulse": own, "impulses": told})


def _columns(
    columns: Columns, names: Sequence[str] | None, arrays: Arrays
) -> tuple[dict[str, Alias], dict[str, int], list[str]]:
    """Each wanted scalar as a place in the state or as a numbered array; equal expressions are stored once."""
    wanted = columns.names if names is None else [part for name in names for part in columns.components(name)]
    aliases, values = {}, {}
    keys: dict[Any, int] = {}
    fresh: list[str] = []
    for name in dict.fromkeys(wanted):
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


def _ledger(ledger: Ledger, arrays: Arrays) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Names and kinds of what changed the energy, and of what stores it."""
    arrays["kinetic"], arrays["potential"] = ledger.kinetic, ledger.potential
    for title, parts in (("part", ledger.parts), ("store", ledger.stored)):
        arrays.update({f"{title} {number}": part.energy for number, part in enumerate(parts)})
    return [(part.name, part.kind) for part in ledger.parts], [(part.name, part.kind) for part in ledger.stored]


def _read_ledger(record: Record, arrays: Arrays, meta: Mapping[str, Any]) -> Ledger:
    """The ledger of a file; older ones do not tell what stores energy."""
    parts, stored = (
        tuple(Part(name, kind, arrays[f"{title} {k}"]) for k, (name, kind) in enumerate(meta.get(key, ())))
        for title, key in (("part", "parts"), ("store", "stored"))
    )
    marks = tuple((event.time, event.name) for event in record.events if event.kind != "opened")
    stride = record.settings.get("store", 1)
    return Ledger(record.time, arrays["kinetic"], arrays["potential"], parts, stride, stored, marks)


def load(path: str | Path) -> Trajectory:
    """Read a run; see `mbd.load`."""
    from mbd.trajectory import Trajectory

    source = Path(path)
    arrays, meta = read(source, FORMAT, VERSION, "run.save(…)")
    record = _record(arrays, meta)
    values = {name: arrays[f"value {number}"] for name, number in meta["values"].items()}
    aliases = {name: (part, index) for name, (part, index) in meta["aliases"].items()}
    columns = StoredColumns(record, aliases, values, meta["names"], arrays["anchors"], arrays.get("q_rate", record.v))
    ledger = _read_ledger(record, arrays, meta)
    return Trajectory(record, Archive(columns, ledger, Violation(**meta["violation"]), Facts.read(meta["facts"])))


def read(source: Path, kind: str, version: int, written_by: str) -> tuple[Arrays, dict[str, Any]]:
    """Arrays and words of a file of one kind ('mbd run', 'mbd failure')."""
    name = kind.removeprefix("mbd ")
    if not source.is_file():
        raise FileNotFoundError(f"no {name} file at '{source}'")
    refusal = f"'{source}' is not a {name} of mbd; expected a file written by {written_by}"
    if not zipfile.is_zipfile(source):
        raise TrajectoryError(refusal)
    try:
        with np.load(source, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        meta = json.loads(arrays["meta"].tobytes())
    except (KeyError, ValueError, zipfile.BadZipFile) as error:
        raise TrajectoryError(refusal) from error
    if not isinstance(meta, dict) or meta.get("format") != kind:
        raise TrajectoryError(refusal)
    if meta["version"] > version:
        raise TrajectoryError(
            f"'{source}' was written by a newer mbd (format {meta['version']}, here {version}); update mbd"
        )
    return arrays, meta


def _record(arrays: Arrays, meta: Mapping[str, Any]) -> Record:
    from mbd.results.capsule import unpacked

    failure = meta["failure"]  # older files have its sentence only
    failure = unpacked(failure, arrays) if isinstance(failure, dict) else failure
    events = tuple(_read_event(event) for event in meta["events"])
    changes = tuple((row, arrays[f"change {number}"]) for number, row in enumerate(meta["changes"]))
    return Record(
        equations=None, parameter_names=tuple(meta["parameter_names"]), events=events, stats=meta["stats"],
        success=meta["success"], message=meta["message"], failure=failure,
        final=unpack(meta["final"], arrays), settings=meta["settings"], parameter_changes=changes,
        **{name: arrays[name] for name in ROWS if name in arrays},  # older files do not tell what frictions do
    )  # fmt: skip
