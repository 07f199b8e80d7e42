"""What results need to know about a model besides numbers; kept in files, so that a loaded run can do without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mbd.equations.equations import Equations

__all__ = ["ContactFacts", "Facts"]


@dataclass(frozen=True)
class ContactFacts:
    """A contact: its name, kind ('unilateral' or 'penalty'), unit of the gap, and the anchors that hold where it
    touched the ground (x, y, z), empty for contacts without a place such as a knee stop."""

    name: str
    kind: str
    unit: str
    place: tuple[int, ...] = ()


@dataclass(frozen=True)
class Facts:
    """Names and units of a model.

    coordinates : (name, unit) of the coordinates and of the first-order states
    coordinate_count : how many of them belong to q
    contacts : in the order of the columns of `closed`
    segments : (body, (frame, …)) lines of the stick figure, whose points are the results 'body.frame'
    """

    model: str = ""
    coordinates: tuple[tuple[str, str], ...] = ()
    coordinate_count: int = 0
    contacts: tuple[ContactFacts, ...] = ()
    segments: tuple[tuple[str, tuple[str, ...]], ...] = ()

    @classmethod
    def of(cls, equations: Equations) -> Facts:
        """The facts of a set of equations."""
        figure = equations.figure() if equations.figure is not None else ()
        return cls(
            equations.name,
            tuple((c.name, c.unit) for c in (*equations.coordinates, *equations.states)),
            equations.n_q,
            tuple(
                ContactFacts(c.name, c.kind, c.unit, tuple(c.anchors) if len(c.anchors) == 3 else ())
                for c in equations.contacts
            ),
            tuple((body, tuple(frames)) for body, frames in figure),
        )

    @classmethod
    def read(cls, data: Mapping[str, Any]) -> Facts:
        """The facts from what `as_json` gave."""
        return cls(
            data["model"],
            tuple((name, unit) for name, unit in data["coordinates"]),
            data["coordinate_count"],
            tuple(ContactFacts(c["name"], c["kind"], c["unit"], tuple(c["place"])) for c in data["contacts"]),
            tuple((body, tuple(frames)) for body, frames in data["segments"]),
        )

    def as_json(self) -> dict[str, Any]:
        """Plain lists and dictionaries."""
        return asdict(self)
