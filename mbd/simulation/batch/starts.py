"""Starts and parameters of many runs as columns, checked as those of one run are."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.given_state import MAX_ANGLE, fits
from mbd.assembly.machines import begun_in, require_past, stored_anew
from mbd.bodies.values import shown
from mbd.compile.mechanism import Mechanism, rate_names
from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.simulation.batch.changes import Changes
from mbd.simulation.many_runs import start_line
from mbd.simulation.marching import Run
from mbd.state import State

Columns = Mapping[str, Vector]
"""Numbers of each run by name (N,)."""


@dataclass(frozen=True, eq=False)
class Starts:
    """N starts: the states themselves, or one with columns in the place of some of its numbers."""

    base: State
    states: Sequence[State]
    columns: Columns
    count: int
    anchors: Matrix | None = None  # (N, n_anchors), where machines store at a start what others do not

    def __len__(self) -> int:
        return self.count

    def state(self, k: int, names: Mapping[str, int]) -> State:
        """The k-th start, without what an earlier run remembers; `names` as `places_of` gives them."""
        own = {} if self.anchors is None else {"anchors": self.anchors[k]}
        if self.states:
            return replace(self.states[k], memory=None, moved={}, **own)
        q, v, z = self.base.q.copy(), self.base.v.copy(), self.base.z.copy()
        for name, column in self.columns.items():
            place = names[name]
            for part in (q, v, z):
                if place < len(part):
                    part[place] = column[k]
                    break
                place -= len(part)
        return replace(self.base, q=q, v=v, z=z, memory=None, moved={}, **own)

    def lines(self, run: Run, names: Mapping[str, int]) -> Matrix:
        """What the kernel takes: a line for each."""
        if self.states:
            return np.array([start_line(run, self.state(k, names)) for k in range(self.count)])
        lines = np.tile(start_line(run, self.base), (self.count, 1))
        for name, column in self.columns.items():
            lines[:, 1 + names[name]] = column
        if self.anchors is not None:
            first = 1 + len(self.base.q) + len(self.base.v) + len(self.base.z)
            lines[:, first : first + self.anchors.shape[1]] = self.anchors
        return lines


def places_of(mechanism: Mechanism) -> dict[str, int]:
    """Where coordinates, rates and states stand in (q, v, z), by every spelling."""
    equations = mechanism.equations
    names = {coordinate.name: k for k, coordinate in enumerate(equations.coordinates)}
    rates = {name: equations.n_q + k for name, k in rate_names(equations).items() if name not in names}
    states = {state.name: equations.n_q + equations.n_v + k for k, state in enumerate(equations.states)}
    return {**rates, **states, **names}


def raise_for_turning(what: str, names: Collection[str], mechanism: Mechanism, instead: str) -> None:
    """Raise a `ModelError` for names of parts of a quaternion, which one by one are no orientation."""
    configuration = mechanism.equations.configuration
    own = {configuration.names[place] for place in configuration.places if place >= 0}
    parts = [name for name in names if name in configuration.names and name not in own]
    if parts:
        listed = ", ".join(map(repr, parts))
        raise ModelError(f"{what}: {listed} {'is a part' if len(parts) == 1 else 'are parts'} of a quaternion, and a "
                         f"column of it alone is no orientation; {instead}")  # fmt: skip


def columns_of(values: Any, what: str, count: int | None = None) -> tuple[dict[str, Vector], list[str]]:
    """Columns by name from numbers and lists of numbers, of one length; and what is wrong with them."""
    if not isinstance(values, Mapping):
        return {}, [f"{what} must map names to numbers or lists of numbers, not {shown(values)}"]
    found, faults = {}, []
    for name, value in values.items():
        try:
            column = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            faults.append(f"{what}: {name!r} must be a number or a list of numbers, not {shown(value)}")
            continue
        if not isinstance(name, str) or column.ndim > 1 or (column.ndim == 1 and not len(column)):
            faults.append(f"{what}: {name!r} must be a name with a number or a list of at least one, of one dimension")
        elif not np.all(np.isfinite(column)):
            bad = int(np.flatnonzero(~np.isfinite(np.atleast_1d(column)))[0])
            faults.append(f"{what}: {name!r} has {np.atleast_1d(column)[bad]} at place {bad}; give finite numbers")
        else:
            found[name] = column
    sizes = {name: len(column) for name, column in found.items() if column.ndim}
    if len(set(sizes.values()) | ({count} if count is not None else set())) > 1:
        listed = ", ".join(f"{name!r} has {size}" for name, size in sizes.items())
        faults.append(f"{what}: lists must have one length{'' if count is None else f', {count}'}; {listed}")
    return found, faults


def given_starts(starts: Any) -> tuple[State, Sequence[State], dict[str, Vector]]:
    """(base, states, columns) of the argument `starts`.

    Raises
    ------
    ModelError
        for what is neither a state, nor a list of them, nor a state with columns.
    """
    if isinstance(starts, State):
        return starts, (), {}
    if (
        isinstance(starts, tuple)
        and len(starts) == 2
        and isinstance(starts[0], State)
        and not isinstance(starts[1], State)
    ):
        columns, faults = columns_of(starts[1], "starts")
        if faults:
            raise ModelError(faults)
        return starts[0], (), columns
    several = isinstance(starts, Sequence) and not isinstance(starts, str | bytes) and len(starts) > 0
    if not several or not all(isinstance(start, State) for start in starts):
        raise ModelError(
            "starts must be a list of at least one State, or a State with columns, such as "
            f"(state, {{'hip.angle': [0.1, 0.2]}}), not {shown(starts) if not several else 'a list of other things'}"
        )
    return starts[0], list(starts), {}


def starts_of(
    base: State, states: Sequence[State], columns: Mapping[str, Vector], count: int,
    model: Any, mechanism: Mechanism, manager: ActiveSetManager, changes: Changes,
) -> Starts:  # fmt: skip
    """The starts of a model.

    Raises
    ------
    ModelError, UnknownNameError
        for states of another model, names that are neither coordinates nor rates, angles that are none.
    """
    fits(base, mechanism.equations, manager)
    alike = (base.names, len(base.q), len(base.v), len(base.z))
    faults = []
    for k, start in enumerate(states):
        if (start.names, len(start.q), len(start.v), len(start.z)) != alike:
            faults.append(f"start {k} has other coordinates than the first; assemble all from one model")
        elif start.time != base.time:
            faults.append(f"start {k} begins at {start.time:g} s, the first at {base.time:g} s; give all one time")
        elif dict(start.parameters) != dict(base.parameters):
            faults.append(f"start {k} has other parameters than the first; give them as columns of parameters=")
        elif not (np.all(np.isfinite(start.q)) and np.all(np.isfinite(start.v)) and np.all(np.isfinite(start.z))):
            faults.append(f"start {k} has numbers that are not finite")
        elif not mechanism.vector or start.mode != base.mode or len(start.anchors) != len(base.anchors):
            fits(start, mechanism.equations, manager)
        if len(faults) > 5:
            break
    if faults:
        raise ModelError(faults)
    places = places_of(mechanism)
    wrong = [nearest(name, places, "coordinate or rate", "There are") for name in columns if name not in places]
    if wrong:
        raise UnknownNameError([f"starts: {each}" for each in wrong])
    raise_for_turning("starts", columns, mechanism, "give a list of states")
    for name, column in columns.items():
        if np.max(np.abs(column), initial=0.0) > MAX_ANGLE:
            raise ModelError(f"starts: {name!r} has values beyond {MAX_ANGLE:g}; take whole turns away")
    whole = {name: np.broadcast_to(column, count) for name, column in columns.items()}
    if not mechanism.equations.machines:
        return Starts(base, states, whole, count)
    for each in states or [base]:
        require_past(model, mechanism, each)
    known = [begun_in(model, mechanism, each) for each in states or [base]]
    found = Starts(known[0][0], [start for start, _ in known] if states else (), whole, count)
    made = (
        stored_anew(mechanism, found.state(k, places), changes.vectors(k, k + 1)[0], known[k if states else 0][1])
        for k in range(count)
    )
    return replace(found, anchors=np.array([start.anchors for start in made]))
