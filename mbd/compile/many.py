"""A compiled function at many blocks of inputs in one call: the loop over the rows is machine code too."""

import ctypes
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector, address_of
from mbd.compile.backend import Function
from mbd.compile.layout import Layout

CHUNK = 128
"""Rows of inputs that are laid out at once, so that they stay in the processor's cache."""

LOOP = """\
define void @mbd.each_row(ptr %function, i64 %rows, ptr %block, i64 %block_step, ptr %parameters, i64 %parameter_step,
ptr %out, i64 %out_step) #0 {
entry:
br label %test
test:
%k = phi i64 [ 0, %entry ], [ %next, %row ]
%more = icmp ult i64 %k, %rows
br i1 %more, label %row, label %done
row:
%block_at = mul i64 %k, %block_step
%parameter_at = mul i64 %k, %parameter_step
%out_at = mul i64 %k, %out_step
%b = getelementptr double, ptr %block, i64 %block_at
%p = getelementptr double, ptr %parameters, i64 %parameter_at
%o = getelementptr double, ptr %out, i64 %out_at
call void %function(ptr %b, ptr %p, ptr %o)
%next = add i64 %k, 1
br label %test
done:
ret void
}
attributes #0 = { nounwind }
"""
"""Calls a function once for every row of the three arrays, whose rows lie so many numbers apart."""

_PROTOTYPE = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64,
    ctypes.c_void_p, ctypes.c_int64,
)  # fmt: skip


@cache
def _loop() -> Any:
    """The machine code of the loop, made once in a process."""
    from mbd.compile.llvm import cached_object, emit_object, load_object

    code = cached_object(LOOP, lambda: emit_object(LOOP), lasting=True)
    return _PROTOTYPE(load_object(code, "mbd.each_row"))


def at_blocks(function: Function, blocks: Matrix, parameters: Vector | Matrix, out: Matrix | None = None) -> Matrix:
    """The outputs of a function at every row of inputs (R, size).

    Parameters
    ----------
    blocks : (R, layout.size), see `mbd.compile.layout`
    parameters : one vector for all rows, or (R, n_p)
    out : where they go, zeros
    """
    blocks = np.ascontiguousarray(blocks, dtype=float)
    parameters = np.ascontiguousarray(parameters, dtype=float)
    rows, several = len(blocks), parameters.ndim == 2
    out = np.zeros((rows, function.size)) if out is None else out
    if not function.address:
        for k in range(rows):
            function(blocks[k], parameters[k] if several else parameters, out[k])
        return out
    if rows:
        # what is made at its first call is called, as nothing may be raised through machine code
        check = getattr(function, "require_room", function)
        check(blocks[0], parameters[0] if several else parameters, out[0])
        _loop()(
            function.address, rows, address_of(blocks), blocks.shape[1], address_of(parameters),
            parameters.shape[1] if several else 0, address_of(out), out.shape[1],
        )  # fmt: skip
    return out


def at_inputs(function: Function, layout: Layout, inputs: Mapping[str, Any], parameters: Vector | Matrix) -> Matrix:
    """The same from arrays by kind: {'t': (R,), 'q': (R, n_q), …}; kinds that are absent are zero."""
    rows = len(inputs["t"])
    columns = [(layout.place(kind, 0), np.asarray(values).reshape(rows, -1)) for kind, values in inputs.items()]
    blocks, out = np.zeros((min(rows, CHUNK), layout.size)), np.zeros((rows, function.size))
    for first in range(0, rows, CHUNK):
        part = slice(first, min(first + CHUNK, rows))
        count = part.stop - first
        for place, values in columns:
            blocks[:count, place : place + values.shape[1]] = values[part]
        at_blocks(function, blocks[:count], parameters[part] if parameters.ndim == 2 else parameters, out[part])
    return out
