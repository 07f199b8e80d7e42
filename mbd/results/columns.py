"""Named quantities of a run, evaluated from its states or read from a file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equations.equations import Equations
from mbd.equations.outputs import Outputs
from mbd.errors import TrajectoryError, UnknownNameError, nearest
from mbd.joints.euler import SEQUENCES
from mbd.results.balance import Balance
from mbd.results.charts import Charts
from mbd.results.dense import Restepping
from mbd.results.dense_implicit import LedSteps
from mbd.results.forces import Forces
from mbd.results.interpolation import Grid
from mbd.results.names import AXES, rate_name, scalars_behind
from mbd.results.orientations import ReadOff, read_off
from mbd.results.polynomials import Places
from mbd.results.projection import Projection
from mbd.results.record import Record, Rows
from mbd.results.stored_states import StoredStates, is_smooth
from mbd.results.turning import turns_to
from mbd.tape.node import Node

Alias = tuple[str, int]
"""A named quantity that is itself part of the state: ('q', 0), ('v', 3), …"""

STATE = ("q", "v", "z", "a", "s", "lam")


class Columns(ABC):
    """The named scalars of a run, at its stored rows or between them."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.grid = Grid(record.time)

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """The scalars that are certainly known."""

    @abstractmethod
    def knows(self, name: str) -> bool:
        """Whether there is a scalar of that name."""

    @abstractmethod
    def at_rows(self, names: Sequence[str]) -> list[Vector]:
        """Each scalar at every stored row."""

    @abstractmethod
    def at_places(self, names: Sequence[str], places: Places) -> list[Vector]:
        """Each scalar between the rows."""

    @property
    @abstractmethod
    def anchors(self) -> Matrix:
        """The values that closed contacts hold, at every stored row."""

    @property
    @abstractmethod
    def q_rate(self) -> Matrix:
        """q̇ at every stored row (R, n_q)."""

    @property
    @abstractmethod
    def between_rows(self) -> ModelColumns | None:
        """What evaluates quantities between the rows; None where only columns are known."""

    @abstractmethod
    def identity(self, name: str) -> tuple[Alias | None, Hashable]:
        """The scalar's place in the state if it is part of it, and a key that equal quantities share."""

    @property
    def vectors(self) -> tuple[str, ...]:
        """Names that stand for several components: 'left shank.end' for 'left shank.end.x', '.y', '.z'."""
        known = set(self.names)
        stems = [name[:-2] for name in self.names if name.endswith(".x")]
        return tuple(s for s in stems if s not in known and all(s + axis in known for axis in AXES))

    def lists(self, name: str) -> bool:
        """Whether a name is one of `names`."""
        return name in self.names

    def components(self, name: str) -> tuple[str, ...]:
        """The scalars behind a name: itself, or the components of a vector, a quaternion or Euler angles.

        A vector comes before a parameter of its name: 'left thigh.center' is a place, not a distance along the link.
        """
        if not isinstance(name, str):
            raise TrajectoryError(f"a quantity is asked for by its name, such as 'hip.angle', not {name!r}")
        if self.lists(name):
            return (name,)
        if parts := scalars_behind(name, self.knows):
            return parts
        raise UnknownNameError(self._unknown(name))

    def _unknown(self, name: str) -> str:
        """The sentence that answers a wrong name; of Euler angles it tells their sequences, which are not listed."""
        joint, euler, sequence = name.partition(".euler")
        if euler and self.knows(f"{joint}.orientation.w"):
            wrong = f"{sequence[1:]!r} is no sequence" if sequence else "name their sequence"
            return (
                f"no result named {name!r}: {wrong}; there are '{joint}.euler.zxy' and others: {', '.join(SEQUENCES)}"
            )
        owner = name.rpartition(".")[0]
        kinds = ("net_moment", "net_force", "euler.zxy.1")  # which are not listed
        beside = [full for kind in kinds if self.knows(full := f"{owner}.{kind}")]
        return nearest(name, (*self.names, *self.vectors), "result", "The run has", beside)


