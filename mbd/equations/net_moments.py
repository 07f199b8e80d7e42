"""Net moments of joints: all that acts along a joint's coordinate but gravity and the ground."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from mbd.tape.derivatives import gradient
from mbd.tape.node import Node

__all__ = ["net_moments", "stored_moments"]

STORED = "net moment of "
"""Before the name of a coordinate: the expression of its moment among those that the file of a run has."""


def net_moments(equations: Any, ground: Collection[str]) -> Mapping[str, Node]:
    """``τ_k = −Σ f_k − Σ λ ∂h/∂q_k`` by coordinate, as nodes of the tape.

    The sums are over losses, springs, motors, stops and locks.

    ground : names of contacts of the ground and of forces that act from outside, which are left out

    Of the expressions that a file has, those that were stored in it.
    """
    if not hasattr(equations, "effects"):
        names = equations.output_names()
        return {name.removeprefix(STORED): equations.output(name) for name in names if name.startswith(STORED)}
    tape = equations.tape
    with tape.lock:
        names = [name for name, _ in equations.configuration.freedoms]
        total = dict.fromkeys(names, tape.zero)
        dry = {f"{friction.name} friction" for friction in equations.frictions}
        for effect in equations.effects:
            of_ground = effect.contact >= 0 and equations.contacts[effect.contact].name in ground
            of_ground = of_ground or effect.name in ground
            if effect.kind == "gravity" or of_ground or effect.name in dry:
                continue
            switch = tape.one if effect.contact < 0 else tape.input("switch", effect.contact)
            for name, force in zip(names, effect.generalized(), strict=False):  # first-order states stand behind
                total[name] = total[name] - switch * force
        x, v = ([tape.input(kind, k) for k in range(len(names))] for kind in ("x", "v"))
        for number, row in enumerate(equations.rows):
            if row.contact >= 0 and equations.contacts[row.contact].name in ground:
                continue
            slopes = gradient(row.rate, v) if row.is_velocity else gradient(row.value, x)
            for name, slope in zip(names, slopes, strict=True):
                if not slope.is_zero:
                    total[name] = total[name] - tape.input("lam", number) * slope
    return total


def stored_moments(equations: Any, ground: Collection[str]) -> dict[str, Node]:
    """The moments by the names under which a file has them."""
    return {STORED + name: node for name, node in net_moments(equations, ground).items()}
