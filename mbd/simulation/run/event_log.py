"""Events of a run, from the lines in which the kernel has logged them."""

from collections.abc import Iterator, Mapping, Sequence

from mbd.arrays import Matrix, Vector, read_only
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.results.record import EventRecord

KINDS = ("closed", "opened", "event", "stuck", "slipped", "pushed")
"""Kinds of events by their numbers in the log."""
STUCK = KINDS.index("stuck")
FIRST = 5
"""Place of the first impulse in a line: time, kind, number, energy loss and row come before."""

Bearer = tuple[str, slice | list[int]]
"""Name of a contact, or of dry friction in a joint, and the rows that bear its impulses."""
NONE: Mapping[str, Vector] = {}


class EventLog:
    """Names what the lines of the log tell.

    Parameters
    ----------
    manager : contacts, frictions and guards by their numbers
    """

    def __init__(self, manager: ActiveSetManager) -> None:
        names = [friction.name for friction in manager.frictions]
        guards = [guard.name for guard in manager.guards]
        self._names = (
            manager.names,
            manager.names,
            guards,
            names,
            names,
            [each.name for each in manager.impulses],
        )
        self._contacts = [friction.contact for friction in manager.frictions]
        self._bearers: list[Bearer] = [(contact.name, _place(contact.rows)) for contact in manager.contacts]
        frictions = manager.frictions
        joints = {f.group or (k,): f.name for k, f in enumerate(frictions) if f.contact < 0}
        self._bearers += [(name, _place(tuple(frictions[k].row for k in group))) for group, name in joints.items()]
        self._bearers += [(name, _place(rows)) for name, rows in manager.rolling.items()]

    def events(self, lines: Matrix, stored: int) -> list[EventRecord]:
        """The events of some lines (L, width), in rows counted from the `stored` ones on."""
        impulses, bearers, found = read_only(lines[:, FIRST:].copy()), self._bearers, []
        for number, (time, code, index, loss, row) in enumerate(lines[:, :FIRST].tolist()):
            kind, who = int(code), int(index)
            name, own, all_of_them = self._names[kind][who], impulses[number, :0], NONE
            struck = kind == STUCK and bool(impulses[number].any())  # an impulse without collision
            bearer = self._contacts[who] if struck else who
            if kind < 2 or struck:
                own = impulses[number, bearers[bearer][1]]
                all_of_them = Impulses(bearers, bearer, impulses[number])
            found.append(EventRecord(time, KINDS[kind], name, own, loss, stored + int(row), all_of_them))
        return found


class Impulses(Mapping[str, Vector]):
    """Impulses at an event by name: those of the contact itself, and of others (or dry frictions) that have any.

    They are looked for when somebody asks, as few events of a long run are looked at.
    """

    __slots__ = ("_bearers", "_impulses", "_own")

    def __init__(self, bearers: Sequence[Bearer], own: int, impulses: Vector) -> None:
        self._bearers, self._own, self._impulses = bearers, own, impulses

    def _found(self) -> dict[str, Vector]:
        name, place = self._bearers[self._own]
        others = [(name, self._impulses[place]) for name, place in self._bearers]
        return {name: self._impulses[place], **{name: impulse for name, impulse in others if impulse.any()}}

    def __getitem__(self, name: str) -> Vector:
        return self._found()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found())

    def __len__(self) -> int:
        return len(self._found())

    def __repr__(self) -> str:
        return repr(self._found())


def _place(rows: tuple[int, ...]) -> slice | list[int]:
    """Where some rows stand: successive ones as a slice, which takes no time to read."""
    first = rows[0] if rows else 0
    return slice(first, first + len(rows)) if rows == tuple(range(first, first + len(rows))) else list(rows)
