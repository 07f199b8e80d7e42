"""Functions of this folder as machine code, compiled once for a machine; or as they stand, in plain Python."""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.compile.backend import Function
from mbd.kernel.records import TABLE

__all__ = ["Entry", "entry"]

TYPES = {"Integers": "ints", "Reals": "reals", "int": "int", "float": "real"}
CODE, PARAMS = (list(TABLE.addresses).index(name) for name in ("code", "params"))


class Entry:
    """A function ``f(K, …) → int`` of this folder, with what it is called with.

    Parameters
    ----------
    function : in Python
    """

    def __init__(self, function: Callable[..., int]) -> None:
        self.function = function
        notes = list(function.__annotations__.items())[1:]
        self.kinds = [TYPES[note] for name, note in notes if name != "return"]
        self._machine: Any = None

    def __call__(self, programs: Sequence[Function], parameters: Vector, *given: Any) -> int:
        """Run it with these programs of a mechanism, in machine code if they are; arrays are contiguous."""
        if any(program.address == 0 for program in programs):
            flat = [each.reshape(-1) if isinstance(each, np.ndarray) else each for each in given]
            return int(self.function(SimpleNamespace(code=programs, params=parameters), *flat))
        if self._machine is None:
            self._machine = machine_code(self.function, self.kinds)
        table = np.zeros(len(TABLE.addresses), dtype=np.int64)
        code = np.array([program.address for program in programs], dtype=np.int64)
        table[CODE], table[PARAMS] = code.ctypes.data, parameters.ctypes.data
        words = [address(each) if isinstance(each, np.ndarray) else each for each in given]
        return int(self._machine(table.ctypes.data, *words))


def address(array: Any) -> int:
    """Where an array begins (faster than ``array.ctypes.data`` where it may be written to)."""
    if array.size and array.flags.writeable:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))
    return int(array.ctypes.data)


def machine_code(function: Callable[..., int], kinds: Sequence[str]) -> Any:
    """A compiled function, which takes addresses, integers and reals."""
    from mbd.compile.llvm import cached_object, load_object

    name = f"mbd_{function.__name__}"

    def compiled() -> bytes:
        from mbd.kernel.build import object_of
        from mbd.kernel.translation.llvm import llvm_text
        from mbd.kernel.translation.translate import source_of, translate

        trees = translate(source_of(function.__module__), function.__name__, ["kernel", *kinds])
        return object_of(llvm_text(trees, name))

    address = load_object(cached_object(f"{name} {digest()}", compiled, lasting=True), name)
    types = [
        ctypes.c_double if kind == "real" else ctypes.c_int64 if kind == "int" else ctypes.c_void_p for kind in kinds
    ]
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, *types)(address)


@lru_cache(maxsize=1)
def digest() -> str:
    """Hash of all that these functions are made from."""
    from mbd.kernel.build import source_digest

    found = hashlib.sha256(source_digest().encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        found.update(path.read_bytes())
    return found.hexdigest()


@lru_cache(maxsize=16)
def entry(function: Callable[..., int]) -> Entry:
    """The entry of a function."""
    return Entry(function)
