"""Lemke's method as the tests call it, interpreted or compiled, and what a solution is."""

from __future__ import annotations

import ctypes
import itertools
from functools import lru_cache

import numpy as np

from mbd.compile.llvm import load_object
from mbd.kernel.build import object_of
from mbd.kernel.lemke import lemke, lemke_places
from mbd.kernel.llvm import llvm_text
from mbd.kernel.translate import source_of, translate

__all__ = ["compiled", "enumerated", "is_solution", "root", "solved"]


def solved(M, q, most=None, function=lemke):
    """(status, z)."""
    n = len(q)
    z, work, basis = np.full(n, np.nan), np.full(lemke_places(n), np.nan), np.zeros(n, dtype=np.int64)
    flat, given_q = M.flatten(), q.copy()
    status = function(flat, n, given_q, z, work, basis, 20 * n + 20 if most is None else most)
    assert np.array_equal(flat, M.flatten(), equal_nan=True) and np.array_equal(given_q, q, equal_nan=True)
    return status, z


def is_solution(M, q, z, bound=1e-7):
    """Whether w = M z + q ≥ 0, z ≥ 0, zᵀ w = 0, of the terms of each row and of q."""
    w, terms = M @ z + q, np.abs(M) @ np.abs(z) + np.abs(q) + 1e-3 * np.abs(q).max()
    closed = (np.abs(w) <= bound * terms) | (z <= bound * (1.0 + np.abs(z).max()))
    return bool(np.all(z >= 0.0) and np.all(w >= -bound * terms) and np.all(closed))


def enumerated(M, q):
    """Every solution that is a vertex."""
    n = len(q)
    for basic in itertools.chain.from_iterable(itertools.combinations(range(n), k) for k in range(n + 1)):
        part, z = list(basic), np.zeros(n)
        if part:
            block = M[np.ix_(part, part)]
            if np.linalg.matrix_rank(block) < len(part):
                continue
            z[part] = np.linalg.solve(block, -q[part])
        if np.all(z >= -1e-10) and np.all(M @ z + q >= -1e-9 * (1.0 + np.abs(q).max())):
            yield z


def root(rng, n, rank):
    return rng.normal(size=(n, rank))


@lru_cache(maxsize=1)
def compiled():
    """The same functions as machine code, as in the kernel."""
    kinds = ["reals", "int", "reals", "reals", "reals", "ints", "int"]
    text = llvm_text(translate(source_of("mbd.kernel.lemke"), "lemke", kinds), "lemke")
    address, number = ctypes.c_void_p, ctypes.c_int64
    function = ctypes.CFUNCTYPE(number, address, number, address, address, address, address, number)(
        load_object(object_of(text), "lemke")
    )

    def run(*arguments):
        return function(*(one if isinstance(one, int) else one.ctypes.data for one in arguments))

    return run
