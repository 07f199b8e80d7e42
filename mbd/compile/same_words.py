"""Whether two descriptions say the same: a digest of words, for those that cannot come to mean anything else.

Only what is listed here is read: numbers, texts, lists, arrays, words of `mbd`, and functions whose code refers to
nothing but such values, other functions, and numpy and math. Of anything else, such as objects and classes of the
user's, nobody can tell what it will do as it is called, so that a description that holds one has no digest.
"""

from __future__ import annotations

import dis
import sys
import types
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from hashlib import sha256
from typing import Any

import numpy as np

__all__ = ["digest_of_words"]

PACKAGES = frozenset({"mbd", "numpy", "math", "builtins"})
"""What is in them is what its name says."""
PLAIN = (bool, int, float, complex, str, bytes, type(None))
CHANGING = frozenset(
    dis.opmap[name]
    for name in (
        "IMPORT_NAME", "STORE_GLOBAL", "STORE_DEREF", "STORE_ATTR", "STORE_SUBSCR", "DELETE_GLOBAL", "DELETE_SUBSCR",
    )
    if name in dis.opmap
)  # fmt: skip
"""Instructions by which a function changes, or brings in, more than it returns."""
UNREADABLE = frozenset({
    "globals", "locals", "vars", "dir", "getattr", "setattr", "eval", "exec", "open", "input", "__import__", "random",
    "__builtins__",
})  # fmt: skip
"""Names through which a function reaches values that its code does not tell."""


class _CannotTellError(Exception):
    """What a description says may change."""


def digest_of_words(*words: Any) -> str | None:
    """Equal for two descriptions that say the same; None where none can be given."""
    reader = _Reader()
    try:
        text = "\0".join(reader.read(words))
    except (_CannotTellError, RecursionError):
        return None
    return sha256(text.encode(errors="backslashreplace")).hexdigest()


class _Reader:
    """Reads words; one that is met again counts as the number of its first meeting."""

    def __init__(self) -> None:
        self.met: dict[int, int] = {}
        self.kept: list[Any] = []  # so that no identity number is used twice

    def read(self, item: Any) -> Iterator[str]:
        """Everything below an object, in an order that follows from the object alone."""
        kind = type(item)
        if kind in PLAIN:
            yield f"{kind.__name__} {item!r}"
            return
        if id(item) in self.met:
            yield f"again {self.met[id(item)]}"
            return
        self.met[id(item)] = len(self.met)
        self.kept.append(item)
        if kind is tuple or kind is list:
            yield f"{kind.__name__} {len(item)}"
            for part in item:
                yield from self.read(part)
        elif kind is np.ndarray and item.dtype.kind in "biufc":
            yield f"array {item.dtype.str} {item.shape} {item.tobytes().hex()}"
        elif isinstance(item, np.generic) and _is_what_it_says(kind):
            yield f"{kind.__name__} {item!r}"
        elif _is_what_it_says(item):
            yield f"{kind.__name__} {getattr(item, '__module__', '')} {getattr(item, '__qualname__', item.__name__)}"
        elif kind is types.FunctionType:
            yield from self._function(item)
        elif is_dataclass(kind) and kind.__module__.startswith("mbd.") and _is_what_it_says(kind):
            yield f"{kind.__module__}.{kind.__qualname__}"
            for field in fields(item):
                yield field.name
                yield from self.read(getattr(item, field.name, None))
        else:
            raise _CannotTellError

    def _function(self, function: types.FunctionType) -> Iterator[str]:
        """What a function does: its code and all that it refers to."""
        if function.__dict__:
            raise _CannotTellError
        yield "function"
        names = set[str]()
        yield from self._code(function.__code__, names)
        if names & UNREADABLE:
            raise _CannotTellError
        known = function.__globals__
        yield from self._fixed(function.__defaults__ or ())
        yield from self._fixed([part for pair in (function.__kwdefaults__ or {}).items() for part in pair])
        yield from self._fixed([cell.cell_contents for cell in function.__closure__ or () if _is_bound(cell)])
        for name in sorted(names & known.keys()):
            yield name
            yield from self._fixed([known[name]])

    def _code(self, code: types.CodeType, names: set[str]) -> Iterator[str]:
        """Code with the functions inside it; the names that it uses go into `names`."""
        if CHANGING.intersection(code.co_code[::2]):
            raise _CannotTellError
        names.update(code.co_names)
        counts = code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags
        yield f"{code.co_code.hex()} {counts} {code.co_varnames} {code.co_freevars} {code.co_cellvars} {code.co_names}"
        for constant in code.co_consts:
            if isinstance(constant, types.CodeType):
                yield from self._code(constant, names)
            else:
                yield from (
                    self.read(constant) if type(constant) is not frozenset else [repr(sorted(map(repr, constant)))]
                )

    def _fixed(self, values: Iterable[Any]) -> Iterator[str]:
        """Values that a function refers to, which can be replaced there but not changed."""
        for value in values:
            if type(value) is tuple:
                yield f"tuple {len(value)}"
                yield from self._fixed(value)
            elif type(value) in (list, np.ndarray):
                raise _CannotTellError
            else:
                yield from self.read(value)


def _is_bound(cell: types.CellType) -> bool:
    try:
        cell.cell_contents  # noqa: B018
    except ValueError as unbound:
        raise _CannotTellError from unbound
    return True


def _is_what_it_says(item: Any) -> bool:
    """Whether something is found under its name in a package that is what it says."""
    if isinstance(item, types.ModuleType):
        return item.__name__.partition(".")[0] in PACKAGES and sys.modules.get(item.__name__) is item
    name = getattr(item, "__qualname__", None) or getattr(item, "__name__", None)
    module = getattr(item, "__module__", None) or ("numpy" if isinstance(item, np.ufunc) else None)
    if not isinstance(name, str) or not isinstance(module, str) or module.partition(".")[0] not in PACKAGES:
        return False
    found: Any = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return found is item
