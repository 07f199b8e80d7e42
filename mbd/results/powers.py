"""What changes T + V while a mechanism moves smoothly, as powers on the tape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mbd.dataclass import dataclass
from mbd.equations.cones import NO_SLIP, slip_square
from mbd.equations.equations import Effect, Equations
from mbd.tape.derivatives import gradient, jvp, live, substitute
from mbd.tape.node import Node, Scalar

UNKNOWN_RATE = frozenset({"a", "s", "lam"})
"""Inputs whose rates the stored rows do not hold."""


@dataclass(frozen=True)
class Power:
    """Power that one cause gives to the mechanism [W], and its rate [W/s] where that follows from the rows.

    lost : what a penalty contact takes without giving it back; None for others, and where its law does not tell
    """

    name: str
    kind: str
    value: Node
    rate: Node | None
    lost: Lost | None = None


@dataclass(frozen=True)
class Lost:
    """What a penalty contact takes without giving it back.

    value, rate : power [W] and its rate; elastic : energy that it can give back while it acts [J]; contact : its number
    """

    value: Node
    rate: Node | None
    elastic: Node
    contact: int


def powers(equations: Equations) -> list[Power]:
    """Everything that changes T + V, apart from jumps.

    Effects give their own power; a row with
    h_t ≠ 0 does the work ``λ h_t``; with ``dT/dt = Q·v − ∂T/∂t + d/dt(2T − v·∂T/∂v)`` and
    ``dV/dt = v·∂V/∂q + ∂V/∂t + ∂V/∂z·ż`` a kinetic energy or a potential that depends on time adds the rest; what a
    potential gains as first-order states change belongs to the effect that stores it.
    """
    tape = equations.tape
    found: dict[tuple[str, str], Node] = {}
    elastic: dict[tuple[str, str], tuple[Node, Effect]] = {}
    dry = {f"{friction.name} friction": k for k, friction in enumerate(equations.frictions)}

    def add(name: str, kind: str, power: Node) -> None:
        found[name, kind] = found.get((name, kind), tape.zero) + power

    states: dict[Node, Scalar] = dict(
        zip((tape.input("z", k) for k in range(equations.n_z)), _flow(equations), strict=True)
    )
    for effect in equations.effects:
        stored = tape.zero if effect.potential is None else jvp([effect.potential], states)[0]
        if not stored.is_zero:
            add(effect.name, effect.column, stored)
        if effect.power is not None:
            switch = tape.one if effect.contact < 0 else tape.input("switch", effect.contact)
            if effect.column == "friction" and effect.name in dry:  # what sticks does no work
                switch = _slides(equations, dry[effect.name])
            add(effect.name, effect.column, switch * effect.power)
            if effect.elastic is not None:
                elastic[effect.name, effect.column] = switch * _change(equations, effect.elastic, states), effect
    still = {tape.input("v", k): 0.0 for k in range(equations.n_v)}
    for number, row in enumerate(equations.rows):
        # friction acts along the direction of now, which turns with its surface; its row keeps that of the anchor
        rate = row.rate if row.friction < 0 else equations.frictions[row.friction].rate
        speed = substitute([rate], still)[0]
        if not speed.is_zero:
            add(row.owner, "constraint", tape.input("lam", number) * speed)
    clock: dict[Node, Scalar] = {tape.input("t"): 1.0}
    for number, contact in enumerate(equations.contacts):
        speed = jvp([contact.gap], clock)[0]
        if contact.force is not None and not speed.is_zero:
            work = tape.input("switch", number) * contact.force * speed
            add(contact.name, "penalty", work)
            add(f"surface of {contact.name}", "constraint", -work)
    for name, power in (
        ("moving coordinates", -jvp([equations.kinetic], clock)[0]),
        ("changing potential", jvp([equations.potential], clock)[0]),
    ):
        if not power.is_zero:
            add(name, "constraint", power)
    rates = _rates(equations, list(found.values()))
    lost = [found[key] + stored for key, (stored, _) in elastic.items()]
    losses = {
        key: Lost(value, rate, effect.elastic, effect.contact)
        for (key, (_, effect)), value, rate in zip(elastic.items(), lost, _rates(equations, lost), strict=True)
        if effect.elastic is not None
    }
    return [Power(*key, power, rate, losses.get(key)) for (key, power), rate in zip(found.items(), rates, strict=True)]


def moving_share(equations: Equations) -> Node:
    """``2T − v·∂T/∂v`` [J], zero unless coordinates move with time: its change is work of what moves them."""
    tape = equations.tape
    v = [tape.input("v", k) for k in range(equations.n_v)]
    total = 2.0 * equations.kinetic
    for rate, momentum in zip(v, gradient(equations.kinetic, v), strict=True):
        total = total - rate * momentum
    return total


def _slides(equations: Equations, k: int) -> Node:
    """1 while friction k slides, 0 while it sticks or is off."""
    own = equations.tape.input("slip", k)
    if not equations.frictions[k].group:
        return abs(own)
    square = slip_square(equations, k)
    return square / (square + NO_SLIP)


def _flow(equations: Equations) -> list[Node]:
    """ż of every first-order state as a function of t, q ⊕ x, v and z."""
    tape = equations.tape
    still = {tape.input("s", k): 0.0 for k in range(equations.n_z)}
    return [-rest for rest in substitute(list(equations.balance[equations.n_v :]), still)]


def _change(equations: Equations, value: Node, states: Mapping[Node, Scalar]) -> Node:
    """d/dt of a function of t, q ⊕ x and z."""
    tape = equations.tape
    seeds: dict[Node, Scalar] = {tape.input("t"): 1.0, **states}
    seeds |= {tape.input("x", k): tape.input("v", k) for k in range(equations.n_v)}
    return jvp([value], seeds)[0]


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
