"""Code of elements that repeat is written once, and gives the bits of straight-line code."""

import numpy as np
import pytest

from mbd.compile import elements, lowering
from mbd.compile.ir import Module
from mbd.compile.mechanism import Mechanism
from mbd.equations import programs
from mbd.equations.derivation import derive
from mbd.testing.mechanisms import random_tree
from tests.compile.graphs import COMPILER, by_c, by_llvm


@pytest.mark.parametrize("backend", ["llvm", "C"])
def test_elements_of_random_trees_give_the_bits_of_straight_code(backend, monkeypatch, tmp_path):
    if backend == "C" and COMPILER is None:
        pytest.skip("needs a C compiler")
    for module in (elements, lowering):
        monkeypatch.setattr(module, "MIN_REPEATED", 0)
    for seed in range(4 if backend == "llvm" else 2):
        made = Mechanism(derive(random_tree(seed, 5, spatial=seed % 2 == 1, most=8)), "python")
        outputs = {"accelerations": made._accelerations, "scales": programs.scales(made.equations)}
        random, found = np.random.default_rng(seed), []
        block, parameters = random.uniform(-1.0, 1.0, made.layout.size), made.parameters()
        for rolled in (10**9, 0):
            options = {"large": 300, "part": 100, "rolled": rolled}
            if backend == "C":
                folder = tmp_path / f"{seed} {rolled}"
                folder.mkdir()
                functions = by_c(outputs, folder, made.layout, **options)
            else:
                assert (".kind" in Module(outputs, made.layout, **options).text()) == (rolled == 0)
                functions = by_llvm(outputs, made.layout, **options)
            found.append([])
            for name, nodes in outputs.items():
                out = np.zeros(len(nodes))
                functions[name](block, parameters, out)
                found[-1].append(out)
        for one, other in zip(*found, strict=True):
            assert np.array_equal(one, other, equal_nan=True), seed
