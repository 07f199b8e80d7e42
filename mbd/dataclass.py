"""Dataclasses whose methods are made when they are first needed.

`dataclasses.dataclass` writes and compiles the text of some six methods for each class, 0.4 ms of every process for
each of the 230 classes that a first step of a walker imports; a process uses the methods of a third of them. Here a
class is given placeholders, and the first look at one of them makes the class the dataclass that it would have been.
"""

import dataclasses
import sys
from collections.abc import Callable
from operator import attrgetter
from reprlib import recursive_repr
from threading import RLock
from typing import TYPE_CHECKING, Any, TypeVar

__all__ = ["LateFields", "changed_late", "dataclass", "forwarded", "found_late", "makes_late"]


def forwarded(path: str) -> Any:
    """What a class has from one of its fields, 'joint.labels': a value, or a method that is called there."""
    return property(attrgetter(path))


class _Factory:
    """Default of an argument whose field has a factory, as signatures show it."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY: Any = _Factory()
_ONE_AT_A_TIME = RLock()


class _Placeholder:
    """A method, or table of fields, of a class that is no dataclass yet."""

    def __init__(self, owner: type, name: str, options: dict[str, bool], fields: dict[str, Any]) -> None:
        self.owner, self.name, self.options, self.fields = owner, name, options, fields

    def __get__(self, instance: Any, kind: type | None = None) -> Any:
        with _ONE_AT_A_TIME:
            if self.owner.__dict__.get(self.name) is self:
                self._complete()
        found = self.owner.__dict__[self.name]
        return found.__get__(instance, kind) if hasattr(found, "__get__") else found

    def _complete(self) -> None:
        """Make the class a dataclass; its `__init__` is put in its place at once, as other threads may wait for it."""
        owner: Any = self.owner
        for name, value in list(owner.__dict__.items()):
            if isinstance(value, _Placeholder) and name != "__init__":
                delattr(owner, name)
        for name, value in self.fields.items():
            setattr(owner, name, value)
        for name in ("__setattr__", "__delattr__"):  # of an attempt that an interrupt has cut off
            if getattr(owner.__dict__.get(name), "__module__", "") == __name__:
                delattr(owner, name)
        frozen, first = self.options.get("frozen", False), not any(map(dataclasses.is_dataclass, owner.__mro__[1:]))
        own = first and not {"__setattr__", "__delattr__"} & owner.__dict__.keys()
        dataclasses.dataclass(init=False, repr=False, eq=False, frozen=frozen and not own)(owner)
        if frozen and own:
            _freeze(owner)
        if self.options.get("repr", True) and "__repr__" not in owner.__dict__:
            owner.__repr__ = _shown(owner)
        if self.options.get("eq", True):
            _compared(owner, frozen)
        owner.__init__ = _initializer(owner, frozen)


def _lazy(owner: type | None = None, /, **options: bool) -> Any:
    """See `dataclasses.dataclass`; classes with an `__init__` of their own, or no words, are dataclasses at once."""
    if owner is None:
        return lambda decorated: _lazy(decorated, **options)
    known = options.get("init", True) and set(options) <= {"frozen", "eq", "repr"}
    if not known or "__init__" in owner.__dict__ or owner.__doc__ is None:
        return dataclasses.dataclass(**options)(owner)
    names = ["__init__", "__match_args__", "__dataclass_fields__", "__dataclass_params__"]
    names += ["__repr__"] * options.get("repr", True) + ["__eq__", "__hash__"] * options.get("eq", True)
    names += ["__setattr__", "__delattr__"] * options.get("frozen", False)
    fields = {name: value for name, value in owner.__dict__.items() if isinstance(value, dataclasses.Field)}
    for name, value in fields.items():  # what the class has until then, as it has it afterwards
        if value.default is dataclasses.MISSING:
            delattr(owner, name)
        else:
            setattr(owner, name, value.default)
    for name in names:
        if name not in owner.__dict__:
            setattr(owner, name, _Placeholder(owner, name, options, fields))
    return owner


def _freeze(owner: Any) -> None:
    """Make a dataclass without others among its bases a frozen one; `dataclasses` compiles a text for each of them."""
    names = frozenset(field.name for field in dataclasses.fields(owner))

    def __setattr__(self: Any, name: str, value: Any) -> None:  # noqa: N807
        if type(self) is owner or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(owner, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:  # noqa: N807
        if type(self) is owner or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(owner, self).__delattr__(name)

    owner.__dataclass_params__.frozen = True
    owner.__setattr__, owner.__delattr__ = __setattr__, __delattr__


def _shown(owner: Any) -> Any:
    """The `__repr__` of a dataclass."""
    names = [field.name for field in dataclasses.fields(owner) if field.repr]

    @recursive_repr()
    def __repr__(self: Any) -> str:  # noqa: N807
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    __repr__.__qualname__ = f"{owner.__qualname__}.__repr__"
    return __repr__


def _compared(owner: Any, frozen: bool) -> None:
    """Give a dataclass its `__eq__` and `__hash__`, where it has none of its own."""
    fields, own = dataclasses.fields(owner), owner.__dict__
    compared = _values_of([field.name for field in fields if field.compare])
    hashed = _values_of([field.name for field in fields if (field.compare if field.hash is None else field.hash)])

    def __eq__(self: Any, other: Any) -> Any:  # noqa: N807
        return compared(self) == compared(other) if type(other) is type(self) else NotImplemented

    def __hash__(self: Any) -> int:  # noqa: N807
        return hash(hashed(self))

    has_own = "__hash__" in own and not (own["__hash__"] is None and "__eq__" in own)
    if not has_own:
        owner.__hash__ = __hash__ if frozen else None
    if "__eq__" not in own:
        owner.__eq__ = __eq__


def _values_of(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """What reads some attributes as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


