"""Whether two descriptions say the same: a digest of words, for those that cannot come to mean anything else.

Only what is listed here is read: numbers, texts, lists, arrays, words of `mbd`, and functions whose code refers to
nothing but such values, other functions, and numpy and math. Of anything else, such as objects and classes of the
user's, nobody can tell what it will do as it is called, so that a description that holds one has no digest.

`mbd.results.identity` reads more in the same way: all that a study refers to, as it is at the moment. `changing` and
`as_it_is` tell whether functions that were recorded would be recorded as they were.
"""

import dis
import functools
import sys
import types
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np

PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...))


CHANGING = frozenset(
    dis.opmap[name]
    for name in (
        "IMPORT_NAME", "STORE_GLOBAL", "STORE_DEREF", "STORE_ATTR", "STORE_SUBSCR", "DELETE_GLOBAL", "DELETE_SUBSCR",
    )
    if name in dis.opmap
)  # fmt: skip
"""Instructions by which a function changes, or brings in, more than it returns."""


class CannotTellError(Exception):
    """What something says may change, or is not known."""


class Words(NamedTuple):
    """What a description says.

    digest : equal for two descriptions that say the same
    are_fixed : whether there are no functions among the words, so that nothing is `changing`
    """

    digest: str
    are_fixed: bool


def read_words(*words: Any) -> Words | None:
    """What a description says; None where nobody can tell."""
    reader = Reader()
    try:
        digest = reader.digest(words)
    except (CannotTellError, RecursionError):
        return None
    return Words(digest, all(type(each) not in CALLABLE for each in reader.kept))


class Reader:
    """Reads objects; one that is met again counts as the number of its first meeting."""

    packages = frozenset({"mbd", "numpy", "math", "builtins"})
    """What is in them is what its name says."""
    unreadable = frozenset({
        "globals", "locals", "vars", "dir", "getattr", "setattr", "eval", "exec", "open", "input", "__import__",
        "random", "__builtins__",
    })  # fmt: skip
    """Names through which a function reaches values that its code does not tell."""

    def __init__(self) -> None:
        self.met: dict[int, int] = {}
        self.kept: list[Any] = []  # so that no identity number is used twice
        self.kinds: dict[type, tuple[str, list[str]]] = {}  # of words of mbd: what they are called, and their fields

    def digest(self, root: Any) -> str:
        """Of everything below an object, in an order that follows from the object alone.

        Raises
        ------
        CannotTellError
            for what is not read.
        """
        titles, met = list[str](), self.met
        left = [iter((root,))]  # what is still to be read, of the innermost object last
        while left:
            for item in left[-1]:
                kind = type(item)
                if kind in PLAIN:
                    titles.append(f"{kind.__name__} {item!r}")
                elif (number := met.get(id(item))) is not None:
                    titles.append(f"again {number}")
                else:
                    met[id(item)] = len(met)
                    self.kept.append(item)
                    title, parts = self.parts(item)
                    titles.append(title)
                    left.append(iter(parts))
                    break
            else:
                left.pop()
        return sha256("\0".join(titles).encode(errors="backslashreplace")).hexdigest()

    def parts(self, item: Any) -> tuple[str, Iterable[Any]]:
        """What an object is called, and what it holds."""
        kind = type(item)
        if kind in (tuple, list):
            return f"{kind.__name__} {len(item)}", item
        if kind in self.kinds:
            return self.of_word(item)
        if kind is frozenset:
            return f"frozenset {sorted(type(self)().digest(each) for each in item)}", ()
        if kind is np.ndarray and item.dtype.kind in "biufcSU":
            return f"array {item.dtype.str} {item.shape} {item.tobytes().hex()}", ()
        if isinstance(item, np.generic) and self.is_what_it_says(kind):
            return f"{kind.__name__} {item!r}", ()
        if self.is_what_it_says(item):
            return f"{kind.__name__} {getattr(item, '__module__', '')} {_name_of(item)}", ()
        if kind is types.CodeType:
            counts = item.co_argcount, item.co_posonlyargcount, item.co_kwonlyargcount, item.co_flags
            names = item.co_varnames, item.co_freevars, item.co_cellvars, item.co_names
            return f"code {item.co_code.hex()} {counts} {names}", item.co_consts
        if kind is types.FunctionType:
            return "function", self.of_function(item)
        if is_dataclass(kind) and kind.__module__.startswith("mbd.") and self.is_what_it_says(kind):
            own = [field.name for field in fields(item)]
            self.kinds[kind] = f"{kind.__module__}.{kind.__qualname__} {own}", own
            return self.of_word(item)
        raise CannotTellError(item)

    def of_word(self, item: Any) -> tuple[str, Iterable[Any]]:
        """A word of `mbd`, field by field."""
        title, names = self.kinds[type(item)]
        return title, [getattr(item, name, None) for name in names]

    def of_function(self, function: types.FunctionType) -> list[Any]:
        """What a function does: its code and all that it refers to, values that can be replaced but not changed."""
        codes = [*codes_of(function.__code__)]
        names = {name for code in codes for name in code.co_names}
        changing = any(CHANGING.intersection(code.co_code[::2]) for code in codes)
        if function.__dict__ or changing or names & self.unreadable:
            raise CannotTellError(function)
        held = values_of(function)
        held += [part for name in sorted(names & function.__globals__.keys())
                 for part in (name, function.__globals__[name])]  # fmt: skip
        _require_fixed(held)
        return [function.__code__, *held]

    def is_what_it_says(self, item: Any) -> bool:
        """Whether something is found under its name in a package that is what it says."""
        if isinstance(item, types.ModuleType):
            return self.is_of_package(item.__name__) and sys.modules.get(item.__name__) is item
        name = _name_of(item)
        module = getattr(item, "__module__", None) or ("numpy" if isinstance(item, np.ufunc) else None)
        if not isinstance(name, str) or not isinstance(module, str) or not self.is_of_package(module):
            return False
        found: Any = sys.modules.get(module)
        for part in name.split("."):
            found = getattr(found, part, None)
        return found is item

    def is_of_package(self, module: str) -> bool:
        """Whether a module belongs to one of the packages."""
        return module.partition(".")[0] in self.packages


