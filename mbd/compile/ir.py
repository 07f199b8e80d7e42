"""Tape outputs as LLVM IR text: whole, or in pieces that are compiled one at a time into objects that belong together.

Functions are cut into parts that are made into machine code each for itself (`lowering`); so it does not matter to a
bit of the results in which object file one lies. A piece takes some 50 ms to compile, which is the longest that anybody
has to wait for whoever compiles them in the background.
"""

from collections.abc import Iterator, Mapping, Sequence

from mbd.compile.elements import MIN_OPERATIONS
from mbd.compile.layout import Layout
from mbd.compile.lowering import MAX_OPERATIONS, PART_OPERATIONS, lower
from mbd.tape.node import Node
from mbd.trees.llvm import Straight, helpers

MAX_LINES = 2500
"""Lines of text after which a piece is full: some 1000 operations, with what goes in and out of their functions."""


class Module:
    """The functions of some programs, printed.

    Parameters
    ----------
    programs : names and what each function writes to ``out``
    fused : whether the machine has fused multiply-add (used only inside sine and cosine)
    large, part, rolled : see `lowering.lower`
    """

    def __init__(
        self,
        programs: Mapping[str, Sequence[Node]],
        layout: Layout,
        fused: bool = False,
        large: int = MAX_OPERATIONS,
        part: int = PART_OPERATIONS,
        rolled: int = MIN_OPERATIONS,
    ) -> None:
        self.bodies, self.fused = lower(programs, layout, Straight, large, part, rolled), fused
        self.lines = sum(len(body.lines) for body in self.bodies)

    def text(self) -> str:
        """All functions in one module, parts for nobody else to see."""
        texts = [body.text("internal " if body.apart else "") for body in self.bodies]
        return "\n".join([*texts, *helpers(self.bodies, self.fused)])

    def pieces(self, size: int = MAX_LINES) -> list[str]:
        """Modules that together define the same; parts of functions see each other."""
        portions = list(self._portions(size))
        return [self.text()] if len(portions) == 1 else [self._piece(portion) for portion in portions]

    def _portions(self, size: int) -> Iterator[list[Straight]]:
        portion: list[Straight] = []
        for body in self.bodies:
            if portion and sum(len(each.lines) for each in [*portion, body]) > size:
                yield portion
                portion = []
            portion.append(body)
        yield portion

    def _piece(self, portion: list[Straight]) -> str:
        own = {body.symbol for body in portion}
        called = {symbol for body in portion for symbol in body.called}
        texts = [body.text() for body in portion]
        given = {body.symbol: ", ".join("ptr" for _ in body.arguments) for body in self.bodies}
        elsewhere = [f"declare void @{symbol}({given[symbol]})" for symbol in sorted(called - own)]
        return "\n".join([*texts, *helpers(portion, self.fused), *elsewhere])
