"""Imports go down: each part knows only the ones before it."""

import ast
from functools import cache
from pathlib import Path
from typing import Any

import networkx as nx

import mbd

PACKAGE = Path(mbd.__file__).parent

RANKS = [
    ("dataclass",),
    ("errors", "equal", "later", "arguments", "arrays", "state", "free_memory", "notebook", "notes", "progress"),
    ("tape", "trees"),
    ("bodies",),
    ("scope",),
    ("joints",),
    ("forces",),
    ("constraints",),
    ("topology",),
    ("parts",),
    ("configuration",),
    ("equations",),
    ("compile",),
    ("kernel",),
    ("integrators",),
    ("assembly",),
    ("model",),
    ("lagrangian",),
    ("results",),
    ("simulation",),
    ("sensitivity",),
    ("analysis",),
    ("gait",),
    ("laboratory",),
    ("optimization",),
    ("view",),
    ("hardcases",),
    ("testing",),
    ("scripts", "script_changes"),
    ("cli", "commands", "__main__"),
]
"""From the lowest layer to the highest; parts of one layer may know each other."""

RANK = {part: rank for rank, parts in enumerate(RANKS) for part in parts}

FILES = sorted(file for file in PACKAGE.rglob("*.py") if file != PACKAGE / "__init__.py")


@cache
def imports(file: Path) -> set[tuple[str, bool]]:
    """(module, whether inside a function) of every import of ours, those for type checkers only among them."""
    found: set[tuple[str, bool]] = set()
    statements: list[tuple[ast.AST, bool]] = [(ast.parse(file.read_text()), False)]
    while statements:
        node, inside = statements.pop()
        if isinstance(node, ast.Import):
            found |= {(alias.name, inside) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            found |= {(f"{node.module}.{alias.name}", inside) for alias in node.names}
        inside = inside or isinstance(node, ast.FunctionDef)
        statements += [(each, inside) for each in ast.iter_child_nodes(node) if not isinstance(each, ast.expr)]
    return {(name.removeprefix("mbd."), deep) for name, deep in found if name.startswith("mbd.")}


def test_imports_go_down():
    upwards = []
    for file in FILES:
        module = ".".join(file.relative_to(PACKAGE).with_suffix("").parts)
        part = module.split(".")[0]
        assert part in RANK, f"{part} has no layer yet: give it one in RANKS"
        above = {name for name, _ in imports(file) if RANK.get(name.split(".")[0], 0) > RANK[part]}
        upwards += [f"{module} imports from above: {sorted(above)}"] if above else []
    assert upwards == []


def test_no_modules_import_each_other():
    names = {
        ".".join(file.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): file for file in FILES
    }
    graph: Any = nx.DiGraph()
    for module, file in names.items():
        for name, inside in imports(file):
            owner = name if name in names else name.rpartition(".")[0]
            if owner in names and not inside:
                graph.add_edge(module, owner)
    circles = [circle for circle in nx.strongly_connected_components(graph) if len(circle) > 1]
    assert not circles, circles
