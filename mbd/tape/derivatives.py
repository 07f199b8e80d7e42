"""Exact derivatives of tape expressions, forward (jvp) and reverse (vjp), and substitution.

At kinks one side is chosen: the derivative of ``abs`` is 0 at 0, of ``min(x, y)`` and ``max(x, y)`` that of x where
both are equal, of ``where`` that of the branch taken. A branch that is not taken never spoils a derivative, even where
it is infinite or not a number.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping, Sequence

from mbd.tape.node import Node, Scalar, Tape
from mbd.tape.operations import CONDITIONS, value

_FLAT = CONDITIONS | {"floor", "sign"}
"""Operations whose derivative is zero wherever it exists."""


def live(outputs: Iterable[Node], given: Container[int] = ()) -> list[Node]:
    """The nodes that the outputs need, arguments first; what lies behind nodes whose index is `given` is left out."""
    found = {node.index: node for node in outputs}
    stack = list(found.values())
    while stack:
        node = stack.pop()
        if node.index in given:
            continue
        for arg in node.args:
            if arg.index not in found:
                found[arg.index] = arg
                stack.append(arg)
    return [found[index] for index in sorted(found)]


def _partials(node: Node) -> tuple[Scalar, ...]:
    """∂node/∂args for the smooth operations that are not arithmetic."""
    tape, op = node.tape, node.op
    if op == "table":
        table, order = node.data
        return (tape.lookup(table, node.args[0], order + 1),)
    x = node.args[0]
    if op == "sin":
        return (tape.unary("cos", x),)
    if op == "cos":
        return (-tape.unary("sin", x),)
    if op == "tan":
        return (1.0 + node * node,)
    if op == "sqrt":
        return (0.5 / node,)
    if op == "exp":
        return (node,)
    if op == "log":
        return (1.0 / x,)
    if op == "asin":
        return (1.0 / tape.unary("sqrt", 1.0 - x * x),)
    if op == "acos":
        return (-1.0 / tape.unary("sqrt", 1.0 - x * x),)
    if op == "atan":
        return (1.0 / (1.0 + x * x),)
    if op == "sinh":
        return (tape.unary("cosh", x),)
    if op == "cosh":
        return (tape.unary("sinh", x),)
    if op == "tanh":
        return (1.0 - node * node,)
    if op == "abs":
        return (tape.unary("sign", x),)
    y = node.args[1]
    if op == "atan2":
        square = x * x + y * y
        return y / square, -x / square
    assert op == "pow", op
    slope = y * tape.power(x, y - 1.0)
    return slope, 0.0 if y.op == "const" else tape.where(x <= 0.0, 0.0, node * tape.unary("log", x))


def _choice(node: Node) -> tuple[Node, Node, Node]:
    """(condition, yes, no) of a where, min or max."""
    if node.op == "where":
        condition, yes, no = node.args
        return condition, yes, no
    x, y = node.args
    return (y < x, y, x) if node.op == "min" else (x < y, y, x)


# forward ------------------------------------------------------------------------------------------------------------
def jvp(outputs: Sequence[Node], seeds: Mapping[Node, Scalar]) -> list[Node]:
    """Directional derivatives ``Σ_i ∂output/∂input_i · seed_i`` (forward mode).

    The keys of `seeds` are any nodes; one that depends on another is treated as independent of it.
    """
    return jvps(outputs, [seeds])[0]


def jvps(outputs: Sequence[Node], directions: Iterable[Mapping[Node, Scalar]]) -> list[list[Node]]:
    """`jvp` of the same outputs in several directions, one list for each.

    A node that only some of the directions name stands still in the others.
    """
    if not outputs:
        return [[] for _ in directions]
    directions = list(directions)
    given = {node.index for seeds in directions for node in seeds}
    tape, order = outputs[0].tape, live(outputs, given)
    reached = {node.index for node in order}
    order = [node for node in order if node.args and node.op not in _FLAT and node.index not in given]
    results = []
    for seeds in directions:
        dots = {node.index: tape.lift(seed) for node, seed in seeds.items() if node.index in reached}
        if not dots:
            results.append([tape.zero] * len(outputs))
            continue
        _push_forward(tape, order, dots)
        results.append([dots.get(node.index, tape.zero) for node in outputs])
    return results


class Sweeps:
    """`jvps` of more and more outputs in the same directions: what was differentiated before is not once more.

    Directions may name more nodes each time. A node has one derivative in each, whenever it is asked for.
    """

    def __init__(self) -> None:
        self._dots: list[dict[int, Node]] = []
        self._pushed: set[int] = set()

    def __call__(self, outputs: Sequence[Node], directions: Sequence[Mapping[Node, Scalar]]) -> list[list[Node]]:
        """The same as `jvps`."""
        if not outputs:
            return [[] for _ in directions]
        given = {node.index for seeds in directions for node in seeds}
        if len(self._dots) != len(directions) or not given.isdisjoint(self._pushed):  # it is named for the first time
            self._dots, self._pushed = [{} for _ in directions], set()
        tape, pushed, found = outputs[0].tape, self._pushed, live(outputs, given)
        reached = {node.index for node in found}
        order = [node for node in found if node.args and node.op not in _FLAT]
        order = [node for node in order if node.index not in given and node.index not in pushed]
        results = []
        for dots, seeds in zip(self._dots, directions, strict=True):
            new = {node.index: tape.lift(seed) for node, seed in seeds.items() if node.index in reached}
            if not new:  # what lies between was reached in no direction of this name
                results.append([tape.zero] * len(outputs))
                continue
            dots.update(new)
            _push_forward(tape, order, dots)
            results.append([dots.get(node.index, tape.zero) for node in outputs])
        pushed |= reached - given  # those without a derivative too, on whose having none others rely
        return results


def _push_forward(tape: Tape, order: Sequence[Node], dots: dict[int, Node]) -> None:
    """Fill `dots`, which holds the derivatives of some nodes by their index, for all nodes in `order`."""
    zero, mul, get = tape.zero, tape.mul, dots.get
    for node in order:
        args, index = node.args, node.index
        if len(args) == 2:
            a, b = args
            da, db = get(a.index), get(b.index)
            if da is None:
                if db is None or index in dots:
                    continue
                dot = mul(a, db) if node.op == "mul" else _binary_dot(tape, node, a, b, zero, db)
            elif index in dots:
                continue
            elif db is None:
                dot = mul(da, b) if node.op == "mul" else _binary_dot(tape, node, a, b, da, zero)
            else:
                dot = _binary_dot(tape, node, a, b, da, db)
        elif len(args) == 1:
            da = get(args[0].index)
            if da is None or index in dots:
                continue
            dot = tape.neg(da) if node.op == "neg" else tape.mul(_partials(node)[0], da)
        else:
            da, db = get(args[1].index), get(args[2].index)
            if (da is None and db is None) or index in dots:
                continue
            dot = tape.where(args[0], zero if da is None else da, zero if db is None else db)
        if dot is not zero:
            dots[index] = dot


def _binary_dot(tape: Tape, node: Node, a: Node, b: Node, da: Node, db: Node) -> Node:
    """Derivative of an operation of two arguments; zero derivatives fold away."""
    op = node.op
    if op == "mul":
        if a is b:
            return tape.mul(2.0, tape.mul(a, da))
        return tape.add(tape.mul(da, b), tape.mul(a, db))
    if op == "add":
        return tape.add(da, db)
    if op == "sub":
        return tape.sub(da, db)
    if op == "div":
        return tape.div(tape.sub(da, tape.mul(node, db)), b)
    if op in ("min", "max"):
        return tape.where(_choice(node)[0], db, da)
    first, second = _partials(node)
    return tape.add(tape.mul(first, da), tape.mul(second, db))


# reverse ------------------------------------------------------------------------------------------------------------
def vjp(outputs: Sequence[Node], adjoints: Sequence[Scalar], inputs: Sequence[Node]) -> list[Node]:
    """``Σ_i adjoint_i · ∂output_i/∂input`` for every input (reverse mode).

    The adjoints are held fixed, which makes this the virtual work of forces `adjoints` along `outputs`:
    the generalized force of a force F at a point p is ``vjp(p, F, q)``.
    """
    if not outputs:
        return [node.tape.zero for node in inputs]
    tape = outputs[0].tape
    wanted = {node.index for node in inputs}
    lifted = [(node, tape.lift(adjoint)) for node, adjoint in zip(outputs, adjoints, strict=True)]
    lifted = [(node, adjoint) for node, adjoint in lifted if not adjoint.is_zero]
    order = live([node for node, _ in lifted], wanted)
    depends: set[int] = set(wanted)
    for node in order:
        if node.index not in depends and any(arg.index in depends for arg in node.args):
            depends.add(node.index)
    bars: dict[int, Node] = {}

    def push(node: Node, bar: Node) -> None:
        if node.index in depends and not bar.is_zero:
            known = bars.get(node.index)
            bars[node.index] = bar if known is None else _joined(tape, known, bar)

    for node, adjoint in lifted:
        push(node, adjoint)
    for node in reversed(order):
        bar = bars.get(node.index)
        if bar is not None and node.index not in wanted and node.args and node.op not in _FLAT:
            _push_back(tape, node, bar, depends, push)
    return [bars.get(node.index, tape.zero) for node in inputs]


def _push_back(tape: Tape, node: Node, bar: Node, depends: set[int], push: Callable[[Node, Node], None]) -> None:
    """Hand the adjoint of a node on to its arguments."""
    op, args = node.op, node.args
    if op == "add":
        push(args[0], bar)
        push(args[1], bar)
    elif op == "sub":
        push(args[0], bar)
        push(args[1], tape.neg(bar))
    elif op == "neg":
        push(args[0], tape.neg(bar))
    elif op == "mul":
        for arg, other in (args, args[::-1]):
            if arg.index in depends:
                push(arg, _times(tape, bar, lambda inner, other=other: tape.mul(inner, other)))  # type: ignore[misc]
    elif op == "div":
        share = _times(tape, bar, lambda inner: tape.div(inner, args[1]))
        push(args[0], share)
        if args[1].index in depends:
            push(args[1], tape.neg(_times(tape, share, lambda inner: tape.mul(inner, node))))
    elif op in ("where", "min", "max"):
        condition, yes, no = _choice(node)
        push(yes, tape.where(condition, bar, 0.0))
        push(no, tape.where(condition, 0.0, bar))
    else:
        for arg, partial in zip(args, _partials(node), strict=True):
            if arg.index in depends:
                push(arg, _times(tape, bar, lambda inner, partial=partial: tape.mul(inner, partial)))  # type: ignore[misc]


def _mask(bar: Node) -> tuple[Node, bool, Node] | None:
    """(condition, side, inner) of an adjoint that is zero unless the condition equals the side."""
    core = bar.args[0] if bar.op == "neg" else bar
    if core.op != "where":
        return None
    condition, yes, no = core.args
    if not yes.is_zero and not no.is_zero:
        return None
    inner = no if yes.is_zero else yes
    return condition, no.is_zero, -inner if bar.op == "neg" else inner


def _masked(tape: Tape, condition: Node, side: bool, inner: Node) -> Node:
    return tape.where(condition, inner, 0.0) if side else tape.where(condition, 0.0, inner)


def _times(tape: Tape, bar: Node, factor: Callable[[Node], Node]) -> Node:
    """The adjoint times a factor; a mask stays outside, so that 0·∞ of a branch not taken does not arise."""
    mask = _mask(bar)
    if mask is None:
        return factor(bar)
    condition, side, inner = mask
    return _masked(tape, condition, side, _times(tape, inner, factor))


def _joined(tape: Tape, one: Node, other: Node) -> Node:
    """The sum of two adjoints, under their mask if it is the same."""
    first, second = _mask(one), _mask(other)
    if first is None or second is None or first[0] is not second[0] or first[1] != second[1]:
        return tape.add(one, other)
    return _masked(tape, first[0], first[1], _joined(tape, first[2], second[2]))


def gradient(output: Node, inputs: Sequence[Node]) -> list[Node]:
    """∂output/∂inputs (reverse mode).

    >>> from mbd.tape.node import Tape
    >>> tape = Tape()
    >>> x, y = tape.input("q", 0), tape.input("q", 1)
    >>> gradient(x * x * y, [x, y])
    [2*q0*q1, q0*q0]
    """
    return vjp([output], [1.0], inputs)


# substitution -------------------------------------------------------------------------------------------------------
def substitute(outputs: Sequence[Node], replacements: Mapping[Node, Scalar], tape: Tape | None = None) -> list[Node]:
    """The outputs rebuilt, and folded again, with some nodes replaced; onto another tape if one is given."""
    if not outputs:
        return []
    target = outputs[0].tape if tape is None else tape
    new: dict[int, Node] = {node.index: target.lift(value) for node, value in replacements.items()}
    for node in live(outputs, new):
        if node.index not in new:
            new[node.index] = rebuild(target, node, [new[arg.index] for arg in node.args])
    return [new[node.index] for node in outputs]


def rebuild(tape: Tape, node: Node, args: Sequence[Node]) -> Node:
    """The operation of `node` on other arguments, recorded on `tape`."""
    op = node.op
    if op == "const":
        return tape.constant(node.data)
    if op == "input":
        return tape.input(*node.data)
    if op == "table":
        table, order = node.data
        if tape is not node.tape:
            table = tape.table(table.name, table.breaks, table.coefficients, table.jumps)
        return tape.lookup(table, args[0], order)
    if op in ("add", "sub", "mul", "div"):
        if op == "div" and args[1].is_zero:  # perhaps in a branch that is not taken
            return tape.constant(value("div", args[0].data if args[0].op == "const" else float("nan"), 0.0))
        return getattr(tape, op)(*args)  # type: ignore[no-any-return]
    if op == "neg":
        return tape.neg(args[0])
    if op == "where":
        return tape.where(*args)
    return tape.unary(op, args[0]) if len(args) == 1 else tape.binary(op, *args)
