"""Tape outputs → straight functions of a target, one operation after the other in the order of the tape.

Every function is ``mbd.<name>(block, parameters, out)``; inputs are loaded once, nothing is reordered or contracted.
Sines and cosines come first, four at a time (see `trees.trigonometry`), because a call empties all registers. A
function above `MAX_OPERATIONS` operations is cut into parts of about `PART_OPERATIONS`, which hand values on through
an array of their caller: allocating registers costs more than linear time (16 000 operations: 0.8 s in one piece,
0.3 s in parts, which run 2 % slower), and ordering stores costs quadratic time (2000: 2.5 s, 0.2 s in parts).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol, TypeVar

from mbd.compile.elements import MIN_OPERATIONS, MIN_REPEATED, Angle, Element, Step, elements, stretches
from mbd.compile.layout import Layout
from mbd.errors import ModelError
from mbd.tape.derivatives import live
from mbd.tape.node import CONDITIONS, Node, Table
from mbd.trees.trigonometry import WIDTHS

MAX_OPERATIONS = 2500
"""Operations above which a function is cut into parts."""
PART_OPERATIONS = 250
"""Operations of a part."""
MIN_ZEROS = 12
"""Zeros side by side from which on they are written together: large matrices consist of little else."""
MIN_RUNS = 24
"""Such runs from which on all between the first and the last is cleared before anything is stored: LLVM takes 2 s for
200 calls that clear something behind one another, and 0.2 s for the rest of that function."""

SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
UNARY = {"neg": "-", "sqrt": "sqrt", "abs": "abs"}
ARRAYS = ("block", "parameters", "out")


Store = tuple[Node, int, int]
"""A value and the place that it goes to, or zero and the first of some places side by side, with their number."""


class Target(Protocol):
    """Verbs by which a language writes a straight function, on texts of its own: numbers, conditions (`flag`).

    load, store : a number of an array; clear : zeros side by side; load_from : the number at first + step · number
    arithmetic : + − × ÷; unary : '-', 'abs', 'sqrt'; library : a function of the C library
    cast : a value, with its kind, as 'real' or 'bool'
    compare : < <= > != of numbers; join : 'and', 'or' of conditions; select : both are computed, one is taken
    piece : how many of `count` ascending numbers from `first` on are not above x, less one, at least 0
    room, call : an array of the function itself, and another straight function
    load_at, store_at : at the place in a line of a table; table : one of whole numbers, for calls from a line on
    """

    symbol: str

    def number(self, value: float) -> str: ...
    def load(self, array: str, place: int) -> str: ...
    def store(self, value: str, array: str, place: int) -> None: ...
    def clear(self, array: str, first: int, count: int) -> None: ...
    def arithmetic(self, sign: str, a: str, b: str) -> str: ...
    def unary(self, operator: str, operand: str, kind: str) -> str: ...
    def floor(self, x: str) -> str: ...
    def library(self, name: str, *operands: str) -> str: ...
    def compare(self, sign: str, a: str, b: str) -> str: ...
    def join(self, word: str, a: str, b: str) -> str: ...
    def negate(self, flag: str) -> str: ...
    def select(self, flag: str, yes: str, no: str) -> str: ...
    def cast(self, value: tuple[str, str], kind: str) -> str: ...
    def piece(self, array: str, first: int, count: int, x: str) -> str: ...
    def load_from(self, array: str, first: int, step: int, number: str) -> str: ...
    def sines_and_cosines(self, angles: Sequence[str]) -> tuple[list[str], list[str]]: ...
    def room(self, name: str, size: int) -> None: ...
    def call(self, symbol: str, arrays: Sequence[str]) -> None: ...
    def load_at(self, array: str, entry: int) -> str: ...
    def store_at(self, value: str, array: str, entry: int) -> None: ...
    def table(self, numbers: Sequence[int]) -> None: ...
    def call_at(self, symbol: str, arrays: Sequence[str], entry: int) -> None: ...


T = TypeVar("T", bound=Target)


def lower(
    programs: Mapping[str, Sequence[Node]],
    layout: Layout,
    target: Callable[[str, Sequence[str], bool], T],
    large: int = MAX_OPERATIONS,
    part: int = PART_OPERATIONS,
    rolled: int = MIN_OPERATIONS,
) -> list[T]:
    """One function ``mbd.<name>`` per program, each after its parts.

    Parameters
    ----------
    programs : names and what each function writes to ``out``
    target : makes a function from its name, the names of its arrays, and whether it is a part of another
    large, part : operations above which a function is cut, and those of a part; stores beyond two parts cut it too
    rolled : operations from which on what repeats is written once (see `elements`)

    Raises
    ------
    ModelError
        for a name that a target cannot write.
    """
    found, known = list[T](), dict[Any, str]()
    for name, outputs in programs.items():
        if not re.fullmatch(r"[A-Za-z_][\w.]*", name, re.ASCII):
            raise ModelError(f"a compiled function cannot be called {name!r}; use letters, digits, '_' and '.'")
        symbol, whole = f"mbd.{name}", target(f"mbd.{name}", ARRAYS, False)
        steps, places = list(_steps(live(outputs))), _places(outputs)
        _clear_at_once(whole, outputs, places)
        operations, direct = sum(len(nodes) for nodes, _ in steps), _direct(outputs, places)
        stores = sum(len(own) for own in places.values() if outputs[own[0]].args)
        small = operations <= large and stores <= 2 * part
        if small and stores + len(direct) <= 2 * part:
            _Body(whole, places, layout, {}).steps(steps).rest(direct)
        else:
            # what repeats as elements, all else as parts, and outputs that nothing computes as parts of their own
            kinds = _rolled(steps, places, layout) if operations >= rolled else None
            parts = [
                (each, direct[:0]) for each in ([] if kinds else [steps] if small else _parts(steps, part, places))
            ]
            slots = kinds.slots if kinds else _slots([each for each, _ in parts])
            whole.room("work", len(slots) + 1)
            if kinds:
                found += kinds.written(whole, target, known)
            parts += [([], direct[first : first + part]) for first in range(0, len(direct), part)]
            for number, (each, own) in enumerate(parts):
                found.append(target(f"{symbol}.{number}", (*ARRAYS, "work"), True))
                _Body(found[-1], places, layout, slots).steps(each).rest(own)
                whole.call(found[-1].symbol, (*ARRAYS, "work"))
        found.append(whole)
    return found


class _Rolled:
    """Steps as elements of a few kinds, and what they hand on in ``work``."""

    def __init__(self, parts: list[list[Step]], places: dict[int, list[int]], layout: Layout) -> None:
        self.slots, self.places, self.layout = _slots(parts), places, layout
        self.elements = elements(parts, places, self.slots, lambda node: self._at(node)[0])
        self.kinds = {element.kind: element for element in reversed(self.elements)}

    @property
    def operations(self) -> int:
        """Operations of the kinds."""
        return sum(len(nodes) for element in self.kinds.values() for nodes, _ in element.steps)

    def _at(self, node: Node) -> tuple[str, int]:
        """Array and place of an input, or of what another element made."""
        if node.args:
            return "work", self.slots[node.index]
        kind, index = node.data
        return ("parameters", index) if kind == "p" else ("block", self.layout.place(kind, index))

    def _results(self, node: Node) -> Iterator[tuple[str, int]]:
        """Arrays and places that a result of an element goes to."""
        yield from (("out", place) for place in self.places.get(node.index, ()))
        if node.index in self.slots:
            yield "work", self.slots[node.index]

    def written(self, whole: T, target: Callable[[str, Sequence[str], bool], T], symbols: dict[Any, str]) -> list[T]:
        """A function of each kind that has none among `symbols`, and calls of these by `whole`."""
        found, table = list[T](), list[int]()
        for element in self.elements:
            if element.kind not in symbols:
                symbol = symbols[element.kind] = f"{whole.symbol}.kind{len(symbols)}"
                found.append(target(symbol, (*ARRAYS, "work", "table"), True))
                _ElementBody(found[-1], self, element)
            whole.call_at(symbols[element.kind], (*ARRAYS, "work"), len(table))
            table += [self._at(node)[1] for node in element.outside]
            table += [place for node in element.kept for _, place in self._results(node)]
        whole.table(table)
        for element in self.elements:
            for node in element.kept:
                self.places.pop(node.index, None)
        return found


def _rolled(steps: list[Step], places: dict[int, list[int]], layout: Layout) -> _Rolled | None:
    """Steps as elements where these repeat enough."""
    parts = stretches(steps)
    rolled = _Rolled(parts, places, layout)
    return rolled if parts and MIN_REPEATED * rolled.operations <= sum(len(nodes) for nodes, _ in steps) else None


class _Body:
    """Writes a function, or a part of it.

    places : where the outputs that are still to be stored go, by index of the node
    slots : places in ``work`` of values that one part makes and another uses
    names, flags : texts of numbers and conditions by index; each is made from the other when it is first asked for
    """

    def __init__(self, target: Target, places: dict[int, list[int]], layout: Layout, slots: dict[int, int]) -> None:
        self.target, self.places, self.layout, self.slots = target, places, layout, slots
        self.names: dict[int, str] = {}
        self.flags: dict[int, str] = {}
        self.pieces: dict[tuple[int, int], tuple[str, str]] = {}

    def steps(self, steps: Iterable[Step]) -> _Body:
        """The operations of some steps."""
        names, places, slots, arithmetic = self.names, self.places, self.slots, self.target.arithmetic
        for nodes, angles in steps:
            for node in nodes:
                index, sign = node.index, SIGNS.get(node.op)
                if sign is not None:
                    a, b = node.args
                    x = names.get(a.index) or self.number(a)
                    names[index] = arithmetic(sign, x, names.get(b.index) or self.number(b))
                elif node.op in CONDITIONS:
                    self.flags[index] = self.condition(node)
                else:
                    names[index] = self.function(node)
                if index in places or index in slots:
                    self.keep(node)
            if angles:
                self.angles(angles)
        return self

    def number(self, node: Node) -> str:
        """The value of a node as a number; inputs, and what another part made, are loaded when first asked for."""
        name = self.names.get(node.index)
        if name is None:
            if node.op == "const":
                name = self.target.number(node.data)
            elif node.index in self.flags:
                name = self.target.cast((self.flags[node.index], "bool"), "real")
            elif node.op == "input":
                kind, index = node.data
                parameter = kind == "p"
                name = self.target.load(ARRAYS[parameter], index if parameter else self.layout.place(kind, index))
            else:
                name = self.target.load("work", self.slots[node.index])
            self.names[node.index] = name
        return name

    def flag(self, node: Node) -> str:
        """The value of a node as a condition."""
        name = self.flags.get(node.index)
        if name is None:
            name = self.flags[node.index] = self.target.cast((self.number(node), "real"), "bool")
        return name

    def keep(self, node: Node) -> None:
        """Store a value where the caller, or a later part, finds it."""
        for place in self.places.pop(node.index, ()):
            self.target.store(self.number(node), "out", place)
        if node.index in self.slots:
            self.target.store(self.number(node), "work", self.slots[node.index])

    def rest(self, stores: Iterable[Store]) -> _Body:
        """Outputs that are inputs or constants."""
        for node, first, number in stores:
            if number > 1:
                self.target.clear("out", first, number)
            else:
                self.target.store(self.number(node), "out", first)
        return self

    def condition(self, node: Node) -> str:
        op, args, target = node.op, node.args, self.target
        if op == "lt" or op == "le":
            return target.compare("<" if op == "lt" else "<=", self.number(args[0]), self.number(args[1]))
        return target.negate(self.flag(args[0])) if op == "not" else target.join(op, *map(self.flag, args))

    def function(self, node: Node) -> str:
        """Every operation on numbers besides + − × ÷."""
        op, args, target = node.op, node.args, self.target
        if op == "where":
            return target.select(self.flag(args[0]), self.number(args[1]), self.number(args[2]))
        if op == "table":
            return self.table(node)
        x = self.number(args[0])
        if op in UNARY:
            return target.unary(UNARY[op], x, "real")
        if op == "floor":
            return target.arithmetic("+", target.floor(x), target.number(0.0))  # 0 for −0
        if op == "sign":
            zero, above, below = map(target.number, (0.0, 1.0, -1.0))
            other = target.arithmetic("+", x, zero)  # 0 for ±0, and NaN stays
            other = target.select(target.compare("<", x, zero), below, other)
            return target.select(target.compare(">", x, zero), above, other)
        if op == "min" or op == "max":  # x where it is not a number
            y = self.number(args[1])
            first = target.compare("<" if op == "min" else ">", x, y)
            return target.select(target.join("or", first, target.compare("!=", x, x)), x, y)
        return target.library(op, *map(self.number, args))

    def table(self, node: Node) -> str:
        """A derivative of a piecewise cubic (Horner); the piece is searched once for each argument."""
        table: Table
        (table, order), target = node.data, self.target
        argument, n, start = node.args[0], len(table.breaks), self.layout.table_offsets[table.index]
        found = self.pieces.get((table.index, argument.index))
        if found is None:
            x = self.number(argument)
            piece = target.piece("parameters", start, n, x)
            found = piece, target.arithmetic("-", x, target.load_from("parameters", start, 1, piece))
            self.pieces[table.index, argument.index] = found
        piece, s = found
        value = target.number(0.0) if order == 3 else ""  # so that a NaN comes out again
        for power in range(3, order - 1, -1):
            c = target.load_from("parameters", start + n + power, 4, piece)
            factor = math.perm(power, order)
            if factor != 1:
                c = target.arithmetic("*", target.number(float(factor)), c)
            value = target.arithmetic("+", target.arithmetic("*", value, s), c) if value else c
        return value

    def angles(self, angles: Sequence[Angle]) -> None:
        """Sines and cosines of up to four angles together."""
        halves = self.target.sines_and_cosines([self.number(argument) for argument, _, _ in angles])
        for (_, *nodes), *values in zip(angles, *halves, strict=True):
            for node, value in zip(nodes, values, strict=True):
                if node is not None:
                    self.names[node.index] = value
                    self.keep(node)


class _ElementBody(_Body):
    """Writes the function of a kind of elements, which finds places in a line of a table."""

    def __init__(self, target: Target, rolled: _Rolled, element: Element) -> None:
        super().__init__(target, {node.index: [] for node in element.kept}, rolled.layout, {})
        self.entries = {node.index: (rolled._at(node)[0], k) for k, node in enumerate(element.outside)}
        first, self.results = len(self.entries), dict[int, list[tuple[str, int]]]()
        for node in element.kept:
            arrays = [array for array, _ in rolled._results(node)]
            self.results[node.index] = [(array, first + k) for k, array in enumerate(arrays)]
            first += len(arrays)
        self.steps(element.steps)

    def number(self, node: Node) -> str:
        if node.index in self.entries and node.index not in self.names:
            self.names[node.index] = self.target.load_at(*self.entries[node.index])
        return super().number(node)

    def keep(self, node: Node) -> None:
        for array, entry in self.results.get(node.index, ()):
            self.target.store_at(self.number(node), array, entry)


def _clear_at_once(target: Target, outputs: Sequence[Node], places: dict[int, list[int]]) -> None:
    """Clear stretches of outputs at the beginning where many runs of zeros are in one, and forget these zeros."""
    zeros = next((own for own in places.values() if outputs[own[0]].is_zero), [])
    left, number = zeros, outputs[zeros[0]].index if zeros else -1
    for begin, end in _stretches(outputs, zeros):
        target.clear("out", begin, end - begin)
        left = [place for place in left if not begin <= place < end]
    if left:
        places[number] = left
    else:
        places.pop(number, None)


def _stretches(outputs: Sequence[Node], zeros: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Ends of stretches with many runs of zeros, between which nothing is to be left as it is."""
    groups, last = list[list[tuple[int, int]]](), -1
    for first, number in _runs(zeros) if zeros else ():
        if number < MIN_ZEROS:
            continue
        if last < 0 or any(node.is_untouched for node in outputs[last:first]):
            groups.append([])
        last = first + number
        groups[-1].append((first, last))
    yield from ((group[0][0], group[-1][1]) for group in groups if len(group) >= MIN_RUNS)


