"""The choice between machine code and plain Python."""

import subprocess
import sys

import numpy as np
import pytest

from mbd.compile import backend as module
from mbd.compile.backend import backend
from mbd.compile.cache import ObjectCache
from mbd.errors import CapabilityError, UnknownNameError
from tests.compile.chains import chain
from tests.compile.test_llvm import results

LINKS = chain(3)


def test_machine_code_is_chosen_where_llvmlite_is_installed():
    chosen = backend("auto")
    assert (chosen.name, chosen.note) == ("llvm", "")


@pytest.mark.parametrize("kind", ["llvm", "python"])
def test_every_backend_gives_functions_by_name(kind):
    functions = backend(kind, cache=ObjectCache()).functions(LINKS.layout)
    functions.add({"r": LINKS.outputs})
    functions.add({"energy": [LINKS.energy]})
    assert list(functions) == ["r", "energy"]
    assert len(functions) == 2
    assert "r" in functions
    assert (functions["r"].name, functions["r"].size) == ("r", 12)
    assert (functions["r"].address == 0) == (kind == "python")
    with pytest.raises(UnknownNameError, match="did you mean 'energy'"):
        functions["enrgy"]


def test_machine_code_and_plain_python_agree_to_round_off():
    both = [backend(kind, cache=ObjectCache()).functions(LINKS.layout) for kind in ("llvm", "python")]
    for functions in both:
        functions.add({"r": LINKS.outputs})
    machine, plain = (functions["r"] for functions in both)
    for seed in range(20):
        a, b = results(machine, LINKS, seed), results(plain, LINKS, seed)
        assert np.abs(a - b).max() <= 1e-14 * np.abs(a).max()


def test_without_llvmlite_plain_python_runs_and_says_so(monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    chosen = backend("auto")
    assert chosen.name == "python"
    assert "llvmlite is not installed" in chosen.note
    with pytest.raises(CapabilityError, match="pip install llvmlite"):
        backend("llvm")


def test_a_broken_llvmlite_is_reported(monkeypatch):
    monkeypatch.delitem(sys.modules, "mbd.compile.llvm", raising=False)
    monkeypatch.setitem(sys.modules, "llvmlite.binding", None)
    import mbd.compile

    monkeypatch.delattr(mbd.compile, "llvm", raising=False)
    chosen = backend("auto")
    assert chosen.name == "python"
    assert "does not load" in chosen.note
    with pytest.raises(CapabilityError, match="does not load"):
        backend("llvm")


def test_an_unknown_backend_is_an_error_that_names_the_known_ones():
    with pytest.raises(UnknownNameError, match="no backend named 'lvm'; did you mean 'llvm'"):
        backend("lvm")


def test_plain_python_needs_no_llvmlite():
    program = """
import sys
sys.modules["llvmlite"] = None
from mbd.compile.backend import backend
from mbd.compile.layout import Layout
from mbd.tape.node import Tape
import numpy
out = numpy.zeros(1)
functions = backend("python").functions(Layout(0, 0, 0, 0, 0, 0, 0))
functions.add({"f": [2.0 * Tape().input("t")]})
functions["f"](numpy.array([3.0, 0.0, 0.0]), numpy.zeros(0), out)
print(out[0])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.strip() == "6.0"


def test_a_run_needs_no_llvmlite():
    program = """
import sys, warnings
warnings.simplefilter("ignore")
sys.modules["llvmlite"] = sys.modules["llvmlite.binding"] = None
import mbd
model = mbd.Model("rod")
rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5)
model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start))
run = mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 0.3}), dt=0.01, until=0.05)
print(round(float(run["hinge.angle"][-1]), 3))
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.strip() == "0.293"
