"""Named results: a table from names to expressions that are made when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

from mbd.errors import UnknownNameError, nearest
from mbd.tape.node import Node, Scalar, Tape

AXES = "xyz"
"""Components of a vector result: 'left shank.end.x', …"""


class Outputs:
    """Results by name; each is traced at its first use and kept.

    base : results that are offered here too
    finish : what is done to every result in the end
    """

    def __init__(self, tape: Tape, base: Outputs | None = None, finish: Callable[[Scalar], Node] | None = None) -> None:
        self._finish = tape.lift if finish is None else finish
        self._tape = tape
        self._makers: dict[str, Callable[[], Scalar]] = {} if base is None else dict(base._makers)
        self._made: dict[str, Node] = {}
        self._spelled: dict[str, str] = {}
        self._unlisted: set[str] = set() if base is None else set(base._unlisted)

    def alias(self, spelled: str, name: str) -> None:
        """Another spelling of a name, which is not listed."""
        self._spelled[spelled] = name

    def add(self, name: str, make: Callable[[], Scalar], listed: bool = True) -> None:
        """Offer a scalar, among the names or not; the first offer of a name stays."""
        if name not in self._makers:
            self._makers[name] = make
            self._unlisted.update(() if listed else (name,))

    def value(self, name: str, value: Scalar) -> None:
        """Offer a scalar that is already known."""
        self.add(name, lambda: value)

    def triple(
        self, name: str, make: Callable[[], Sequence[Scalar]], suffixes: Sequence[str] = AXES, listed: bool = True
    ) -> None:
        """Offer the components 'name.x', 'name.y', 'name.z' of a vector that is made once."""
        made: list[Scalar] = []

        def component(k: int) -> Scalar:
            if not made:
                made.extend(make())
            return made[k]

        for k, suffix in enumerate(suffixes):
            self.add(f"{name}.{suffix}", partial(component, k), listed)

    def __call__(self, name: str) -> Node:
        """The node of a result; an unknown name is answered with the nearest known ones."""
        name = self._spelled.get(name, name)
        node = self._made.get(name)
        if node is None:
            make = self._makers.get(name)
            if make is None:
                raise UnknownNameError(nearest(name, self.names(), "result"))
            node = self._made[name] = self._finish(make())
        return node

    def offers(self, name: str) -> bool:
        """Whether there is a result of this name, in any spelling."""
        return self._spelled.get(name, name) in self._makers

    def names(self) -> Sequence[str]:
        """Everything that users can ask for."""
        return tuple(name for name in self._makers if name not in self._unlisted)

    def lists(self, name: str) -> bool:
        """Whether a name is one of `names`."""
        return name in self._makers and name not in self._unlisted

    def __contains__(self, name: str) -> bool:
        return name in self._makers

    def __iter__(self) -> Iterator[str]:
        return iter(self.names())
