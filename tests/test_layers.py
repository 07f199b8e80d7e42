"""Imports go down: each part knows only the ones before it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import mbd

PACKAGE = Path(mbd.__file__).parent

RANKS = [
    ("errors", "arrays", "state", "free_memory"),
    ("tape",),
    ("scope",),
    ("bodies", "joints", "forces", "constraints"),
    ("description",),
    ("configuration", "topology"),
    ("equations",),
    ("compile",),
    ("kernel",),
    ("integrators",),
    ("assembly",),
    ("model", "lagrangian"),
    ("results", "simulation", "trajectory"),
    ("analysis", "view"),
    ("cli", "hardcases", "testing"),
]
"""From the lowest layer to the highest; parts of one layer may know each other."""

RANK = {part: rank for rank, parts in enumerate(RANKS) for part in parts}

DOORS = {"trajectory": ("view",), "results.ledger": ("view",)}
"""Methods of the objects in users' hands that only call a later stage, and import it when they are called."""

FILES = sorted(file for file in PACKAGE.rglob("*.py") if file != PACKAGE / "__init__.py")


def imports(tree: ast.AST, inside: bool = False) -> set[tuple[str, bool]]:
    """(module, whether inside a function) of every import of ours, but not of those for type checkers only."""
    found: set[tuple[str, bool]] = set()
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            found |= {(alias.name, inside) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            found |= {(f"{node.module}.{alias.name}", inside) for alias in node.names}
        else:
            found |= imports(node, inside or isinstance(node, ast.FunctionDef))
    return {(name.removeprefix("mbd."), deep) for name, deep in found if name.startswith("mbd.")}


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_imports_go_down(file):
    module = ".".join(file.relative_to(PACKAGE).with_suffix("").parts)
    part = module.split(".")[0]
    assert part in RANK, f"{part} has no layer yet: give it one in RANKS"
    doors = DOORS.get(module, ())
    above = {
        name
        for name, inside in imports(ast.parse(file.read_text()))
        if RANK.get(name.split(".")[0], 0) > RANK[part]
        and not (inside and f"{name}.".startswith(tuple(f"{door}." for door in doors)))
    }
    assert not above, f"{module} imports from above: {sorted(above)}"