def _runs(places: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Ascending places as runs (first, how many)."""
    first, number = places[0], 0
    for place in places:
        if place != first + number:
            yield first, number
            first, number = place, 0
        number += 1
    yield first, number


def _direct(outputs: Sequence[Node], places: Mapping[int, list[int]]) -> list[Store]:
    """Outputs that are inputs or constants, in the order of their first places."""
    found = list[Store]()
    for node in {node.index: node for node in outputs if not node.args and node.index in places}.values():
        for first, number in _runs(places[node.index]):
            if node.is_zero and number >= MIN_ZEROS:
                found.append((node, first, number))
            else:
                found += [(node, place, 1) for place in range(first, first + number)]
    return found


def _places(outputs: Sequence[Node]) -> dict[int, list[int]]:
    """Where each node is asked for, by its index."""
    places: dict[int, list[int]] = {}
    untouched: Node | None = None  # one node, however many outputs it stands for
    for k, node in enumerate(outputs):
        known = places.get(node.index)
        if known is not None:
            known.append(k)
        elif node is not untouched:
            if node.is_untouched:
                untouched = node
            else:
                places[node.index] = [k]
    return places


def _steps(order: list[Node]) -> Iterator[Step]:
    """The operations in an order that asks for sines and cosines as early and as many together as possible."""
    asked: dict[int, dict[str, Node]] = {}
    arguments: dict[int, Node] = {}
    for node in order:
        if node.op == "sin" or node.op == "cos":
            argument = node.args[0]
            arguments[argument.index] = argument
            asked.setdefault(argument.index, {})[node.op] = node
    done: set[int] = set()
    level: dict[int, int] = {}
    for node in live(arguments.values()):
        deepest = max((level[arg.index] for arg in node.args), default=0)
        level[node.index] = deepest + (node.op == "sin" or node.op == "cos")
    ranked = sorted(arguments.values(), key=lambda node: (level[node.index], node.index))
    for group in _groups(ranked, level):
        before = [n for n in live(group, done) if n.index not in done and n.op != "sin" and n.op != "cos" and n.args]
        angles = [(arg, asked[arg.index].get("sin"), asked[arg.index].get("cos")) for arg in group]
        done.update(node.index for node in before)
        done.update(node.index for _, *values in angles for node in values if node is not None)
        yield before, angles
    yield [n for n in order if n.args and n.index not in done], ()


def _groups(ranked: list[Node], level: dict[int, int]) -> Iterator[list[Node]]:
    group: list[Node] = []
    for node in ranked:
        if group and (len(group) == WIDTHS[-1] or level[node.index] != level[group[0].index]):
            yield group
            group = []
        group.append(node)
    if group:
        yield group


def _parts(steps: list[Step], size: int, places: Mapping[int, Sequence[int]]) -> Iterator[list[Step]]:
    """The same steps in portions of about `size` operations, or stores where these are more."""
    portion: list[Step] = []
    filled = 0
    for nodes, angles in steps:
        piece: list[Node] = []
        for node in nodes:
            weight = max(1, len(places.get(node.index, ())))
            if filled and filled + weight > size:
                yield [*portion, (piece, ())]
                portion, piece, filled = [], [], 0
            piece.append(node)
            filled += weight
        portion.append((piece, angles))
        filled += 4 * len(angles)
        if filled >= size:
            yield portion
            portion, filled = [], 0
    if portion:
        yield portion


def _slots(parts: list[list[Step]]) -> dict[int, int]:
    """Places in ``work`` of the values that one part makes and another uses."""
    made: dict[int, int] = {}
    slots: dict[int, int] = {}

    def use(node: Node, number: int) -> None:
        if node.args and made[node.index] != number:
            slots.setdefault(node.index, len(slots))

    for number, steps in enumerate(parts):
        for nodes, angles in steps:
            for node in nodes:
                made[node.index] = number
                for arg in node.args:
                    use(arg, number)
            for argument, *values in angles:
                use(argument, number)
                made.update((node.index, number) for node in values if node is not None)
    return slots
