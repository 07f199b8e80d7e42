"""Which force, constraint, gap or guard is not a finite number at an instant."""

from collections.abc import Mapping, Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.equations.equations import Effect, Equations
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node

Key = Node | tuple[str, int]
Inputs = Mapping[Key, float]


def first_cause(
    equations: Equations, inputs: Inputs, places: Mapping[str, str] | None = None, when: str = ""
) -> str | None:
    """A sentence on the first that is not finite: what touches nowhere, forces, constraints; None if all are.

    Parameters
    ----------
    inputs : of the tape, by kind and index, as `tape_inputs` gives them
    places : the frame on which a force acts, by the force's name
    when : words behind 'is not finite', such as ' at the start'
    """
    if all(np.isfinite(value) for key, value in inputs.items() if isinstance(key, tuple) and key[0] == "q"):
        for number, contact in enumerate(equations.contacts):  # where nothing touches at one place no force has one
            if contact.undefined and not _finite([contact.gap, contact.gap_rate], inputs):
                return f"the gap of {contact.name!r} is not finite{when}{_hint(equations, number)}"
    for effect in equations.effects:
        if not _finite(list(effect.generalized()), inputs):
            force = (
                f"{effect.name!r} on {places[effect.name]}" if places and places.get(effect.name) else repr(effect.name)
            )
            moved = _moved_by(equations, effect, inputs)
            return f"the force of {force} is not finite{when}{moved}; check its roots, logarithms, divisions"
    for row in equations.rows:
        if not _finite([row.value, row.rate], inputs):
            return f"the constraint {row.title} is not finite{when}{_hint(equations, row.contact)}"
    for number, contact in enumerate(equations.contacts):
        if not _finite([contact.gap, contact.gap_rate], inputs):
            return f"the gap of {contact.name!r} is not finite{when}{_hint(equations, number)}"
    for guard in equations.guards:
        if not _finite([guard.value, guard.rate], inputs):
            return f"the guard of the event {guard.name!r} is not finite{when}"
    return None


def tape_inputs(mechanism: Mechanism, block: Vector, parameters: Vector) -> dict[Key, float]:
    """Every input of the tape at the values in a block."""
    layout = mechanism.layout
    sizes = {
        "t": 1, "c": 2, "q": layout.n_q, "x": layout.n_v, "v": layout.n_v, "z": layout.n_z, "a": layout.n_v,
        "s": layout.n_z, "lam": layout.n_rows, "anchor": layout.n_anchors, "switch": layout.n_contacts,
    }  # fmt: skip
    inputs: dict[Key, float] = {
        (kind, k): float(block[layout.place(kind, k)]) for kind, size in sizes.items() for k in range(size)
    }
    return inputs | {("p", k): float(parameters[k]) for k in range(layout.n_parameters)}


def _hint(equations: Equations, contact: int) -> str:
    """What that means of a contact, where its measure says so."""
    undefined = equations.contacts[contact].undefined if contact >= 0 else ""
    return f": {undefined}" if undefined else ""


def _moved_by(equations: Equations, effect: Effect, inputs: Inputs) -> str:
    """The coordinates that the force acts on."""
    forces = evaluate(list(effect.generalized()), inputs)
    names = [name.removesuffix(".rate") for name in equations.velocity_names]
    hit = [name for name, force in zip(names, forces, strict=False) if not np.isfinite(force)]
    return f" (it acts on {', '.join(map(repr, hit))})" if hit else ""


def _finite(nodes: Sequence[Node], inputs: Inputs) -> bool:
    return bool(np.isfinite(evaluate(nodes, inputs)).all())
