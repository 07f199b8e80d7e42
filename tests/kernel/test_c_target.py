"""Kernel and models as C99: compiled by a C compiler, they give the bits of LLVM's code without fused multiply-add."""

import ctypes
import inspect
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import mbd
from mbd.compile import llvm, mechanism
from mbd.compile.backend import Backend
from mbd.compile.c import c_source
from mbd.compile.functions import ByName
from mbd.compile.host import host
from mbd.compile.llvm import MachineFunction
from mbd.kernel import build, entry as kernel_entry
from mbd.kernel.translation.llvm import PLACES
from mbd.kernel.translation.translate import Source, functions_of, translate
from mbd.trees.c import HEAD, c_text
from tests.compile.graphs import COMPILER
from tests.kernel.test_translate import CASES, HALF, MOST, inner, whole
from tests.kernel.test_twin import SCENES

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")
SIZES = 0, 0, 0
"""Of arrays, which the kernel does not ask for."""


def library(text, folder, *flags):
    """A C text as a loaded library."""
    (folder / "text.c").write_text(text)
    options = ["-std=c99", "-ffp-contract=off", "-fPIC", "-shared", "-w", *flags]
    subprocess.run([COMPILER, *options, "-o", "text.so", "text.c", "-lm"], cwd=folder, check=True, timeout=300)
    return ctypes.CDLL(str(folder / "text.so"))


def entry_of(loaded):
    entry = loaded.mbd_kernel
    entry.argtypes, entry.restype = [ctypes.c_void_p], ctypes.c_int64
    return entry


class InC(ByName):
    """The functions of a model in C, each set of them a library of its own."""

    def __init__(self, layout, folder):
        super().__init__()
        self.layout, self.folder = layout, folder

    def add(self, programs, rarely=False):
        folder = self.folder / f"{len(list(self.folder.iterdir()))}"
        folder.mkdir()
        loaded = library(c_source(programs, self.layout), folder, "-O1" if len(programs) > 1 else "-O0")
        for name, outputs in programs.items():
            address = ctypes.cast(getattr(loaded, f"mbd_{name}"), ctypes.c_void_p).value
            self._functions[name] = MachineFunction(name, address, (0, 0, len(outputs)), loaded)


def same_rows(found, expected):
    for part in ("time", "q", "v", "a", "lam"):
        np.testing.assert_array_equal(getattr(found.record, part), getattr(expected.record, part), err_msg=part)
    assert [event.time for event in found.events] == [event.time for event in expected.events]


@pytest.mark.parametrize("function", CASES, ids=lambda function: function.__name__)
def test_c_gives_the_bits_of_python(function, tmp_path):
    functions = functions_of(*(inspect.getsource(one) for one in (function, inner, whole)))
    source = Source("test", functions, {"HALF": HALF, "MOST": MOST})
    trees = translate(source, function.__name__, ["reals", "ints"])
    entry = library(HEAD + c_text(trees, "entry", PLACES), tmp_path).entry
    entry.argtypes, entry.restype = [ctypes.c_void_p] * 2, ctypes.c_int64
    rng = np.random.default_rng(7)
    for _ in range(200):
        x, k = rng.choice([rng.normal(size=4) * 10.0, rng.integers(-3, 4, 4) * 1.0]), rng.integers(-9, 10, 4)
        (x1, k1), (x2, k2) = (x.copy(), k.copy()), (x.copy(), k.copy())
        with np.errstate(all="ignore"):
            assert entry(x2.ctypes.data, k2.ctypes.data) == int(function(x1, k1))
        np.testing.assert_array_equal(x2, x1)
        np.testing.assert_array_equal(k2, k1)


@pytest.fixture
def without_fma(monkeypatch):
    """Machine code of models that does without fused multiply-add."""
    plain = replace(host(), fused=False, features=f"{host().features},-fma")
    monkeypatch.setattr(llvm, "host", lambda: plain)


@pytest.mark.usefixtures("made_afresh")
@pytest.mark.parametrize("scene", ["walker", "lagging servo"])
def test_a_model_in_c_takes_the_same_steps(scene, tmp_path, monkeypatch, without_fma):
    scheme = mbd.HHT(0.05)
    expected = SCENES[scene](scheme, "auto")
    monkeypatch.setattr(
        mechanism, "choose_backend", lambda kind: Backend("llvm", "", lambda layout: InC(layout, tmp_path))
    )
    same_rows(SCENES[scene](scheme, "auto"), expected)
    assert any(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.usefixtures("made_afresh")
def test_kernel_and_model_in_c_take_the_same_steps(tmp_path_factory, monkeypatch, without_fma):
    entry = entry_of(library(build.kernel_c_source(), tmp_path_factory.mktemp("kernel"), "-O1"))
    for scheme in (mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()):
        for scene in ("walker", "bouncing ball", "ball on rubber", "lagging servo"):
            expected, folder = SCENES[scene](scheme, "auto"), tmp_path_factory.mktemp("model")
            with monkeypatch.context() as patched:
                patched.setattr(kernel_entry, "entry", lambda: entry)
                patched.setattr(
                    mechanism,
                    "choose_backend",
                    lambda kind, folder=folder: Backend("llvm", "", lambda layout: InC(layout, folder)),
                )
                same_rows(SCENES[scene](scheme, "auto"), expected)
