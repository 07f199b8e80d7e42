"""Left and right exchanged: the mirror image of a state, and whether the mechanism is its own mirror image.

In a plane names alone are exchanged. In space the walker is reflected too (`mbd.gait.reflection`), across the first of
z, y and x under which the mechanism is its own mirror image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.equations.equations import Equations
from mbd.errors import ModelError
from mbd.gait.reflection import Reflection, reflections
from mbd.joints.reflected import exchanged
from mbd.state import Mode, State

__all__ = ["Mirror", "mirror_of"]

Numbers = NDArray[np.intp]

POSES = 2
"""States at which a mechanism is compared with its mirror image [-]."""
ALIKE = 1e-9
"""Difference of inertia and forces, relative to the largest of their kind, below which two sides are alike [-]."""


@dataclass(frozen=True, eq=False)
class Mirror:
    """The places from which the mirror image takes its numbers.

    sides : the two words; q, v, z, anchors : places of coordinates, velocities, first-order states, held values
    reflection : signs of the numbers there, of a walker in space; None: they are those of the other side
    """

    sides: tuple[str, str]
    q: Numbers
    v: Numbers
    z: Numbers
    anchors: Numbers
    reflection: Reflection | None = None

    def name(self, name: str) -> str:
        """The mirror image of a name."""
        return exchanged(name, self.sides)

    def names(self, names: frozenset[str]) -> frozenset[str]:
        """The mirror images of names."""
        return frozenset(map(self.name, names))

    def of_q(self, q: Any) -> Matrix:
        """Mirror images of coordinates (…, n_q)."""
        return np.asarray(q[..., self.q] if self.reflection is None else self.reflection.q * q[..., self.q])

    def of_v(self, v: Any) -> Matrix:
        """Mirror images of velocities (…, n_v), and of increments."""
        return np.asarray(v[..., self.v] if self.reflection is None else self.reflection.v * v[..., self.v])

    def of_anchors(self, anchors: Any) -> Matrix:
        """Mirror images of held values (…, n_anchors)."""
        found = anchors[..., self.anchors]
        return np.asarray(found if self.reflection is None else self.reflection.anchors * found)

    def state(self, state: State) -> State:
        """The mirror image of a state."""
        anchors = self.of_anchors(state.anchors) if len(state.anchors) == len(self.anchors) else state.anchors
        armed = None if state.armed is None else self.names(state.armed)
        return replace(
            state, q=self.of_q(state.q), v=self.of_v(state.v), z=state.z[self.z], anchors=anchors, armed=armed,
            mode=Mode(self.names(state.mode.closed)), memory=None,
        )  # fmt: skip


def mirror_of(equations: Equations, sides: Any) -> Mirror:
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
    lists = {
        "coordinate": [c.name for c in equations.coordinates],
        "velocity": list(equations.velocity_names),
        "state": [s.name for s in equations.states],
        "contact": [c.name for c in equations.contacts],
    }
    faults, sided = [], 0
    for kind, names in lists.items():
        for name in names:
            other = exchanged(name, (one, two))
            sided += other != name
            if other not in names:
                faults.append(f"mirror={(one, two)}: {kind} {name!r} has no partner {other!r}")
    if not sided:
        faults.append(f"mirror={(one, two)}: no coordinate or contact has one of these words in its name")
    if faults:
        raise ModelError([*faults[:-1], f"{faults[-1]}; name both sides alike, or take mirror=None"])
    q, v, z = (_places(lists[kind], (one, two)) for kind in ("coordinate", "velocity", "state"))
    return Mirror((one, two), q, v, z, _anchor_places(equations, lists["contact"], (one, two)))


def _places(names: Sequence[str], sides: tuple[str, str]) -> Numbers:
    return np.array([names.index(exchanged(name, sides)) for name in names], dtype=np.intp)


def _anchor_places(equations: Equations, names: Sequence[str], sides: tuple[str, str]) -> Numbers:
    """Where each anchor of the mirror image stands; turns of cut joints stay."""
    found = np.arange(equations.n_anchors, dtype=np.intp)
    for contact in equations.contacts:
        partner = equations.contacts[names.index(exchanged(contact.name, sides))]
        if len(partner.anchors) == len(contact.anchors):
            found[list(contact.anchors)] = list(partner.anchors)
    return found


def require_alike(
    mechanism: Mechanism, mirror: Mirror, parameters: Vector, values: dict[str, float], model: Any = None
) -> Mirror:
    """The mirror with its reflection, if the walker moves in space.

    Inertia and forces of mirrored motions are compared at some states, in space gaps of contacts too.

    Raises
    ------
    ModelError
        where the mirror image of the mechanism is another mechanism; it tells parameters that differ by name.
    """
    choices = [replace(mirror, reflection=each) for each in reflections(model, mechanism, mirror, parameters)]
    different = np.inf
    for choice in choices or [mirror]:
        found = _difference(mechanism, choice, parameters)
        if found <= ALIKE:
            return choice
        different = min(different, found)
    pairs = [(name, exchanged(name, mirror.sides)) for name in values]
    unlike = [
        f"{name!r} is {values[name]:g}, {other!r} {values[other]:g}"
        for name, other in pairs
        if other in values and name < other and values[name] != values[other]
    ]
    why = f": {'; '.join(unlike[:4])}" if unlike else f"; forces differ by {different:.2g} of the largest"
    raise ModelError(
        f"mirror={mirror.sides}: the mechanism with its sides exchanged is another one{why}; "
        "a step of one side does not repeat on the other: take mirror=None, whose strides have a step of each side"
    )


def _difference(mechanism: Mechanism, mirror: Mirror, parameters: Vector) -> float:
    """The largest difference of mirrored motions, relative to the largest of its kind."""
    layout, random = mechanism.layout, np.random.default_rng(3)
    configuration, different = mechanism.equations.configuration, 0.0
    none = np.zeros(layout.n_anchors)
    for _ in range(POSES):
        q, y = (
            np.array(configuration.defaults) + random.uniform(-0.4, 0.4, layout.n_q),
            random.uniform(-1, 1, layout.n),
        )
        q = configuration.normalise(q)
        image_q = mirror.of_q(q)
        image_y = np.concatenate([mirror.of_v(y[: layout.n_v]), y[layout.n_v :][mirror.z]])
        here = mechanism.acceleration_terms(0.0, q, y, parameters, none)
        there = mechanism.acceleration_terms(0.0, image_q, image_y, parameters, none)
        order = np.concatenate([mirror.v, layout.n_v + mirror.z]).astype(np.intp)
        signs = np.ones(layout.n)
        if mirror.reflection is not None:
            signs[: layout.n_v] = mirror.reflection.v
        pairs = [
            (here.M[np.ix_(order, order)] * np.outer(signs, signs), there.M),
            (here.f[order] * signs, there.f),
        ]
        if mirror.reflection is not None:
            gaps = [_gaps(mechanism, at, parameters) for at in ((q, y), (image_q, image_y))]
            pairs.append((gaps[0][_contact_order(mechanism.equations, mirror)], gaps[1]))
        for mine, its in pairs:
            size = float(np.max(np.abs(mine), initial=0.0)) or 1.0
            different = max(different, float(np.max(np.abs(mine - its), initial=0.0)) / size)
    return different


def _gaps(mechanism: Mechanism, at: tuple[Vector, Vector], parameters: Vector) -> Vector:
    """Gaps of all contacts at (q, y), nothing being held [m, rad]."""
    out = np.zeros(max(mechanism.sizes["guards"], 1))
    block = mechanism.block(0.0, *at, np.zeros(mechanism.layout.n_anchors))
    mechanism.common["guards"](block, parameters, out)
    return out[: len(mechanism.equations.contacts)]


def _contact_order(equations: Equations, mirror: Mirror) -> Numbers:
    names = [contact.name for contact in equations.contacts]
    return np.array([names.index(mirror.name(name)) for name in names], dtype=np.intp)
