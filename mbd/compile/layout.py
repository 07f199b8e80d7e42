"""Where every input of a compiled function lies.

Every compiled function has one signature, ``f(block, parameters, out)``, three arrays of float64:

block       ``[t, c_C, c_K | q | x | v, z | a, ż | λ | anchors | switches | slips | u]``
parameters  ``[p | tables]``
out         whatever the program lists
"""

from __future__ import annotations

from functools import cached_property

from mbd.dataclass import dataclass
from mbd.equations.equations import Equations


@dataclass(frozen=True)
class Layout:
    """Offsets into the block; (v, z) and (a, ż) stand together, as the integrators treat them alike.

    q, x, v, a, lam, anchor, switch, slip, shift : where each part begins; size : numbers in the block

    u is the predicted shift of positions in the stabilized form, which only the program `correction` reads. The program
    `solution` gets the output of that one in the place of the block; its inputs are called 'held'.
    """

    n_q: int
    n_v: int
    n_z: int
    n_rows: int
    n_anchors: int
    n_contacts: int
    n_parameters: int
    table_offsets: tuple[int, ...] = ()
    n_frictions: int = 0

    @classmethod
    def of(cls, equations: Equations) -> Layout:
        """The layout of a set of equations, tables behind the parameters."""
        offset, offsets = len(equations.parameters), []
        for table in equations.tables:
            offsets.append(offset)
            offset += 5 * len(table.breaks)
        return cls(
            equations.n_q, equations.n_v, equations.n_z, len(equations.rows), equations.n_anchors,
            len(equations.contacts), len(equations.parameters), tuple(offsets), len(equations.frictions),
        )  # fmt: skip

    @cached_property
    def n(self) -> int:
        """Number of rates: n_v + n_z."""
        return self.n_v + self.n_z

    @cached_property
    def q(self) -> int:
        return 3

    @cached_property
    def x(self) -> int:
        return 3 + self.n_q

    @cached_property
    def v(self) -> int:
        return self.x + self.n_v

    @cached_property
    def a(self) -> int:
        return self.v + self.n

    @cached_property
    def lam(self) -> int:
        return self.a + self.n

    @cached_property
    def anchor(self) -> int:
        return self.lam + self.n_rows

    @cached_property
    def switch(self) -> int:
        return self.anchor + self.n_anchors

    @cached_property
    def slip(self) -> int:
        return self.switch + self.n_contacts

    @cached_property
    def shift(self) -> int:
        return self.slip + self.n_frictions

    @cached_property
    def size(self) -> int:
        return self.shift + self.n_v

    def place(self, kind: str, index: int) -> int:
        """Offset of an input in the block."""
        return self._starts[kind] + index

    @cached_property
    def _starts(self) -> dict[str, int]:
        """Where the inputs of each kind begin."""
        return {
            "t": 0, "c": 1, "q": self.q, "x": self.x, "v": self.v, "z": self.v + self.n_v, "a": self.a,
            "s": self.a + self.n_v, "lam": self.lam, "anchor": self.anchor, "switch": self.switch, "slip": self.slip,
            "shift": self.shift, "held": 0,
        }  # fmt: skip
