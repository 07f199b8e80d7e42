"""Numbers from equations: random inputs, evaluation by the plain interpreter, finite differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from mbd.equations.equations import Equations
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node

Point: TypeAlias = dict[tuple[str, int], float]
"""A number for every input of the tape: (kind, index)."""

Numbers: TypeAlias = "np.ndarray[Any, np.dtype[np.float64]]"

__all__ = ["Point", "at", "block", "derivative", "inputs", "moved", "placed", "solved"]


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


def solved(equations: Equations, given: Point, rows: Sequence[int] | None = None) -> Point:
    """The inputs with the accelerations and multipliers that satisfy the balance and ḧ = 0 of some rows (all)."""
    from mbd.equations.programs import accelerations

    n, R = equations.n_v + equations.n_z, len(equations.rows)
    rows = list(range(R)) if rows is None else list(rows)
    sizes = ((n, n), (n,), (n, R), (R, n), (R,), (R,), (R,))
    values = at(accelerations(equations), given)
    M, f, Rm, B, _, _, bias = block(values[: sum(int(np.prod(s)) for s in sizes)], *sizes)
    K = np.block([[M, Rm[:, rows]], [B[rows], np.zeros((len(rows), len(rows)))]])
    unknowns = np.linalg.lstsq(K, -np.concatenate([f, bias[rows]]), rcond=1e-12)[0]
    found: Point = {("a", k): value for k, value in enumerate(unknowns[: equations.n_v])}
    found |= {("s", k): value for k, value in enumerate(unknowns[equations.n_v : n])}
    found |= {("lam", k): 0.0 for k in range(R)}
    return given | found | {("lam", k): value for k, value in zip(rows, unknowns[n:], strict=True)}


def placed(equations: Equations, given: Point) -> Point:
    """The inputs moved by Newton's method until all rows hold, with velocities made consistent."""
    from mbd.equations.programs import constraint_jacobian

    rows = equations.rows
    B_nodes = [entry for line in constraint_jacobian(equations, range(len(rows))) for entry in line]
    n = equations.n_v
    for _ in range(30):
        h = at([row.value for row in rows], given)
        B = at(B_nodes, given).reshape(len(rows), n)
        if np.abs(h).max() < 1e-13:
            break
        step = np.linalg.lstsq(B, -h, rcond=1e-10)[0]
        given = given | {("q", k): given["q", k] + step[k] for k in range(n)}
    rates = at([row.rate for row in rows], given)
    step = np.linalg.lstsq(B, -rates, rcond=1e-10)[0]
    return given | {("v", k): given["v", k] + step[k] for k in range(n)}
