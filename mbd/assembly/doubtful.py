"""What is possible but was hardly meant: degrees for radians, millimetres for metres, a hinge twice."""

from collections.abc import Mapping
from typing import Any

from mbd.compile.mechanism import Mechanism
from mbd.equations.equations import Equations
from mbd.tape.derivatives import gradient, live, substitute
from mbd.tape.node import Node
from mbd.topology.doubts import doubts, in_radians


def doubtful(model: Any, mechanism: Mechanism, position: Mapping[str, float]) -> list[str]:
    """Sentences on values of a start and of the model that look like mistakes; those of a model are found once."""
    equations = mechanism.equations
    jumps = mechanism.kept(_reversals, lambda: _reversals(equations))
    return degrees(equations, position) + jumps + doubts_of(model, mechanism)


def doubts_of(model: Any, mechanism: Mechanism) -> list[str]:
    """Sentences on what looks like a mistake in a model, which follow from the words that its mechanism is made of."""
    return mechanism.kept(doubts, lambda: doubts(model))


def _reversals(equations: Equations) -> list[str]:
    """Forces of users' functions that jump as a velocity changes its sign, between which steps chatter for ever."""
    found = []
    for effect in equations.effects:
        if effect.kind not in ("applied", "dissipative", "loss", "potential") or effect.power is None:
            continue
        if any(_switches(node) and _jumps(effect.power, node) for node in live([effect.power])):
            found.append(
                f"the force of {effect.name!r} jumps with the sign of a velocity, so that it never comes to rest and "
                "steps become very short; dry friction that sticks is loss=mbd.Coulomb(…) of a joint or friction=… "
                "of a contact, and mbd.tanh(v / 0.01) in the place of the sign is smooth"
            )
    return found


def _switches(node: Node) -> bool:
    """Whether an expression is the sign of a velocity, or one of two numbers by it."""
    if node.op == "sign":
        return _is_fast(node.args[0])
    if node.op != "where" or node.args[0].op not in ("lt", "le"):
        return False
    condition, yes, no = node.args
    numbers = yes.op == "const" and no.op == "const" and yes.data * no.data < 0.0
    return numbers and any(map(_is_fast, condition.args))


def _jumps(power: Node, switch: Node) -> bool:
    """Whether a force differs on both sides of a switch where velocities vanish, as that of −v² sign(v) does not."""
    speeds = [node for node in live([power]) if node.op == "input" and node.data[0] == "v"]
    ends = (1.0, -1.0) if switch.op == "sign" else switch.args[1:]
    one, other = (substitute([power], {switch: end})[0] for end in ends)
    forces = gradient(one - other, speeds)
    return not all(force.is_zero for force in substitute(forces, dict.fromkeys(speeds, 0.0)))


def _is_fast(node: Node) -> bool:
    """Whether a velocity is in an expression."""
    return any(each.op == "input" and each.data[0] == "v" for each in live([node]))


def degrees(equations: Equations, position: Mapping[str, float]) -> list[str]:
    """Sentences on angles of a start that may be in degrees."""
    angles = {each.name for each in equations.coordinates if each.unit == "rad"}
    given = {name: value for name, value in position.items() if name in angles}
    return [sentence for name, value in given.items() for sentence in in_radians(f"position: {name!r}", value)]
