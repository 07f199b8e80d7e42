"""Counts of the source itself: how much there is, and how its files hang together. The same on every machine.

Aims are those of one form of each idea: fewer lines, fields, constants and arguments, imports that go down in short
chains and never in a circle. They are reached by removing forms, not by longer lines or thinner docstrings.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import networkx as nx

from mbd.kernel.records import TABLE

ROOT = Path(__file__).parents[1]

SILENT = {
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING,
    tokenize.ENDMARKER,
}  # fmt: skip
"""Tokens that make no line one of code."""

NUMBER = (ast.Constant, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop)
"""What a number is written with."""


@dataclass(frozen=True)
class Count:
    """A count beside its aim, and where its largest part is found."""

    name: str
    value: int
    aim: int
    where: str = ""


class House:
    """The Python files of a folder, read once.

    Parameters
    ----------
    folder : of a package, whose name is that of its modules
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.texts = {file: file.read_text(encoding="utf-8") for file in sorted(folder.rglob("*.py"))}
        self.trees = {file: ast.parse(text) for file, text in self.texts.items()}
        self.modules = {self._module(file): file for file in self.texts}

    def _module(self, file: Path) -> str:
        parts = file.relative_to(self.folder.parent).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    def lines(self) -> int:
        """All lines."""
        return sum(len(text.splitlines()) for text in self.texts.values())

    def code_lines(self) -> int:
        """Lines with a token that is neither a comment nor part of a docstring."""
        return sum(_code_lines(text, self.trees[file]) for file, text in self.texts.items())

    def constants(self) -> dict[str, list[str]]:
        """By module, names in capitals that are assigned one number each.

        Codes that are numbered together, ``LEFT, RIGHT = 0, 1``, bound nothing and are left out.
        """
        found = {name: [*_numeric_constants(self.trees[file])] for name, file in self.modules.items()}
        return {name: constants for name, constants in found.items() if constants}

    def argument_lists(self) -> dict[str, int]:
        """By function, how many arguments a call may give it by position."""
        return {
            f"{name}.{function.name}": len(function.args.posonlyargs) + len(function.args.args)
            for name, file in self.modules.items()
            for function in ast.walk(self.trees[file])
            if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
        }

    def imports(self, inside: bool, types: bool) -> Any:
        """Graph of modules with an edge to each that is imported when the module is.

        The package's own face is left out, from which users import all names.

        Parameters
        ----------
        inside : those in functions too
        types : those for type checkers too
        """
        graph: Any = nx.DiGraph()
        for name in self.modules.keys() - {self.folder.name}:
            graph.add_node(name)
            nodes = _statements(self.trees[self.modules[name]], inside, types)
            graph.add_edges_from((name, imported) for node in nodes for imported in self._imported(node))
        graph.remove_edges_from(list(nx.selfloop_edges(graph)))
        return graph

    def _imported(self, node: ast.AST) -> Iterator[str]:
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        for name in names:
            owner = name if name in self.modules else name.rpartition(".")[0]
            if owner in self.modules and owner != self.folder.name:
                yield owner

    def circles(self, inside: bool, types: bool = False) -> list[set[str]]:
        """Sets of modules that import each other, largest first."""
        found = nx.strongly_connected_components(self.imports(inside, types))
        return sorted((circle for circle in found if len(circle) > 1), key=len, reverse=True)

    def room(self, module: str) -> str:
        """The folder of a module; a file beside the folders is a room of its own."""
        file = self.modules[module]
        return module if file.parent == self.folder else ".".join(file.parent.relative_to(self.folder).parts)

    def chain(self) -> list[str]:
        """The chain of imports through most rooms: in each room the module by which it is entered."""
        graph = self.imports(inside=False, types=True)
        for a, b in graph.edges:
            graph.edges[a, b]["rooms"] = int(self.room(a) != self.room(b))
        path = nx.dag_longest_path(graph, weight="rooms")
        return [
            module
            for before, module in zip([None, *path], path, strict=False)
            if before is None or graph.edges[before, module]["rooms"]
        ]


def _statements(node: ast.AST, inside: bool, types: bool) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr):
            continue
        function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef)
        checker = isinstance(child, ast.If) and isinstance(child.test, ast.Name) and child.test.id == "TYPE_CHECKING"
        if (inside or not function) and (types or not checker):
            yield child
            yield from _statements(child, inside, types)


def _code_lines(text: str, tree: ast.Module) -> int:
    lines = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in SILENT
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            lines -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def _numeric_constants(tree: ast.Module) -> Iterator[str]:
    for node in tree.body:
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        value = getattr(node, "value", None)
        if isinstance(target, ast.Name) and target.id.isupper() and value is not None and _is_number(value):
            yield target.id


def _is_number(value: ast.expr) -> bool:
    parts = [*ast.walk(value)]
    numbers = [part.value for part in parts if isinstance(part, ast.Constant)]
    plain = all(isinstance(number, int | float) and not isinstance(number, bool) for number in numbers)
    return plain and all(isinstance(part, NUMBER) for part in parts)


def measure(root: Path = ROOT) -> list[Count]:
    """The counts of a checkout: of the package, and of its tests."""
    package, tests = House(root / "mbd"), House(root / "tests")
    constants, arguments = package.constants(), package.argument_lists()
    most, longest = (
        max(constants, key=lambda name: len(constants[name])),
        max(arguments, key=lambda name: arguments[name]),
    )
    tied, chain = package.circles(inside=True), package.chain()
    return [
        Count("lines of mbd/", package.lines(), 82_000, f"{len(package.texts)} files"),
        Count("lines of code of mbd/", package.code_lines(), 56_000, "without comments, docstrings and blank lines"),
        Count("lines of tests/", tests.lines(), 46_000, f"{len(tests.texts)} files"),
        Count("fields of the kernel's record", len(TABLE.kinds), 260, "numbers, arrays and places in arrays"),
        Count("constants of modules", sum(map(len, constants.values())), 300, f"{len(constants[most])} in {most}"),
        Count("arguments of the longest list", arguments[longest], 12, longest),
        Count("files tied by imports in functions", sum(map(len, tied)), 19, f"circles of {_sizes(tied)}"),
        Count("rooms on the longest chain of imports", len(chain), 18, " > ".join(map(package.room, chain))),
        Count("circles of imports", len(package.circles(inside=False)), 0),
    ]


def _sizes(circles: list[set[str]]) -> str:
    return ", ".join(str(len(circle)) for circle in circles) or "none"


def report(counts: list[Count]) -> str:
    """The counts as text, one a line beside its aim."""
    width = max(len(count.name) for count in counts)
    lines = [f"{'':<{width}}  {'counted':>8}  {'aim':>8}"]
    for count in counts:
        missed = "  MISSED" if count.value > count.aim else ""
        lines.append(f"{count.name:<{width}}  {count.value:>8,}  {count.aim:>8,}{missed:<8}  {count.where}".rstrip())
    return "\n".join(lines)
