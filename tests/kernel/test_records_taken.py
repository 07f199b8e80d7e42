"""Functions of the kernel take the least record that has what they and all that they call read or write."""

import ast
from functools import lru_cache
from pathlib import Path
from types import FunctionType

import mbd
from mbd.kernel import records
from mbd.kernel.records import Kernel
from mbd.kernel.records.declare import Record
from mbd.kernel.schemes import contract
from mbd.kernel.translation.translate import source_of

RECORDS = {
    name: found for name, found in vars(records).items() if isinstance(found, type) and issubclass(found, Record)
}
OWNER = {
    name: record
    for record in RECORDS.values()
    for name, found in (vars(record).get("__annotations__", {}) | vars(record)).items()
    if not name.startswith("_") and not isinstance(found, FunctionType)
}
Function = tuple[str, str]


def functions() -> dict[Function, ast.FunctionDef]:
    """Those whose first argument is a record, by module and name."""
    folder = Path(mbd.__file__).parent
    found = {}
    for file in (folder / "kernel").rglob("*.py"):
        module = ".".join(["mbd", *file.relative_to(folder).with_suffix("").parts]).removesuffix(".__init__")
        for name, node in source_of(module).functions.items():
            if node.args.args and node.args.args[0].annotation and record_of(node) in RECORDS:
                found[module, name] = node
    return found


def record_of(node: ast.FunctionDef) -> str:
    return ast.unparse(node.args.args[0].annotation)


def called(module: str, node: ast.FunctionDef) -> list[Function]:
    """Functions to which it gives its record; those of schemes where it calls what differs between them."""
    own, names = node.args.args[0].arg, source_of(module).names
    found = []
    for call in ast.walk(node):
        if isinstance(call, ast.Call) and any(isinstance(given, ast.Name) and given.id == own for given in call.args):
            function = names.get(call.func.id) if isinstance(call.func, ast.Name) else None
            if isinstance(function, FunctionType):
                found.append((function.__module__, function.__name__))
    return found


@lru_cache(maxsize=1)
def needed() -> dict[Function, type[Record]]:
    """The least record of each function."""
    nodes = functions()
    owners: dict[Function, set[type[Record]]] = {}
    for (module, name), node in nodes.items():
        own = node.args.args[0].arg
        owners[module, name] = {
            OWNER[part.attr]
            for part in ast.walk(node)
            if isinstance(part, ast.Attribute) and isinstance(part.value, ast.Name) and part.value.id == own
        }
    calls = {key: [each for each in called(key[0], node) if each in nodes] for key, node in nodes.items()}
    while True:
        wider = {key: owners[key].union(*(owners[each] for each in calls[key])) for key in nodes}
        if wider == owners:
            break
        owners = wider
    return {key: least(found) for key, found in owners.items()}


def least(owners: set[type[Record]]) -> type[Record]:
    """The record that has all of these and is part of every other one that does."""
    enough = [each for each in RECORDS.values() if all(issubclass(each, owner) for owner in owners)]
    found = min(enough, key=lambda each: len(each.__mro__))
    assert all(issubclass(each, found) for each in enough), f"no least record with {owners}: put one together"
    return found


def test_each_function_takes_the_least_record_that_it_needs():
    fixed = {hook for scheme in contract.schemes() for hook in vars(scheme).values() if isinstance(hook, FunctionType)}
    fixed = {(hook.__module__, hook.__name__) for hook in fixed}
    fixed |= {key for key in functions() if key[0] == "mbd.kernel.tangent_rules"}  # stand for rules that need more
    wide = [
        f"{module}.{name} takes {record_of(node)}: {needed()[module, name].__name__} is enough"
        for (module, name), node in functions().items()
        if (module, name) not in fixed and RECORDS[record_of(node)] is not needed()[module, name]
    ]
    assert not wide, "\n".join(wide)


def test_the_law_sees_fields_of_functions_that_are_called():
    assert needed()["mbd.kernel.stepping.candidate", "accept_guards"] is records.Events
    assert needed()["mbd.kernel.stepping.advance", "advance"] is Kernel
