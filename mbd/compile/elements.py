"""Straight-line code that repeats, element after element, found again as elements of a few kinds.

Bodies, joints and forces of a kind leave the same operations on the tape, on other inputs. The operations of a program
are cut where few neighbouring ones say so (content-defined chunking: a place whose hash is the least within `REACH`
operations), so that equal stretches are cut alike wherever they lie. Stretches that differ only in what they read and
in where their results go are elements of one kind, whose code is written once and takes places from a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any
from zlib import crc32

import numpy as np

from mbd.dataclass import dataclass
from mbd.tape.node import Node

MIN_OPERATIONS, MIN_REPEATED = 30_000, 3
"""Operations of a program, and how often those of a kind occur on average, from which on its code is written once.

Below that straight-line code runs a little faster.
"""
WINDOW, REACH, SHORTEST, LONGEST = 8, 100, 40, 400
"""Operations that decide on a cut, among how many to either side, and those of a stretch at least and at most."""

Angle = tuple[Node, Node | None, Node | None]
"""An argument, with the sine and the cosine that are asked of it."""
Step = tuple[list[Node], Sequence[Angle]]
"""Operations, and then the sines and cosines of some angles together."""


@dataclass(frozen=True)
class Element:
    """A stretch of operations.

    kind : what it shares with others of its kind
    outside : what it reads besides numbers; kept : its results that others read, in the order of their making
    """

    kind: tuple[Any, ...]
    steps: list[Step]
    outside: list[Node]
    kept: list[Node]


def stretches(steps: Sequence[Step]) -> list[list[Step]]:
    """The same steps, cut alike wherever operations are alike; none where few are."""
    signs, known = list[int](), dict[tuple[Any, ...], int]()
    for nodes, angles in steps:
        for node in nodes:
            read = (arg.op if arg.args else arg.data if arg.op == "const" else arg.data[0] for arg in node.args)
            signs.append(_sign(known, (node.op, *read)))
        if angles:
            signs.append(_sign(known, ("angles", len(angles))))
    sums = _sums(np.array(signs, dtype=np.uint64))
    if len(sums) < MIN_REPEATED * len(np.unique(sums)):
        return []
    cuts, found, done = _cuts(sums), list[list[Step]](), 0
    cut = next(cuts)  # 0
    for nodes, angles in steps:
        first = 0
        while first < len(nodes) + bool(angles):
            if done + first == cut:
                found.append([])
                cut = next(cuts)
            last = min(cut - done, len(nodes) + bool(angles))
            found[-1].append((nodes[first:last], angles if last > len(nodes) else ()))
            first = last
        done += len(nodes) + bool(angles)
    return found


def _sign(known: dict[tuple[Any, ...], int], operation: tuple[Any, ...]) -> int:
    """A number for an operation, the same in every process."""
    found = known.get(operation)
    if found is None:
        found = known[operation] = crc32(repr(operation).encode())
    return found


def _sums(signs: Any) -> Any:
    """A number for each operation with those behind it."""
    number, ahead = len(signs), np.concatenate([signs, np.zeros(WINDOW, np.uint64)])
    sums: Any = np.zeros(number, np.uint64)
    for k in range(WINDOW):
        sums = sums * np.uint64(0x9E3779B97F4A7C15) + ahead[k : k + number]
    return (sums ^ (sums >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)


def _cuts(sums: Any) -> Iterator[int]:
    """Where stretches begin, from 0 on, and where the last one ends."""
    beyond: Any = np.full(REACH, np.iinfo(np.uint64).max, np.uint64)
    around = np.lib.stride_tricks.sliding_window_view(np.concatenate([beyond, sums, beyond]), 2 * REACH + 1)
    last = 0
    yield 0
    for cut in [*np.flatnonzero(around.min(axis=1) == sums).tolist(), len(sums)]:
        if cut - last < SHORTEST and cut != len(sums):
            continue
        while cut - last > LONGEST:
            last += LONGEST // 2
            yield last
        if cut > last:
            yield cut
        last = cut


def elements(
    parts: Sequence[list[Step]],
    places: Mapping[int, Sequence[int]],
    slots: Mapping[int, int],
    array: Callable[[Node], str],
) -> list[Element]:
    """Each part as an element.

    Parameters
    ----------
    places, slots : by the index of a node, where it is asked for, and its place among what parts hand on
    array : of an input, or of what another part made
    """
    return [_element(steps, places, slots, array) for steps in parts]


def _element(
    steps: list[Step], places: Mapping[int, Sequence[int]], slots: Mapping[int, int], array: Callable[[Node], str]
) -> Element:
    inside, outside, kept = dict[int, int](), dict[int, int](), list[Node]()
    kind, read = list[Any](), list[Node]()

    def use(node: Node) -> None:
        """A value made before, by its number, or one from outside: −1, −2, …, whose array follows the first time."""
        index = node.index
        number = inside.get(index) or outside.get(index)
        if number is None:
            number = outside[index] = -1 - len(outside)
            if node.op == "const":
                kind.append(node.data)
            else:
                kind.append(array(node))
                read.append(node)
        kind.append(number)

    def make(node: Node) -> None:
        index = node.index
        inside[index] = 1 + len(inside)
        if index in places or index in slots:
            kept.append(node)
            kind.append((len(places.get(index, ())), index in slots))

    for nodes, angles in steps:
        for node in nodes:
            kind.append(node.op if node.op != "table" else (node.data[0].index, node.data[1]))
            for arg in node.args:
                use(arg)
            make(node)
        for argument, *values in angles:
            kind.append("angle")
            use(argument)
            for value in values:
                kind.append(value is not None)
                if value is not None:
                    make(value)
        kind.append("")
    return Element(tuple(kind), steps, read, kept)