def changing(words: Iterable[Any]) -> list[Any]:
    """What equations were made of and may be another thing later: functions inside words, and objects of users' own.

    Not what runs call as it is then: resets of events, and controllers.
    """
    found, stack, met = list[Any](), [*words], set[int]()
    while stack:
        item = stack.pop()
        kind = type(item)
        if kind in PLAIN or id(item) in met:
            continue
        met.add(id(item))
        if kind in (tuple, list):
            stack += item
        elif kind in (dict, types.MappingProxyType):
            stack += item.values()
        elif kind in CALLABLE or not _is_installed(kind.__module__):
            found.append(item)
        elif kind.__module__.startswith("mbd."):
            own = getattr(item, "__dict__", {})
            stack += [part for name, part in own.items() if type(part) not in PLAIN and name not in CALLED]
    return found


def as_it_is(items: Iterable[Any]) -> tuple[str, list[Any]]:
    """What some functions and objects refer to at the moment, to be compared with that of another moment.

    The digest, and the objects that it knows by what they are: as long as these are kept no other can pass for one.
    """
    reader = _AsItIs()
    try:
        return reader.digest([*items]), reader.kept
    except Exception:  # attributes of users' objects raise what they like; then nothing is known to have changed
        return "", reader.kept


CALLED = ("reset", "controllers")
CALLABLE = (types.FunctionType, types.MethodType, functools.partial, functools._lru_cache_wrapper)


@functools.cache
def _is_installed(module: str) -> bool:
    """Whether a module is one of Python's or of a package, which stay as they are."""
    root = module.partition(".")[0]
    file = getattr(sys.modules.get(root), "__file__", None)
    return root == "mbd" or (root in sys.stdlib_module_names and root != "__main__") or "-packages" in (file or "")


