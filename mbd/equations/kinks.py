"""Where rates of first-order states and forces that follow them have kinks: friction reverses, bristles slide."""

from collections.abc import Iterable

from mbd.equations.derivation_scope import DerivationScope
from mbd.equations.effects import Cause
from mbd.equations.equations import Guard
from mbd.equations.laws import Laws
from mbd.tape.derivatives import live
from mbd.tape.node import Node, Scalar

STATES = frozenset({"z"})
MOVES = frozenset({"x", "v", "z"})
"""Inputs that follow the motion."""
HIDDEN = frozenset({"a", "s", "lam", "switch"})
"""Inputs that are not known where guards are looked at."""


def kinks(scope: DerivationScope, causes: Iterable[Cause], laws: Laws) -> list[Guard]:
    """A guard that nothing tells of for each kink of a rate of a loss or a law, or of a contact that follows a state.

    Kinks are where two sides of a ``min``, a ``max`` or a comparison meet, or the argument of an ``abs`` or ``sign``
    vanishes, which depend on a state; of rates also the latter on positions and velocities. Steps end there, so that
    schemes keep their order. Forces, muscles among them, have none: their limits are hardly ever met.
    """
    names = {node.index: coordinate.name for coordinate, node in scope.states}
    rates = [*(pair for cause in causes if cause.kind == "loss" for pair in cause.rates), *laws.rates]
    owned: list[tuple[str, Scalar, bool]] = [(names[state.index], rate, True) for state, rate in rates]
    if scope.states:
        owned += [(contact.name, contact.force, False) for contact in laws.contacts if contact.force is not None]
    found: dict[int, Guard] = {}
    for name, expression, is_rate in owned:
        for node in live([scope.tape.lift(scope.real(expression))]):
            value = _meeting(node)
            if value is None or value.index in found:
                continue
            kinds = {each.data[0] for each in live([value]) if each.op == "input"}
            moves = MOVES if is_rate and node.op in ("abs", "sign") else STATES
            if kinds & moves and not kinds & HIDDEN:
                found[value.index] = Guard(f"{name} kink {len(found) + 1}", value, scope.change(value), is_kink=True)
    return list(found.values())


def _meeting(node: Node) -> Node | None:
    """What is zero where a node has a kink; None of one that has none."""
    if node.op in ("abs", "sign"):
        return node.args[0]
    return node.args[0] - node.args[1] if node.op in ("min", "max", "lt", "le") else None
