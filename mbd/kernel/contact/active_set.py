"""The active-set manager: constraints register, it keeps who is closed and by which rule each opens."""

from collections.abc import Collection, Iterable, Sequence
from functools import cached_property
from itertools import accumulate, chain

import numpy as np
from numpy.typing import NDArray

from mbd.equations.equations import Contact, Equations, Guard
from mbd.kernel.codes import ALWAYS, BY_MEASURE
from mbd.state import Mode

Integers = NDArray[np.int64]


class ContactTables(dict[str, Integers | NDArray[np.float64]]):
    """The rules of all contacts as arrays, under the names of the kernel's fields."""


class ActiveSetManager:
    """Switches bilateral rows, unilateral contacts and penalty contacts on and off.

    Bilateral rows are always active. A contact registers with its gap, its rows or force law, and its rules;
    the manager turns the rules into tables for the kernel, which judges every step by them, and turns the
    kernel's closed flags into a `Mode` and into lists of active rows.

    Parameters
    ----------
    trivial : numbers of rows that hold whatever the motion, and never act (see `mbd.compile.trivial_rows`)
    """

    def __init__(self, equations: Equations, trivial: Collection[int] = ()) -> None:
        self.trivial = frozenset(trivial)
        self.contacts: list[Contact] = []
        self.names: list[str] = []
        self._flags: dict[frozenset[str], Integers] = {}
        self._modes: dict[tuple[int, ...], Mode] = {}
        self._penalties: list[int] = []
        self._active: dict[tuple[tuple[int, ...], tuple[int, ...] | None], tuple[int, ...]] = {}
        self.guards: list[Guard] = []
        self._row_contact = [row.contact for row in equations.rows]
        self._row_level = [int(row.is_velocity) for row in equations.rows]
        self._row_friction = [row.friction for row in equations.rows]
        self.frictions = equations.frictions
        self.machines, self.impulses = equations.machines, equations.impulses
        self._first_anchor = equations.n_held_by_machines
        self.rolling: dict[str, tuple[int, ...]] = {}  # rows of wheels that roll while a contact is closed, by name
        own = {contact.name for contact in equations.contacts}
        for k, row in enumerate(equations.rows):
            if row.is_velocity and row.contact >= 0 and row.owner not in own:
                self.rolling[row.owner] = (*self.rolling.get(row.owner, ()), k)
        for contact in equations.contacts:
            self.register(contact)
        for guard in equations.guards:
            self.guards.append(guard)

    def register(self, contact: Contact) -> int:
        """Add a contact; its number."""
        self._penalties += [len(self.contacts)] if contact.kind == "penalty" else []
        self.contacts.append(contact)
        self.names.append(contact.name)
        return len(self.contacts) - 1

    @cached_property
    def instants(self) -> dict[str, tuple[int, ...]]:
        """Guards by the names of events; 'knee phase: stance' are all transitions that enter this state."""
        found: dict[str, tuple[int, ...]] = {guard.name: (e,) for e, guard in enumerate(self.guards)}
        for e, guard in enumerate(self.guards):
            if guard.transition is not None:
                machine = self.machines[guard.transition.machine]
                name = f"{machine.name}: {machine.states[guard.transition.target]}"
                found[name] = (*found.get(name, ()), e)
        return found

    def happens(self, name: str, event: str) -> bool:
        """Whether an event of this name is one that `instants` or a contact is called by."""
        return name == event or any(self.guards[e].name == event for e in self.instants.get(name, ()))

    def flags(self, closed: Iterable[str]) -> Integers:
        """1 for each closed contact, in order of registration."""
        closed = frozenset(closed)
        found = self._flags.get(closed)
        if found is None:
            found = self._flags[closed] = np.array([int(name in closed) for name in self.names], dtype=np.int64)
        return found.copy()

    def mode(self, flags: Sequence[int] | Integers) -> Mode:
        """The closed contacts by name."""
        key = tuple(flags)
        found = self._modes.get(key)
        if found is None:
            closed = frozenset(name for name, flag in zip(self.names, key, strict=True) if flag)
            found = self._modes[key] = Mode(closed)
        return found

    def active_rows(
        self, flags: Sequence[int] | Integers, sticks: Sequence[int] | Integers | None = None
    ) -> tuple[int, ...]:
        """Rows that act, ascending: bilateral ones, those of closed contacts and of frictions that stick.

        Parameters
        ----------
        flags : 1 for each closed contact
        sticks : 1 for each friction that sticks; None: none does
        """
        key = tuple(flags), None if sticks is None else tuple(sticks)
        found = self._active.get(key)
        if found is None:
            rows = zip(self._row_contact, self._row_friction, strict=True)
            found = self._active[key] = tuple(
                k
                for k, (contact, friction) in enumerate(rows)
                if k not in self.trivial
                and (contact < 0 or flags[contact])
                and (friction < 0 or (sticks is not None and sticks[friction]))
            )
        return found

    def penalties(self, flags: Sequence[int] | Integers) -> tuple[int, ...]:
        """Numbers of the penalty contacts that act."""
        return tuple(c for c in self._penalties if flags[c])

    def tables(self) -> ContactTables:
        """Rules as arrays; see `mbd.kernel.records`."""
        number = {contact.name: c for c, contact in enumerate(self.contacts)}
        opens = {"pull": 0, "gap": 1, "when": 2}
        anchors, watched_by = [self._first_anchor], []
        for contact in self.contacts:
            anchors.append(anchors[-1] + len(contact.anchors))
            named = isinstance(contact.only_while, str)
            watched_by.append(
                number[str(contact.only_while)] if named else ALWAYS if contact.only_while is None else BY_MEASURE
            )
        normals = [contact.rows[0] if contact.rows else -1 for contact in self.contacts]
        integers = {
            "row_contact": self._row_contact, "row_level": self._row_level, "row_friction": self._row_friction,
            "friction_row": [friction.row for friction in self.frictions],
            "friction_contact": [friction.contact for friction in self.frictions],
            "leader": [min(friction.group, default=f) for f, friction in enumerate(self.frictions)],
            "group_size": [max(len(friction.group), 1) for friction in self.frictions],
            "row_trivial": [int(k in self.trivial) for k in range(len(self._row_contact))],
            "kind": [int(contact.kind == "penalty") for contact in self.contacts],
            "opens": [opens[contact.opens_on] for contact in self.contacts],
            "normal": normals, "watched_by": watched_by, "anchor_start": anchors,
            "when": _lists([[2 * number[other] + after for other, after in each.when] for each in self.contacts]),
            "direction": [guard.direction for guard in self.guards], **self._transitions(),
            "impulse_contact": [each.contact for each in self.impulses],
            "impulse_order": [each.order for each in self.impulses],
        }  # fmt: skip
        tables = ContactTables({name: np.array(values, dtype=np.int64) for name, values in integers.items()})
        tables["restitution"] = np.array([contact.restitution for contact in self.contacts], dtype=float)
        return tables

    def _transitions(self) -> dict[str, list[int]]:
        """The transitions of machines as the kernel's tables, by guards."""
        n_c, n_g = len(self.contacts), len(self.guards)
        begin = {"closed": 0, "opened": n_c, "event": 2 * n_c, "taken": 2 * n_c + n_g}
        own = [(e, guard.transition) for e, guard in enumerate(self.guards)]
        causes = [[] if each is None else [begin[kind] + k for kind, k in each.causes] for _, each in own]
        releases = [
            [begin["taken"] + e for name in contact.released_in for e in self.instants.get(name, ())]
            for contact in self.contacts
        ]
        return {
            "machine_start": [machine.anchors[0] for machine in self.machines],
            "guard_machine": [-1 if each is None else each.machine for _, each in own],
            "guard_source": [-1 if each is None else each.source for _, each in own],
            "guard_target": [-1 if each is None else each.target for _, each in own],
            "guard_fires": [int(each is not None and ("event", e) in each.causes) for e, each in own],
            "guard_timed": [
                0 if each is None else each.timed * (1 + 2 * each.is_unconditional + 4 * self.guards[e].is_timer)
                for e, each in own
            ],
            "guard_kink": [int(guard.is_kink) for guard in self.guards],
            "guard_contact": [-1 if each is None else each.contact for _, each in own],
            "releases": _lists(releases), "causes": _lists(causes),
            "stores": _lists([[] if each is None else each.stored for _, each in own]),
        }  # fmt: skip


def _lists(lists: Sequence[Sequence[int]]) -> list[int]:
    """Lists side by side, behind the places at which each begins and the last ends."""
    starts = accumulate(map(len, lists), initial=len(lists) + 1)
    return [*starts, *chain.from_iterable(lists)]