@functools.cache
def _globals_of(code: types.CodeType) -> frozenset[str]:
    """Names that code looks up among the values of its module."""
    return frozenset(
        step.argval for each in codes_of(code) for step in dis.get_instructions(each) if step.opname == "LOAD_GLOBAL"
    )


class _AsItIs(Reader):
    """Reads all that items refer to; of objects what the code that refers to them names, and which objects they are."""

    def __init__(self) -> None:
        super().__init__()
        self.names: set[str] = set()

    def parts(self, item: Any) -> tuple[str, Iterable[Any]]:
        kind = type(item)
        if kind is set:
            return f"set {sorted(type(self)().digest(each) for each in item)}", ()
        if kind is dict:
            return f"dict {len(item)}", [part for pair in item.items() for part in pair]
        if kind is types.MethodType:
            return "method", (item.__func__, item.__self__)
        if kind is functools.partial:
            return "partial", (item.func, item.args, item.keywords)
        if kind is functools._lru_cache_wrapper:
            return "cached", (item.__wrapped__,)
        try:
            return super().parts(item)
        except CannotTellError:
            return f"{kind.__name__} {id(item)}", self.of_object(item)

    def of_object(self, item: Any) -> list[Any]:
        """What functions read of an object, a class or a module; of a user's object the methods that they call, too.

        Of a word, which the library calls, all methods.
        """
        is_class = isinstance(item, type)
        held = dict[str, Any]()
        for kind in (item if is_class else type(item)).__mro__[::-1]:
            held |= {} if _is_installed(kind.__module__) else vars(kind)
        methods = {} if is_class else {name: each for name in held if (each := _function_of(held[name])) is not None}
        is_word, read = callable(getattr(item, "mentions", None)), list[Any]()
        while asked := [name for name in methods if is_word or name in self.names or name == "__call__"]:
            for name in asked:
                del held[name]
                read.append(methods.pop(name))
                self.know(read[-1])
        held |= {} if is_class else getattr(item, "__dict__", {})
        for name in sorted(self.names & held.keys()):
            value = held[name]
            read += [name, getattr(item, name, None) if type(value) is types.MemberDescriptorType else value]
        if isinstance(item, dict):
            read += [part for pair in item.items() for part in pair]
        return [*read, *item] if isinstance(item, (list, tuple, deque)) else read

    def know(self, function: types.FunctionType) -> None:
        """Note which attributes a function may ask for."""
        for code in codes_of(function.__code__):
            self.names.update(code.co_names, [each for each in code.co_consts if type(each) is str])  # also of getattr

    def of_function(self, function: types.FunctionType) -> list[Any]:
        self.know(function)
        known = function.__globals__
        held = [part for name in sorted(_globals_of(function.__code__) & known.keys()) for part in (name, known[name])]
        try:
            return [function.__code__, *values_of(function), *held]
        except CannotTellError:  # something captured has no value yet
            return [function.__code__, *held]


def _function_of(member: Any) -> types.FunctionType | None:
    """What runs as a member of a class is asked for or called; None for a value."""
    kind = type(member)
    if kind is property:
        member = member.fget
    elif kind is functools.cached_property:
        member = member.func
    elif kind in (staticmethod, classmethod):
        member = member.__func__
    return member if type(member) is types.FunctionType else None


def _name_of(item: Any) -> Any:
    return getattr(item, "__qualname__", None) or getattr(item, "__name__", None)


def codes_of(code: types.CodeType) -> Iterator[types.CodeType]:
    """Code with that of the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from codes_of(constant)


def values_of(function: types.FunctionType) -> list[Any]:
    """Defaults of a function, and what it has captured."""
    try:
        cells = [cell.cell_contents for cell in function.__closure__ or ()]
    except ValueError as unbound:
        raise CannotTellError(function) from unbound
    keywords = [part for pair in (function.__kwdefaults__ or {}).items() for part in pair]
    return [function.__defaults__, tuple(keywords), tuple(cells)]


def _require_fixed(values: Iterable[Any]) -> None:
    for value in values:
        if type(value) in (list, np.ndarray):
            raise CannotTellError(value)
        if type(value) is tuple:
            _require_fixed(value)