class ModelColumns(StoredStates, Columns):
    """Quantities evaluated by the model's own equations."""

    def __init__(self, record: Record, equations: Equations) -> None:
        StoredStates.__init__(self, record, equations)
        self._nodes: dict[str, Node] = {}
        self._waiting: dict[str, Vector] = {}  # coordinates that were evaluated with another one
        self._placed: WeakKeyDictionary[Places, dict[bool, Rows]] = WeakKeyDictionary()

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(self.equations.output_names())

    def lists(self, name: str) -> bool:
        offered = self.equations.output
        return offered.lists(name) if isinstance(offered, Outputs) else super().lists(name)

    @property
    def between_rows(self) -> ModelColumns:
        return self

    def knows(self, name: str) -> bool:
        if name not in self._nodes:
            offered = self.equations.output
            try:
                if isinstance(offered, Outputs) and not offered.offers(name):
                    raise KeyError(name)  # without the search for the nearest name
                with self.equations.tape.lock:
                    self._nodes[name] = self.equations.output(name)
            except (UnknownNameError, KeyError):
                places = {parameter.name: k for k, parameter in enumerate(self.equations.parameters)}
                if name not in places:
                    return False
                self._nodes[name] = self.equations.tape.input("p", places[name])
        return True

    def node(self, name: str) -> Node:
        """The quantity as an expression."""
        if not self.knows(name):
            raise UnknownNameError(nearest(name, (*self.names, *self.vectors), "result", "The run has"))
        return self._nodes[name]

    def at_rows(self, names: Sequence[str]) -> list[Vector]:
        group = self._read_together.get(names[0], ()) if len(names) == 1 else ()
        if not group:
            return self.evaluate_stored([self.node(name) for name in names])
        value = self._waiting.pop(names[0], None)  # one call, as other threads may read the same run
        if value is None:
            values = dict(zip(group, self.evaluate_stored([self.node(name) for name in group]), strict=True))
            value = values.pop(names[0])
            self._waiting.update(values)
        return [value]

    @property
    def _read_together(self) -> dict[str, tuple[str, ...]]:
        """Coordinates of each joint where they do not add, such as a quaternion: one costs as much as all of them."""
        memory, key = self.equations.memory, "coordinates read together"
        if key not in memory:
            names = tuple(each.name for each in getattr(self.equations, "coordinates", ()))  # a file has none
            charts = self.equations.configuration.charts if names else ()
            groups = [names[first : first + len(joint.labels)] for joint, first, _ in charts]
            memory[key] = {name: group for group in groups for name in group}
        found: dict[str, tuple[str, ...]] = memory[key]
        return found

    def at_places(self, names: Sequence[str], places: Places) -> list[Vector]:
        nodes = [self.node(name) for name in names]
        return self.evaluate(nodes, self.between(places, asks_for_forces(nodes)))

    def between(self, places: Places, forces: bool = True) -> Rows:
        """The states between the stored rows: explicit steps taken again where they can be, else polynomials.

        forces : whether accelerations, ż and multipliers count, which then come from the balance of forces
        """
        if len(self.rows.time) == 1:  # whose accelerations may be unknown
            return replace(self.rows.part(places.lower), time=places.time)
        known = self._placed.setdefault(places, {})
        if forces not in known:
            known[forces] = self._turned(self._between(places, forces), places)
        return known[forces]

    def _between(self, places: Places, forces: bool) -> Rows:
        if self._steps is not None:
            return self._steps.at(self.rows, places)
        if forces and Balance.serves(self.equations):
            return self._forces.at(places)
        return self._held(places, self._polynomials(places, forces))

    def _interpolated(self, places: Places) -> tuple[Rows, Rows]:
        """States by polynomials, and by polynomials of a lower degree."""
        found = self._polynomials(places)
        rougher = self.grid.rougher(self.rows, places, found, self.equations.compose is None, self._smooth)
        return self._held(places, found), self._held(places, rougher)

    def _held(self, places: Places, found: Rows) -> Rows:
        """The states on the constraints as far as the rows are."""
        return found if self._onto is None else self._onto.at(self.rows, places, found)

    def _polynomials(self, places: Places, forces: bool = True) -> Rows:
        """The same wherever they lead, with multipliers where these count."""
        rows, loads = self.rows, forces or any(friction.group for friction in self.equations.frictions)
        charts = Charts.of(self.equations)
        rates = self.q_rate if charts is None else rows.v  # which charts do without
        found = self.grid.between(rows, places, rates, self._smooth, charts, loads)
        if self._smooth and LedSteps.serves(self) and Balance.serves(self.equations):
            found = LedSteps(Restepping(self, self.balance)).at(rows, places, found)
        return found

    @cached_property
    def _smooth(self) -> bool:
        return is_smooth(self.record, self.equations.compose is None or Charts.of(self.equations) is not None)

    @cached_property
    def _steps(self) -> Restepping | None:
        return Restepping(self, self.balance) if Restepping.serves(self) else None

    @cached_property
    def _forces(self) -> Forces:
        return Forces(self.balance, self.rows, self._interpolated)

    @cached_property
    def _onto(self) -> Projection | None:
        return Projection.of(self.balance) if self.equations.rows and Balance.serves(self.equations) else None

    @cached_property
    def balance(self) -> Balance:
        """The equations of motion, to be solved at any state."""
        return Balance(self)

    def _turned(self, found: Rows, places: Places) -> Rows:
        """States between the rows with the turns made there."""
        if not self.equations.wrapped:
            return found
        anchors = found.anchors.copy()
        ends, inside = self._turning(self.rows), self._turning(found)
        for turn, (angle, rate), (shown, _) in zip(self.equations.wrapped, ends, inside, strict=True):
            anchors[:, turn.anchor] += turns_to(shown, places.blend(angle, rate))
        return replace(found, anchors=anchors)

    def identity(self, name: str) -> tuple[Alias | None, Hashable]:
        node = self.node(name)
        key = node.index
        if node.op == "add" and {arg.data[0] for arg in node.args if arg.op == "input"} == {"q", "x"}:
            node = next(arg for arg in node.args if arg.data[0] == "q")  # q ⊕ 0
        part = node.data[0] if node.op == "input" else ""
        return ((part, node.data[1]) if part in STATE else None), key


