"""What to write instead of Python that the kernel may not use: the advice of its translator."""

import ast
from collections.abc import Iterable
from pathlib import Path

from mbd.errors import nearest
from mbd.trees.tree import kind_of

STATEMENTS = "an assignment, a call, if, while, for … in range(…), break, continue, pass or return"

INSTEAD: dict[type[ast.AST], str] = {
    ast.AnnAssign: "x = 0.0 without an annotation: a name has the kind of what it is given",
    ast.Raise: "return a code of mbd.kernel.codes, such as NOT_CONVERGED",
    ast.Assert: "return a code of mbd.kernel.codes, such as NOT_CONVERGED",
    ast.Try: "compare: x/0 is ±inf or NaN here, no exception",
    ast.FunctionDef: "a function of the module in place of one inside another",
    ast.Import: "imports at the top of the module",
    ast.ImportFrom: "imports at the top of the module",
    ast.List: "an array of the kernel, such as K.stages, whose length the entry gives by memory=",
    ast.ListComp: "an array of the kernel, such as K.stages, and a loop over a range",
    ast.Tuple: "one name at a time",
    ast.Dict: "an array of the kernel, such as K.stages",
    ast.Lambda: "a function of the module",
    ast.Slice: "a loop over its elements, or a[i:j] = b[k:l] in a line of its own",
    ast.NamedExpr: "an assignment in a line of its own",
}

CALLS = {
    "sqrt": "from mbd.kernel.algebra.roots import sqrt",
    "len": "a length of the record, such as K.n, K.n_v, K.n_rows",
    "sum": "a loop that adds up",
    "print": 'backend="python", where a debugger stops',
    "zeros": "an array of the kernel, such as K.stages, whose length the entry gives by memory=",
    "enumerate": "for i in range(…)",
    "dot": "a loop that adds up",
}


def instead(node: ast.AST) -> str:
    """What to try in place of a piece of Python, with '; try ' before it; '' if nothing is known."""
    found = next((INSTEAD[type(part)] for part in ast.walk(node) if type(part) in INSTEAD), "")
    return f"; try {found}" if found else ""


def statement(node: ast.stmt) -> str:
    """The sentence about a statement that the kernel may not use."""
    return f"expected {STATEMENTS}, got {first_line(node)!r}{instead(node)}"


def expected(what: str, node: ast.AST) -> str:
    """The sentence about an expression that the kernel may not use."""
    return f"expected {what}, got {ast.unparse(node)!r}{instead(node)}"


def first_line(node: ast.AST) -> str:
    """A statement, but for what stands in its block."""
    return ast.unparse(node).partition("\n")[0]


def called(name: str, arguments: Iterable[str], given: int) -> str:
    """The sentence about a wrong number of arguments."""
    names = list(arguments)
    return f"expected {name}({', '.join(names)}), got {given} argument{'s' * (given != 1)}"


def no_function(name: str, known: Iterable[str]) -> str:
    """The sentence about a function that a module has not."""
    advice = f"; try {CALLS[name]}" if name in CALLS else ", or import it at the top of the module"
    return f"{nearest(name, known, 'function', 'The module has')}{advice}"


def no_value(name: str, locals_: Iterable[str], module: Iterable[str]) -> str:
    """The sentence about a name without a value."""
    if name in module:
        return f"expected a number, got {name!r} of the module; try capitals, {name.upper()}, for a constant"
    return nearest(name, locals_, "value", "There are") + "; a constant of the module is written in capitals"


def unknown_field(code: str, field: str, kind: str, fields: Iterable[str]) -> str:
    """The sentence about an attribute that is no field of the kernel's record."""
    if kind != "kernel":
        return f"expected a field of a record, got {code!r} of {kind_of(kind)}; lengths are K.n, K.n_v, K.n_rows, …"
    return f"{code!r}: {nearest(field, fields, 'field of the kernel', 'There are')}; see mbd/kernel/records"


def shown(path: str) -> str:
    """A file as messages name it: from the package, else from where the program runs."""
    parts, here = Path(path).parts, Path.cwd()
    if "mbd" in parts[:-1]:
        return "/".join(parts[len(parts) - 1 - parts[::-1].index("mbd") :])
    return str(Path(path).relative_to(here)) if Path(path).is_relative_to(here) else path
