"""The rows that a run has stored until now, as a record."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, read_only
from mbd.results.balance import Balance
from mbd.results.record import EventRecord, Record
from mbd.results.stored_states import StoredStates
from mbd.simulation.run.data import RunData

BLOCK = 4096
"""Rows that are read together."""


def record_of(run: RunData, table: Matrix, events: Sequence[EventRecord] = ()) -> Record:
    """Rows that the kernel has stored, (R, width), as a record without a verdict."""
    equations, parts = run.mechanism.equations, columns_of(run, table)
    parts |= {"closed": _bytes(parts["closed"], np.uint8), "phase": _bytes(parts["phase"], np.int8)}
    return Record(
        equations=equations, parameters=run.first_parameters,
        parameter_names=[*run.mechanism.parameter_places], **parts,
        events=events, settings=run.settings, parameter_changes=run.parameter_changes, start=run.start,
    )  # fmt: skip


def inputs_of(run: RunData, table: Matrix, kinds: Collection[str]) -> dict[str, Any]:
    """Rows of the kernel as inputs of some kinds, time among them, of energies, with the anchors of now."""
    columns = {"switch": "closed"}
    places = run.stepper.columns
    named = {kind: table[:, places[columns.get(kind, kind)]] for kind in kinds if columns.get(kind, kind) in places}
    if "anchor" in kinds:
        named["anchor"] = run.kernel.anchors[: run.kernel.n_anchors].reshape(1, -1).repeat(len(table), axis=0)
    if "slip" in kinds:
        phase = table[:, places["phase"]]
        named["slip"] = phase * (np.abs(phase) == 1.0)
    return {"t": table[:, 0], **named}


def columns_of(run: RunData, table: Matrix) -> dict[str, Any]:
    """Columns of the kernel's rows by their letters."""
    return {name: table[:, place] for name, place in run.stepper.columns.items()}


def _bytes(values: Matrix, kind: Any) -> NDArray[Any]:
    """A few columns of a large table as small integers (R, C), column by column of rows that stay in the cache."""
    if len(values) <= BLOCK:
        return values.astype(kind)
    found = np.empty(values.shape, dtype=kind)
    for first in range(0, len(values), BLOCK):
        for column in range(values.shape[1]):
            found[first : first + BLOCK, column] = values[first : first + BLOCK, column]
    return found


def whole_record(run: RunData) -> Record:
    """All rows and events until now, without a verdict."""
    last = run.stored - 1  # a run that failed right at an event has no row after it
    events = [event if event.row <= last else replace(event, row=last) for event in run.events]
    return record_of(run, read_only(run.table[: run.stored]), events)


def ended_record(run: RunData) -> Record:
    """All rows and events of a run that is over; of one that failed before it had a row its start alone.

    Its accelerations and multipliers are those of the balance of forces; NaN where that determines none, as it may be
    why the run failed, and with dry friction, of which nobody has found yet what sticks and where the rest slides.
    """
    if run.stored:
        return whole_record(run)
    v, start = run.kernel, run.start
    closed = run.manager.flags(start.mode.closed)
    row = np.zeros((1, run.table.shape[1]))
    known = np.concatenate([[start.time], start.q, start.v, start.z, np.full(v.n + v.n_rows, np.nan), closed])
    row[0, : len(known)] = known
    record = record_of(run, row, [replace(event, row=0) for event in run.events])
    states = StoredStates(record, run.mechanism.equations)
    if states.equations.frictions or not Balance.serves(states.equations):
        return record
    guess = replace(states.rows, lam=np.zeros_like(record.lam))
    solved = Balance(states).solve(guess)
    if not solved.sound.all():
        return record
    a, s = np.split(solved.rate, [v.n_v], axis=1)
    return replace(record, a=a, s=s, lam=solved.lam)
