"""What is sought, as a function of numbers by name, with its derivative by them."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import shown
from mbd.errors import MbdError, ModelError
from mbd.tape.derivatives import jvp
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node, Tape


class Formula:
    """A function of numbers, recorded once.

    names : of the numbers that it takes; title : what it is called
    """

    def __init__(self, title: str, tape: Tape, output: Node, names: tuple[str, ...]) -> None:
        self.title, self.names = title, names
        self._output = output
        self._slopes = [jvp([output], {tape.input("p", k): 1.0})[0] for k in range(len(names))]

    def value(self, numbers: Mapping[str, float]) -> float:
        """The value."""
        return evaluate([self._output], self._given(numbers))[0]

    def slope(self, numbers: Mapping[str, float], slope_of: Callable[[str], Vector], size: int) -> Vector:
        """The derivative by all unknowns (size,), from those of the numbers."""
        if not self.names:
            return np.zeros(size)
        by = evaluate(self._slopes, self._given(numbers))
        return sum((factor * slope_of(name) for factor, name in zip(by, self.names, strict=True)), np.zeros(size))

    def _given(self, numbers: Mapping[str, float]) -> dict[Any, float]:
        return {("p", k): numbers[name] for k, name in enumerate(self.names)}


class _Named(Mapping[str, Node]):
    """Numbers by name, recorded as they are asked for."""

    def __init__(self, tape: Tape, check: Callable[[str], None]) -> None:
        self.tape, self.check, self.nodes = tape, check, dict[str, Node]()

    def __getitem__(self, name: str) -> Node:
        if name not in self.nodes:
            self.check(name)
            self.nodes[name] = self.tape.input("p", len(self.nodes))
        return self.nodes[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.nodes)

    def __len__(self) -> int:
        return len(self.nodes)


def formula(given: Any, what: str, check: Callable[[str], None]) -> Formula:
    """The function that a name or a user's function of numbers means; `check` raises for names that are none.

    Raises
    ------
    ModelError, UnknownNameError, TraceError
        for what is neither, and for functions that cannot be recorded.
    """
    tape = Tape()
    named = _Named(tape, check)
    if isinstance(given, str):
        return Formula(given, tape, named[given], tuple(named))
    if not callable(given) or isinstance(given, type):
        raise ModelError(
            f"{what} must be the name of a number, such as 'speed', or a function of numbers, such as "
            f"lambda n: n['speed'] ** 2, not {shown(given)}"
        )
    try:
        output = tape.lift(given(named))
    except MbdError as error:
        raise type(error)(f"{what}: {error}") from None
    except Exception as error:  # the user's code may raise anything
        raise ModelError(
            f"{what}: its function of numbers by name raises {type(error).__name__}: {error}; write it as "
            "lambda n: n['speed'] ** 2, with mbd.sin, mbd.where, … of what it takes"
        ) from None
    title = getattr(given, "__name__", "")
    return Formula(what if title in ("", "<lambda>") else title, tape, output, tuple(named))
