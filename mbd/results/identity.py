"""What something is, as a digest: equal digests of a model, a start or a function mean that runs with them are equal.

Objects are read as they would be pickled, functions by their code with all that they refer to: defaults, captured and
global values, other functions of the user's. Expressions on a tape are read by their structure. What belongs to Python
or to an installed package counts by its name. An object that cannot be read counts by its class.
"""

from __future__ import annotations

import functools
import os
import sys
import sysconfig
import types
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from mbd.compile.mechanism import Mechanism
from mbd.results.trajectory import Trajectory
from mbd.tape.node import Node

__all__ = ["identity", "identity_of_model"]


_LIBRARY = tuple(
    f"{Path(path).resolve()}{os.sep}"
    for path in (
        *map(sysconfig.get_path, ("stdlib", "platstdlib", "purelib", "platlib")),
        str(Path(__file__).parent.parent),
    )
)
"""Folders of Python, of installed packages and of this one."""

SKIPPED = frozenset({"moved"})
"""Fields that say how a value was found, and change no run."""


def identity(*values: Any) -> str:
    """The digest of some values."""
    return _Reader().of(values)[:24]


def identity_of_model(model: Any, mechanism: Mechanism) -> dict[str, str]:
    """Digests of a model: of its words, whatever is written in them, and of the equations that its laws became."""
    equations = mechanism.equations
    laws = (equations.balance, equations.rows, equations.contacts, equations.guards, equations.frictions)
    kinds = ("joints", "forces", "constraints", "controllers", "markers", "observations", "gravity", "cut")
    words = [getattr(model, kind, ()) for kind in kinds] if hasattr(model, "joints") else model
    return {"model": identity(words), "equations": identity(laws)}


class _Reader:
    """Reads objects; one that is met again counts as the number of its first meeting."""

    def __init__(self) -> None:
        self.met: dict[int, int] = {}
        self.kept: list[Any] = []  # so that no identity number is used twice
        self.nodes: dict[int, str] = {}

    def of(self, item: Any) -> str:
        """The digest of an object."""
        digest = sha256()
        for word in self.words(item):
            digest.update(word.encode() if isinstance(word, str) else word)
            digest.update(b"\0")
        return digest.hexdigest()

    def words(self, root: Any) -> Iterable[str | bytes]:
        """Everything below an object, in an order that follows from the object alone."""
        stack = [root]
        while stack:
            item = stack.pop()
            if isinstance(item, bool | str | bytes | complex) or item is None or item is Ellipsis:
                yield repr(item)
            elif isinstance(item, np.generic):
                stack.append(item.item())
            elif isinstance(item, int | float):
                yield repr(float(item)) if isinstance(item, float) or abs(item) < 2**53 else repr(item)
            elif id(item) in self.met:
                yield f"again {self.met[id(item)]}"
            else:
                self.met[id(item)] = len(self.met)
                self.kept.append(item)
                title, parts = self.parts(item)
                yield title
                stack += parts[::-1]

    def parts(self, item: Any) -> tuple[str | bytes, list[Any]]:
        """What an object is called, and what it holds."""
        kind = f"{type(item).__module__}.{type(item).__qualname__}"
        if isinstance(item, tuple | list):
            return f"{kind} {len(item)}", list(item)
        if isinstance(item, Mapping):
            return f"{kind} {len(item)}", [part for pair in item.items() for part in pair]
        if isinstance(item, set | frozenset):
            return f"{kind} {sorted(_Reader().of(each) for each in item)}", []
        if isinstance(item, np.ndarray):
            if item.dtype.kind == "O":
                return f"array {item.shape}", item.ravel().tolist()
            return f"array {item.dtype.str} {item.shape}".encode() + np.ascontiguousarray(item).tobytes(), []
        if isinstance(item, Node):
            return self.of_node(item), []
        if isinstance(item, Trajectory):
            return kind, [item.record.time, item.record.q, item.record.v, item.record.z]
        if isinstance(item, types.CodeType):
            return b"code" + item.co_code, [item.co_consts, item.co_names]
        if isinstance(item, types.FunctionType | type | types.ModuleType) and _is_library(item):
            return f"{kind} {getattr(item, '__module__', '')}.{getattr(item, '__qualname__', item.__name__)}", []
        if isinstance(item, types.FunctionType):
            return "function", _of_function(item)
        if isinstance(item, types.MethodType):
            return "method", [item.__func__, item.__self__]
        if isinstance(item, functools.partial):
            return "partial", [item.func, item.args, item.keywords]
        if isinstance(item, type):
            own = {name: value for name, value in vars(item).items() if isinstance(value, _OF_CLASSES)}
            return f"class {item.__qualname__}", [own, item.__bases__]
        if isinstance(item, types.ModuleType):
            return f"module {item.__name__}", []
        if hasattr(item, "__wrapped__"):
            return kind, [item.__wrapped__]
        if is_dataclass(item):
            held = [getattr(item, each.name, None) for each in fields(item) if each.name not in SKIPPED]
            return kind, [type(item), *held]
        return kind, _as_pickled(item)

    def of_node(self, root: Node) -> str:
        """An expression by its structure."""
        stack, known = [root], self.nodes
        while stack:
            node = stack[-1]
            left = [each for each in node.args if each.index not in known]
            if node.index not in known and left:
                stack += left
                continue
            stack.pop()
            if node.index not in known:
                data = _Reader().of(_data(node))
                text = " ".join([node.op, data, *(known[each.index] for each in node.args)])
                known[node.index] = sha256(text.encode()).hexdigest()
        return known[root.index]