def _initializer(owner: Any, frozen: bool) -> Any:
    """The `__init__` that `dataclasses.dataclass` would write."""
    scope: dict[str, Any] = {"_set": object.__setattr__, "_FACTORY": _FACTORY}
    by_place: list[str] = []
    by_name: list[str] = []
    lines: list[str] = []
    found: dict[str, Any] = {}
    for field in dataclasses.fields(owner):
        name, argument, value = field.name, field.name, field.name
        if field.default_factory is not dataclasses.MISSING:
            scope[f"_made_{name}"] = field.default_factory
            argument += "=_FACTORY"
            value = f"_made_{name}() if {name} is _FACTORY else {name}" if field.init else f"_made_{name}()"
        elif field.default is not dataclasses.MISSING:
            scope[f"_value_{name}"] = field.default
            argument += f"=_value_{name}"
            if not field.init:
                continue  # the class has it
        elif not field.init:
            continue
        if field.init:
            (by_name if field.kw_only else by_place).append(argument)
        lines.append(f"_set(self, {name!r}, {value})" if frozen else f"self.{name} = {value}")
    if hasattr(owner, "__post_init__"):
        lines.append("self.__post_init__()")
    arguments = ", ".join(["self", *by_place, *(["*", *by_name] if by_name else [])])
    body = "\n  ".join(lines) or "pass"
    text = f"def made({', '.join(scope)}):\n def __init__({arguments}):\n  {body}\n return __init__"
    exec(text, vars(sys.modules[owner.__module__]), found)
    made = found["made"](**scope)
    made.__qualname__ = f"{owner.__qualname__}.__init__"
    types = {field.name: field.type for field in dataclasses.fields(owner) if field.init}
    made.__annotations__ = {**types, "return": None}
    return made


class LateFields:
    """An object of which `found_late` may find out fields as somebody first looks at them."""

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            make = vars(self).get("_late", {}).get(name)
            if make is None:
                raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}", name=name, obj=self)
            vars(self)[name] = value = make()
            vars(self)["_late"].pop(name, None)
            return value

    def __getstate__(self) -> dict[str, Any]:
        """Copies and files have the values themselves."""
        for name in [*vars(self).get("_late", ())]:
            getattr(self, name)
        return {name: value for name, value in vars(self).items() if name != "_late"}


Late = TypeVar("Late", bound=LateFields)


def found_late(one: Late, name: str, make: Callable[[], Any]) -> Late:
    """An object that was just made, a field of which, one with a `default_factory`, is made when it is looked at."""
    del vars(one)[name]
    vars(one).setdefault("_late", {})[name] = make
    return one


def makes_late(one: LateFields, name: str) -> Any:
    """What finds out a field that nobody has looked at; None of others."""
    return vars(one).get("_late", {}).get(name)


def changed_late(one: LateFields, name: str, change: Callable[[Any], Any]) -> None:
    """Change a field; one that nobody has looked at is changed as it is made."""
    make = makes_late(one, name)
    if make is None:
        vars(one)[name] = change(getattr(one, name))
    else:
        vars(one)["_late"] = {**vars(one)["_late"], name: lambda: change(make())}


if TYPE_CHECKING:
    from dataclasses import dataclass
else:
    dataclass = _lazy
