"""No test waits for ever: whoever starts a process says how long it may take."""

import ast
from pathlib import Path

TESTS = Path(__file__).parent
WAITS = {"run", "check_call", "check_output", "communicate"}
"""Functions of `subprocess`, and methods, that wait for a process to end."""


def unbounded(source: str) -> list[int]:
    """Lines of the calls that wait for a process without a timeout."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute) or node.func.attr not in WAITS:
            continue
        owner = ast.unparse(node.func.value)
        if (owner == "subprocess" or node.func.attr == "communicate") and "timeout" not in {
            keyword.arg for keyword in node.keywords
        }:
            found.append(node.lineno)
    return found


def test_processes_that_tests_start_have_a_time_by_which_they_end():
    found = {str(path.relative_to(TESTS)): unbounded(path.read_text(encoding="utf-8")) for path in TESTS.rglob("*.py")}
    assert {name: lines for name, lines in found.items() if lines} == {}


def test_a_process_without_a_time_is_found():
    assert unbounded("import subprocess\nsubprocess.run(['ls'])\nsubprocess.run(['ls'], timeout=3)") == [2]
