"""Functions of a model by name."""

from collections.abc import Iterator
from typing import Generic, TypeVar

from mbd.errors import UnknownNameError, nearest

F = TypeVar("F")


class ByName(Generic[F]):
    """Functions found by name; a wrong name is answered with the nearest one. Whoever derives from it adds them.

    kind : what they are called in that answer
    """

    def __init__(self, kind: str = "function") -> None:
        self._kind = kind
        self._functions: dict[str, F] = {}

    def __getitem__(self, name: str) -> F:
        function = self._functions.get(name)
        if function is None:
            raise UnknownNameError(nearest(name, self._functions, self._kind, "There are"))
        return function

    def __contains__(self, name: object) -> bool:
        return name in self._functions

    def __iter__(self) -> Iterator[str]:
        return iter(self._functions)

    def __len__(self) -> int:
        return len(self._functions)
