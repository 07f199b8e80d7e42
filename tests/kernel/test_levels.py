"""The kernel without optimization takes the same steps, bit by bit."""

import ctypes
import re
from collections import Counter

import numpy as np
import pytest

import mbd
from mbd.compile.llvm import Machine, cached_object
from mbd.kernel import build, entry
from tests.kernel.test_decisions import scenes

SCHEMES = (mbd.GeneralizedAlpha(0.9), mbd.GeneralizedAlpha(0.5, formulation="index3"), mbd.RadauIIA(),
           mbd.RungeKutta853())  # fmt: skip


@pytest.fixture(scope="module")
def plain_kernel():
    """The entry of a kernel that no pass has worked on."""
    machine = Machine()
    code = cached_object(f"level 0 {build.source_digest()}", lambda: build.object_of(build.kernel_text(), 0))
    yield ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(machine.load(code, [build.ENTRY])[0])
    del machine


def steps(name, scheme):
    model, start, until = scenes()[name]
    run = mbd.simulate(model, start, scheme, dt=until / 150, until=until, on_failure="return")
    return run.record, run.stats["steps"]


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("name", ["equal rods", "walker", "box", "driven, all cut"])
def test_every_level_of_optimization_gives_the_same_bits(name, scheme, plain_kernel, monkeypatch):
    optimized, count = steps(name, scheme)
    monkeypatch.setattr(entry, "entry", lambda: plain_kernel)
    plain, same = steps(name, scheme)
    assert count == same > 100
    for part in ("time", "q", "v", "a", "lam"):
        np.testing.assert_array_equal(getattr(optimized, part), getattr(plain, part), err_msg=part)


def test_what_is_called_in_one_place_is_part_of_its_caller():
    text = build.kernel_text()
    calls = Counter(re.findall(r"call \w+ @([\w.]+)\(", text))
    heads = re.findall(r"^define internal \w+ @([\w.]+)\(.*\) nounwind(.*) align 64 \{$", text, re.MULTILINE)
    joined = {name for name, how in heads if how == " alwaysinline"}
    apart = {name for name, how in heads if how == " noinline"}
    assert joined == {name for name, _ in heads if calls[name] == 1} - apart
    assert len(apart) >= len(build.APART) and len(joined) > len(heads) / 3
