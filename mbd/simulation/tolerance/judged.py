"""Which results a tolerance holds for: every coordinate, or those that `tol_of` names."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.equations.equations import Equations
from mbd.errors import ModelError, UnknownNameError
from mbd.results.columns import ModelColumns
from mbd.results.record import Record
from mbd.tape.derivatives import live

MOVING = frozenset({"q", "x", "v", "z", "a", "s", "lam"})
"""Inputs that the motion changes."""


def judged(equations: Equations, wanted: Any) -> tuple[str, ...]:
    """The scalars behind the names of `tol_of`; () for None, which stands for every coordinate.

    Raises
    ------
    ModelError, UnknownNameError
        for what is no list of names, for unknown names, each with the nearest, and for what has no error.
    """
    if wanted is None:
        return ()
    if isinstance(wanted, str) or not isinstance(wanted, Sequence) or not all(isinstance(n, str) for n in wanted):
        example = f"[{wanted!r}]" if isinstance(wanted, str) else "['crank.angle', 'rod.tension']"
        raise ModelError([f"tol_of must be a list of results such as {example}, not {wanted!r}"])
    if not wanted:
        raise ModelError(["tol_of is empty; name the results that tol holds for, or leave it out for every coordinate"])
    columns = ModelColumns(_nothing(equations), equations)
    found: dict[str, list[str]] = {}
    unknown = []
    for name in wanted:
        try:
            found[name] = [part for part in columns.components(name) if _moves(columns, part)]
        except UnknownNameError as error:
            unknown.append(f"tol_of: {error}")
    if unknown:
        raise UnknownNameError(unknown)
    still = [name for name, parts in found.items() if not parts]
    if still:
        raise ModelError([f"tol_of: {name!r} is the same whatever the motion and has no error" for name in still])
    return tuple(dict.fromkeys(part for parts in found.values() for part in parts))


def _moves(columns: ModelColumns, name: str) -> bool:
    return any(node.op == "input" and node.data[0] in MOVING for node in live([columns.node(name)]))


def _nothing(equations: Equations) -> Record:
    """A run without rows, of which names can be asked."""
    q, v, z = (np.zeros((0, size)) for size in (equations.n_q, equations.n_v, equations.n_z))
    lam, closed = np.zeros((0, len(equations.rows))), np.zeros((0, len(equations.contacts)), dtype=np.uint8)
    return Record(equations, np.zeros(0), (), np.zeros(0), q, v, z, v, z, lam, closed)
