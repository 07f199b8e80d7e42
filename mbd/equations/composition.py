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

__all__ = [
    "BOTTOM", "MATRIX", "RATE", "RESIDUAL", "RIGHT", "TURNING", "VALUE", "Part", "Sparse", "composes",
    "own_program",
]  # fmt: skip

MIN_COMPOSED_CONTACTS = 8
"""Contacts from which on modes are composed [-]."""
MATRIX, RIGHT, BOTTOM, RESIDUAL, VALUE, RATE, TURNING = range(7)
"""Blocks of the outputs of `programs.newton`: S, ∂r/∂λ, B̃, r, h, ḣ, ∂ḣ/∂x."""

Sparse = list[tuple[tuple[int, int, int], Node]]
"""Outputs that are not zero, each with its block, and line and column there; those of rows are their numbers."""


def composes(equations: Equations) -> bool:
    """Whether modes are composed of parts.

    Laws that read forces of contacts join contacts, so that there are none.
    """
    count, n = len(equations.contacts), equations.n_v + equations.n_z
    if count < MIN_COMPOSED_CONTACTS or n <= programs.MAX_UNKNOWNS or equations.held_forces:
        return False
    shared = 0  # entries of S that contacts may fill
    for contact in equations.contacts:
        inputs = [node.data for node in live([contact.gap, contact.gap_rate]) if node.op == "input"]
        shared += len({index for kind, index in inputs if kind in ("x", "v", "z")}) ** 2
    return 2 * shared <= n * n


@dataclass(frozen=True)
class Part:
    """The rows, penalty contacts, sliding frictions and given rows of a mode that belong to one contact.

    contact : its number; −1 for the balance, and what belongs to no contact
    """

    contact: int
    rows: tuple[int, ...] = ()
    penalties: tuple[int, ...] = ()
    sliding: tuple[int, ...] = ()
    given_rows: tuple[int, ...] = ()

    @classmethod
    def of_mode(
        cls,
        equations: Equations,
        rows: Sequence[int],
        penalties: Sequence[int],
        sliding: Sequence[int],
        given_rows: Sequence[int],
    ) -> list[Part]:
        """The parts of a mode, the common one first."""
        kinds = (rows, penalties, sliding, given_rows)
        owners = (
            [equations.rows[k].contact for k in rows], list(penalties),
            [equations.frictions[k].contact for k in sliding], [equations.rows[k].contact for k in given_rows],
        )  # fmt: skip
        own: dict[int, tuple[list[int], ...]] = {-1: ([], [], [], [])}
        for place, (numbers, contacts) in enumerate(zip(kinds, owners, strict=True)):
            for number, contact in zip(numbers, contacts, strict=True):
                own.setdefault(contact, ([], [], [], []))[place].append(number)
        return [cls(contact, *map(tuple, own[contact])) for contact in sorted(own)]

    def newton(self, equations: Equations, stabilized: bool) -> Sparse:
        """What is not zero of its share in `programs.newton`."""
        rows = sorted(self.rows)
        S, right, bottom, tail = programs.system(
            equations, rows, self.penalties, stabilized, self.sliding, self.given_rows, alone=self.contact >= 0
        )
        n, zero = len(S), equations.tape.zero
        found = [
            ((MATRIX, i, j), S[j][i]) for j in range(n) if any(node is not zero for node in S[j]) for i in range(n)
        ]
        found += [((RIGHT, i, row), line[i]) for row, line in zip(rows, right, strict=True) for i in range(n)]
        found += [((BOTTOM, row, j), line[j]) for row, line in zip(rows, bottom, strict=True) for j in range(len(line))]
        return _filled(found + self._tail(tail, rows, n, equations.n_v, stabilized))

    def residual(self, equations: Equations, stabilized: bool) -> Sparse:
        """What is not zero of its share in `programs.residual`."""
        rows = sorted(self.rows)
        outputs = programs.residual(
            equations, rows, self.penalties, stabilized, self.sliding, self.given_rows, alone=self.contact >= 0
        )
        n = equations.n_v + equations.n_z
        return _filled(self._tail(outputs, rows, n, equations.n_v, stabilized))

    def _tail(self, outputs: Sequence[Node], rows: list[int], n: int, n_v: int, stabilized: bool) -> Sparse:
        """r | h | ḣ | ∂ḣ/∂x with their places."""
        places = [(RESIDUAL, i, 0) for i in range(n)] + [(VALUE, row, 0) for row in rows]
        if stabilized:
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
