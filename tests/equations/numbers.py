"""Numbers from equations, for tests: those of `mbd.testing.numbers`, and points that satisfy rows and balance."""

from collections.abc import Sequence

import numpy as np

from mbd.equations.equations import Equations
from mbd.equations.programs import accelerations, constraint_jacobian
from mbd.testing.numbers import Point, at, block, derivative, inputs, moved

__all__ = ["at", "block", "derivative", "inputs", "moved", "placed", "solved"]


def solved(equations: Equations, given: Point, rows: Sequence[int] | None = None) -> Point:
    """The inputs with the accelerations and multipliers that satisfy the balance and ḧ = 0 of some rows (all)."""
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
