"""Numbers from equations: random inputs, evaluation by the plain interpreter, finite differences."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from mbd.equations.equations import Equations
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node

Point: TypeAlias = dict[tuple[str, int], float]
"""A number for every input of the tape: (kind, index)."""

Numbers: TypeAlias = "np.ndarray[Any, np.dtype[np.float64]]"


def inputs(equations: Equations, seed: int = 0, x: float = 0.0, spread: float = 1.0) -> Point:
    """A random value for every input; parameters at their values, every penalty switched on, no dry friction.

    x : size of the local increments; spread : of the coordinates
    """
    rng = np.random.default_rng(seed)
    sizes = {
        "q": equations.n_q, "v": equations.n_v, "a": equations.n_v, "z": equations.n_z, "s": equations.n_z,
        "lam": len(equations.rows), "anchor": equations.n_anchors,
    }  # fmt: skip
    found: Point = {("t", 0): 0.37, ("c", 0): 0.7, ("c", 1): 0.23}
    for kind, size in sizes.items():
        found |= {(kind, k): float(value) for k, value in enumerate(rng.uniform(-1, 1, size) * spread)}
    if not equations.configuration.is_vector:
        q = equations.configuration.normalise([found["q", k] for k in range(equations.n_q)])
        found |= {("q", k): float(value) for k, value in enumerate(q)}
    found |= {("x", k): float(value) for k, value in enumerate(rng.uniform(-1, 1, equations.n_v) * x)}
    found |= {("p", k): parameter.value for k, parameter in enumerate(equations.parameters)}
    found |= {("switch", k): 1.0 for k in range(len(equations.contacts))}
    found |= {("slip", k): 0.0 for k in range(len(equations.frictions))}
    found |= {("anchor", turn.anchor): 0.0 for turn in equations.turns}
    found |= {("lam", friction.row): 0.0 for friction in equations.frictions}
    return found


def at(nodes: Sequence[Node], given: Point) -> Numbers:
    """Values of the nodes."""
    asked: Mapping[Any, float] = given
    return np.array(evaluate(nodes, asked), dtype=float)


def moved(given: Point, step: float, along: Mapping[tuple[str, int], float]) -> Point:
    """The inputs shifted along a direction."""
    return given | {key: given[key] + step * rate for key, rate in along.items()}


def derivative(
    nodes: Sequence[Node], given: Point, along: Mapping[tuple[str, int], float], step: float = 1e-3
) -> Numbers:
    """d nodes along a direction of the inputs, by central differences of sixth order."""
    weights = {1: 0.75, 2: -0.15, 3: 1.0 / 60.0}
    terms = [
        w * (at(nodes, moved(given, k * step, along)) - at(nodes, moved(given, -k * step, along)))
        for k, w in weights.items()
    ]
    return np.asarray(sum(terms)) / step


def block(values: Numbers, *sizes: tuple[int, ...]) -> list[Numbers]:
    """A flat list of numbers parted into arrays of these shapes."""
    parts: list[Numbers] = []
    first = 0
    for shape in sizes:
        size = int(np.prod(shape))
        parts.append(values[first : first + size].reshape(shape))
        first += size
    assert first == len(values)
    return parts
