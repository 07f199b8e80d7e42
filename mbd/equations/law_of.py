"""The law of a constraint as its kind promises it, or what is missing: nothing that a word says is left aside."""

from collections.abc import Iterator, Sequence
from dataclasses import field

from mbd.bodies.promises import called, title_of
from mbd.constraints.base import Constraint
from mbd.constraints.law import Closing, Law
from mbd.constraints.machine import state_of
from mbd.dataclass import dataclass
from mbd.equations.derivation_scope import DerivationScope
from mbd.equations.states import has_pairs
from mbd.errors import ModelError, nearest
from mbd.tape.derivatives import gradient, live
from mbd.tape.node import Node, Scalar


@dataclass
class Holding:
    """What a contact stores as it closes: `captured` on the tape, in the anchors that stand for it."""

    scope: DerivationScope
    first: int
    captured: list[Node] = field(default_factory=list)

    def __call__(self, values: Sequence[Scalar]) -> list[Node]:
        begin = self.first + len(self.captured)
        self.captured += [self.scope.real(value) for value in values]
        return [self.scope.tape.input("anchor", begin + k) for k in range(len(values))]

    @property
    def anchors(self) -> tuple[int, ...]:
        """Numbers of what it stores."""
        return tuple(range(self.first, self.first + len(self.captured)))


def law_of(word: Constraint, holding: Holding, contacts: Sequence[Constraint]) -> Law:
    """What ``word.act`` returns.

    Raises
    ------
    ModelError
        where that is not what its kind promises, each fault by name.
    """
    title = f"{title_of(word)} of kind '{word.kind}'"
    law = called(word, "act", "act(scope, hold)", holding.scope, holding)
    if not isinstance(law, Law):
        raise ModelError([f"{title}: act(scope, hold) must return an mbd.constraints.Law, got {law!r}"])
    faults = list(_faults(word, law, holding))
    known = {contact.name: contact for contact in contacts}
    at = law.contact
    others = [] if at is None else [*(rule.other for rule in at.releases), at.only_while]
    for other in (*others, law.while_closed):
        by_state = other is not law.while_closed and isinstance(other, str) and state_of(other, holding.scope.modes)
        if isinstance(other, str) and other not in known and not by_state:
            faults.append(nearest(other, known, "contact"))
    if at is not None and at.only_while == word.name:
        faults.append(f"only_while='{word.name}' names itself; name another contact")
    if faults:
        raise ModelError([f"{title}: {fault}" for fault in faults])
    return law


def _faults(word: Constraint, law: Law, holding: Holding) -> Iterator[str]:
    """What its parts lack for its kind, or say beyond it."""
    by_force, closes = word.kind == "penalty", word.kind in ("unilateral", "penalty")
    if closes != (law.contact is not None):
        yield f"it {'needs' if closes else 'acts at all times and takes no'} Law(contact=Closing(gap))"
    if bool(law.rows) == by_force:
        yield "it acts by a force: give push=, not rows" if by_force else "it needs Law(rows=[…])"
    if (law.push is None) == by_force or (law.drags and not by_force):
        yield "push= and drags= are the forces of laws of kind 'penalty', which need push="
    if law.rubbing is not None and (by_force or not closes):
        yield "rubbing= is the smooth friction of contacts by rows; of laws of kind 'penalty' give drags="
    if holding.captured and not closes:
        yield "it never closes, so that hold() has no instant; only laws with a contact hold values"
    if not has_pairs(law.rates):
        yield f"rates={law.rates!r} must be pairs (state, its rate), such as rates=((z, speed - z / lag),)"
    if law.rates_while_open is not True and not by_force:
        yield "rates_while_open= is for force laws; the states of other laws follow their rates at all times"
    if not isinstance(law.rates_while_open, bool) and len(law.rates_while_open) != len(law.rates):
        yield f"rates_while_open= has {len(law.rates_while_open)} rates for {len(law.rates)} states; give one for each"
    if law.while_closed is not None and (closes or any(row.limit is not None for row in law.rows)):
        yield "while_closed= is for rows that act as long as another contact is closed, and have no limit"
    if law.contact is not None:
        yield from _closing_faults(law, law.contact, by_force, holding.scope)
    for drag in law.drags:
        slopes = gradient(holding.scope.real(drag.velocity), holding.scope.inputs.v)
        if (all(slope.is_zero for slope in slopes) and not drag.may_fold) or _has_velocity(slopes):
            yield f"the velocity of its {drag.part} is not linear in velocities; give a sum of rates times functions"


def _closing_faults(law: Law, at: Closing, by_force: bool, scope: DerivationScope) -> Iterator[str]:
    rules = ("gap", "pull") if by_force else ("pull", "when")
    if at.opens_on not in rules:
        yield f"opens_on is {' or '.join(map(repr, rules))}, got {at.opens_on!r}"
    if by_force and (at.releases or at.restitution):
        yield "releases and restitution serve contacts by rows; leave them out"
    if not at.restitution >= 0.0:
        yield f"restitution {at.restitution:g} is negative"
    if by_force and _has_velocity(gradient(scope.real(at.gap), scope.inputs.v)):
        yield "its gap is not linear in velocities"
    if any(node.op == "input" and node.data[0] == "z" for node in live([scope.real(at.gap)])):
        yield "its gap depends on states; let the force depend on them, and the gap on the posture"
    if law.rows:
        first = law.rows[0]
        watched = scope.tape.lift(first.value) is scope.tape.lift(at.gap)
        if not watched or first.part != "normal" or first.limit is not None:
            yield "its first row is Equation(gap, 'normal'), of the gap that Closing watches and without a limit"
        if first.level != "position":
            yield "the first row of a contact holds positions"


def _has_velocity(nodes: Sequence[Node]) -> bool:
    return any(node.op == "input" and node.data[0] == "v" for node in live(nodes))
