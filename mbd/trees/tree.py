"""Functions of the kernel as typed trees: what stands between Python and any target.

`kernel.translation.translate` makes them, `trees.llvm` and `trees.c` print them.

Kinds of values: 'bool', 'int' (64 bits), 'real' (double), 'ints' and 'reals' (addresses of arrays), 'kernel' (of the
table of fields), 'none'. An operation, a comparison, a choice and an extreme convert their operands to the kind that
holds all of them, an assignment, a call and a return what they are given to the kind that they need. Operators mean
what they mean in Python: ``//`` and ``%`` round down, an extreme keeps its first value unless a later one is beyond it,
a square root is rounded once, powers are those of the C library, nothing is reordered or contracted. Only the bounds of
int do not grow, and x/0 is ±∞ or NaN.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

from mbd.dataclass import dataclass
from mbd.errors import CapabilityError

NUMBERS = ("bool", "int", "real")
KINDS = {
    "bool": "a bool", "int": "an int", "real": "a float", "ints": "an array of ints", "reals": "an array of floats",
    "kernel": "a record of the kernel", "none": "nothing",
}  # fmt: skip


def kind_of(kind: str) -> str:
    """A kind of value in words."""
    return KINDS.get(kind, repr(kind))


def joined(*kinds: str) -> str:
    """The kind that holds values of all of these."""
    if len(set(kinds)) == 1:
        return kinds[0]
    if set(kinds) <= set(NUMBERS):
        return max(kinds, key=NUMBERS.index)
    raise CapabilityError(f"expected one kind of value, got {kind_of(kinds[0])} and {kind_of(kinds[1])}")


@dataclass(frozen=True)
class Number:
    """A constant."""

    value: bool | int | float
    kind: str


@dataclass(frozen=True)
class Local:
    """An argument or a local name."""

    name: str
    kind: str


@dataclass(frozen=True)
class Field:
    """A number or an array of a record, which does not change while the kernel runs."""

    record: Expression
    name: str
    kind: str


@dataclass(frozen=True)
class Element:
    """A number in an array; `what` can be at its address: 'real', 'int', or a field."""

    array: Expression
    index: Expression
    kind: str
    what: str


@dataclass(frozen=True)
class Convert:
    """A number as one of another kind; a real as by ``int``."""

    value: Expression
    kind: str


@dataclass(frozen=True)
class Operation:
    """``left operator right``: + - * / // % **, or << of 1."""

    operator: str
    left: Expression
    right: Expression
    kind: str


@dataclass(frozen=True)
class Unary:
    """'-', 'not', 'abs' or 'sqrt' of a value."""

    operator: str
    value: Expression
    kind: str


@dataclass(frozen=True)
class Compare:
    """``first < second <= third …`` from left to right until one does not hold."""

    first: Expression
    rest: tuple[tuple[str, Expression], ...]
    kind: str = "bool"


@dataclass(frozen=True)
class Junction:
    """Conditions from left to right until one decides: until one does not hold (`every`), or one does."""

    every: bool
    conditions: tuple[Expression, ...]
    kind: str = "bool"


@dataclass(frozen=True)
class Choice:
    """``yes if test else no``."""

    test: Expression
    yes: Expression
    no: Expression
    kind: str


@dataclass(frozen=True)
class Extreme:
    """The largest of some values ('>'), or the smallest ('<')."""

    operator: str
    values: tuple[Expression, ...]
    kind: str


@dataclass(frozen=True)
class Call:
    """A call of another function of the kernel."""

    function: Function
    arguments: tuple[Expression, ...]
    kind: str


@dataclass(frozen=True)
class Evaluate:
    """A call of model code `number` on the block of the kernel (inputs None) or on other numbers."""

    kernel: Expression
    number: Expression
    inputs: Expression | None
    out: Expression
    kind: str = "none"


@dataclass(frozen=True)
class Assign:
    """A value to one target or more."""

    targets: tuple[Local | Element, ...]
    value: Expression


@dataclass(frozen=True)
class Update:
    """``target operator= value``, the place of the target found once."""

    target: Element
    operator: str
    value: Expression
    kind: str


@dataclass(frozen=True)
class Do:
    """An expression for its effect."""

    value: Expression


@dataclass(frozen=True)
class Return:
    value: Expression | None


@dataclass(frozen=True)
class If:
    test: Expression
    yes: Sequence[Statement]
    no: Sequence[Statement]


@dataclass(frozen=True)
class While:
    test: Expression
    body: Sequence[Statement]


@dataclass(frozen=True)
class Range:
    """A loop over ``range(first, last, step)``, whose bounds are found once; its body may change the target."""

    target: Local
    first: Expression
    last: Expression
    step: int
    body: Sequence[Statement]


@dataclass(frozen=True)
class Break:
    pass


@dataclass(frozen=True)
class Continue:
    pass


@dataclass
class Function:
    """A function for arguments of given kinds.

    symbol : its name, with the module and the kinds; arguments, locals : kinds by name, all in `locals`
    result : its kind; apart : never inlined
    """

    symbol: str
    arguments: dict[str, str]
    result: str
    apart: bool
    locals: dict[str, str] = field(default_factory=dict)
    body: Sequence[Statement] = ()


Expression = (
    Number | Local | Field | Element | Convert | Operation | Unary | Compare | Junction | Choice | Extreme | Call
    | Evaluate
)  # fmt: skip
Statement = Assign | Update | Do | Return | If | While | Range | Break | Continue
