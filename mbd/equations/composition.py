"""Parts of contact modes: what belongs to all modes, and what each contact adds to it.

``M a + f`` and its tangent belong to no contact; a contact's gap, rows and forces belong to it alone. So the programs
of a mode are sums of those of its parts, each of which is derived once, however many modes it takes part in. What two
parts share, such as kinematics of a body, is then evaluated twice; composition is for mechanisms with many contacts
that concern few coordinates each.
"""

from __future__ import annotations

from collections.abc import Sequence

from mbd.dataclass import dataclass
from mbd.equations import programs
from mbd.equations.equations import Equations
from mbd.tape.derivatives import live, substitute
from mbd.tape.node import Node, Tape

MATRIX, RIGHT, BOTTOM, RESIDUAL, VALUE, RATE, TURNING = range(7)
"""Blocks of the outputs of `programs.newton`: S, ∂r/∂λ, B̃, r, h, ḣ, ∂ḣ/∂x."""

Sparse = list[tuple[tuple[int, int, int], Node]]
"""Outputs that are not zero, each with its block, and line and column there; those of rows are their numbers."""


def composes(equations: Equations) -> bool:
    """Whether modes are composed of parts.

    Laws that read forces of contacts join contacts, so that there are none.
    """
    count, n = len(equations.contacts), equations.n_v + equations.n_z
    if count < 8 or n <= programs.MAX_UNKNOWNS or equations.held_forces:  # few contacts have few modes
        return False
    shared = 0  # entries of S that contacts may fill
    for contact in equations.contacts:
        inputs = [node.data for node in live([contact.gap, contact.gap_rate]) if node.op == "input"]
        shared += len({index for kind, index in inputs if kind in ("x", "v", "z")}) ** 2
    return 2 * shared <= n * n


@dataclass(frozen=True)
class Part:
    """What of a mode belongs to one contact.

    contact : its number; −1 for the balance, and what belongs to no contact
    active : its rows, penalty, sliding frictions and given rows
    """

    contact: int
    active: programs.ActiveSet

    @classmethod
    def of_mode(cls, equations: Equations, mode: programs.ActiveSet) -> list[Part]:
        """The parts of a mode, the common one first."""
        kinds = (mode.rows, mode.penalties, mode.sliding, mode.given_rows)
        owners = (
            [equations.rows[k].contact for k in mode.rows], list(mode.penalties),
            [equations.frictions[k].contact for k in mode.sliding],
            [equations.rows[k].contact for k in mode.given_rows],
        )  # fmt: skip
        own: dict[int, tuple[list[int], ...]] = {-1: ([], [], [], [])}
        for place, (numbers, contacts) in enumerate(zip(kinds, owners, strict=True)):
            for number, contact in zip(numbers, contacts, strict=True):
                own.setdefault(contact, ([], [], [], []))[place].append(number)
        found = []
        for contact in sorted(own):
            rows, penalties, sliding, given_rows = map(tuple, own[contact])
            found.append(cls(contact, programs.ActiveSet(rows, penalties, mode.stabilized, sliding, given_rows)))
        return found

    def newton(self, equations: Equations) -> Sparse:
        """What is not zero of its share in `programs.newton`."""
        rows = sorted(self.active.rows)
        S, right, bottom, tail = programs.system(equations, self.active, alone=self.contact >= 0)
        n, zero = len(S), equations.tape.zero
        found = [
            ((MATRIX, i, j), S[j][i]) for j in range(n) if any(node is not zero for node in S[j]) for i in range(n)
        ]
        found += [((RIGHT, i, row), line[i]) for row, line in zip(rows, right, strict=True) for i in range(n)]
        found += [((BOTTOM, row, j), line[j]) for row, line in zip(rows, bottom, strict=True) for j in range(len(line))]
        return _filled(found + self._tail(tail, n, equations.n_v))

    def residual(self, equations: Equations) -> Sparse:
        """What is not zero of its share in `programs.residual`."""
        outputs = programs.residual(equations, self.active, alone=self.contact >= 0)
        return _filled(self._tail(outputs, equations.n_v + equations.n_z, equations.n_v))

    def _tail(self, outputs: Sequence[Node], n: int, n_v: int) -> Sparse:
        """r | h | ḣ | ∂ḣ/∂x with their places."""
        rows = sorted(self.active.rows)
        places = [(RESIDUAL, i, 0) for i in range(n)] + [(VALUE, row, 0) for row in rows]
        if self.active.stabilized:
            places += [(RATE, row, 0) for row in rows] + [(TURNING, row, j) for row in rows for j in range(n_v)]
        return list(zip(places, outputs, strict=False))


def _filled(outputs: Sparse) -> Sparse:
    return [(place, node) for place, node in outputs if not node.is_zero]


def own_program(outputs: Sequence[Node]) -> tuple[list[Node], list[tuple[str, int]]]:
    """Outputs on a tape of their own, with inputs by number ('held'), and what those are: parameters last.

    Contacts of one kind, which differ in their inputs alone, have the same program.
    """
    inputs = [node for node in live(outputs) if node.op == "input"]
    inputs.sort(key=lambda node: node.data[0] == "p")
    tape = Tape()
    own = substitute(outputs, {node: tape.input("held", k) for k, node in enumerate(inputs)}, tape)
    return own, [node.data for node in inputs]
