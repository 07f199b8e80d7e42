"""The rows that a run has stored until now, as a record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.results.balance import Balance
from mbd.results.record import EventRecord, Record
from mbd.results.stored_states import StoredStates
from mbd.simulation.run.data import RunData

__all__ = ["ended_record", "inputs_of", "record_of", "whole_record"]

BLOCK = 4096
"""Rows that are read together."""


def record_of(run: RunData, table: Matrix, events: Sequence[EventRecord] = ()) -> Record:
    """Rows that the kernel has stored, (R, width), as a record without a verdict."""
    equations, parts = run.mechanism.equations, _parts(run, table)
    parts |= {"closed": _bytes(parts["closed"], np.uint8), "phase": _bytes(parts["phase"], np.int8)}
    return Record(
        equations=equations, parameters=run.first_parameters,
        parameter_names=[parameter.name for parameter in equations.parameters], **parts,
        events=events, settings=run.settings, parameter_changes=run.parameter_changes, start=run.start,
    )  # fmt: skip


def inputs_of(run: RunData, table: Matrix) -> dict[str, Any]:
    """Rows of the kernel as inputs of energies, with the anchors of now."""
    parts = _parts(run, table)
    phase = parts.pop("phase")
    anchors = run.kernel.anchors[: run.kernel.n_anchors].reshape(1, -1).repeat(len(table), axis=0)
    named = {"t": parts.pop("time"), "anchor": anchors, "switch": parts.pop("closed")}
    return {**parts, **named, "slip": phase * (np.abs(phase) == 1.0)}


def _parts(run: RunData, table: Matrix) -> dict[str, Any]:
    """Columns of the kernel's rows by their letters."""
    v = run.kernel
    n_q, n_v, n, rows = v.n_q, v.n_v, v.n, v.n_rows
    at_v, at_a = 1 + n_q, 1 + n_q + n
    at_lam, at_closed = at_a + n, at_a + n + rows
    at_friction = at_closed + v.n_contacts
    return {
        "time": table[:, 0], "q": table[:, 1:at_v], "v": table[:, at_v : at_v + n_v], "z": table[:, at_v + n_v : at_a],
        "a": table[:, at_a : at_a + n_v], "s": table[:, at_a + n_v : at_lam], "lam": table[:, at_lam:at_closed],
        "closed": table[:, at_closed:at_friction], "phase": table[:, at_friction:],
    }  # fmt: skip


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
    return record_of(run, run.table[: run.stored], events)


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
