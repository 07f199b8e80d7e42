"""Readable text of tape expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mbd.tape.node import Node

INFIX = {"add": ("+", 4), "sub": ("-", 4), "mul": ("*", 5), "div": ("/", 5), "lt": ("<", 3), "le": ("<=", 3)}
"""Sign and binding strength of the operations written between their arguments."""

LOGIC = {"and": ("&", 2), "or": ("|", 1)}

NEG = 6
ATOM = 9


def input_name(node: Node) -> str:
    """How an input is written when nobody named it: ``t``, ``q0``, ``v1``, …

    >>> from mbd.tape.node import Tape
    >>> input_name(Tape().input("q", 3))
    'q3'
    """
    kind, index = node.data
    return str(kind) if kind == "t" else f"{kind}{index}"


def text(node: Node, names: Mapping[Node, str] | None = None, depth: int = 5) -> str:
    """The node as an infix formula; what lies more than `depth` operations below is written '…'.

    >>> from mbd.tape.node import Tape
    >>> tape = Tape()
    >>> x, y = tape.input("q", 0), tape.input("q", 1)
    >>> text(x * (y - 1.0) / 3.0 ** x)
    'q0*(q1 - 1)/3**q0'
    """
    known = {named.index: name for named, name in (names or {}).items()}
    return _write(node, known, depth)[0]


def _write(node: Node, known: Mapping[int, str], depth: int) -> tuple[str, int]:
    """Text and binding strength."""
    name = known.get(node.index)
    if name is not None:
        return name, ATOM
    op = node.op
    if op == "const":
        return f"{node.data:.12g}", ATOM if node.data >= 0.0 else NEG
    if op == "input":
        return input_name(node), ATOM
    if depth == 0:
        return "…", ATOM
    parts = [_write(arg, known, depth - 1) for arg in node.args]

    def operand(k: int, strength: int) -> str:
        written, binds = parts[k]
        return written if binds >= strength else f"({written})"

    if op in INFIX or op in LOGIC:
        sign, strength = INFIX.get(op) or LOGIC[op]
        space = "" if op in ("mul", "div") else " "
        tighter = strength + (op not in ("add", "mul", "and", "or"))
        return f"{operand(0, strength)}{space}{sign}{space}{operand(1, tighter)}", strength
    if op == "neg":
        return f"-{operand(0, NEG - 1)}", NEG - 1
    if op == "pow":
        return f"{operand(0, 8)}**{operand(1, 7)}", 7
    if op == "not":
        return f"~{operand(0, ATOM)}", 8
    if op == "table":
        table, order = node.data
        op = table.name + "'" * order
    return f"{op}({', '.join(written for written, _ in parts)})", ATOM


def listing(outputs: Mapping[str, Node] | Sequence[Node], names: Mapping[Node, str] | None = None) -> str:
    """The outputs as assignments, one a line; what is used twice gets a name of its own.

    >>> from mbd.tape.node import Tape
    >>> tape = Tape()
    >>> x = tape.input("q", 0)
    >>> s = tape.unary("sin", x)
    >>> print(listing({"f": s * s, "g": 2.0 * s}))
    w0 = sin(q0)
    f = w0*w0
    g = 2*w0
    """
    from mbd.tape.derivatives import live

    named = outputs if isinstance(outputs, Mapping) else {f"out{k}": node for k, node in enumerate(outputs)}
    known = {node.index: name for node, name in (names or {}).items()}
    order = live(named.values(), known)
    uses: dict[int, int] = {}
    depth: dict[int, int] = {}
    for node in order:
        for arg in node.args:
            uses[arg.index] = uses.get(arg.index, 0) + 1
    for node in named.values():
        uses[node.index] = uses.get(node.index, 0) + 1
    lines: list[str] = []
    for node in order:
        depth[node.index] = 1 + max((depth[arg.index] for arg in node.args), default=-1)
        if node.index in known or not node.args:
            depth[node.index] = 0
        elif uses[node.index] > 1 or depth[node.index] >= MAX_DEPTH:
            formula = _write(node, known, MAX_DEPTH + 1)[0]
            known[node.index] = f"w{len(lines)}"
            depth[node.index] = 0
            lines.append(f"{known[node.index]} = {formula}")
    lines += [f"{name} = {_write(node, known, MAX_DEPTH + 1)[0]}" for name, node in named.items()]
    return "\n".join(lines)


MAX_DEPTH = 8
"""Depth of a formula at which a listing starts a new line."""
