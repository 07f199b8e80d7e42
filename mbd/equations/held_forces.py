"""What laws read of the forces that hold a mechanism: of constraints, contacts and cut joints, by their results' names.

Laws are derived before rows are numbered. A model whose laws read such a force is therefore derived twice: the first
time with a placeholder for each, the second time with the multipliers of the rows that the first one has found. These
are unknowns of every step, so that a law and the force it reads are solved for together, at the same instant.

Impacts follow no such law: a law's force stays finite, however large the impulse is that passes through what it reads.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from mbd.constraints.base import Constraint
from mbd.constraints.law import Law
from mbd.equations.derivation_context import DerivationContext
from mbd.equations.equations import Equations
from mbd.equations.law_of import Holding, law_of
from mbd.equations.outputs import Outputs
from mbd.equations.reactions import Wrench, cut_reaction
from mbd.equations.results import offer_contacts, offer_rows
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.tape.derivatives import live
from mbd.tape.node import Node
from mbd.topology.description import Description
from mbd.topology.held_forces import OF_GAPS, REACTIONS, names_of_held_forces

ADVICE = (
    "let the law read a sample of it (mbd.SampledLaw), or a first-order state that follows it (rates of an "
    "mbd.constraints.Law or a Loss)"
)


class HeldForces:
    """The forces of one derivation by name; `first` is the derivation before it, None in the first one.

    Attributes
    ----------
    asked : names that were asked for and are forces
    """

    def __init__(self, model: Description, scope: DerivationContext, first: Equations | None) -> None:
        self._model, self._scope, self._first = model, scope, first
        self._possible = names_of_held_forces(model)
        self._contacts = {word.name: word for word in model.contacts}
        self._laws: dict[str, Law] = {}
        self._within: set[str] = set()
        self.asked: dict[str, Node] = {}
        self._known = Outputs(scope.tape)
        if first is not None:
            self._offer(first)

    def __call__(self, name: str) -> Node | None:
        """The force of this name, or None where it is the name of none.

        Raises
        ------
        ModelError
            for a force of a penalty contact that follows itself, and the reaction of a joint that is not cut.
        UnknownNameError
            for a force that its constraint has under another name.
        """
        if name not in self._possible or name.endswith(REACTIONS):  # of vectors the components have names
            return None
        if name not in self.asked:
            found = self._found(name)
            if found is None:
                return None
            self.asked[name] = found
        return self.asked[name]

    def _found(self, name: str) -> Node | None:
        owner, _, what = name.partition(".")
        while owner not in self._contacts and what.count("."):  # names of words may have dots
            head, _, what = what.partition(".")
            owner = f"{owner}.{head}"
        word = self._contacts.get(owner)
        if word is not None and (what in OF_GAPS or word.kind == "penalty"):
            return self._of_law(word, what)
        if self._first is None:
            return self._scope.tape.input("lam", (1 << 30) + len(self.asked))  # far above the numbers of rows
        if not self._known.offers(name):
            raise UnknownNameError(nearest(name, self._known.names(), "force that holds the mechanism", "There are"))
        return self._known(name)

    def _of_law(self, word: Constraint, what: str) -> Node | None:
        """Gap, its rate, and the force of a penalty contact, which the law gives as functions of the motion."""
        scope, number = self._scope, list(self._contacts).index(word.name)
        if word.name in self._within:
            raise ModelError(f"'{word.name}' asks for '{word.name}.{what}', which it gives itself; {ADVICE}")
        if word.name not in self._laws:
            anchors = () if self._first is None else self._first.contacts[number].anchors
            self._within.add(word.name)
            try:
                holding = Holding(scope, anchors[0] if anchors else scope.first_anchor)
                self._laws[word.name] = law_of(word, holding, list(self._contacts.values()))
            finally:
                self._within.remove(word.name)
        law, lift = self._laws[word.name], scope.tape.lift
        if law.contact is None:
            return None
        if what == "gap":
            return lift(law.contact.gap)
        if what == "gap_rate":
            moving = any(each.op == "input" and each.data[0] == "v" for each in live([scope.real(law.contact.gap)]))
            return scope.change(law.contact.gap) if moving else scope.rate(law.contact.gap)
        switch = scope.tape.input("switch", number)
        if what == "force" and law.push is not None:
            return switch * lift(law.push)
        found = [switch * lift(drag.force) for drag in law.drags if drag.part == what]
        return found[0] if found else None

    def _offer(self, first: Equations) -> None:
        """Multipliers by the numbers that their rows have in the first derivation, and reactions of cut joints."""
        rows, scope = first.rows, self._scope
        known = Outputs(scope.tape)
        offer_rows(known, scope.tape, rows)
        offer_contacts(known, scope.tape, rows, [contact for contact in first.contacts if contact.force is None])
        for name in known.names():
            if not name.endswith((".residual", ".gap", ".gap_rate")) and name in self._possible:
                self._known.add(name, partial(known, name))
        for joint in scope.cuts:
            made: list[Wrench] = []

            def part(kind: str, joint: object = joint, made: list[Wrench] = made) -> tuple[Node, ...]:
                if not made:
                    made.append(cut_reaction(joint, scope, rows))  # type: ignore[arg-type]
                wrench = made[0].force if kind == "force" else made[0].torque
                return tuple(scope.tape.lift(value) for value in wrench)

            for kind in ("force", "torque"):
                self._known.triple(f"{joint.name}.reaction_{kind}", partial(part, kind))


def held_force_faults(equations: Equations, asked: Iterable[str]) -> list[str]:
    """What may not follow the forces that laws have asked for, and forces that no unknown of a step is.

    A row, a gap, an event and a stored energy are functions of the motion alone. Dry friction that slides is no
    multiplier, nor is smooth friction.
    """
    names = ", ".join(repr(name) for name in asked)
    found = []

    def lam(nodes: Iterable[Node | None]) -> set[int]:
        given = [node for node in nodes if node is not None]
        return {int(node.data[1]) for node in live(given) if node.op == "input" and node.data[0] == "lam"}

    for row in equations.rows:
        if lam([row.value, row.rate]):
            found.append(f"'{row.owner}' reads {names}; a row is a function of the motion: read places and rates")
    for contact in equations.contacts:
        condition = contact.only_while if isinstance(contact.only_while, Node) else None
        if lam([contact.gap, condition]):
            found.append(f"'{contact.name}' reads {names} in its gap or only_while=; let these follow the motion")
    for guard in equations.guards:
        condition = None if guard.transition is None else guard.transition.condition
        if lam([guard.value, condition]):
            found.append(
                f"'{guard.name}' waits for a function of {names}, whose rate is not known between steps; {ADVICE}, and "
                "wait for that"
            )
    for effect in equations.effects:
        if lam([effect.potential]):
            found.append(f"'{effect.name}' stores an energy that depends on {names}; give a force, such as mbd.Motor")
    forces = [contact.force for contact in equations.contacts]
    forces += [force for contact in equations.contacts if contact.force is not None for _, _, force in contact.drags]
    read = lam([*equations.balance, *forces])
    for k in sorted(read):
        friction = equations.rows[k].friction
        if friction >= 0:
            found.append(
                f"a law reads the dry friction of '{equations.frictions[friction].name}', which follows its normal "
                f"force as it slides; read that force, or {ADVICE}"
            )
    return list(dict.fromkeys(found))
