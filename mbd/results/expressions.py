"""What a run needs of its equations between its rows, as arrays: named results and the balance of forces.

The graph of expressions is written node by node (an operation of a fixed list, arguments before it, a number), so that
a run that is read from a file gives the same bits between its rows as the one that was saved. Nothing in a file is
executed but these operations.
"""

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mbd.dataclass import dataclass
from mbd.equations import programs
from mbd.equations.shapes import PLACE
from mbd.results.archive import Arrays, Members
from mbd.results.balance import Balance
from mbd.results.charts import Charts
from mbd.results.content import expect, of_kind
from mbd.tape.derivatives import live
from mbd.tape.node import Node, Table, Tape
from mbd.tape.operations import ARITHMETIC, BINARY, UNARY

ARITY = {
    **dict.fromkeys(("const", "input"), 0), **dict.fromkeys(UNARY, 1), **dict.fromkeys(BINARY, 2),
    **dict.fromkeys(ARITHMETIC, 2), "neg": 1, "where": 3, "table": 1,
}  # fmt: skip
"""Operations and how many arguments they have."""
OPERATIONS = tuple(sorted(ARITY))
KINDS = ("t", "q", "x", "v", "z", "a", "s", "lam", "anchor", "switch", "slip", "p", PLACE)
"""Kinds of inputs."""
MEMBERS = {"graph": ("i", 6), "graph numbers": ("f", 0), "graph outputs": ("i", 0), "graph terms": ("i", 0)}
"""Arrays, each with its kind and number of columns; those of tables besides."""


@dataclass(frozen=True)
class _Row:
    contact: int
    friction: int


@dataclass(frozen=True)
class _Contact:
    anchors: tuple[int, ...]


@dataclass(frozen=True)
class _Friction:
    contact: int
    row: int
    group: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class _Wrapped:
    anchor: int
    angle: Node
    rate: Node


@dataclass(frozen=True, eq=False)
class Expressions:
    """What results read of `mbd.equations.Equations`, made from a file; coordinates add (q ⊕ x = q + x) or are given.

    found : named results; terms : those of `programs.accelerations`, () without equations of motion
    """

    tape: Tape
    n_q: int
    n_v: int
    n_z: int
    rows: tuple[_Row, ...]
    contacts: tuple[_Contact, ...]
    frictions: tuple[_Friction, ...]
    found: Mapping[str, Node]
    terms: tuple[Node, ...]
    adds: bool
    parameters: tuple[Any, ...] = ()
    wrapped: tuple[_Wrapped, ...] = ()
    memory: dict[str, Any] = field(default_factory=dict)

    @property
    def balance(self) -> tuple[Node, ...]:
        """As long as the equations of motion; results ask for no more."""
        return self.terms[: self.n_v + self.n_z]

    @property
    def compose(self) -> tuple[Node, ...] | None:
        """None where coordinates add; () where they do not and a file does not tell how."""
        charts: Charts | None = self.memory.get("charts")
        return None if self.adds else () if charts is None else charts.compose

    def output(self, name: str) -> Node:
        """A named result; KeyError for one that was not saved."""
        return self.found[name]

    def output_names(self) -> Sequence[str]:
        """Those that were saved."""
        return tuple(self.found)


