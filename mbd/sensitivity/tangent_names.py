"""Names of what a start may be changed by: coordinates and turns, velocities, first-order states.

An orientation has three directions: 'hip.turn.x', '.y', '.z' are small rotations of the child about its own axes,
``R → R exp(δθ̂)`` [rad]. 'hip.orientation' stands for all of them, 'hip.angular_velocity' for its three components.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from mbd.compile.mechanism import rate_names
from mbd.equations.equations import Equations
from mbd.errors import UnknownNameError


def place_names(equations: Equations) -> list[str]:
    """Of the n_v directions of a configuration, in the order of its velocities."""
    configuration, found = equations.configuration, list[str]()
    pairs = zip(configuration.places, configuration.freedoms, configuration.velocity_names, strict=True)
    for place, (known, _), velocity in pairs:
        joint, word, axis = velocity.rpartition(".angular_velocity.")
        found.append(f"{joint}.turn.{axis}" if place < 0 and word else known)
    return found


def start_names(equations: Equations) -> dict[str, tuple[int, int]]:
    """Names of what a start has: the numbers of the direction of q and of the velocity that each is, −1 for none."""
    places = {name: (k, -1) for k, name in enumerate(place_names(equations))}
    speeds = {name: (-1, k) for name, k in rate_names(equations).items()}
    states = {state.name: (-1, equations.n_v + k) for k, state in enumerate(equations.states)}
    return {**speeds, **states, **places}


def whole_names(equations: Equations) -> dict[str, tuple[str, ...]]:
    """Names that stand for several: {'hip.orientation': ('hip.turn.x', 'hip.turn.y', 'hip.turn.z'), …}."""
    found: dict[str, tuple[str, ...]] = {}
    places = place_names(equations)
    for joint, _, first in equations.configuration.charts:
        own = slice(first + joint.adding, first + len(joint.freedoms))
        speeds = equations.configuration.velocity_names[own]
        if joint.orientation is not None and all(".turn." in name for name in places[own]):
            found[f"{joint.name}.orientation"] = tuple(places[own])
            found[f"{joint.name}.angular_velocity"] = tuple(speeds)
    return found


def expanded(equations: Equations, names: Sequence[Any]) -> list[Any]:
    """The names with those that stand for several taken apart; what is no name stays."""
    known, found = whole_names(equations), list[Any]()
    for name in names:
        found += known.get(name, (name,)) if isinstance(name, str) else (name,)
    return found


def refuse_parts(equations: Equations, names: Sequence[str], what: str) -> None:
    """Refuse parts of a quaternion, none of which can change alone."""
    known: Mapping[str, tuple[str, ...]] = whole_names(equations)
    for name in names:
        stem, _, part = name.rpartition(".")
        if stem in known and stem.endswith(".orientation") and part in "wxyz":
            raise UnknownNameError(
                f"{what}: {name!r} is one part of a quaternion, which does not change alone; there are "
                f"{', '.join(map(repr, known[stem]))}, small rotations about the axes of the child [rad], and {stem!r} "
                "for all of them"
            )
