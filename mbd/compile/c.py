"""Tape outputs as C99 text."""

from collections.abc import Mapping, Sequence

from mbd.compile.elements import MIN_OPERATIONS
from mbd.compile.layout import Layout
from mbd.compile.lowering import MAX_OPERATIONS, PART_OPERATIONS, lower
from mbd.tape.node import Node
from mbd.trees.c import HEAD, Straight


def c_source(
    programs: Mapping[str, Sequence[Node]],
    layout: Layout,
    large: int = MAX_OPERATIONS,
    part: int = PART_OPERATIONS,
    rolled: int = MIN_OPERATIONS,
) -> str:
    """A file with one ``void mbd_name(const double *block, const double *parameters, double *out)`` per program.

    With ``-ffp-contract=off`` it gives the bits of machine code without fused multiply-add (see `mbd.trees.c`).
    large, part, rolled : see `mbd.compile.lowering.lower`
    """
    return "\n".join([HEAD, *(function.text() for function in lower(programs, layout, Straight, large, part, rolled))])
