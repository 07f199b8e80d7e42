"""What a set of equations is, as a digest: equal digests mean equal programs, to the bit.

Programs are functions of what the derivation left: all nodes of the tape in order, and which of them are balance, rows,
contacts, motions of bodies and so on. Both are read here as they are; nothing is inferred from the words of the model.
So whatever users' functions were made of, their traced expressions count, and nothing else. Values of parameters are
inputs of programs, and no part of the digest. The sources of the package that turn equations into programs are.

What is met and not known here, such as a joint of a class of a user's own, has no digest.
"""

import marshal
import os
from collections.abc import Iterable, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from mbd.bodies.base import Body
from mbd.equations.derivation import TreeGeometry
from mbd.equations.equations import Effect, Equations, Guard, Parameter
from mbd.joints.base import Joint
from mbd.tape.node import Node, Tape

SOURCES = (
    "arrays.py", "configuration.py", "equal.py", "scope.py", "bodies", "compile", "equations", "joints", "tape",
    "trees",
)  # fmt: skip
"""Of the package: what programs are made by. Joints say how their coordinates compose, bodies have the algebra."""

FIELDS = (
    "balance", "rows", "contacts", "guards", "kinetic", "potential", "compose", "chart", "frictions", "turns",
    "facings", "coordinates", "states", "velocity_names", "parameters", "configuration",
)  # fmt: skip
"""Of `Equations`: what programs are made of, besides tape and geometry. Results and effects make their own."""

PARTS = ("placement", "views", "inputs", "bodies", "carried")
"""The same of the scope of a `TreeGeometry`."""


class _Unknown(Exception):
    """Something met that has no digest."""


@cache
def source_digest() -> str | None:
    """Of the sources that turn equations into programs; None where they cannot be read."""
    root, digest = str(Path(__file__).parent.parent), sha256()
    try:
        for name in SOURCES:
            for path in [f"{root}/{name}"] if name.endswith(".py") else sources_of(f"{root}/{name}"):
                with open(path, "rb") as file:
                    content = file.read()
                digest.update(f"{path[len(root) :]} {len(content)}\n".encode())
                digest.update(content)
    except OSError:
        return None
    return digest.hexdigest()


def sources_of(folder: str) -> list[str]:
    """Python files below a folder, in order, with / between names; three times as fast as `pathlib`."""
    found, waiting = [], [folder]
    while waiting:
        with os.scandir(place := waiting.pop()) as entries:
            for entry in entries:
                if entry.name.endswith(".py"):
                    found.append(f"{place}/{entry.name}")
                elif entry.is_dir() and entry.name != "__pycache__":
                    waiting.append(f"{place}/{entry.name}")
    return sorted(found)


def fingerprint(equations: Equations) -> str | None:
    """The digest of equations as they are now, with all that is on their tape; None for what cannot be known."""
    source = source_digest()
    if source is None:
        return None
    tape, geometry = equations.tape, equations.geometry
    parts: list[Any] = [getattr(equations, name) for name in FIELDS]
    try:
        if isinstance(geometry, TreeGeometry):
            parts += [getattr(geometry.scope, name) for name in PARTS]
            parts += [geometry.dynamics, geometry.work, geometry.rests, geometry.constraints, geometry.planar]
        elif geometry is not None:
            raise _Unknown
        words = _Reading(tape).of(parts)
    except _Unknown:
        return None
    with tape.lock:
        nodes = tuple(tape.keys())
    tables = [(table.name, tuple(table.flat)) for table in tape.tables]
    whole: Any = (source, nodes, tables, words)
    # the last version without references, whose bytes follow from the values alone
    return sha256(marshal.dumps(whole, 2)).hexdigest()


class _Reading:
    """Objects as a flat list of plain values; what is met again stands as the number of its first meeting."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.met: dict[int, int] = {}
        self.words: list[Any] = []

    def of(self, root: Any) -> list[Any]:
        """Everything below a root, in an order that follows from the objects alone."""
        stack, add, tape = [root], self.words.append, self.tape
        while stack:
            item = stack.pop()
            kind = item.__class__
            if kind is Node:
                if item.tape is not tape:
                    raise _Unknown
                add(("node", item.index))
            elif kind is float or kind is int or kind is str or kind is bool or item is None:
                add(item)
            elif id(item) in self.met:
                add(("again", self.met[id(item)]))
            else:
                self.met[id(item)] = len(self.met)
                stack += self.inside(item, kind)
        return self.words

    def inside(self, item: Any, kind: type) -> list[Any]:
        """What an object holds, last first; its kind and size are noted at once."""
        add = self.words.append
        if kind is tuple or kind is list:
            if {*map(type, item)} == {int}:  # paths, as many as bodies, of as many coordinates
                add((kind.__name__, *item))
                return []
            add((kind.__name__, len(item)))
            return list(item[::-1])
        if kind is dict:
            add(("dict", len(item)))
            return [part for pair in reversed(item.items()) for part in reversed(pair)]
        if kind is set or kind is frozenset:
            add(("set", *self.sorted(item)))
            return []
        if isinstance(item, np.ndarray):
            add(("array", item.dtype.str, item.shape, item.tobytes()))
            return []
        if kind is Tape:
            add("tape")
            return []
        if not kind.__module__.startswith("mbd."):
            raise _Unknown
        name = f"{kind.__module__}.{kind.__qualname__}"
        if isinstance(item, Parameter | Body | Effect):  # a name; values of parameters are inputs, effects are results
            add((name, item.name))
            return []
        if isinstance(item, Joint):
            add((name, item.name))
            return [part for part in vars(item).values() if isinstance(part, Joint)]
        held = {"value": item.value, "rate": item.rate} if isinstance(item, Guard) else vars(item)
        add((name, len(held)))
        return [part for pair in reversed(held.items()) for part in reversed(pair)]

    def sorted(self, items: Iterable[Any]) -> Sequence[Any]:
        """The members of a set, nodes by their index and texts, in order."""
        nodes = sorted(item.index for item in items if item.__class__ is Node and item.tape is self.tape)
        texts = sorted(item for item in items if item.__class__ is str)
        if len(nodes) + len(texts) != len(list(items)):
            raise _Unknown
        return [*nodes, *texts]
