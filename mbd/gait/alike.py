"""Whether the two sides of a walker are alike, and whether a parameter keeps them so.

A mirrored step repeats on the other side where the mechanism is its own mirror image: inertia, forces, rows, forces of
closed penalty contacts, gaps, conditions of contacts and transitions, limits of friction, restitutions, events, timers
and resets, impulses at strikes, and what contacts and machines store at some states are those of the mirrored states on
the other side. A parameter keeps both sides alike where they are alike beside its value too. One comparison decides
both, wherever parameters enter a mirrored gait.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism, rate_names
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL, NOMINAL_RTOL
from mbd.equations.equations import Equations, Guard
from mbd.errors import MbdError, ModelError
from mbd.gait.machines import in_state
from mbd.gait.mirror import Mirror
from mbd.gait.reflection import reflections
from mbd.joints.reflected import exchanged
from mbd.sensitivity.resets import reset_expressions

POSES = (0.4, 0.4, 2.5)
"""Largest changes of coordinates at the states at which a mechanism is compared with its mirror image [m, rad].

The wide one reaches stops and branches of laws that small motions do not.
"""
WIDEST, GROWTH = 1e12, 30.0
"""Change of a parameter, over its value or 1, up to which an effect is looked for, and the factor of the next [-]."""

EVENTS = slice(4, 7)
"""Those of events among the numbers that are watched."""

Pairs = tuple[Vector, Vector, NDArray[np.intp]]
"""Numbers of mirrored states, exchanged, those of their images, and where each kind of them begins."""


def require_alike(
    mechanism: Mechanism, mirror: Mirror, parameters: Vector, values: dict[str, float], model: Any = None
) -> Mirror:
    """The mirror with its reflection, if the walker moves in space.

    Raises
    ------
    ModelError
        where the mirror image of the mechanism is another mechanism; it tells parameters that differ by name.
    """
    known: dict[Hashable, Mirror] = mechanism.kept(require_alike, dict)
    key = mirror.sides, mirror.section, parameters.tobytes()
    found = known.get(key)
    if found is None:
        found = _alike(mechanism, mirror, parameters, values, model)
        if len(known) >= 8:  # so many values of the parameters keep their mirror image
            known.clear()
        known[key] = found
    return found


def _alike(mechanism: Mechanism, mirror: Mirror, parameters: Vector, values: dict[str, float], model: Any) -> Mirror:
    """The same, looked for."""
    choices = [replace(mirror, reflection=each) for each in reflections(model, mechanism, mirror, parameters)]
    different = np.inf
    for choice in choices or [mirror]:
        found = _difference(mechanism, choice, parameters)
        if found <= EQUAL_RTOL:
            return choice
        different = min(different, found)
    raise ModelError(_sentence(mechanism, mirror, values, different))


def sides_faults(mechanism: Mechanism, mirror: Mirror, parameters: Vector, values: Mapping[str, float]) -> list[str]:
    """One sentence where the sides are not alike with these values of parameters; none where they are."""
    found = _difference(mechanism, mirror, parameters)
    return [] if found <= EQUAL_RTOL else [_sentence(mechanism, mirror, values, found)]


def moves_sides_alike(
    mechanism: Mechanism, mirror: Mirror, vector: Callable[[float], Vector], value: float
) -> bool:  # fmt: skip
    """Whether the sides change alike as a parameter does, so that they stay each other's image.

    The change of the parameter grows until it changes something of the mechanism. If it changes nothing at the states
    that are compared, its name decides: a parameter with a partner on the other side changes one side alone.

    Parameters
    ----------
    vector : parameter vector at a value of it; value : its own
    """
    mine, its, starts = _pairs(mechanism, mirror, vector(value))
    size, h = _sizes(mine, starts), NOMINAL_RTOL * (abs(value) or 1.0)
    while h <= WIDEST * max(abs(value), 1.0):
        mine_there, its_there, _ = _pairs(mechanism, mirror, vector(value + h))
        changes = (mine_there - mine, its_there - its, (mine_there - its_there) - (mine - its))
        own, others, apart = (float(np.max(_largest(change, starts) / size)) for change in changes)
        effect = max(own, others)
        if effect > NOMINAL_RTOL:
            return apart <= 1e-2 * effect  # share of that change that two sides may differ by after it
        h *= GROWTH
    return _changes_both(mechanism, mirror, vector(value), vector(value + NOMINAL_RTOL * (abs(value) or 1.0)))


def _changes_both(mechanism: Mechanism, mirror: Mirror, here: Vector, beside: Vector) -> bool:
    """Whether each parameter that has a partner on the other side changes only where its partner changes too."""
    names = [parameter.name for parameter in mechanism.equations.parameters]
    changed = {name for name, one, two in zip(names, here, beside, strict=False) if one != two}
    return all(mirror.name(name) in changed for name in changed if mirror.name(name) in names)


def _sentence(mechanism: Mechanism, mirror: Mirror, values: Mapping[str, float], different: float) -> str:
    """That the mirror image is another mechanism, and which parameters or contacts make it so."""
    pairs = [(name, exchanged(name, mirror.sides)) for name in values]
    unlike = [
        f"{name!r} is {values[name]:g}, {other!r} {values[other]:g}"
        for name, other in pairs
        if other in values and name < other and values[name] != values[other]
    ]
    contacts = {contact.name: contact for contact in mechanism.equations.contacts}
    for name, contact in contacts.items():
        partner = contacts[mirror.name(name)]
        if name < partner.name and contact.restitution != partner.restitution:
            unlike.append(
                f"the restitution of {name!r} is {contact.restitution:g}, of {partner.name!r} {partner.restitution:g}"
            )
    why = f": {'; '.join(unlike[:4])}" if unlike else f"; they differ by {different:.2g} of the largest"
    return (
        f"mirror={mirror.sides}: the mechanism with its sides exchanged is another one{why}; "
        "a step of one side does not repeat on the other: take mirror=None, whose strides have a step of each side"
    )


def _difference(mechanism: Mechanism, mirror: Mirror, parameters: Vector) -> float:
    """The largest difference of mirrored motions, relative to the largest of its kind."""
    contacts = {contact.name: contact for contact in mechanism.equations.contacts}
    if any(contact.restitution != contacts[mirror.name(name)].restitution for name, contact in contacts.items()):
        return np.inf
    mine, its, starts = _pairs(mechanism, mirror, parameters)
    return float(np.max(_largest(mine - its, starts) / _sizes(mine, starts), initial=0.0))


def _sizes(numbers: Vector, starts: NDArray[np.intp]) -> Vector:
    """The largest finite modulus of each kind; 1 where there is none."""
    largest = np.maximum.reduceat(np.where(np.isfinite(numbers), np.abs(numbers), 0.0), starts)
    return np.where(largest == 0.0, 1.0, largest)


def _largest(numbers: Vector, starts: NDArray[np.intp]) -> Vector:
    """The largest modulus of each kind; what is no number on both sides counts as none."""
    finite = np.logical_or.reduceat(np.isfinite(numbers), starts)
    return np.where(finite, np.fmax.reduceat(np.abs(numbers), starts), 0.0)


@dataclass(frozen=True, eq=False)
class _Places:
    """What of a comparison depends on no parameter.

    states : (q, y, anchors) of states and of their mirror images
    acting, storing : see `_acting`, `_storing`; watched : see `_watched_places`; impulses : places of their images
    order, signs : of velocities and first-order states
    """

    states: Sequence[tuple[tuple[Vector, ...], tuple[Vector, ...]]]
    acting: list[int]
    storing: list[int]
    watched: list[NDArray[np.intp]]
    impulses: dict[tuple[str, int], tuple[str, int]]
    order: NDArray[np.intp]
    signs: Vector


def _places(mechanism: Mechanism, mirror: Mirror) -> _Places:
    """These of a mechanism and a mirror, found once."""
    known: WeakKeyDictionary[Mirror, _Places] = mechanism.equations.memory.setdefault(
        "compared with mirror images", WeakKeyDictionary()
    )
    if mirror not in known:
        known[mirror] = _found_places(mechanism, mirror)
    return known[mirror]


def _found_places(mechanism: Mechanism, mirror: Mirror) -> _Places:
    layout, random, equations = mechanism.layout, np.random.default_rng(3), mechanism.equations
    configuration, states = equations.configuration, []
    storing = _storing(equations)
    signs = np.ones(layout.n)
    if mirror.reflection is not None:
        signs[: layout.n_v] = mirror.reflection.v
    for number in range(max([len(POSES), *(len(machine.states) for machine in equations.machines)])):
        # a state and its mirror image; machines and contacts hold something, as they do in motion
        width = POSES[number % len(POSES)]
        q, y = (
            np.array(configuration.defaults) + random.uniform(-width, width, layout.n_q),
            random.uniform(-1, 1, layout.n),
        )
        q = configuration.normalise(q)
        image_q = mirror.of_q(q)
        image_y = np.concatenate([mirror.of_v(y[: layout.n_v]), y[layout.n_v :][mirror.z]])
        held = in_state(mechanism, number)
        held[storing] = random.uniform(0.1, 0.5, len(storing))
        states.append(((q, y, held), (image_q, image_y, mirror.of_anchors(held))))
    return _Places(
        states, _acting(equations, mirror), storing, _watched_places(equations, mirror),
        {(c.name, when): (mirror.name(c.name), when) for c in equations.contacts for when in range(3)},
        np.concatenate([mirror.v, layout.n_v + mirror.z]).astype(np.intp), signs,
    )  # fmt: skip


def _pairs(mechanism: Mechanism, mirror: Mirror, parameters: Vector) -> Pairs:
    """What is compared, at some states with their mirror images."""
    places, found = _places(mechanism, mirror), list[tuple[Vector, Vector]]()
    order, signs = places.order, places.signs
    square, both_signs = np.ix_(order, order), np.outer(signs, signs)
    for at, image in places.states:
        here, there = _numbers(mechanism, parameters, *at), _numbers(mechanism, parameters, *image)
        # numbers of the one in the places and with the signs of the other
        for mine, its in zip(here["matrices"], there["matrices"], strict=True):
            found.append((np.ravel(mine[square] * both_signs), np.ravel(its)))
        for mine, its in zip(here["vectors"], there["vectors"], strict=True):
            found.append((mine[order] * signs, its))
        pairs = zip(places.watched, here["watched"], there["watched"], strict=True)
        watched = [(mine[place], its) for place, mine, its in pairs]
        watched[EVENTS] = [(mine[places.acting], its[places.acting]) for mine, its in watched[EVENTS]]
        found += watched
        found += [(mirror.of_v(here["impulses"][places.impulses[key]]), its) for key, its in there["impulses"].items()]
        stored = mirror.of_anchors(here["stored"])
        found += [(stored[[k]], there["stored"][[k]]) for k in places.storing]
        found += _resets(mechanism, mirror, parameters, at, image)
    found = [pair for pair in found if len(pair[0])]
    starts = np.array([0, *np.cumsum([len(mine) for mine, _ in found[:-1]])], dtype=np.intp)
    return np.concatenate([mine for mine, _ in found]), np.concatenate([its for _, its in found]), starts


def _acting(equations: Equations, mirror: Mirror) -> list[int]:
    """Numbers of the events that change something: the motion, a machine, or where a return ends."""
    causes = {number for guard in equations.guards if guard.transition is not None
              for kind, number in guard.transition.causes if kind == "event"}  # fmt: skip
    return [
        e
        for e, guard in enumerate(equations.guards)
        if guard.terminal or guard.reset is not None or guard.transition or guard.name == mirror.section or e in causes
    ]


def _storing(equations: Equations) -> list[int]:
    """Anchors that hold values, not numbers of states or of turns."""
    machines = [anchor for machine in equations.machines for anchor in machine.anchors[1:]]
    return machines + [anchor for contact in equations.contacts for anchor in contact.anchors]


def _numbers(mechanism: Mechanism, parameters: Vector, q: Vector, y: Vector, anchors: Vector) -> dict[str, Any]:
    """What a state tells of a mechanism; of rows what depends neither on their order nor on their signs."""
    layout, equations = mechanism.layout, mechanism.equations
    lam, n_c, n_g, n_f = -np.ones(layout.n_rows), len(equations.contacts), len(equations.guards), layout.n_frictions
    terms = mechanism.acceleration_terms(0.0, q, y, parameters, anchors, lam=lam)
    # what is watched
    guards = np.zeros(max(mechanism.sizes["guards"], 1))
    mechanism.common["guards"](mechanism.block(0.0, q, y, anchors), parameters, guards)
    ends = accumulate([n_c, n_c, n_c, n_c, n_g, n_g, n_f, 2 * n_f], initial=0)
    parts = [guards[first:end] for first, end in pairwise([*ends, len(guards)])]
    slides, conditions = parts[6], parts[8][:n_g] if equations.machines else np.ones(n_g)
    both = [guard.direction == 0 for guard in equations.guards]  # the sign of their values tells nothing
    events = [np.where(both, np.abs(part), part) for part in parts[4:6]]
    # what acts while penalty contacts are closed and frictions slide
    penalties = [c for c, contact in enumerate(equations.contacts) if contact.force is not None]
    loaded = mechanism.acceleration_terms(0.0, q, y, parameters, anchors, penalties, np.sign(slides), lam)
    # impulses by what they wait for
    impulses = {}
    if equations.impulses:
        impulses = {(contact.name, when): np.zeros(layout.n_v) for contact in equations.contacts for when in range(3)}
    for impulse, vector in zip(equations.impulses, terms.impulses, strict=True):
        impulses[equations.contacts[impulse.contact].name, impulse.order] += vector
    return {
        "matrices": [terms.M, terms.B.T @ terms.B, terms.R @ terms.R.T],
        "vectors": [
            terms.f, loaded.f - terms.f, terms.B.T @ terms.rate, terms.B.T @ terms.bias, terms.B.T @ terms.h,
        ],
        "watched": [*parts[:4], *events, conditions, loaded.limits],
        "impulses": impulses,
        "stored": terms.captured,
    }  # fmt: skip


def _watched_places(equations: Equations, mirror: Mirror) -> list[NDArray[np.intp]]:
    """From which places the image takes what is watched: four of contacts, three of events, limits of frictions."""
    names = [contact.name for contact in equations.contacts]
    contacts = np.array([names.index(mirror.name(name)) for name in names], dtype=np.intp)
    events = [guard.name for guard in equations.guards]
    partners = np.array([events.index(mirror.name(name)) if mirror.name(name) in events else e
                         for e, name in enumerate(events)], dtype=np.intp)  # fmt: skip
    frictions: dict[str, list[int]] = {}
    for f, friction in enumerate(equations.frictions):
        frictions.setdefault(friction.name, []).append(f)
    limits = np.arange(len(equations.frictions))
    for name, places in frictions.items():
        others = frictions.get(mirror.name(name), [])
        if len(others) == len(places):
            limits[places] = others
    return [*[contacts] * 4, *[partners] * 3, limits]


def _resets(
    mechanism: Mechanism, mirror: Mirror, parameters: Vector, at: tuple[Vector, ...], image: tuple[Vector, ...]
) -> list[tuple[Vector, Vector]]:
    """The states after the resets of all events, of a state and of its image, as far as resets can be recorded."""
    guards = {guard.name: guard for guard in mechanism.equations.guards if guard.reset is not None}
    found = list[tuple[Vector, Vector]]()
    for name, guard in guards.items():
        mine, its = (_after(mechanism, each, parameters, *state)
                     for each, state in ((guard, at), (guards.get(mirror.name(name), guard), image)))  # fmt: skip
        if mine is not None and its is not None:
            n_v, (q, y) = mechanism.layout.n_v, mine
            found += [(mirror.of_q(q), its[0]), (mirror.of_v(y[:n_v]), its[1][:n_v]), (y[n_v:][mirror.z], its[1][n_v:])]
    return found


def _after(
    mechanism: Mechanism, guard: Guard, parameters: Vector, q: Vector, y: Vector, anchors: Vector
) -> tuple[Vector, Vector] | None:  # fmt: skip
    """(q, y) after the reset of an event; None where it cannot be recorded."""
    equations, memory = mechanism.equations, mechanism.equations.memory
    key = f"mirrored reset of {guard.name}"
    if key not in memory:
        memory[key] = _recorded(mechanism, guard)
    known: tuple[list[int], ScalarFunction] | None = memory[key]
    if known is None:
        return None
    places, function = known
    out, after = np.zeros(len(places)), np.concatenate([q, y])
    function(mechanism.block(0.0, q, y, anchors), parameters, out)
    after[places] = out
    return after[: equations.n_q], after[equations.n_q :]


def _recorded(mechanism: Mechanism, guard: Guard) -> tuple[list[int], ScalarFunction] | None:
    """Where in (q, y) an event sets values, and the program of these."""
    equations = mechanism.equations
    try:
        values = reset_expressions(equations, guard.reset, guard.name)
        places = [_place(equations, name) for name in values]
        with equations.tape.lock:
            return places, scalar_function(list(values.values()), mechanism.layout, "reset")
    except MbdError:
        return None


def _place(equations: Equations, name: str) -> int:
    """Where a coordinate, rate or state stands in (q, v, z), by every spelling that a reset may use."""
    n_q, n_v = equations.n_q, equations.n_v
    rates = rate_names(equations)
    known = {each: n_q + k for each, k in rates.items()}
    known |= {f"{each.removesuffix('.rate')}_rate": n_q + k for each, k in rates.items()}
    known |= {state.name: n_q + n_v + k for k, state in enumerate(equations.states)}
    return {**known, **{each.name: k for k, each in enumerate(equations.coordinates)}}[name]
