"""Left and right exchanged: the mirror image of a state.

In a plane names alone are exchanged. In space the walker is reflected too (`mbd.gait.reflection`), across the first of
z, y and x under which the mechanism is its own mirror image (`mbd.gait.alike`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equations.equations import Contact, Equations
from mbd.errors import ModelError
from mbd.gait.machines import image_faults, images
from mbd.gait.reflection import Reflection
from mbd.joints.reflected import exchanged
from mbd.state import Mode, State

Numbers = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Mirror:
    """The places from which the mirror image takes its numbers.

    sides : the two words; q, v, z, anchors : places of coordinates, velocities, first-order states, held values
    reflection : signs of the numbers there, of a walker in space; None: they are those of the other side
    section : the event at which returns end
    states : by the anchor of the state of a machine, the numbers that those of its partner become
    """

    sides: tuple[str, str]
    q: Numbers
    v: Numbers
    z: Numbers
    anchors: Numbers
    reflection: Reflection | None = None
    section: str = ""
    states: Mapping[int, Vector] = field(default_factory=dict)

    def name(self, name: str) -> str:
        """The mirror image of a name."""
        return exchanged(name, self.sides)

    @cached_property
    def _images(self) -> dict[frozenset[str], frozenset[str]]:
        """Those that were asked for."""
        return {}

    def names(self, names: frozenset[str]) -> frozenset[str]:
        """The mirror images of names."""
        found = self._images.get(names)
        if found is None:
            found = self._images[names] = frozenset(map(self.name, names))
        return found

    def of_q(self, q: Any) -> Matrix:
        """Mirror images of coordinates (…, n_q)."""
        return np.asarray(q[..., self.q] if self.reflection is None else self.reflection.q * q[..., self.q])

    def of_v(self, v: Any) -> Matrix:
        """Mirror images of velocities (…, n_v), and of increments."""
        return np.asarray(v[..., self.v] if self.reflection is None else self.reflection.v * v[..., self.v])

    def of_changes(self, anchors: Any) -> Matrix:
        """Mirror images of changes of held values (…, n_anchors), of which the numbers of states have none."""
        found = np.asarray(anchors)[..., self.anchors]
        return found if self.reflection is None else np.asarray(self.reflection.anchors * found)

    def of_anchors(self, anchors: Any) -> Matrix:
        """Mirror images of held values (…, n_anchors)."""
        found = self.of_changes(anchors)
        for place, numbers in self.states.items():
            found[..., place] = numbers[np.abs(found[..., place]).astype(int)]
        return np.asarray(found)

    def state(self, state: State) -> State:
        """The mirror image of a state."""
        anchors = self.of_anchors(state.anchors) if len(state.anchors) == len(self.anchors) else state.anchors
        armed = None if state.armed is None else self.names(state.armed)
        return State(
            state.time, self.of_q(state.q), self.of_v(state.v), state.z[self.z], Mode(self.names(state.mode.closed)),
            armed, anchors, state.names, state.velocity_names, state.moved, state.parameters,
        )  # fmt: skip


def mirror_of(equations: Equations, sides: Any, section: str = "") -> Mirror:
    """The exchange of two sides of a mechanism.

    Raises
    ------
    ModelError
        if sides are not two words, if no name has them, or if a name has no partner on the other side.
    """
    if (
        not isinstance(sides, tuple | list)
        or len(sides) != 2
        or not all(isinstance(word, str) and word for word in sides)
        or sides[0] == sides[1]
    ):
        raise ModelError(f"mirror must be two words in names, such as ('left', 'right'), or None, not {sides!r}")
    one, two = sides
    known: dict[tuple[str, str, str], Mirror] = equations.memory.setdefault("mirrors", {})
    if (one, two, section) in known:
        return known[one, two, section]
    lists = {
        "coordinate": [c.name for c in equations.coordinates],
        "velocity": list(equations.velocity_names),
        "state": [s.name for s in equations.states],
        "contact": [c.name for c in equations.contacts],
        "event": [g.name for g in equations.guards if g.terminal or g.reset is not None or g.transition is not None],
    }
    faults, sided = [], 0
    for kind, names in lists.items():
        for name in names:
            other = exchanged(name, (one, two))
            sided += other != name
            if other not in names:
                faults.append(f"mirror={(one, two)}: {kind} {name!r} has no partner {other!r}")
    faults += image_faults(equations, (one, two)) or _rule_faults(equations, (one, two))
    if not sided:
        faults.append(f"mirror={(one, two)}: no coordinate or contact has one of these words in its name")
    if faults:
        raise ModelError([*faults[:-1], f"{faults[-1]}; name both sides alike, or take mirror=None"])
    q, v, z = (_places(lists[kind], (one, two)) for kind in ("coordinate", "velocity", "state"))
    anchors, states = _anchor_places(equations, lists["contact"], (one, two))
    found = known[one, two, section] = Mirror((one, two), q, v, z, anchors, section=section, states=states)
    return found


def _rule_faults(equations: Equations, sides: tuple[str, str]) -> list[str]:
    """Contacts that open and close by other rules than their partners."""

    def rules(contact: Contact, image: Callable[[str], str]) -> tuple[Any, ...]:
        needed = image(contact.only_while) if isinstance(contact.only_while, str) else ""
        opened = frozenset((image(name), late) for name, late in contact.when)
        return contact.kind, contact.opens_on, opened, frozenset(map(image, contact.released_in)), needed

    found = {contact.name: rules(contact, lambda name: name) for contact in equations.contacts}
    images = {contact.name: rules(contact, lambda name: exchanged(name, sides)) for contact in equations.contacts}
    pairs = [(name, exchanged(name, sides)) for name in found]
    return [
        f"mirror={sides}: release= or only_while= of {name!r} and {other!r} are not each other's image"
        for name, other in pairs
        if name <= other and other in found and images[name] != found[other]
    ]


def _places(names: Sequence[str], sides: tuple[str, str]) -> Numbers:
    return np.array([names.index(exchanged(name, sides)) for name in names], dtype=np.intp)


def _anchor_places(
    equations: Equations, names: Sequence[str], sides: tuple[str, str]
) -> tuple[Numbers, dict[int, Vector]]:
    """Where each anchor of the mirror image stands, turns of cut joints stay; and what numbers of states become."""
    found, states = images(equations, sides)
    for contact in equations.contacts:
        partner = equations.contacts[names.index(exchanged(contact.name, sides))]
        if len(partner.anchors) == len(contact.anchors):
            found[list(contact.anchors)] = list(partner.anchors)
    return found, states
