"""Translated functions give the same bits as Python does, for everything the kernel may use."""

import ctypes
import inspect
import math
from functools import lru_cache
from importlib import import_module

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from mbd.compile.llvm import load_object
from mbd.errors import CapabilityError
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.build import object_of
from mbd.kernel.translation.llvm import llvm_text
from mbd.kernel.translation.translate import Source, functions_of, source_of, translate

reals = st.lists(st.floats(-1e3, 1e3) | st.sampled_from([0.0, -0.0, np.inf, -np.inf, np.nan]), min_size=4, max_size=4)
integers = st.lists(st.integers(-9, 9), min_size=4, max_size=4)
HALF = 0.5
MOST = 7


def arithmetic(x, k):
    x[0] = x[0] + x[1] * 2 - x[2] / 3.0
    x[1] = -x[3] * HALF - float(k[0])
    x[2] = abs(x[2]) + abs(k[1])
    x[3] *= 0.25
    x[3] += k[2]
    k[0] = k[0] * k[1] - k[2]
    k[3] -= MOST
    return k[3]


def rounding_down(x, k):
    k[0] = k[0] // 3 + k[1] % 4
    k[1] = k[1] // -2
    k[2] = k[2] % -5
    x[0] = k[3] % 1.0 + 0.6180339887498949 * k[0] % 1.0
    x[1] = x[1] * 0.0 if not abs(x[1]) < 1e300 else x[1] % 0.75
    k[3] = int(x[1]) if abs(x[1]) < 1e300 else 0
    return 0


def extremes(x, k):
    x[0] = max(x[0], x[1], 0.0)
    x[1] = min(x[1], x[2])
    x[3] = max(x[3], k[3])
    k[0] = max(k[0], 0, k[1])
    k[1] = min(2, k[2])
    return 0


def roots(x, k):
    x[0] = sqrt(x[0])
    x[1] = 1.0 / sqrt(abs(x[1])) if x[1] != 0.0 else sqrt(HALF * x[1])
    x[2] = sqrt(x[2] * x[2] + x[3] * x[3])
    x[3] = abs(x[3]) ** 1.3 + abs(x[3]) ** 3.0
    return 0


def decisions(x, k):
    found = 0
    if 0.0 < x[0] < x[1] <= 500.0:
        found += 1
    if x[0] == x[1] or (x[2] != x[2] and not k[0] > 0):
        found += 2
    elif k[0]:
        found += 4
    inside = k[1] >= 0 and k[1] < 4 and x[k[1]] > 0.0
    kind = 8 if inside else (16 if x[3] >= 0.0 else 32)
    mixed = x[1] if inside else 3
    x[2] = mixed
    k[3] = bool(x[3]) + int(k[2] == 1)
    return found + kind


def loops(x, k):
    total = 0
    for i in range(4):
        if k[i] < 0:
            continue
        for j in range(i, -1, -1):
            total += k[j]
            if total > 12:
                break
    i = 0
    while True:
        i += 1
        if x[i % 4] > 0.0 or i > 5:
            break
    for n in range(2, k[0]):
        total = total + 2**n
        n = 0
    k[1] = i + total
    return total


def widening(x, k):
    size = 0
    for i in range(4):
        if x[i] > size:
            size = x[i]
    x[0] = x[1] = size
    return inner(x, k, size, k[0]) + inner(x, k, 1, 1)


def inner(x, k, size: float, times: int) -> int:
    values = x if times > 0 else whole(x)
    values[3] = size / 2
    for i in range(4):
        if k[i] == times:
            return i
    return -1


def whole(x):
    x[2] = 0.0
    return x


def slices(x, k):
    m = 1 + k[0] % 2
    x[m : m + 2] = k[:2]
    k[:m] = 3
    x[:0] = 7.0
    for i in range(2):
        k[2 * i : 2 * i + m] = 5
    return 0


CASES = (arithmetic, rounding_down, extremes, roots, decisions, loops, slices, widening)


@lru_cache
def machine_code(function, level):
    functions = functions_of(*(inspect.getsource(one) for one in (function, inner, whole)))
    name = f"translated_{function.__name__}_{level}"
    source = Source("test", functions, {"HALF": HALF, "MOST": MOST})
    text = llvm_text(translate(source, function.__name__, ["reals", "ints"]), name)
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)(load_object(object_of(text, level), name))


