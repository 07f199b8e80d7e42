"""The scalar expression graph: hash-consed nodes with folding.

All mechanics is written once as plain Python on scalars and recorded here. A node is created only if no equal node
exists (hash-consing), zeros and constants fold away at creation, and signs travel outward, so that ``-s*x - c*y`` is
found again as ``-(s*x + c*y)``. An effect whose factor is an exact zero therefore leaves no trace.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Sequence
from numbers import Complex, Number, Real
from threading import RLock
from typing import Any, NoReturn, TypeAlias

from mbd.errors import TraceError
from mbd.tape.operations import BINARY, CONDITIONS, EVEN, ODD, UNARY, value
from mbd.tape.table import Table

__all__ = ["BINARY", "CONDITIONS", "UNARY", "Node", "Scalar", "Table", "Tape"]

UNTOUCHED = "untouched"
"""Kind of the input that stands for an output as it was before."""


def _is_scalar(value: object) -> bool:
    """False for arrays, whose own arithmetic then goes element by element."""
    return value.__class__ is Node or not getattr(value, "ndim", 0)


def _related(op: str, reflected: bool = False) -> Callable[[Node, Scalar], Node]:
    """The Python operator of a relation in BINARY; `reflected` for one that is recorded with its sides exchanged."""

    def operator(self: Node, other: Scalar) -> Any:
        if not _is_scalar(other):
            return NotImplemented
        return self.tape.binary(op, other, self) if reflected else self.tape.binary(op, self, other)

    return operator


class Node:
    """One scalar of the graph.

    Attributes
    ----------
    tape : the graph it belongs to
    index : creation order; arguments always have a smaller index
    op : 'const', 'input', 'add', 'sub', 'mul', 'div', 'neg', 'where', 'table', or a key of UNARY or BINARY
    args : argument nodes
    data : the value of a 'const', the key of an 'input', (table, derivative order) of a 'table'
    """

    __slots__ = ("args", "data", "index", "op", "tape")

    def __init__(self, tape: Tape, index: int, op: str, args: tuple[Node, ...], data: Any) -> None:
        self.tape, self.index, self.op, self.args, self.data = tape, index, op, args, data

    def __add__(self, other: Scalar) -> Node:
        if other.__class__ is float and other == 0.0:
            return self
        return self.tape.add(self, other) if _is_scalar(other) else NotImplemented

    __radd__ = __add__

    def __sub__(self, other: Scalar) -> Node:
        return self.tape.sub(self, other) if _is_scalar(other) else NotImplemented

    def __rsub__(self, other: Scalar) -> Node:
        return self.tape.sub(other, self) if _is_scalar(other) else NotImplemented

    def __mul__(self, other: Scalar) -> Node:
        if other.__class__ is float and self.op != "const":  # most factors of rotations and axes are these
            if other == 0.0:
                return self.tape.zero
            if other == 1.0:
                return self
        return self.tape.mul(self, other) if _is_scalar(other) else NotImplemented

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Node:
        return self.tape.div(self, other) if _is_scalar(other) else NotImplemented

    def __rtruediv__(self, other: Scalar) -> Node:
        return self.tape.div(other, self) if _is_scalar(other) else NotImplemented

    def __pow__(self, other: Scalar) -> Node:
        return self.tape.power(self, other) if _is_scalar(other) else NotImplemented

    def __rpow__(self, other: Scalar) -> Node:
        return self.tape.power(other, self) if _is_scalar(other) else NotImplemented

    def __neg__(self) -> Node:
        return self.tape.neg(self)

    def __pos__(self) -> Node:
        return self

    def __abs__(self) -> Node:
        return self.tape.unary("abs", self)

    def __mod__(self, other: Scalar) -> Node:
        return self.tape.remainder(self, other) if _is_scalar(other) else NotImplemented

    def __rmod__(self, other: Scalar) -> Node:
        return self.tape.remainder(other, self) if _is_scalar(other) else NotImplemented

    __lt__, __gt__ = _related("lt"), _related("lt", reflected=True)
    __le__, __ge__ = _related("le"), _related("le", reflected=True)
    __and__, __or__ = _related("and"), _related("or")

    def __invert__(self) -> Node:
        return self.tape.unary("not", self)

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        if self is not other and (isinstance(other, Node | Number) or hasattr(other, "ndim")):
            raise TraceError("'==' on a traced value is not recorded; write mbd.where(abs(a - b) < tolerance, x, y)")
        if isinstance(other, str):
            raise TraceError(
                f"a traced value is compared with the text {other!r}, which no number equals; laws know the state of "
                "a mode by its number from 0: give a law for each state, {state: law} with by=, or compare that number"
            )
        return self is other

    def __bool__(self) -> NoReturn:
        raise TraceError(
            "a Python 'if', 'and', 'or', 'min' or 'max' met a traced value, whose number is not known yet; "
            "write mbd.where(condition, x, y), mbd.minimum, mbd.maximum, or use an mbd.Controller for decisions in time"
        )

    def __float__(self) -> NoReturn:
        raise TraceError(
            "a traced value has no number yet: use mbd.sin, mbd.exp, … (or numpy's) instead of those of math, "
            "and no float(), round() or int() inside a traced function"
        )

    __int__ = __index__ = __round__ = __float__

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        """``np.where`` and ``np.clip`` of traced values; other functions of numpy do what they do with objects."""
        from mbd.tape.functions import on_numpy_function

        return on_numpy_function(function, args, kwargs)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        """Let ``np.sin(node)`` and friends record themselves."""
        from mbd.tape.functions import on_numpy

        if method != "__call__" or kwargs:
            raise TraceError(f"numpy.{ufunc.__name__}.{method} with {list(kwargs) or 'traced values'} is not recorded")
        return on_numpy(ufunc.__name__, inputs)

    @property
    def is_constant(self) -> bool:
        return self.op == "const"

    @property
    def is_untouched(self) -> bool:
        """Whether this is `Tape.untouched`."""
        return self.op == "input" and bool(self.data[0] == UNTOUCHED)

    @property
    def is_zero(self) -> bool:
        return self.op == "const" and self.data == 0.0

    def __repr__(self) -> str:
        from mbd.tape.printing import text

        return text(self)


Scalar: TypeAlias = Node | float

_MIN_FOLDED = 1e-290
"""Products of constants smaller than this, or larger than its inverse, are left to run time."""


class Tape:
    """A growing graph of scalars; nothing is ever removed, `live` finds what an output needs.

    Folding keeps every value to round-off, and to the bit wherever only zeros, ones and signs are concerned:
    sums are never reassociated. Threads that share a derivation add to it under its `lock`.
    """

    def __init__(self) -> None:
        self.lock = RLock()
        self.nodes: list[Node] = []
        self.tables: list[Table] = []
        self._tables: dict[tuple[float, ...], Table] = {}
        self.phases: dict[int, tuple[Node, float, float]] = {}
        """Nodes that `phase` made, by number: what they are a phase of, where its cycle starts, and the period."""
        self._known: dict[Hashable, Node] = {}
        self._numbers: dict[float, Node] = {}
        self.zero = self.constant(0.0)
        self.one = self.constant(1.0)

    def _make(self, key: Hashable, op: str, args: tuple[Node, ...], data: Any = None) -> Node:
        node = self._known.get(key)
        if node is None:
            node = self._known[key] = Node(self, len(self.nodes), op, args, data)
            self.nodes.append(node)
        return node

    def keys(self) -> Collection[Hashable]:
        """What each node is, in order: its operation, and numbers of nodes, a value or the key of an input."""
        return self._known.keys()

    def constant(self, number: float) -> Node:
        node = self._numbers.get(number) if number.__class__ is float else None
        if node is None:
            if isinstance(number, Complex) and not isinstance(number, Real):  # float() drops numpy's imaginary parts
                raise TraceError(f"the complex number {number!r} met a traced value; real numbers are wanted")
            number = float(number) + 0.0
            node = self._make(("const", number if number == number else "nan"), "const", (), number)
            self._numbers[number] = node
        return node

    def input(self, kind: str, index: int = 0) -> Node:
        """The node of a run-time input, known by its kind ('t', 'q', 'v', 'p', …) and place."""
        return self._make(("input", kind, index), "input", (), (kind, index))

    @property
    def untouched(self) -> Node:
        """An output that compiled code leaves as it finds it; interpreted code writes 0."""
        return self.input(UNTOUCHED)

    def table(
        self,
        name: str,
        breaks: Sequence[float],
        coefficients: Sequence[Sequence[float]],
        jumps: Sequence[int] | None = None,
    ) -> Table:
        """The table of this tape with these numbers, made on first use; see `Table` for the shapes."""
        table = Table(name, breaks, coefficients, len(self.tables), jumps)
        known = self._tables.setdefault(tuple(table.flat), table)
        if known is table:
            self.tables.append(table)
        return known

    def lookup(self, table: Table, x: Scalar, order: int = 0) -> Node:
        """``d^order/dx^order`` of the table at x."""
        node = self.lift(x)
        if table.index >= len(self.tables) or self.tables[table.index] is not table:
            raise TraceError(f"the table {table.name!r} belongs to another derivation; make it with tape.table")
        if order > 3:
            return self.zero
        if node.op == "const":
            return self.constant(table.value(node.data, order))
        return self._make(("table", table.index, order, node.index), "table", (node,), (table, order))

    def lift(self, value: Scalar) -> Node:
        """The node of a scalar: itself, or the constant of a float."""
        if value.__class__ is float:
            return self.constant(value)
        if isinstance(value, Node):
            if value.tape is not self:
                raise TraceError("two tapes met in one expression: a value was kept from an earlier derivation")
            return value
        if isinstance(value, str):
            raise TraceError(f"the text {value!r} met a traced value; numbers are wanted")
        return self.constant(value)

    def add(self, left: Scalar, right: Scalar) -> Node:
        a = left if left.__class__ is Node and left.tape is self else self.lift(left)
        b = right if right.__class__ is Node and right.tape is self else self.lift(right)
        if a.op == "const":
            a, b = b, a
        if b.op == "const":
            number = b.data
            if a.op == "const":
                return self.constant(a.data + number)
            if number == 0.0:
                return a
            if number < 0.0:
                return self.sub(a, -number)
        if b.op == "neg":
            if a.op == "neg":
                return self.neg(self.add(a.args[0], b.args[0]))
            return self.sub(a, b.args[0])
        if a.op == "neg":
            return self.sub(b, a.args[0])
        if a is b:
            return self.mul(2.0, a)
        i, j = a.index, b.index
        return self._make(("add", i, j), "add", (a, b)) if i < j else self._make(("add", j, i), "add", (b, a))

    def sub(self, left: Scalar, right: Scalar) -> Node:
        a = left if left.__class__ is Node and left.tape is self else self.lift(left)
        b = right if right.__class__ is Node and right.tape is self else self.lift(right)
        if b.op == "const":
            number = b.data
            if a.op == "const":
                return self.constant(a.data - number)
            if number == 0.0:
                return a
            if number < 0.0:
                return self.add(a, -number)
        elif a.op == "const":
            if a.data == 0.0:
                return self.neg(b)
            if a.data < 0.0:
                return self.neg(self.add(b, -a.data))
        if a is b:
            return self.zero
        if b.op == "neg":
            return self.add(a, b.args[0])
        if a.op == "neg":
            return self.neg(self.add(a.args[0], b))
        if (swapped := self._known.get(("sub", b.index, a.index))) is not None:
            return self.neg(swapped)
        return self._make(("sub", a.index, b.index), "sub", (a, b))

    def neg(self, value: Scalar) -> Node:
        a = self.lift(value)
        if a.op == "const":
            return self.constant(-a.data)
        if a.op == "neg":
            return a.args[0]
        return self._make(("neg", a.index), "neg", (a,))

    def mul(self, left: Scalar, right: Scalar) -> Node:
        a = left if left.__class__ is Node and left.tape is self else self.lift(left)
        b = right if right.__class__ is Node and right.tape is self else self.lift(right)
        if b.op == "const":
            a, b = b, a
        if a.op == "const":
            return self._scaled(a, b)
        if a.op == "neg":
            if b.op == "neg":
                return self.mul(a.args[0], b.args[0])
            return self.neg(self.mul(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.mul(a, b.args[0]))
        i, j = a.index, b.index
        return self._make(("mul", i, j), "mul", (a, b)) if i < j else self._make(("mul", j, i), "mul", (b, a))

    def _scaled(self, a: Node, b: Node) -> Node:
        """A constant a times b."""
        factor = a.data
        if b.op == "const":
            return self.constant(factor * b.data)
        if factor == 0.0:
            return self.zero
        if factor == 1.0:
            return b
        if factor < 0.0:
            return self.neg(self.mul(-factor, b))
        if b.op == "neg":
            return self.neg(self.mul(a, b.args[0]))
        if b.op == "mul" and b.args[0].op == "const":
            product = factor * b.args[0].data
            if _MIN_FOLDED < product < 1.0 / _MIN_FOLDED:
                return self.mul(product, b.args[1])
        if b.op == "mul":
            for inner, other in (b.args, b.args[::-1]):
                if inner.op == "mul" and inner.args[0].op == "const" and inner.args[0].data * factor == 1.0:
                    return self.mul(inner.args[1], other)  # 2·((½ k) x) = k x
        return self._make(("mul", a.index, b.index), "mul", (a, b))

    def div(self, left: Scalar, right: Scalar) -> Node:
        a = left if left.__class__ is Node and left.tape is self else self.lift(left)
        b = right if right.__class__ is Node and right.tape is self else self.lift(right)
        if b.op == "const":
            if b.data == 0.0:
                raise TraceError("a traced expression divides by an exact zero")
            if a.op == "const":
                return self.constant(a.data / b.data)
            if _MIN_FOLDED < abs(b.data) < 1.0 / _MIN_FOLDED:
                return self.mul(1.0 / b.data, a)
        if a.op == "const":
            if a.data == 0.0:
                return a
            if a.data < 0.0:
                return self.neg(self.div(-a.data, b))
        if a is b:
            return self.one
        if a.op == "neg":
            return self.neg(self.div(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.div(a, b.args[0]))
        return self._make(("div", a.index, b.index), "div", (a, b))

    def power(self, base: Scalar, exponent: Scalar) -> Node:
        """``base ** exponent``; small whole exponents become products, ½ a square root."""
        a, b = self.lift(base), self.lift(exponent)
        if b.op != "const" or a.op == "const":
            return self.binary("pow", a, b)
        n = b.data
        if n == 0.0:
            return self.one
        if n < 0.0:
            return self.div(self.one, self.power(a, -n))
        if n == 0.5:
            return self.unary("sqrt", a)
        if n <= 64.0 and n == int(n):
            half = self.power(a, int(n) // 2)
            square = self.mul(half, half)
            return self.mul(square, a) if int(n) % 2 else square
        return self.binary("pow", a, b)

    def remainder(self, left: Scalar, right: Scalar) -> Node:
        """``left − right ⌊left / right⌋``."""
        return self.sub(left, self.mul(right, self.unary("floor", self.div(left, right))))

    def phase(self, x: Scalar, start: float, period: float) -> Node:
        """``start + (x − start) mod period``: where x stands in a cycle, such as that of a table that repeats."""
        node = start + self.remainder(x - start, period)
        if node.op != "const":
            self.phases[node.index] = self.lift(x), start, period
        return node

    def unary(self, op: str, argument: Scalar) -> Node:
        """A function of UNARY."""
        a = self.lift(argument)
        if a.op == "const":
            return self.constant(value(op, a.data))
        if a.op == "neg":
            if op in ODD:
                return self.neg(self.unary(op, a.args[0]))
            if op in EVEN:
                return self.unary(op, a.args[0])
        if a.op == "abs" and op in EVEN:
            return a if op == "abs" else self.unary(op, a.args[0])
        if op == "abs" and a.op == "sqrt":
            return a
        if op == "sqrt" and a.op == "mul" and a.args[0] is a.args[1]:
            return self.unary("abs", a.args[0])
        if op == "not" and a.op == "not":
            return a.args[0]
        return self._make((op, a.index), op, (a,))

    def binary(self, op: str, left: Scalar, right: Scalar) -> Node:
        """A function or relation of BINARY."""
        a, b = self.lift(left), self.lift(right)
        if a.op == "const" and b.op == "const":
            return self.constant(value(op, a.data, b.data))
        if op in ("and", "or"):
            if a.op == "const":
                a, b = b, a
            if b.op == "const":
                return a if bool(b.data) == (op == "and") else self.constant(b.data)
            if a.index > b.index:
                a, b = b, a
        if a is b and op in ("min", "max", "and", "or"):
            return a
        return self._make((op, a.index, b.index), op, (a, b))

    def where(self, condition: Scalar, yes: Scalar, no: Scalar) -> Node:
        """`yes` where the condition holds, else `no`."""
        c, a, b = self.lift(condition), self.lift(yes), self.lift(no)
        if c.op == "const":
            return a if c.data else b
        if c.op not in CONDITIONS:
            raise TraceError("mbd.where needs a condition such as 'x < 0' as its first argument")
        if c.op == "not":
            c, a, b = c.args[0], b, a
        if a is b:
            return a
        if a.op == "neg" and (b.op == "neg" or b.is_zero):
            return self.neg(self.where(c, a.args[0], self.neg(b)))
        if b.op == "neg" and a.is_zero:
            return self.neg(self.where(c, a, b.args[0]))
        return self._make(("where", c.index, a.index, b.index), "where", (c, a, b))