def write_expressions(equations: Any, nodes: Mapping[str, Node], arrays: Arrays) -> dict[str, Any]:
    """The words of named results and of the balance of forces; their arrays go into `arrays`."""
    own = isinstance(equations, Expressions)
    with equations.tape.lock:
        terms: Sequence[Node] = equations.terms if own else ()
        if not own and Balance.serves(equations):
            terms = programs.accelerations(equations, impacts=False)
        charts = Charts.of(equations)
        moving = () if charts is None else charts.nodes
        turning = [node for turn in equations.wrapped for node in (turn.angle, turn.rate)]
        order = live([*nodes.values(), *terms, *turning, *moving])
    place = {node.index: k for k, node in enumerate(order)}
    tables = list({node.data[0].index: node.data[0] for node in order if node.op == "table"}.values())
    where = {table.index: k for k, table in enumerate(tables)}
    graph, numbers = np.full((len(order), 6), -1, dtype=np.int32), np.zeros(len(order))
    for k, node in enumerate(order):
        graph[k, 0] = OPERATIONS.index(node.op)
        graph[k, 1 : 1 + len(node.args)] = [place[arg.index] for arg in node.args]
        if node.op == "const":
            numbers[k] = node.data
        elif node.op == "input":
            graph[k, 4:] = KINDS.index(node.data[0]), node.data[1]
        elif node.op == "table":
            graph[k, 4:] = where[node.data[0].index], node.data[1]
    arrays["graph"], arrays["graph numbers"] = graph, numbers
    arrays["graph outputs"] = np.array([place[node.index] for node in nodes.values()], dtype=np.int32)
    arrays["graph terms"] = np.array([place[node.index] for node in terms], dtype=np.int32)
    for k, table in enumerate(tables):
        arrays[f"table {k}"] = np.column_stack([table.breaks, table.coefficients])
    return {
        "sizes": [equations.n_q, equations.n_v, equations.n_z], "names": list(nodes), "tables": len(tables),
        "rows": [[row.contact, row.friction] for row in equations.rows],
        "contacts": [list(contact.anchors) for contact in equations.contacts],
        "frictions": [[friction.contact, friction.row] for friction in equations.frictions],
        "partners": [_after(friction.group, k) for k, friction in enumerate(equations.frictions)],
        "adds": equations.compose is None, "charts": [place[node.index] for node in moving],
        "wrapped": [[turn.anchor, place[turn.angle.index], place[turn.rate.index]] for turn in equations.wrapped],
    }  # fmt: skip


def arrays_of_expressions(words: Any, members: Members) -> set[str]:
    """Names of the arrays that the words call for, of agreeing shapes; nothing for a file without expressions."""
    if words is None:
        return set()
    what = "'expressions'"
    of_kind(words, dict, what)
    count = members.head("graph").shape[0] if members.head("graph").shape else 0
    for name, (kind, columns) in MEMBERS.items():
        head = members.head(name)
        expect(head.kind == kind and len(head.shape) == (2 if columns else 1), f"{name!r}")
        expect(not columns or head.shape[1] == columns, f"{name!r}")
    expect(members.head("graph numbers").shape == (count,), "'graph numbers'")
    names = of_kind(words["names"], list, what)
    expect(all(isinstance(name, str) for name in names), what)
    expect(members.head("graph outputs").shape == (len(names),), what)
    sizes = [members.head(part).shape[1] for part in ("q", "v", "z", "lam", "closed", "anchors")]
    q, v, z, rows, contacts, anchors = sizes
    frictions = members.head("phase").shape[1] if "phase" in members.names else 0
    expect(words["sizes"] == [q, v, z], what)
    expect(isinstance(words["adds"], bool), what)
    _indices(words["rows"], rows, ((-1, contacts), (-1, frictions)), what)
    _indices(words["frictions"], frictions, ((-1, contacts), (0, rows)), what)
    partners = of_kind(words.get("partners", []), list, what)  # older files have none
    expect(len(partners) in (0, frictions) and all(-1 <= of_kind(k, int, what) < frictions for k in partners), what)
    expect(all(k < 0 or partners.count(k) == 1 for k in partners), what)
    expect(len(of_kind(words["contacts"], list, what)) == contacts, what)
    for held in words["contacts"]:
        for place in of_kind(held, list, what):
            expect(0 <= of_kind(place, int, what) < anchors, what)
    charts = of_kind(words.get("charts", []), list, what)  # older files have none
    expect(len(charts) in (0, q + 5 * v) and all(0 <= of_kind(k, int, what) < count for k in charts), what)
    wrapped = words.get("wrapped", [])  # older files have none
    _indices(wrapped, len(of_kind(wrapped, list, what)), ((0, anchors), (0, count), (0, count)), what)
    n = v + z
    wanted = n * n + n + 2 * n * rows + 3 * rows + anchors + 1 + frictions
    expect(members.head("graph terms").shape in ((0,), (wanted,)), "'graph terms'")
    tables = [f"table {k}" for k in range(of_kind(words["tables"], int, what))]
    for name in tables:
        head = members.head(name)
        expect(head.kind == "f" and len(head.shape) == 2 and head.shape[0] > 0 and head.shape[1] == 5, f"{name!r}")
    return {*MEMBERS, *tables}


def _after(group: Sequence[int], k: int) -> int:
    """The next of those that slide together with friction k, of the last the first; −1 for one alone."""
    return group[(group.index(k) + 1) % len(group)] if group else -1


