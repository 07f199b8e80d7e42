"""Shorthand of the kernel's Python, spelled out: slices as loops, formulas of records as their expressions."""

import ast
import inspect
import re
from functools import lru_cache
from textwrap import dedent
from typing import Any

from mbd.errors import CapabilityError
from mbd.kernel.records import TABLE
from mbd.kernel.translation import hints

ELEMENT = "_element"
"""Name that counts the elements of a slice."""


def each(node: ast.Assign, target: ast.Subscript, part: ast.Slice) -> ast.For:
    """``a[i:j] = b[k:l]`` or ``a[i:j] = number``, element by element; slices begin at 0 where they do not say."""
    value = node.value
    copied = isinstance(value, ast.Subscript) and isinstance(value.slice, ast.Slice)
    overlaps = copied and ast.unparse(value.value) == ast.unparse(target.value)  # type: ignore[attr-defined]
    if part.upper is None or not (copied or isinstance(value, ast.Constant)) or overlaps or len(node.targets) > 1:
        raise CapabilityError(hints.expected("a number or a slice of another array to fill a slice with", node))
    count = part.upper if part.lower is None else ast.BinOp(part.upper, ast.Sub(), part.lower)
    element = ast.Assign([_element(target)], _element(value) if copied else value, lineno=node.lineno)
    counts = ast.Call(ast.Name("range", ast.Load()), [count], [])
    return ast.For(ast.Name(ELEMENT, ast.Store()), counts, [element], [], lineno=node.lineno)


def _element(node: ast.expr) -> ast.Subscript:
    """The element of a slice whose number is counted by `ELEMENT`."""
    assert isinstance(node, ast.Subscript)
    assert isinstance(node.slice, ast.Slice)
    index: ast.expr = ast.Name(ELEMENT, ast.Load())
    if node.slice.lower is not None:
        index = ast.BinOp(node.slice.lower, ast.Add(), index)
    return ast.Subscript(node.value, index, node.ctx)


def formula_of(name: str, record: ast.expr) -> ast.expr:
    """The expression of a formula, of the fields of `record`."""
    (given,), body = _formulas(TABLE.formulas[name])[name]
    return ast.parse(re.sub(rf"\b{given}\b", ast.unparse(record), body), mode="eval").body


@lru_cache(maxsize=64)
def _formulas(record: type[Any]) -> dict[str, tuple[list[str], str]]:
    """Arguments and bodies of the formulas that a record declares, by name."""
    (owner,) = ast.parse(dedent(inspect.getsource(record))).body
    assert isinstance(owner, ast.ClassDef)
    return {
        ast.unparse(line.target): ([each.arg for each in call.args[0].args.args], ast.unparse(call.args[0].body))
        for line in owner.body
        if isinstance(line, ast.AnnAssign) and isinstance(call := line.value, ast.Call)
        if call.args and isinstance(call.args[0], ast.Lambda)
    }
