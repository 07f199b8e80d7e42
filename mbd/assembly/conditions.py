"""Named values that are no coordinates: the angle of a cut joint, the place of a foot, held as rows at the start."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.errors import UnknownNameError
from mbd.tape.derivatives import gradient, live
from mbd.tape.node import Node

PLACES = frozenset({"t", "q", "x", "p"})
"""Kinds of inputs that a position may depend on; a rate depends on v as well."""


@dataclass(frozen=True)
class Condition:
    """``value(q) = target`` or ``value(q, v) = target``, with the gradient that Newton's method needs."""

    name: str
    target: float
    periodic: bool
    function: Any

    def at(self, block: Vector, parameters: Vector) -> tuple[float, Vector]:
        """(residual, gradient) at a state; angles read off a rotation compare modulo a turn."""
        out = np.zeros(self.function.size)
        self.function(block, parameters, out)
        residual = float(out[0]) - self.target
        if self.periodic:
            residual = math.atan2(math.sin(residual), math.cos(residual))
        return residual, out[1:]


def _result(equations: Equations, name: str) -> Node | None:
    """A named result, None if there is none of that name."""
    try:
        return equations.output(name)
    except (UnknownNameError, KeyError):
        return None


def conditions(mechanism: Mechanism, values: Mapping[str, float], rates: bool) -> tuple[list[Condition], list[str]]:
    """The conditions behind names of results, and the names that are no such result.

    Parameters
    ----------
    rates : whether the names are rates (linear in v) instead of positions
    """
    equations, found, wrong = mechanism.equations, [], []
    kind, allowed = ("v", PLACES | {"v"}) if rates else ("x", PLACES)
    turns = {turn.name: turn.anchor for turn in equations.turns if turn.name}
    counts = {equations.tape.input("anchor", anchor).index for anchor in turns.values()}
    wrapped = {turn.name for turn in equations.wrapped}
    inputs = [equations.tape.input(kind, k) for k in range(equations.n_v)]
    for name, target in values.items():
        node = _result(equations, f"{name}.rate") if rates else None  # 'pin.angle' of a cut joint means its rate
        node = _result(equations, name) if node is None else node
        if node is None:
            wrong.append(name)
            continue
        kinds = {part.data[0] for part in live([node]) if part.op == "input" and part.index not in counts}
        if not kinds <= allowed or (rates and kinds & {"q", "x"} and "v" not in kinds):  # a place is no rate
            wrong.append(name)
            continue

        def made(node: Node = node) -> ScalarFunction:
            return scalar_function([node, *gradient(node, inputs)], mechanism.layout, "condition")

        function = mechanism.kept((Condition, kind, node.index), made)
        found.append(Condition(name, float(target), not rates and name in wrapped, function))  # modulo a turn
    return found, wrong