def _group(partners: Sequence[int], k: int) -> tuple[int, ...]:
    """Those that slide together with friction k, itself among them."""
    found, other = [k], partners[k]
    while other >= 0 and other not in found:
        found.append(other)
        other = partners[other]
    return tuple(sorted(found)) if len(found) > 1 else ()


def _indices(value: Any, count: int, bounds: Sequence[tuple[int, int]], what: str) -> None:
    """Lists of whole numbers, each at least the one and below the other of its bounds."""
    expect(len(of_kind(value, list, what)) == count, what)
    for line in value:
        expect(len(of_kind(line, list, what)) == len(bounds), what)
        for number, (least, most) in zip(line, bounds, strict=True):
            expect(least <= of_kind(number, int, what) < most, what)


def read_expressions(words: Mapping[str, Any], arrays: Mapping[str, Any], parameters: int) -> Expressions:
    """What `write_expressions` was given; `parameters` is how many there are, tables included."""
    sizes = dict(zip("qvz", words["sizes"], strict=True))
    partners = words.get("partners") or [-1] * len(words["frictions"])
    rows, contacts, frictions = (words[name] for name in ("rows", "contacts", "frictions"))
    room = {
        "t": 1, "q": (1 if words["adds"] else 2) * sizes["q"],
        "x": sizes["v"], "v": sizes["v"], "a": sizes["v"], "z": sizes["z"], "s": sizes["z"],
        "lam": len(rows), "anchor": arrays["anchors"].shape[1], "switch": len(contacts), "slip": len(frictions),
        "p": parameters, PLACE: 2,
    }  # fmt: skip
    tape = Tape()
    tables = [_table(tape, arrays[f"table {k}"]) for k in range(words["tables"])]
    nodes: list[Node] = []
    for line, number in zip(arrays["graph"].tolist(), arrays["graph numbers"].tolist(), strict=True):
        nodes.append(_node(tape, line, number, nodes, tables, room))
    outputs, terms = (arrays[f"graph {name}"] for name in ("outputs", "terms"))
    for places in outputs, terms:
        expect(bool(np.all((places >= 0) & (places < len(nodes)))), "'graph'")
    charts = [nodes[k] for k in words.get("charts", ())]
    known = {"charts": Charts.from_nodes(charts, sizes["q"], sizes["v"]) if charts else None}
    return Expressions(
        tape, sizes["q"], sizes["v"], sizes["z"], tuple(_Row(*row) for row in rows),
        tuple(_Contact(tuple(held)) for held in contacts),
        tuple(_Friction(one[0], one[1], _group(partners, k)) for k, one in enumerate(frictions)),
        {_present(name): nodes[k] for name, k in zip(words["names"], outputs, strict=True)},
        tuple(nodes[k] for k in terms),
        words["adds"], (),
        tuple(_Wrapped(anchor, nodes[angle], nodes[rate]) for anchor, angle, rate in words.get("wrapped", ())), known,
    )  # fmt: skip


def _present(name: str) -> str:
    """The present name of a result in older files."""
    older = "net moment of "
    return f"{name.removeprefix(older)}.net_moment" if name.startswith(older) else name


def _table(tape: Tape, numbers: Any) -> Table:
    expect(bool(np.all(np.isfinite(numbers)) and np.all(np.diff(numbers[:, 0]) > 0.0)), "a table")
    return tape.table("", numbers[:, 0], numbers[:, 1:])


def _node(
    tape: Tape, line: Sequence[int], number: float, made: list[Node], tables: Sequence[Table], room: Mapping[str, int]
) -> Node:
    """The next node, as it was: nothing is folded again. `made` are those before it."""
    expect(0 <= line[0] < len(OPERATIONS), "'graph'")
    op = OPERATIONS[line[0]]
    places = line[1 : 1 + ARITY[op]]
    expect(all(0 <= place < len(made) for place in places), "'graph'")
    data: Any = None
    if op == "const":
        data = number
    elif op == "input":
        expect(0 <= line[4] < len(KINDS) and 0 <= line[5] < room[KINDS[line[4]]], "'graph'")
        data = KINDS[line[4]], line[5]
    elif op == "table":
        expect(0 <= line[4] < len(tables) and 0 <= line[5] <= 3, "'graph'")
        data = tables[line[4]], line[5]
    node = Node(tape, len(tape.nodes), op, tuple(made[place] for place in places), data)
    tape.nodes.append(node)
    return node
