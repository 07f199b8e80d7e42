"""What something is, as a digest: equal digests of a model, a start or a function mean that runs with them are equal.

Read are numbers, texts, arrays, tables, expressions on a tape by their structure, runs, functions by their code with
all that they refer to (defaults, captured and global values, modules that they import, other functions), objects by
their class and what a pickle of them holds, and classes by all that they define. What belongs to Python or to a package
of the list counts by its name. What cannot be read has no digest, and is named.
"""

import copyreg
import dis
import functools
import importlib
import os
import sys
import types
from collections.abc import Iterable
from dataclasses import is_dataclass
from hashlib import sha256
from typing import Any

import numpy as np

from mbd.bodies.values import shown
from mbd.compile.mechanism import Mechanism
from mbd.compile.same_words import CannotTellError, Reader, codes_of, values_of
from mbd.errors import ModelError
from mbd.results.storage import Archive, contents
from mbd.results.trajectory import Trajectory
from mbd.tape.node import Node

PACKAGES = {"mbd", "numpy", "scipy", "sympy", "networkx", "pandas", "xarray", "matplotlib"}
"""What is in them is what its name says; packages of users' own change, wherever they are installed."""

LIBRARY = os.path.dirname(os.__file__)
"""Where the modules of Python are."""
HISTORY = {"moved", "runs", "manager", "chart"}
"""Fields of words of mbd that tell how a value was found, or follow from a mechanism and a state beside."""

OF_PYTHON = frozenset({
    "__dict__", "__weakref__", "__doc__", "__module__", "__qualname__", "__annotations__", "__annotate__",
    "__annotate_func__", "__annotations_cache__", "__abstractmethods__", "_abc_impl", "__firstlineno__",
    "__static_attributes__", "__dataclass_fields__", "__dataclass_params__", "__match_args__", "__parameters__",
    "__orig_bases__", "__type_params__",
})  # fmt: skip
"""What Python notes of a class beside what the class says."""


def identity(*values: Any) -> str:
    """The digest of some values.

    Raises
    ------
    ModelError
        for what cannot be read.
    """
    try:
        return _Reader().digest(values)[:24]
    except CannotTellError as error:
        item, *through = error.args
        why = f", which uses {', '.join(map(repr, through))}" if through else ""
        raise ModelError(
            f"file: the study depends on {shown(item):.120}{why}, of which nobody can tell whether it will be the "
            "same in another process; let functions refer to numbers, texts, functions and objects that can be "
            "pickled, or leave file= out"
        ) from None


def identity_of_model(model: Any, mechanism: Mechanism) -> dict[str, str]:
    """Digests of a model: of its words, whatever is written in them, and of the equations that its laws became."""
    kinds = ("joints", "forces", "constraints", "controllers", "markers", "observations", "gravity", "cut")
    words = [getattr(model, kind, ()) for kind in kinds] if hasattr(model, "joints") else model
    return {"model": identity(words), "equations": identity(_laws(mechanism))}


def _laws(mechanism: Mechanism) -> tuple[Any, ...]:
    """What the laws of a model became."""
    equations = mechanism.equations
    return equations.balance, equations.rows, equations.contacts, equations.guards, equations.frictions


