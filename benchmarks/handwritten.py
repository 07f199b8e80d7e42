"""The hand-written C loops of `c/`, compiled here and now with what this machine offers."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import thread_time
from typing import Any

import numpy as np

from mbd import State
from mbd.integrators.family import NewmarkFamily

HERE = Path(__file__).with_name("c")
FLAGS = ("-O3", "-march=native")


def compiler() -> str | None:
    """Path of the C compiler, None where there is none."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def compiler_version() -> str:
    """One line that says which compiler it is."""
    found = compiler()
    if found is None:
        return "no C compiler found"
    return subprocess.run([found, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]


@dataclass(frozen=True)
class Motion:
    """What a C loop computed.

    rows (stored, 3 n + m): q, v, a, λ; seconds of processor time; counts of tangents, residuals and iterations.
    """

    rows: np.ndarray[Any, np.dtype[np.float64]]
    seconds: float
    counts: tuple[int, int, int]


class Program:
    """One model in one formulation as a C loop.

    Parameters
    ----------
    source : header of the model in `c/`
    sizes : degrees of freedom and rows
    numbers : dataclass of the model's parameters, in the order of the C struct
    names : coordinates in the order of the C code
    reduced : whether rows are eliminated before the rest is solved, instead of LU of the whole with a search for pivots
    """

    def __init__(
        self,
        source: str,
        sizes: tuple[int, int],
        numbers: Any,
        names: Sequence[str],
        stabilized: bool,
        reduced: bool = False,
    ):
        self.width = 3 * sizes[0] + sizes[1]
        self.numbers = np.array(astuple(numbers))
        self.names = tuple(names)
        chosen = (f'-DMODEL="{source}"', f"-DSTABILIZED={int(stabilized)}", f"-DREDUCED={int(reduced)}")
        with TemporaryDirectory() as folder:
            library = Path(folder) / "loop.so"
            command = [str(compiler()), *FLAGS, "-shared", "-fPIC", *chosen, str(HERE / "newmark.c"), "-lm", "-o"]
            subprocess.run([*command, str(library)], check=True)
            self._run = ctypes.CDLL(str(library)).run
        pointers, integers = [ctypes.c_void_p] * 4, [ctypes.c_int64] * 2
        self._run.argtypes = [*pointers, *integers, ctypes.c_void_p, ctypes.c_void_p]
        self._run.restype = ctypes.c_int64

    def order(self, start: State) -> list[int]:
        """Where the coordinates of the C code stand in those of the model."""
        return [start.names.index(name) for name in self.names]

    def run(self, start: State, scheme: NewmarkFamily, dt: float, steps: int, stride: int) -> Motion:
        """Steps from a consistent state; one row of results every `stride` of them."""
        order, c = self.order(start), scheme.coefficients
        settings = np.array([c.alpha_m, c.alpha_f, c.beta, c.gamma, scheme.tolerance, dt])
        q, v = start.q[order], start.v[order]
        rows, counts = np.zeros((steps // stride + 1, self.width)), np.zeros(3, dtype=np.int64)
        arrays = [array.ctypes.data for array in (self.numbers, settings, q, v)]
        began = thread_time()
        failed = self._run(*arrays, steps, stride, rows.ctypes.data, counts.ctypes.data)
        seconds = thread_time() - began
        if failed:
            raise ArithmeticError(f"the C loop failed in step {failed}")
        tangents, residuals, iterations = (int(count) for count in counts)
        return Motion(rows, seconds, (tangents, residuals, iterations))
