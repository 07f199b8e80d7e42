"""How the records of the kernel are declared: numbers, flat arrays with their lengths, and places in arrays.

A record is a class with annotated fields: ``n: int`` and ``dt: float`` are numbers, `reals` and `integers` are flat
arrays, `place` is one number in an array, `formula` one that follows from others. Machine code knows a field by its
address (see `mbd.kernel.build`), interpreted code as an attribute.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mbd.errors import nearest

Reals: TypeAlias = NDArray[np.float64]
"""A flat array of float64."""
Integers: TypeAlias = NDArray[np.int64]
"""A flat array of int64."""


class Array:
    """A flat array: its length as a function of the sizes, if it is not given; whether the next step depends on it."""

    def __init__(self, length: Callable[[Any], int] | None, kept: bool) -> None:
        self.length, self.kept = length, kept


class Place:
    """One number in an array, at the index that its record gives it."""

    def __init__(self, array: str) -> None:
        self.array, self.index = array, -1

    def __get__(self, record: Any, owner: Any = None) -> Any:
        return self if record is None else getattr(record, self.array)[self.index]

    def __set__(self, record: Any, value: Any) -> None:
        getattr(record, self.array)[self.index] = value


class Formula:
    """A number that follows from other fields of its record."""

    def __init__(self, value: Callable[[Any], int]) -> None:
        self.value = value

    def __get__(self, record: Any, owner: Any = None) -> Any:
        return self if record is None else self.value(record)


def reals(length: Callable[[Any], int] | None = None, kept: bool = False) -> Any:
    """Declare an array of reals; `kept`: restored before a step, it helps to make the step the same to the bit."""
    return Array(length, kept)


def integers(length: Callable[[Any], int] | None = None, kept: bool = False) -> Any:
    """Declare an array of integers."""
    return Array(length, kept)


def place(array: str) -> Any:
    """Declare a number that lies in an array; places of an array follow each other as they are declared."""
    return Place(array)


def formula(value: Callable[[Any], int]) -> Any:
    """Declare a number that follows from other fields: an offset, or a number read from an array."""
    return Formula(value)


class Record:
    """Numbers and arrays by name; one put together from others has their fields, in the order of declaration.

    A name that none of them declares is an error, as it is to the translator. `renewed` has the names whose arrays were
    set since somebody cleared it.
    """

    __slots__ = ("__dict__", "__weakref__", "renewed")
    renewed: set[str]
    declared: ClassVar[list[type[Record]]] = []
    _names: ClassVar[frozenset[str]] = frozenset()

    def __init_subclass__(cls) -> None:
        Record.declared.append(cls)
        cls._names = frozenset(name for owner in cls.__mro__ for name in vars(owner).get("__annotations__", {}))

    def __init__(self, **fields: Any) -> None:
        object.__setattr__(self, "renewed", set())
        for name, value in fields.items():
            setattr(self, name, value)

    if not TYPE_CHECKING:  # which knows the declared names

        def __getattr__(self, name: str) -> Any:
            raise AttributeError(nearest(name, self._names, "field of the kernel", "There are"))

        def __setattr__(self, name: str, value: Any) -> None:
            if name not in self._names:
                raise AttributeError(nearest(name, self._names, "field of the kernel", "There are"))
            if value.__class__ is np.ndarray:
                self.renewed.add(name)
            object.__setattr__(self, name, value)


class Table:
    """The fields of a record, those of its bases among them.

    Attributes
    ----------
    integers, reals, real_arrays, integer_arrays : names of the fields with an address; addresses : all of them in order
    kept_reals, kept_integers : names of the arrays that the next step depends on
    places : array and index of each number that lies in one; formulas : records that declare them
    kinds : 'int', 'real', 'ints' or 'reals' of all of these but the formulas
    """

    def __init__(self, record: type[Record]) -> None:
        kinds = {"int": "int", "float": "real", "Integers": "ints", "Reals": "reals"}
        self.kinds: dict[str, str] = {}
        self.places: dict[str, tuple[str, int]] = {}
        self.formulas: dict[str, Any] = {}
        self._arrays: dict[str, Array] = {}
        self._counts: dict[str, int] = {}
        for owner in (each for each in Record.declared if issubclass(record, each)):
            for name, annotation in vars(owner).get("__annotations__", {}).items():
                if annotation not in kinds:
                    continue
                declared = vars(owner).get(name)
                if isinstance(declared, Formula):
                    self.formulas[name] = owner
                    continue
                self.kinds[name] = kinds[annotation]
                if isinstance(declared, Array):
                    self._arrays[name] = declared
                elif isinstance(declared, Place):
                    declared.index = self.length_of(declared.array)
                    self._counts[declared.array] = declared.index + 1
                    self.places[name] = declared.array, declared.index
        own = [name for name in self.kinds if name not in self.places]
        self.integers, self.reals, self.real_arrays, self.integer_arrays = (
            tuple(name for name in own if self.kinds[name] == kind) for kind in ("int", "real", "reals", "ints")
        )
        self.addresses = (*self.integers, *self.reals, *self.real_arrays, *self.integer_arrays, "code")
        self.kept_reals = tuple(name for name in self.real_arrays if self._arrays[name].kept)
        self.kept_integers = tuple(name for name in self.integer_arrays if self._arrays[name].kept)

    def length_of(self, array: str) -> int:
        """How many places of an array have a name."""
        return self._counts.get(array, 0)

    def lengths(self, record: Record, given: dict[str, int]) -> dict[str, int]:
        """Lengths of all arrays: those given, those declared for the sizes of a record, those of places."""
        found = {}
        for name, array in self._arrays.items():
            if name in given:
                found[name] = given[name]
            else:
                found[name] = self.length_of(name) if array.length is None else int(array.length(record))
        return found
