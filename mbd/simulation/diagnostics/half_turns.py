"""Springs about all axes that were turned beyond half a turn, where their torque jumps to the other side."""

from __future__ import annotations

import numpy as np

from mbd.results.columns import ModelColumns

__all__ = ["half_turns"]


def half_turns(columns: ModelColumns) -> list[str]:
    """A doubt on each spring of a rotation vector (`Spherical`, `Bushing`) that came beyond half a turn.

    ``V = ½ k θ²`` has a kink at θ = π, where there are two shortest ways back; a step across it loses its accuracy.
    """
    found = []
    if len(columns.record.time) < 2:
        return []
    for spring, names in _rotation_vectors(columns):
        vectors = np.column_stack(columns.at_rows(names))
        jumped = np.linalg.norm(np.diff(vectors, axis=0), axis=1) > np.pi
        if jumped.any():
            time = columns.record.time[int(np.argmax(jumped)) + 1]
            found.append(
                f"{spring!r} was turned beyond half a turn at t = {time:.6g} s, where its torque jumps from "
                "one way back to the other within a step: energy is not kept there; give it a stop like mbd.cone, "
                "or a law that is smooth there, such as an mbd.Potential of the parts of the quaternion"
            )
    return found


def _rotation_vectors(columns: ModelColumns) -> list[tuple[str, list[str]]]:
    """Springs with the names of the parts of their rotation vectors, which are looked for once."""
    memory = columns.equations.memory
    if "rotation vectors" not in memory:
        stems = [
            (effect.name, stem) for effect in columns.equations.effects if effect.potential is not None
            for stem in dict.fromkeys((effect.name, effect.name.removesuffix(" spring")))
        ]  # fmt: skip
        named = [(spring, [f"{stem}.rotation_vector.{axis}" for axis in "xyz"]) for spring, stem in stems]
        memory["rotation vectors"] = [pair for pair in named if all(map(columns.knows, pair[1]))]
    found: list[tuple[str, list[str]]] = memory["rotation vectors"]
    return found
