"""Tape outputs → C source: what a C compiler makes of them is held against the other backends.

Compile with ``-ffp-contract=off`` (gcc contracts by default) to get the numbers of the other backends to round-off.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from mbd.compile.layout import Layout
from mbd.compile.statements import Dialect, statements
from mbd.errors import ModelError
from mbd.tape.node import Node

__all__ = ["source"]

OPERATIONS = {
    "add": "{} + {}", "sub": "{} - {}", "mul": "{} * {}", "div": "{} / {}", "neg": "-{}",
    "lt": "{} < {}", "le": "{} <= {}", "and": "{} && {}", "or": "{} || {}", "not": "!{}",
    "where": "{} ? {} : {}", "abs": "fabs({})", "floor": "floor({}) + 0.0",
    "min": "{0} < {1} || {0} != {0} ? {0} : {1}", "max": "{0} > {1} || {0} != {0} ? {0} : {1}",
    "sign": "{0} > 0.0 ? 1.0 : {0} < 0.0 ? -1.0 : {0} + 0.0",
    "atan2": "atan2({}, {})", "pow": "pow({}, {})",
}  # fmt: skip
"""Operations in C that are not a function of one argument with the same name."""

PIECE = """\
/* number of the piece of a table that x falls into */
static int mbd_piece(const double *breaks, int n, double x)
{
    int low = 0;
    while (n > 1) {
        int half = n / 2;
        if (!(x < breaks[low + half])) low += half;
        n -= half;
    }
    return low;
}

"""


def _literal(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    text = "INFINITY" if math.isinf(value) else repr(abs(value))
    return f"(-{text})" if value < 0.0 else text


_C = Dialect(
    operations=OPERATIONS,
    literal=_literal,
    number="    const double {} = {};",
    condition="    const int {} = {};",
    block="block[{}]",
    parameter="parameters[{}]",
    piece=(
        "    const int k{k} = mbd_piece(parameters + {start}, {n}, {x});",
        "    const double s{k} = {x} - parameters[{start} + k{k}];",
        "    const double *const c{k} = parameters + {rows} + 4 * k{k};",
    ),
)


def source(programs: Mapping[str, Sequence[Node]], layout: Layout) -> str:
    """A C99 file with one ``void name(const double *block, const double *parameters, double *out)`` per program."""
    functions = [_function(name, outputs, layout) for name, outputs in programs.items()]
    helper = PIECE if any("mbd_piece(" in function for function in functions) else ""
    return "#include <math.h>\n\n" + helper + "\n".join(functions)


def _function(name: str, outputs: Sequence[Node], layout: Layout) -> str:
    if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
        raise ModelError(f"a C function cannot be called {name!r}; use letters, digits and underscores")
    lines, results = statements(outputs, layout, _C)
    head = f"void {name}(const double *restrict block, const double *restrict parameters, double *restrict out)\n{{"
    stores = (f"    out[{k}] = {result};" for k, result in enumerate(results))
    return "\n".join((head, *lines, *stores, "}\n"))
