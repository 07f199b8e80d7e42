"""The rows that a run has stored until now, as a record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mbd.arrays import Matrix
from mbd.results.record import EventRecord, Record

if TYPE_CHECKING:
    from mbd.simulation.run import Run

__all__ = ["record_of", "whole_record"]


def record_of(run: Run, table: Matrix, events: Sequence[EventRecord] = ()) -> Record:
    """Rows that the kernel has stored, (R, width), as a record without a verdict."""
    v, equations = run.values, run.mechanism.equations
    n_q, n_v, n, rows = v["n_q"], v["n_v"], v["n"], v["n_rows"]
    cuts = np.cumsum([1, n_q, n_v, n - n_v, n_v, n - n_v, rows])
    time, q, velocity, z, a, s, lam, closed = np.split(table, cuts, axis=1)
    return Record(
        equations=equations, parameters=run.first_parameters,
        parameter_names=[parameter.name for parameter in equations.parameters], time=time[:, 0], q=q, v=velocity,
        z=z, a=a, s=s, lam=lam, closed=closed.astype(np.uint8), events=events, settings=run.settings,
        parameter_changes=run.parameter_changes, start=run.start,
    )  # fmt: skip


def whole_record(run: Run) -> Record:
    """All rows and events until now, without a verdict."""
    last = run.stored - 1  # a run that failed right at an event has no row after it
    events = [event if event.row <= last else replace(event, row=last) for event in run.events]
    return record_of(run, run.table[: run.stored], events)