class SavedColumns(ModelColumns):
    """Quantities between the rows of a run that was read from a file, from the expressions in it."""

    def __init__(
        self, record: Record, expressions: Any, anchors: Matrix, q_rate: Matrix, beside_jumps: Vector | None
    ) -> None:
        super().__init__(record, expressions)
        self._anchors, self._rates, self._beside_jumps = anchors, q_rate, beside_jumps

    @property
    def anchors(self) -> Matrix:
        return self._anchors

    @property
    def q_rate(self) -> Matrix:
        return self._rates

    @property
    def times_beside_jumps(self) -> Vector | None:
        return self._beside_jumps


class StoredColumns(Columns):
    """Quantities read from a file: each name with its values at the stored rows, or its place in the state.

    Between the rows `model` evaluates them like in a live run. Without it, as in older files, parts of the state are
    interpolated; other quantities by cubic Hermite, with their rates where these are stored too ('foot.vx' for
    'foot.x'), else with three-point slopes.
    """

    def __init__(
        self, record: Record, aliases: Mapping[str, Alias], values: Mapping[str, Vector], order: Sequence[str],
        anchors: Matrix, q_rate: Matrix, model: SavedColumns | None = None,
    ) -> None:  # fmt: skip
        super().__init__(record)
        self._model = model
        self._aliases, self._values, self._order = dict(aliases), dict(values), tuple(order)
        self._anchors, self._rates = anchors, q_rate

    @property
    def names(self) -> tuple[str, ...]:
        return self._order

    def knows(self, name: str) -> bool:
        return self._holds(name) or self._read_off(name) is not None or self._derives(name)

    def _derives(self, name: str) -> bool:
        """Whether the expressions in the file have it, as they have net moments, but no column."""
        return self._model is not None and self._model.knows(name)

    def _holds(self, name: str) -> bool:
        return name in self._aliases or name in self._values

    def _read_off(self, name: str) -> ReadOff | None:
        found = None if self._holds(name) else read_off(name)
        return found if found is not None and all(self._holds(part) for part in found[0]) else None

    @property
    def anchors(self) -> Matrix:
        return self._anchors

    @property
    def q_rate(self) -> Matrix:
        return self._rates

    def identity(self, name: str) -> tuple[Alias | None, Hashable]:
        return self._aliases.get(name), id(self._values[name]) if name in self._values else name

    def at_rows(self, names: Sequence[str]) -> list[Vector]:
        found = {name: self._read_off(name) for name in names}
        return [
            self._read(name, self.record) if shown is None else shown[1](self.at_rows(shown[0]))
            for name, shown in found.items()
        ]

    def _read(self, name: str, state: Any) -> Vector:
        if name in self._aliases:
            part, index = self._aliases[name]
            return np.asarray(getattr(state, part)[:, index])
        if not self._holds(name) and self._model is not None:
            return self._model.at_rows([name])[0]
        return np.broadcast_to(self._values[name], (len(self.record.time),))

    @property
    def between_rows(self) -> ModelColumns | None:
        return self._model

    def at_places(self, names: Sequence[str], places: Places) -> list[Vector]:
        shown = {name: found for name in names if (found := self._read_off(name)) is not None}
        wanted = dict.fromkeys(part for name in names for part in (shown[name][0] if name in shown else (name,)))
        values = dict(zip(wanted, self._plainly_at(tuple(wanted), places), strict=True))
        return [
            shown[name][1]([values[part] for part in shown[name][0]]) if name in shown else values[name]
            for name in names
        ]

    def _plainly_at(self, names: Sequence[str], places: Places) -> list[Vector]:
        """Values between the rows of what is stored itself."""
        if self._model is not None:
            return self._model.at_places(names, places)
        plain = np.array_equal(self._rates, self.record.v)
        state = self.grid.between(self.record.rows(self._anchors), places, self._rates, is_smooth(self.record, plain))
        found = []
        for name in names:
            if name in self._aliases:
                found.append(self._read(name, state))
            else:
                column, rate = self._read(name, self.record), rate_name(name)
                known = rate in self._aliases or rate in self._values
                slopes = self._read(rate, self.record) if known else self.grid.slopes(column)
                found.append(places.blend(column, slopes))
        return found


def asks_for_forces(nodes: Sequence[Node]) -> bool:
    """Whether quantities depend on accelerations, ż or multipliers."""
    from mbd.tape.derivatives import live

    return any(node.op == "input" and node.data[0] in ("a", "s", "lam") for node in live(nodes))


def gather(columns: Columns, read: Callable[[Sequence[str]], list[Vector]], name: str) -> Vector | Matrix:
    """A scalar as (R,), a vector as (R, 3), a quaternion as (R, 4)."""
    found = read(columns.components(name))
    return found[0] if len(found) == 1 else np.column_stack(found)
