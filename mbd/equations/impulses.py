"""Impulses of the user's as generalized impulses."""

from collections.abc import Iterator, Sequence

from mbd.constraints.base import Constraint
from mbd.constraints.impulse import ORDERS, Impulse
from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Work
from mbd.equations.equations import StrikeImpulse
from mbd.equations.gathered import Gathered
from mbd.errors import ModelError, nearest
from mbd.tape.derivatives import live


def impulses_of(
    scope: DerivationScope, dynamics: Generalized, words: Sequence[Impulse], contacts: Sequence[Constraint],
    gathered: Gathered,
) -> Iterator[StrikeImpulse]:  # fmt: skip
    """w P of each; names of contacts that there are not, and sizes that no instant tells, are `gathered`."""
    known = {contact.name: number for number, contact in enumerate(contacts)}
    for word in words:
        with gathered.catch(word.name):
            if word.on not in known:
                raise ModelError(f"Impulse '{word.name}': " + nearest(word.on, known, "contact"))
            if contacts[known[word.on]].kind == "penalty":
                raise ModelError(
                    f"Impulse '{word.name}' waits for '{word.on}', a penalty contact, whose impacts take time; name a "
                    "Unilateral, or apply a force"
                )
            velocity, size = (scope.tape.lift(each) for each in word.pair(scope))
            vector = tuple(scope.real(each) for each in dynamics.generalized(Work([], [], [velocity], [size])))
            if any(node.op == "input" and node.data[0] in ("a", "s", "lam") for node in live(vector)):
                raise ModelError(
                    f"size of Impulse '{word.name}' depends on accelerations or forces of contacts, which jump at the "
                    "instant; let it depend on positions and velocities"
                )
            if all(entry.is_zero for entry in vector) and not size.is_zero:
                raise ModelError(f"Impulse '{word.name}' acts on nothing that moves; name a point of a body")
            yield StrikeImpulse(word.name, known[word.on], ORDERS.index(word.order), vector)