_OF_CLASSES = (
    types.FunctionType,
    property,
    classmethod,
    staticmethod,
    functools.cached_property,
    int,
    float,
    str,
    tuple,
)


def _data(node: Node) -> Any:
    """What an expression holds beside its arguments."""
    if node.op == "table":
        table, order = node.data
        return [list(table.flat), order]
    return node.data


def _as_pickled(item: Any) -> list[Any]:
    """What a pickle of an object would hold; nothing for what has none."""
    if isinstance(item, property | classmethod | staticmethod | functools.cached_property):
        return [getattr(item, name, None) for name in ("fget", "__func__", "func")]
    try:
        made = item.__reduce_ex__(4)
    except Exception:  # locks, files and objects of users' own raise what they like
        return [getattr(item, "__qualname__", "")]
    return [made] if isinstance(made, str) else [type(item), *made[1:3], *(list(each or ()) for each in made[3:5])]


def _of_function(function: types.FunctionType) -> list[Any]:
    """What a function does: its code and all that it refers to."""
    known, wanted = function.__globals__, _names(function.__code__)
    named: dict[str, Any] = {}
    for name in sorted(wanted & known.keys()):
        named[name] = _of_module(known[name], wanted) if isinstance(known[name], types.ModuleType) else known[name]
    cells = [_content(cell) for cell in function.__closure__ or ()]
    return [function.__code__, function.__defaults__, function.__kwdefaults__, cells, named]


def _of_module(module: types.ModuleType, wanted: set[str]) -> Any:
    """A module of the user's: what a function may take from it."""
    if _is_library(module):
        return module
    return [module.__name__, {name: getattr(module, name) for name in sorted(wanted) if hasattr(module, name)}]


def _names(code: types.CodeType) -> set[str]:
    """Names of globals and attributes in a function and in the functions inside it."""
    inner = (_names(each) for each in code.co_consts if isinstance(each, types.CodeType))
    return set(code.co_names).union(*inner)


def _content(cell: types.CellType) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not bound yet
        return None


def _is_library(item: Any) -> bool:
    """Whether something belongs to Python, to an installed package or to this one, where its name tells what it is."""
    if isinstance(item, types.FunctionType):
        if "<" in item.__qualname__:  # made in another function, of whose values it may hold some
            return False
        path = item.__code__.co_filename
    else:
        module = item if isinstance(item, types.ModuleType) else sys.modules.get(item.__module__)
        path = getattr(module, "__file__", None) or ""
        if not path:
            return getattr(module, "__name__", "") != "__main__"
    where = str(Path(path).resolve()) if path else ""
    return where.startswith(_LIBRARY)
