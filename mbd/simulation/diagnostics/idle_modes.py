"""Modes that a run never changed, and how near each of the transitions that they waited for has come."""

import numpy as np

from mbd.constraints.machine import SEPARATOR
from mbd.equations.equations import Guard, Machine
from mbd.results.columns import ModelColumns
from mbd.results.record import Record
from mbd.simulation.run.data import RunData

MAX_ROWS = 400
"""Rows at which what a transition waits for is evaluated, at most [-]."""


def idle_modes(run: RunData, record: Record, columns: ModelColumns) -> list[str]:
    """A sentence for each mode that has not left its state, though a transition leads out of it."""
    machines = run.mechanism.equations.machines
    if not machines or len(record.time) < 2:
        return []
    names = {event.name for event in (*run.earlier, *run.events)}
    guards = run.mechanism.equations.guards
    notes = []
    for number, machine in enumerate(machines):
        own = [g for g in guards if g.transition is not None and g.transition.machine == number]
        if len(machine.states) < 2 or any(guard.name in names for guard in own):
            continue
        state = int(run.kernel.anchors[machine.anchors[0]])
        leading = [g for g in own if g.transition is not None and g.transition.source == state]
        if any(g.is_timer and _value(columns, g, record)[1][-1] < 0.0 for g in leading):
            continue  # its time is still to come
        if reasons := [_reason(run, columns, record, guard, machine) for guard in leading]:
            notes.append(
                f"mode {machine.name!r} stayed in {machine.states[state]!r} from t = {record.time[0]:.6g} to "
                f"{record.time[-1]:.6g} s: {'; '.join(reasons)}"
            )
    return notes


def _value(columns: ModelColumns, guard: Guard, record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Some rows of the run, the last one among them, and the value of a guard at these."""
    rows = np.unique(np.linspace(0, len(record.time) - 1, min(MAX_ROWS, len(record.time))).astype(int))
    (found,) = columns.evaluate([guard.value], columns.part(rows, [guard.value]))
    return rows, np.broadcast_to(np.asarray(found, dtype=float), rows.shape)


def _reason(run: RunData, columns: ModelColumns, record: Record, guard: Guard, machine: Machine) -> str:
    """Why a transition has not been taken."""
    title = guard.name.removeprefix(f"{machine.name}{SEPARATOR}")
    assert guard.transition is not None
    kinds = {kind for kind, _ in guard.transition.causes}
    if kinds != {"event"} or guard.value.is_constant:
        waited = [_cause(run, kind, number) for kind, number in guard.transition.causes]
        return f"{title!r} waited for {' or '.join(dict.fromkeys(waited)) or 'what never happened'}"
    rows, values = _value(columns, guard, record)
    if guard.is_timer and values[0] > 0.0:
        return f"the timer of {title!r} had ended before: give a time > 0"
    if guard.is_timer:
        return f"the timer of {title!r} ended while its only_while= did not hold"
    if np.all(values > 0.0) or np.all(values < 0.0):
        place = int(np.argmin(np.abs(values)))
        return (
            f"what {title!r} waits for did not reach 0: it came as near as {values[place]:.3g} at "
            f"t = {record.time[rows[place]]:.4g} s"
        )
    return f"what {title!r} waits for crossed 0 in the other direction only, or while its only_while= did not hold"


def _cause(run: RunData, kind: str, number: int) -> str:
    """What would have caused it, in words."""
    equations = run.mechanism.equations
    if kind in ("closed", "opened"):
        return f"{equations.contacts[number].name!r} to {'close' if kind == 'closed' else 'open'}"
    return repr(equations.guards[number].name)