@pytest.mark.parametrize("function", CASES, ids=lambda function: function.__name__)
@settings(max_examples=150)
@given(x=reals, k=integers)
def test_the_same_bits_as_python_at_every_level(function, x, k):
    plain, *compiled = [(np.array(x), np.array(k, dtype=np.int64)) for _ in range(4)]
    with np.errstate(all="ignore"):
        expected = int(function(*plain))
    numbers = ~np.isnan(plain[0])
    for level, fast in zip((0, 2, 3), compiled, strict=True):
        found = machine_code(function, level)(*(array.ctypes.data for array in fast))
        assert found == expected, level
        assert np.array_equal(np.isnan(fast[0]), ~numbers), (level, fast[0], plain[0])
        bits, expected_bits = (array[numbers].view(np.int64) for array in (fast[0], plain[0]))
        assert np.array_equal(bits, expected_bits), (level, fast[0], plain[0])
        assert np.array_equal(fast[1], plain[1]), (level, fast[1], plain[1])


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("    return [1]", r"a.py:2, in f: expected a number, a field or .*, got '\[1\]'; try an array of the kernel"),
        ("    y = 1\n    return z", "a.py:3, in f: no value named 'z'"),
        ("    return rho", "expected a number, got 'rho' of the module; try capitals, RHO, for a constant"),
        ("    for i in x:\n        pass", "expected a loop over range.*, got one over 'x'"),
        ("    x = 1.0", "expected one kind of value, got an array of floats and a float"),
        ("    g(x)", "no function named 'g'; .*or import it"),
        ("    math.sqrt(x[0])", "no function named 'sqrt'.*try from mbd.kernel.algebra.roots import sqrt"),
        ("    np.zeros(3)", "no function named 'zeros'.*whose length the entry gives by memory="),
        ("    f(x, K)", "'f' calls itself; try a loop"),
        ("    two(x)", r"expected two\(x, k\), got 1 argument"),
        ("    with x:\n        pass", r"expected an assignment, .*, got 'with x:'"),
        ("    y: float = 0.0", "got 'y: float = 0.0'; try x = 0.0 without an annotation"),
        ("    if x[0] > 0.0:\n        a, b = x[0], x[1]", "a.py:3, in f: .*try one name at a time"),
        ("    return x[:2]", "try a loop"),
        ("    x[1:3] = x[0:2]", "a.py:2, in f: expected a number or a slice of another array.*got 'x\\[1:3\\] = x"),
        ("    x[:2] = x[2] + 1.0", "a slice of another array to fill a slice with, got"),
        ("    x[:] = 0.0", "a slice of another array to fill a slice with, got"),
        ("    return x.size", "expected a field of a record, got 'x.size' of an array of floats; lengths are K.n"),
        ("    return 3**int(x[0])", "expected a power of a float"),
        ("    return x[0] ** 0.5", r"try sqrt\(x\)"),
        ("    return K.n_rws", "a.py:2, in f: 'K.n_rws': no field of the kernel named 'n_rws'; did you mean 'n_rows'"),
        ("    K.n_row = 1", "'K.n_row': no field of the kernel named 'n_row'; did you mean 'n_rows'"),
        ("    K.n_rows = 1", "expected an array or a field in one to write to, got 'K.n_rows', a setting"),
        ("    return K.n[0]", "expected an array, got 'K.n', an int"),
        ("    whole(x)", "a.py:9, in whole: expected an int, got an array of floats"),
    ],
)
def test_what_the_kernel_may_not_use_is_named_by_file_line_and_function(source, message):
    beside = "def two(x, k):\n    pass\ndef whole(x) -> int:\n    return x\n"
    text = f"def f(x, K):\n{source}\n" + "\n" * (3 - source.count("\n")) + beside
    names = {"rho": 0.3, "np": np, "math": math}
    with pytest.raises(CapabilityError, match=message):
        translate(Source("test", functions_of(text), names, "a.py"), "f", ["reals", "kernel"])


def test_a_module_is_named_by_its_file_in_the_package():
    source = source_of("mbd.kernel.schemes.newmark")
    line = source.functions["newmark_start"].lineno - 1
    lines = inspect.getsource(import_module("mbd.kernel.schemes.newmark")).splitlines()
    assert source.file == "mbd/kernel/schemes/newmark.py"
    assert lines[line].startswith("def newmark_start")


def test_a_name_means_what_it_means_in_its_module(tmp_path, monkeypatch):
    """Two modules with a `step` and a LIMIT each: a call goes to the one that was imported, under any name."""
    (tmp_path / "one_scheme.py").write_text("LIMIT = 3.0\n\ndef step(x):\n    x[0] += LIMIT\n    return 1\n")
    (tmp_path / "other_scheme.py").write_text("LIMIT = 5.0\n\ndef step(x):\n    x[1] += LIMIT\n    return 2\n")
    (tmp_path / "both_schemes.py").write_text(
        "import one_scheme\nfrom other_scheme import step as other\n\n"
        "def step(x):\n    return 10 * one_scheme.step(x) + other(x)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    functions = translate(source_of("both_schemes"), "step", ["reals"])
    assert [function.symbol for function in functions] == [
        "one_scheme.step.reals", "other_scheme.step.reals", "both_schemes.step.reals"
    ]  # fmt: skip
    x = np.zeros(2)
    run = load_object(object_of(llvm_text(functions, "both_steps")), "both_steps")
    assert ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(run)(x.ctypes.data) == 12
    np.testing.assert_array_equal(x, [3.0, 5.0])
