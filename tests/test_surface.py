"""The public names: they load lazily, all of them, and each says what it is."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import mbd

NAMES = [name for name in mbd.__all__ if name != "__version__"]

HEAVY = ("sympy", "llvmlite", "scipy.integrate", "matplotlib", "networkx", "pandas", "xarray")


def loaded(program: str) -> set[str]:
    """The modules that a fresh interpreter has loaded after a program."""
    report = subprocess.run(
        [sys.executable, "-c", f"{program}\nimport sys\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return set(report.stdout.split())


def test_importing_mbd_loads_nothing_heavy():
    assert loaded("import mbd").isdisjoint(HEAVY)


def test_describing_a_model_loads_nothing_heavy():
    program = """
import mbd
model = mbd.Model("pendulum")
rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start, loss=mbd.Viscous(0.1)))
mbd.HHT(alpha=0.05)
"""
    assert loaded(program).isdisjoint(set(HEAVY))


def test_a_run_loads_only_what_it_needs():
    program = """
import mbd
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start
walker = kneed_walker()
mbd.simulate(walker, kneed_walker_start(walker), mbd.HHT(alpha=0.05), dt=1e-3, until=2e-3)
"""
    needless = {*HEAVY} - {"llvmlite"} | {
        "scipy", "numpy.random", "importlib.metadata", "mbd.kernel.translation.translate",
        "mbd.simulation.replay",
    }  # fmt: skip
    loaded(program)  # the stepping kernel is built where this run is the first of its machine
    assert loaded(program).isdisjoint(needless)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_loads_and_says_what_it_is(name):
    public = getattr(mbd, name)
    assert (inspect.getdoc(public) or "").strip()
    assert name in dir(mbd)


def functions(public):
    """The public functions and methods behind a name."""
    if inspect.isclass(public):
        return [
            member
            for label, member in inspect.getmembers(public, inspect.isfunction)
            if not label.startswith("_") and member.__module__.startswith("mbd")
        ]
    return [public] if callable(public) else []  # a number such as mbd.pi has nothing to annotate


@pytest.mark.parametrize("name", NAMES)
def test_every_public_function_is_annotated(name):
    for function in functions(getattr(mbd, name)):
        signature = inspect.signature(function)
        bare = [p.name for p in signature.parameters.values() if p.annotation is p.empty and p.name != "self"]
        assert not bare, f"{function.__qualname__}: {bare}"
        assert signature.return_annotation is not signature.empty, function.__qualname__


def test_editors_and_type_checkers_see_the_same_names():
    tree = ast.parse(Path(mbd.__file__).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {(alias.name, alias.asname, node.module) for node in block.body for alias in node.names}
    wanted = {(name, name, mbd._HOME[name]) for name in NAMES} | {(name, name, "mbd") for name in ("parts", "testing")}
    assert seen == wanted, f"mbd/__init__.py imports for type checkers what it lists; these differ: {seen ^ wanted}"


def test_no_public_name_is_listed_twice():
    assert len(set(NAMES)) == len(NAMES)


def test_a_wrong_name_offers_the_nearest():
    with pytest.raises(AttributeError, match="did you mean 'Revolute'"):
        _ = mbd.Revolut
    with pytest.raises(AttributeError, match="Model"):
        _ = mbd.zzzz


def test_type_checkers_see_no_names_but_the_listed():
    tree = ast.parse(Path(mbd.__file__).read_text(encoding="utf-8"))
    dynamic = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "__getattr__"]
    assert not dynamic, "a __getattr__ that type checkers see makes every wrong name right"
