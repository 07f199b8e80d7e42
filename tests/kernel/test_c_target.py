"""The typed trees of the kernel hold all that a target needs: printed as C, they give the bits of LLVM."""

from __future__ import annotations

import ctypes
import inspect
import subprocess

import numpy as np
import pytest

import mbd
from mbd.kernel import build
from mbd.kernel.translation.translate import Source, functions_of, translate
from tests.compile.graphs import COMPILER
from tests.kernel.c_target import c_text
from tests.kernel.test_translate import CASES, HALF, MOST, inner, whole
from tests.kernel.test_twin import SCENES

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


def library(text, folder, *flags):
    """A C text as a loaded library."""
    (folder / "kernel.c").write_text(text)
    options = ["-std=gnu11", "-ffp-contract=off", "-fno-strict-aliasing", "-fPIC", "-shared", "-w", *flags]
    subprocess.run([COMPILER, *options, "-o", "kernel.so", "kernel.c", "-lm"], cwd=folder, check=True, timeout=300)
    return ctypes.CDLL(str(folder / "kernel.so"))


@pytest.mark.parametrize("function", CASES, ids=lambda function: function.__name__)
def test_c_gives_the_bits_of_python(function, tmp_path):
    functions = functions_of(*(inspect.getsource(one) for one in (function, inner, whole)))
    source = Source("test", functions, {"HALF": HALF, "MOST": MOST})
    entry = library(c_text(translate(source, function.__name__, ["reals", "ints"]), "entry"), tmp_path).entry
    entry.argtypes, entry.restype = [ctypes.c_void_p] * 2, ctypes.c_int64
    rng = np.random.default_rng(7)
    for _ in range(200):
        x, k = rng.choice([rng.normal(size=4) * 10.0, rng.integers(-3, 4, 4) * 1.0]), rng.integers(-9, 10, 4)
        (x1, k1), (x2, k2) = (x.copy(), k.copy()), (x.copy(), k.copy())
        with np.errstate(all="ignore"):
            assert entry(x2.ctypes.data, k2.ctypes.data) == int(function(x1, k1))
        np.testing.assert_array_equal(x2, x1)
        np.testing.assert_array_equal(k2, k1)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_the_whole_kernel_in_c_takes_the_same_steps(scheme, tmp_path, monkeypatch):
    entry = library(c_text(build.kernel_functions(), "entry"), tmp_path, "-O1").entry
    entry.argtypes, entry.restype = [ctypes.c_void_p], ctypes.c_int64
    for scene in ("walker", "bouncing ball", "ball on rubber", "lagging servo"):
        expected = SCENES[scene](scheme, "auto")
        with monkeypatch.context() as patched:
            patched.setattr(build, "entry", lambda: entry)
            found = SCENES[scene](scheme, "auto")
        for part in ("time", "q", "v", "a", "lam"):
            np.testing.assert_array_equal(getattr(found.record, part), getattr(expected.record, part), err_msg=scene)
        assert [event.time for event in found.events] == [event.time for event in expected.events]
