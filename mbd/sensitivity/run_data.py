"""A run as the pass reads it: its rows, its scheme, its mechanism; and what of it no pass can differentiate."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from mbd import integrators
from mbd.arrays import Matrix, Vector
from mbd.assembly.machines import is_end
from mbd.assembly.manager import manager_of
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass, makes_late
from mbd.errors import CapabilityError, OneSidedError
from mbd.integrators.base import Integrator
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.results.columns import ModelColumns
from mbd.results.record import EventRecord, Record
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.motion import First, Mode
from mbd.sensitivity.programs import watched_nodes
from mbd.state import State
from mbd.tape.derivatives import live

ADVICE = "mbd.sensitivities(…, controllers='held') leaves that out: what they wrote is then held as it was"
"""What may be asked for where controllers are refused."""


def refused(why: str, instead: str = "") -> CapabilityError:
    """The error for a run whose derivatives are not known."""
    return CapabilityError(f"no derivatives of this run: {why}" + (f"; {instead}" if instead else ""))


def sided(why: str, instead: str = "") -> OneSidedError:
    """The error for a run that has derivatives on one side only; `why` says what a change decides."""
    return OneSidedError(str(refused(f"{why}: the run has a derivative on one side only", instead)))


@dataclass(frozen=True)
class Source:
    """What made a run: its model, and its integrator, None for the usual one."""

    model: Any
    scheme: Integrator | None = None


@dataclass
class RunRows:
    """The rows and events of a run with its equations.

    Parameters
    ----------
    run : as `mbd.simulate` returned it
    source : what made it; None where only the run is known. What controllers wrote is then refused, else held as it was
    """

    run: Trajectory
    source: Source | None = None

    def __post_init__(self) -> None:
        record = self.run.record
        if record.equations is None:
            raise refused("it was read from a file, which has no equations", "run the model again")
        settings = record.settings
        if not self.run.success:
            raise refused(f"it failed: {record.message}")
        if settings.get("locate") == "linear":
            raise refused("its events were located by linear interpolation", "take locate='root'")
        if not self.controllers and (record.parameter_changes or _is_sampled(record.final)):
            raise refused("controllers decide in it, whose feedback is not differentiated", ADVICE)

    @cached_property
    def controllers(self) -> Sequence[Any]:
        """Controllers of the model, what they wrote being held."""
        return getattr(self.source.model, "controllers", ()) if self.source is not None else ()

    @cached_property
    def record(self) -> Record:
        return self.run.record

    @cached_property
    def mechanism(self) -> Mechanism:
        """Compiled equations: those that the run was made with, where they are still there."""
        equations: Any = self.record.equations
        known = equations.memory.get("mechanism")
        found = None if known is None else known()
        return Mechanism(equations, str(self.record.settings.get("backend", "auto"))) if found is None else found

    @cached_property
    def manager(self) -> ActiveSetManager:
        return manager_of(self.mechanism, self.record.parameters)

    @cached_property
    def integrator(self) -> Integrator:
        """The scheme, which is known or as its settings print it."""
        if self.source is not None and self.source.scheme is not None:
            return self.source.scheme
        return _integrator_of(str(self.record.settings["integrator"]))

    @cached_property
    def stored(self) -> ModelColumns:
        """The states at its rows, as its results know them."""
        return cast(ModelColumns, self.run.columns)

    @cached_property
    def ends(self) -> Vector:
        """The times of the rows as steps end there: just before an instant at which forces jump."""
        found = self.stored.times_beside_jumps
        return self.record.time if found is None else found

    def y(self, row: int) -> Vector:
        return np.concatenate([self.record.v[row], self.record.z[row]])

    def rate(self, row: int) -> Vector:
        return np.concatenate([self.record.a[row], self.record.s[row]])

    @cached_property
    def events(self) -> dict[int, list[EventRecord]]:
        """Events by the row just after them."""
        found: dict[int, list[EventRecord]] = {}
        for event in self.record.events:
            found.setdefault(event.row, []).append(event)
        return found

    @cached_property
    def full(self) -> float:
        """The step, or the short time that stands for it where steps follow their error [s]."""
        settings = self.record.settings
        if settings.get("dt") is not None:
            return float(settings["dt"])
        until, start = settings["until"], float(self.record.time[0])
        length = 1.0 if isinstance(until, str | tuple | list) else (float(until) - start) or 1.0
        return 1e-3 * min(length, 1.0)

    @cached_property
    def watched_anchors(self) -> Matrix:
        """What contacts and machines hold at every row; 0 where nothing that is watched or limits friction reads it."""
        equations = self.mechanism.equations

        def last() -> int:
            nodes = live([*watched_nodes(equations), *(friction.limit for friction in equations.frictions)])
            return max((node.data[1] for node in nodes if node.op == "input" and node.data[0] == "anchor"), default=-1)

        read = self.mechanism.kept(RunRows, last)
        if read < 0:
            return np.zeros((len(self.record.time), self.mechanism.layout.n_anchors))
        return self.stored.held_by_machines() if read < equations.n_held_by_machines else self.stored.anchors

    @cached_property
    def changes(self) -> dict[int, Vector]:
        """Values of all parameters, by the row from which on they are those that controllers wrote."""
        size = len(self.record.parameters)
        return {row: np.array(values[:size]) for row, values in self.record.parameter_changes}

    def mode(self, row: int) -> Mode:
        """What acts from a row on."""
        closed, phase = self.record.closed[row], self.record.phase[row]
        key = closed.tobytes(), phase.tobytes()
        known = self._modes.get(key)
        if known is None:
            known = self._modes[key] = mode_of(self.manager, closed, phase)
        return known

    @cached_property
    def _modes(self) -> dict[tuple[bytes, bytes], Mode]:
        return {}

    @property
    def first(self) -> First:
        """The first row."""
        anchors = held_at(self.record.start, self.mechanism)
        ended = self.record.start is not None and is_end(self.record.start)
        return First(float(self.ends[0]), np.array(self.record.q[0]), self.y(0), anchors, self.mode(0), ended)


def mode_of(manager: ActiveSetManager, closed: NDArray[Any], phase: NDArray[Any]) -> Mode:
    """What acts by the flags of contacts and the phases of frictions."""
    held = manager.active_rows(np.asarray(closed, dtype=np.int64), (phase == 2).astype(np.int64))
    slip = np.where(np.abs(phase) == 1, phase, 0).astype(float)
    return Mode(held, np.asarray(closed), np.asarray(closed, dtype=float), slip)


def held_at(start: State | None, mechanism: Mechanism) -> Vector:
    """What contacts hold at a start."""
    size = mechanism.layout.n_anchors
    if start is not None and len(start.anchors) == size:
        return np.array(start.anchors, dtype=float)
    return np.zeros(size)


def _is_sampled(final: Any) -> bool:
    """Whether controllers took samples in the run that ended so."""
    unseen = None if final is None else makes_late(final, "memory")
    memory = getattr(final, "memory", None) if unseen is None else unseen.memory
    return memory is not None and bool(memory.controllers.get("samples"))


@lru_cache(maxsize=64)
def _integrator_of(text: str) -> Integrator:
    """The scheme that settings print so."""
    call = ast.parse(text, mode="eval").body
    if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name):
        raise refused(f"its integrator {text} is none of mbd's")
    made = getattr(integrators, call.func.id, None)
    if made is None:
        raise refused(f"its integrator {text} is none of mbd's")
    values = {str(each.arg): ast.literal_eval(each.value) for each in call.keywords}
    found: Integrator = made(*(ast.literal_eval(each) for each in call.args), **values)
    return found
