"""What a simulation hands over: its stored rows, its events, and how it was made."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector, read_only
from mbd.dataclass import LateFields, dataclass
from mbd.equations.equations import Equations
from mbd.integrators.extension import HERMITE, Extension, extension_of
from mbd.notebook import table


def _nothing() -> Vector:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class EventRecord:
    """Something that happened at an instant.

    Parameters
    ----------
    time : instant [s]
    kind : 'closed' or 'opened' (a contact), 'stuck' or 'slipped' (dry friction comes to rest; begins to slide or turns
        around), 'event' (a user's own, or a fall)
    name : of the contact, joint or event
    impulse : impulses of the contact's own rows at the instant, normal first, pushing ≥ 0 [N s or N m s]; zeros where
        it closed or opened without one, empty for penalty contacts, a user's event and frictions, unless an impulse
        without collision stops a slide (Painlevé)
    impulses : the same by name, with those of what rolls while it is closed, and those of the contacts (and dry
        frictions in joints) that took part in its impact without closing in it; where several contacts close in one
        impact, the first event has these. Each impulse of a run is thus in one event
    energy_loss : kinetic energy that a contact took as it closed or was stopped, −½ Σ Λ (γ⁻ + γ⁺) over its rows, and
        its part of what friction in joints and contacts closed before took in the same impact, in their ratio [J]
    row : the stored row just after it (the right side); the row before is the left side
    """

    time: float
    kind: str
    name: str
    impulse: Vector = field(default_factory=_nothing)
    energy_loss: float = 0.0
    row: int = 0
    impulses: Mapping[str, Vector] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.impulse.flags.writeable:
            object.__setattr__(self, "impulse", read_only(self.impulse))
        if isinstance(self.impulses, dict):  # others, which are asked later, give arrays that cannot be written to
            object.__setattr__(self, "impulses", {name: read_only(values) for name, values in self.impulses.items()})

    def __repr__(self) -> str:
        extra = ""
        if self.impulse.any():
            extra += f", impulse {', '.join(f'{value:.4g}' for value in self.impulse)}"
        for name, impulse in self.impulses.items():
            if name != self.name:
                extra += f", impulse of {name!r} {', '.join(f'{value:.4g}' for value in impulse)}"
        if self.energy_loss:
            extra += f", energy loss {self.energy_loss:.4g} J"
        return f"<{self.time:.6f} s: {self.name!r} {self.kind}{extra}>"

    def _repr_html_(self) -> str:
        return Events([self])._repr_html_()


MAX_SHOWN_EVENTS = 40
"""Events that a notebook shows; of more, the first and the last."""


class Events(list[EventRecord]):
    """Events in order of time."""

    def _repr_html_(self) -> str:
        titles = ("time [s]", "name", "kind", "impulse [N s or N m s]", "energy loss [J]")
        hidden, half = max(len(self) - MAX_SHOWN_EVENTS, 0), MAX_SHOWN_EVENTS // 2
        shown = [*self[:half], *self[-half:]] if hidden else self
        rows = [
            (
                f"{event.time:.6f}", event.name, event.kind, _impulses(event),
                f"{event.energy_loss:.4g}" if event.energy_loss else "",
            )
            for event in shown
        ]  # fmt: skip
        return table("events", titles, rows, f"{hidden} more between the first {half} and the last" if hidden else "")


def _impulses(event: EventRecord) -> str:
    """Its own impulse, and those of others by name."""
    words = ["  ".join(f"{value:.4g}" for value in event.impulse)]
    for name, impulse in event.impulses.items():
        if name != event.name:
            words.append(f"{name}: {'  '.join(f'{value:.4g}' for value in impulse)}")
    return "; ".join(word for word in words if word)


@dataclass(frozen=True, eq=False)
class Rows:
    """States of the mechanism, one a row, from which any named quantity can be evaluated.

    time (R,) [s]; q (R, n_q), v and a (R, n_v), z and s (R, n_z); lam (R, n_rows), zero where a row is open;
    closed (R, n_contacts); anchors (R, n_anchors); source (R,): the stored row whose parameters hold here;
    phase (R, n_frictions): 2 where dry friction sticks, ±1 where it slides that way, 0 where it is off
    """

    time: Vector
    q: Matrix
    v: Matrix
    z: Matrix
    a: Matrix
    s: Matrix
    lam: Matrix
    closed: NDArray[np.uint8]
    anchors: Matrix
    source: NDArray[np.intp]
    phase: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.time)

    def part(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Rows:
        """Some of the rows."""
        return Rows(**{item.name: getattr(self, item.name)[chosen] for item in fields(self)})


@dataclass(frozen=True, eq=False)
class Record(LateFields):
    """A run as numbers; `Trajectory` gives it names.

    Rows just before and just after a switch are both stored, with equal times.

    Parameters
    ----------
    equations : what was integrated; None in a run read from a file
    parameters : values of the run-time parameters, then of the tables
    parameter_names : names of the run-time parameters
    time, q, v, z, a, s, lam, closed : see `Rows`; a are the true accelerations v̇
    events : in order of time
    stats : counts and wall times
    success, message, failure : whether the run reached its end, a sentence, a capsule to replay the failing step
    final : the `State` to go on from
    settings : how the run was made: integrator, dt, until, contact, locate, versions
    parameter_changes : (row, parameters) pairs: values that hold from that row on
    start : the `State` it began with, whose closed contacts hold its anchors; None in a run read from a file
    phase : see `Rows`; by default for a mechanism without dry friction
    """

    equations: Equations | None
    parameters: Vector
    parameter_names: Sequence[str]
    time: Vector
    q: Matrix
    v: Matrix
    z: Matrix
    a: Matrix
    s: Matrix
    lam: Matrix
    closed: NDArray[np.uint8]
    events: Sequence[EventRecord] = ()
    stats: dict[str, Any] = field(default_factory=dict)
    success: bool = True
    message: str = ""
    failure: Any = None
    final: Any = None
    settings: dict[str, Any] = field(default_factory=dict)
    parameter_changes: Sequence[tuple[int, Vector]] = ()
    start: Any = None
    phase: NDArray[np.int8] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int8))

    @cached_property
    def extension(self) -> Extension:
        """How states between its rows follow from these."""
        return extension_of(self.settings.get("between", HERMITE))

    def __post_init__(self) -> None:
        count, own = len(self.time), vars(self)
        if not self.phase.size:
            own["phase"] = np.zeros((count, self.phase.shape[1]), dtype=np.int8)
        for name in ("q", "v", "z", "a", "s", "lam", "closed", "phase", "time", "parameters"):
            shape = own[name].shape
            if (len(shape) != 2 or shape[0] != count) and name not in ("time", "parameters"):
                raise ValueError(f"a record of {count} rows needs {name} of shape ({count}, n), got {shape}")
            own[name] = read_only(own[name])

    def concluded(self, **verdict: Any) -> Record:
        """The same rows, which have been judged already, with other words: success, message, stats."""
        found = object.__new__(type(self))
        vars(found).update(vars(self), **verdict)
        return found

    def rows(self, anchors: Matrix) -> Rows:
        """The stored states, with the values that closed contacts hold."""
        return Rows(
            self.time, self.q, self.v, self.z, self.a, self.s, self.lam, self.closed, anchors,
            np.arange(len(self.time), dtype=np.intp), self.phase,
        )  # fmt: skip

    def part(self, chosen: NDArray[np.intp], anchors: Matrix) -> Rows:
        """Some of the stored states, by their numbers, with what closed contacts hold there."""
        return Rows(
            self.time[chosen], self.q[chosen], self.v[chosen], self.z[chosen], self.a[chosen], self.s[chosen],
            self.lam[chosen], self.closed[chosen], anchors, chosen, self.phase[chosen],
        )  # fmt: skip

    def parameters_at(self, source: NDArray[np.intp]) -> Vector | Matrix:
        """The parameters that hold in stored rows: one vector if they never change, else a row each."""
        if not self.parameter_changes:
            return self.parameters
        starts = np.array([row for row, _ in self.parameter_changes])
        values = np.stack([self.parameters, *(vector[: len(self.parameters)] for _, vector in self.parameter_changes)])
        return np.asarray(values[np.searchsorted(starts, source, side="right")])