class _Reader(Reader):
    """Reads what a study refers to, as it is at the moment."""

    packages = frozenset(PACKAGES | sys.stdlib_module_names)
    unreadable = Reader.unreadable - {"random"}

    def __init__(self) -> None:
        super().__init__()
        self.nodes: dict[int, str] = {}

    def parts(self, item: Any) -> tuple[str, Iterable[Any]]:
        """What an object is called, and what it holds."""
        kind = type(item)
        if kind in (dict, types.MappingProxyType):
            return f"{kind.__name__} {len(item)}", [part for pair in item.items() for part in pair]
        if kind is set:
            return f"set {sorted(type(self)().digest(each) for each in item)}", ()
        if kind is np.ndarray and item.dtype.kind == "O":
            return f"array {item.shape}", item.ravel().tolist()
        if kind is Node:
            return self.of_node(item), ()
        if kind is Trajectory:
            return "run", self.of_run(item)
        if kind is Mechanism:
            inputs = [(each.name, each.value) for each in item.equations.parameters]
            return f"mechanism {type(self)().digest((_laws(item), inputs))}", ()  # by itself: models may share it
        try:
            return super().parts(item)
        except CannotTellError:
            if kind is types.FunctionType:
                raise
            if isinstance(item, type):
                return f"class {item.__module__}.{item.__qualname__}", self.of_class(item)
            return kind.__name__, self.of_object(item)

    def of_word(self, item: Any) -> tuple[str, Iterable[Any]]:
        """A word of `mbd` without what changes no run."""
        title, names = self.kinds[type(item)]
        return title, [getattr(item, name, None) for name in names if name not in HISTORY]

    def of_run(self, run: Trajectory) -> list[Any]:
        """Its rows. Expressions behind them come from the cache or from a derivation, with other numbers of nodes."""
        arrays, words = contents(run.record, Archive.of(run))
        rows = {name: each for name, each in arrays.items() if not name.startswith("graph")}
        return [rows, {name: part for name, part in words.items() if name not in ("stats", "expressions")}]

    def of_class(self, item: type) -> list[Any]:
        """All that a class defines, and its bases."""
        is_dataclass(item)  # one of `mbd.dataclass` is made at its first use
        own = {name: value for name, value in vars(item).items() if name not in OF_PYTHON}
        return [type(item), own, item.__bases__]

    def of_object(self, item: Any) -> list[Any]:
        """What a pickle of an object would hold."""
        if isinstance(item, functools._lru_cache_wrapper):
            return [item.__wrapped__]
        if isinstance(item, property | classmethod | staticmethod | functools.cached_property):
            return [getattr(item, name, None) for name in ("fget", "fset", "fdel", "__func__", "func")]
        if isinstance(item, types.MemberDescriptorType | types.GetSetDescriptorType):
            return [item.__name__]
        try:
            made = item.__reduce_ex__(4)
        except Exception:  # locks, files and objects of users' own raise what they like
            if type(item) not in copyreg.dispatch_table:
                raise CannotTellError(item) from None
            made = copyreg.dispatch_table[type(item)](item)
        if isinstance(made, str):
            return [type(item), made]
        return [type(item), *made[:3], *(list(each or ()) for each in made[3:5])]

    def of_function(self, function: types.FunctionType) -> list[Any]:
        """What a function does: its code and all that it refers to."""
        held = [function.__code__, function.__dict__, *values_of(function)]
        if self.is_of_package(function.__module__ or ""):  # made inside another one, whose values it has captured
            return held
        codes = [*codes_of(function.__code__)]
        names = {name for code in codes for name in code.co_names}
        used = {step.argval for code in codes for step in dis.get_instructions(code) if step.opname == "LOAD_GLOBAL"}
        if unreadable := self.unreadable & (names if "builtins" in used else used):
            raise CannotTellError(function, *sorted(unreadable))
        known = {name: function.__globals__[name] for name in names & function.__globals__.keys()}
        known |= {module.__name__: module for module in _imported(function, codes)}
        return [*held, {name: self.used(known[name], names, set()) for name in sorted(known)}]

    def used(self, value: Any, names: set[str], seen: set[str]) -> Any:
        """A value that a function refers to; of a module of the user's what the function may take from it."""
        if not isinstance(value, types.ModuleType) or self.is_what_it_says(value) or value.__name__ in seen:
            return value.__name__ if isinstance(value, types.ModuleType) else value
        seen = seen | {value.__name__}
        found = {name: getattr(value, name) for name in sorted(names) if hasattr(value, name)}
        return [value.__name__, {name: self.used(each, names, seen) for name, each in found.items()}]

    def is_of_package(self, module: str) -> bool:
        """Whether a module belongs to one of the packages; a file of the user's may have the name of one of Python."""
        name = module.partition(".")[0]
        if name not in sys.stdlib_module_names:
            return name in self.packages
        file = getattr(sys.modules.get(name), "__file__", None)
        return file is None or file.startswith(LIBRARY)

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
                text = " ".join([node.op, type(self)().digest(_data(node)), *(known[each.index] for each in node.args)])
                known[node.index] = sha256(text.encode()).hexdigest()
        return known[root.index]


def _data(node: Node) -> Any:
    """What an expression holds beside its arguments."""
    if node.op == "table":
        table, order = node.data
        return [list(table.flat), order]
    return node.data


def _imported(function: types.FunctionType, codes: Iterable[types.CodeType]) -> list[types.ModuleType]:
    """Modules that a function imports."""
    package, found = function.__globals__.get("__package__") or None, []
    for code in codes:
        steps = [*dis.get_instructions(code)]
        for k, step in enumerate(steps):
            if step.opname == "IMPORT_NAME":
                try:  # two values before it: how many dots, and what is taken from it
                    module = importlib.import_module("." * steps[k - 2].argval + step.argval, package)
                except Exception:  # such as a library that is not installed
                    raise CannotTellError(function) from None
                found += [module, sys.modules[module.__name__.partition(".")[0]]]
    return found
