"""What changes T + V while a mechanism moves smoothly, as powers on the tape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mbd.tape.derivatives import gradient, jvp, live, substitute

if TYPE_CHECKING:
    from mbd.equations.equations import Equations
    from mbd.tape.node import Node, Scalar

__all__ = ["Power", "moving_share", "powers"]

UNKNOWN_RATE = frozenset({"a", "s", "lam"})
"""Inputs whose rates the stored rows do not hold."""


@dataclass(frozen=True)
class Power:
    """Power that one cause gives to the mechanism [W], and its rate [W/s] where that follows from the rows."""

    name: str
    kind: str
    value: Node
    rate: Node | None


def powers(equations: Equations) -> list[Power]:
    """Everything that changes T + V, apart from jumps.

    Effects give their own power; a row with h_t ≠ 0 does the work ``λ h_t``; with
    ``dT/dt = Q·v − ∂T/∂t + d/dt(2T − v·∂T/∂v)`` and ``dV/dt = v·∂V/∂q + ∂V/∂t + ∂V/∂z·ż`` a kinetic energy or a
    potential that depends on time or on first-order states adds the rest.
    """
    tape = equations.tape
    found: dict[tuple[str, str], Node] = {}

    def add(name: str, kind: str, power: Node) -> None:
        found[name, kind] = found.get((name, kind), tape.zero) + power

    for effect in equations.effects:
        if effect.power is not None:
            switch = tape.one if effect.contact < 0 else tape.input("switch", effect.contact)
            add(effect.name, effect.column, switch * effect.power)
    still = {tape.input("v", k): 0.0 for k in range(equations.n_v)}
    for number, row in enumerate(equations.rows):
        speed = substitute([row.rate], still)[0]
        if not speed.is_zero:
            add(row.owner, "constraint", tape.input("lam", number) * speed)
    clock: dict[Node, Scalar] = {tape.input("t"): 1.0}
    for number, contact in enumerate(equations.contacts):
        speed = jvp([contact.gap], clock)[0]
        if contact.force is not None and not speed.is_zero:
            work = tape.input("switch", number) * contact.force * speed
            add(contact.name, "penalty", work)
            add(f"surface of {contact.name}", "constraint", -work)
    states: dict[Node, Scalar] = {tape.input("z", k): tape.input("s", k) for k in range(equations.n_z)}
    for name, power in (
        ("moving coordinates", -jvp([equations.kinetic], clock)[0]),
        ("changing potential", jvp([equations.potential], clock | states)[0]),
    ):
        if not power.is_zero:
            add(name, "constraint", power)
    rates = _rates(equations, list(found.values()))
    return [Power(*key, power, rate) for (key, power), rate in zip(found.items(), rates, strict=True)]


def moving_share(equations: Equations) -> Node:
    """``2T − v·∂T/∂v`` [J], zero unless coordinates move with time: its change is work of what moves them."""
    tape = equations.tape
    v = [tape.input("v", k) for k in range(equations.n_v)]
    total = 2.0 * equations.kinetic
    for rate, momentum in zip(v, gradient(equations.kinetic, v), strict=True):
        total = total - rate * momentum
    return total


def _rates(equations: Equations, nodes: Sequence[Node]) -> list[Node | None]:
    """d/dt of functions of t, q ⊕ x, v and z; None for those of multipliers, accelerations or ż."""
    tape = equations.tape
    known = [not {node.data[0] for node in live([power]) if node.op == "input"} & UNKNOWN_RATE for power in nodes]
    seeds: dict[Node, Scalar] = {tape.input("t"): 1.0}
    for k in range(equations.n_v):
        seeds |= {tape.input("x", k): tape.input("v", k), tape.input("v", k): tape.input("a", k)}
    seeds |= {tape.input("z", k): tape.input("s", k) for k in range(equations.n_z)}
    rates = iter(jvp([power for power, is_known in zip(nodes, known, strict=True) if is_known], seeds))
    return [next(rates) if is_known else None for is_known in known]
