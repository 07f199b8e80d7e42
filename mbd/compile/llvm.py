"""Tape outputs → machine code of this machine, through LLVM.

The text of `ir` is the key: if an object file made from the same text, for the same processor, by the same LLVM is in
the cache, it is loaded and nothing is parsed or optimized. A `Library` holds the code; addresses are valid as long as
it lives. The code has no globals and holds no lock, so threads may call it at once with buffers of their own.

Levels, measured on r and S of planar chains (Zen 4; milliseconds to generate the code / nanoseconds per call):

    operations     0            2             3           gcc -O3
    577            5 / 100      19 / 80       125 / 63    235 / 107
    1 179          9 / 188      39 / 152      400 / 110   270 / 211
    1 981          11 / 300     58 / 245      1400 / 185  600 / 327
    4 185          20 / 680     106 / 575     350 / 565   1540 / 680

Level 0 cuts every function into parts of 120 operations, small enough for the allocator that looks at one block only.
Level 1 takes 8 % less than level 2 for code 2 % slower. Neither runs passes over the IR, where the tape has left
nothing to fold: they took 5 to 40 ms and gained nothing. Level 3 does, for the sake of the vectorization of
straight-line code: slow to make, worth it for long runs. All levels give the same bits.

Large programs do not wait for level 2 (`MAX_QUICK_LINES`): they run at level 0 at once, and the object files of level 2
are made in pieces beside the run (`background`). A function tells by `provisional` that it has not yet got its final
address. As all levels give the same bits, it does not matter to any result when that happens.
"""

from __future__ import annotations

import ctypes
import sys
import time
import weakref
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numpy as np

from mbd.arrays import Vector, address_of
from mbd.compile.background import submit, wake
from mbd.compile.cache import ObjectCache, default_cache, key_of
from mbd.compile.forking import COMPILING
from mbd.compile.functions import ByName
from mbd.compile.host import host
from mbd.compile.ir import Module
from mbd.compile.layout import Layout
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError, ModelError
from mbd.tape.node import Node

LEVEL = 2
"""Default optimization level, see above."""

MAX_QUICK_LINES = 4500
"""Lines of IR above which level 2 takes over 0.1 s, so that it is made in the background: some 2000 operations."""

CUTS = {0: {"large": 150, "part": 120, "rolled": 3000}}
"""Cuts of functions into parts that differ from those of `ir`, by level; what is called rarely may run slower."""

PASSES = {"from level": 3, "speed_level": 3, "slp_vectorization": True}
"""Passes over the IR, and from which level on; part of the key of every object file."""

_PROTOTYPE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


LIBRARY = (
    "acos", "asin", "atan", "atan2", "cos", "cosh", "exp", "fmod", "free", "log", "malloc", "memset", "pow", "sin",
    "sinh", "tan", "tanh",
)  # fmt: skip
"""Functions of the C library that the code may call, by their C names."""


@cache
def _announce_library() -> None:
    """Tell LLVM where the functions of the C library are; a name that it cannot find would end the process."""
    libraries = [ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)]
    for name in LIBRARY:
        if not hasattr(libraries[-1], name):
            from ctypes.util import find_library

            libraries.append(ctypes.CDLL(find_library("m")))
        found = next((library for library in reversed(libraries) if hasattr(library, name)), None)
        if found is None:
            raise CapabilityError(f"the C library of this system has no function {name!r}; use backend='python'")
        llvm.add_symbol(name, ctypes.cast(getattr(found, name), ctypes.c_void_p).value)


def _target_machine(level: int) -> llvm.TargetMachine:
    this = host()
    return llvm.Target.from_triple(this.triple).create_target_machine(cpu=this.cpu, features=this.features, opt=level)


def emit_object(text: str, level: int = LEVEL) -> bytes:
    """The object file of an IR text."""
    with COMPILING:
        machine = _target_machine(level)
        ir = llvm.parse_assembly(text, llvm.create_context())
        ir.triple, ir.data_layout = machine.triple, str(machine.target_data)
        if level >= PASSES["from level"]:
            options = llvm.create_pipeline_tuning_options(speed_level=PASSES["speed_level"])
            options.slp_vectorization = PASSES["slp_vectorization"]
            builder = llvm.create_pass_builder(machine, options)
            builder.getModulePassManager().run(ir, builder)
        code: bytes = machine.emit_object(ir)
    return code


def cached_object(
    tag: str, make: Callable[[], bytes], cache: ObjectCache | None = None, lasting: bool = False
) -> bytes:
    """What `make` compiles for this machine, from the cache if it is there.

    The tag must say everything that the object depends on, besides processor, LLVM version and `PASSES`; what is
    `lasting` is the last to be removed from a cache that is full.
    """
    store = default_cache() if cache is None else cache
    key = tag_key(tag)
    code = store.load(key, lasting)
    if code is None:
        code = make()
        store.store(key, code, lasting)
    return code


def tag_key(tag: str) -> str:
    """The key of what is made of a tag for this machine, see `cached_object`."""
    this = host()
    return key_of(tag, this.triple, this.cpu, this.features, this.llvm, llvmlite.__version__, repr(PASSES))


_FLOAT = np.dtype(np.float64)


def _pointer(array: Any) -> int:
    """Where the numbers of an array begin."""
    if array.dtype != _FLOAT or not array.flags.c_contiguous:
        raise TypeError(
            f"compiled code takes contiguous arrays of float64; this one has dtype {array.dtype} and "
            f"strides {array.strides}: use numpy.ascontiguousarray(array, dtype=float)"
        )
    return address_of(array)


def call(address: int) -> Callable[[Vector, Vector, Vector], None]:
    """A function of three float64 arrays from the address of machine code; whoever asks keeps the code alive."""
    function = _PROTOTYPE(address)

    def run(block: Vector, parameters: Vector, out: Vector) -> None:
        if not out.flags.writeable:
            raise ValueError("`out` is a read-only array; give one that may be written, such as numpy.zeros(size)")
        function(_pointer(block), _pointer(parameters), _pointer(out))

    return run


class Machine:
    """An execution engine: object files go in, addresses come out. Addresses are valid as long as it lives."""

    def __init__(self) -> None:
        self._engine: llvm.ExecutionEngine | None = None

    def load(self, code: bytes, symbols: Sequence[str], *more: bytes) -> list[int]:
        """The addresses of some functions of object files, which must not bring a symbol that is here already."""
        with COMPILING:
            if self._engine is None:
                _announce_library()
                self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine(0))
            for file in (code, *more):
                self._engine.add_object_file(llvm.ObjectFileRef.from_data(file))
            self._engine.finalize_object()
            return [self._engine.get_function_address(symbol) for symbol in symbols]


@cache
def _resident() -> Machine:
    return Machine()


def load_object(code: bytes, symbol: str) -> int:
    """The address of a function of an object file, which stays loaded until the process ends."""
    return _resident().load(code, [symbol])[0]


class MachineFunction:
    """One compiled function: its address, and a call on arrays that checks their sizes.

    A provisional one will get another address, of faster code with the same results; the present one stays valid too.
    """

    def __init__(
        self, name: str, address: int, sizes: tuple[int, int, int], library: Library, provisional: bool = False
    ) -> None:
        self.name, self.address, self.size = name, address, sizes[2]
        self._sizes, self._library, self._run = sizes, library, call(address)
        self._provisional = provisional

    @property
    def provisional(self) -> bool:
        """Whether a better version is being made."""
        if self._provisional:
            wake()
        return self._provisional

    def finalize(self, address: int | None) -> None:
        """From now on this is the function, or stays what it is."""
        if address is not None:
            self._run, self.address = call(address), address
        self._provisional = False

    def require_room(self, block: Vector, parameters: Vector, out: Vector) -> None:
        """Raise where an array is too short."""
        sizes = self._sizes
        if block.size < sizes[0] or parameters.size < sizes[1] or out.size < sizes[2]:
            came = block.size, parameters.size, out.size
            raise ValueError(f"{self.name}: (block, parameters, out) need {sizes} numbers, these arrays have {came}")

    def __call__(self, block: Vector, parameters: Vector, out: Vector) -> None:
        self.require_room(block, parameters, out)
        self._run(block, parameters, out)


@dataclass(frozen=True)
class Build:
    """How some functions came to be: from the cache or not, the seconds it took, and at which level they began.

    sizes : numbers that block, parameters and out of each must hold
    objects, quick : keys of their object files, and of the one of level 0 that they run with meanwhile ('' for none)
    final : the level that they end at
    """

    names: tuple[str, ...]
    cached: bool
    text: float
    code: float
    load: float
    level: int = LEVEL
    sizes: tuple[tuple[int, int, int], ...] = ()
    objects: tuple[str, ...] = ()
    quick: str = ""
    final: int = LEVEL


class Library(ByName[MachineFunction]):
    """Machine code of functions with one layout, in memory; functions may be added at any time.

    Parameters
    ----------
    level : optimization level
    cache : where object files are kept; that of the user by default
    hasty : lines of IR above which functions run at level 0 until those of `level` are there; None to wait always

    >>> from mbd.tape.node import Tape
    >>> library = Library(Layout(0, 0, 0, 0, 0, 0, 0), cache=ObjectCache())
    >>> library.add({"twice": [2.0 * Tape().input("t")]})
    >>> block, parameters, out = np.array([3.0, 0.0, 0.0]), np.zeros(0), np.zeros(1)
    >>> library["twice"](block, parameters, out)
    >>> float(out[0]), library.address("twice") > 0
    (6.0, True)
    """

    def __init__(
        self, layout: Layout, level: int = LEVEL, cache: ObjectCache | None = None, hasty: int | None = None
    ) -> None:
        super().__init__("compiled function")
        self.layout, self.level, self.hasty = layout, level, hasty
        self.builds: list[Build] = []
        self.notes: list[str] = []
        self.cache = default_cache() if cache is None else cache
        self._machine = Machine()
        self._later: list[Machine] = []

    def add(self, programs: Mapping[str, Sequence[Node]], rarely: bool = False, soon: bool = False) -> None:
        """Compile, or fetch from the cache, one function per name and list of outputs.

        rarely : called, so that level 0 will do; soon : level 0 first, however few operations they have
        """
        for name in programs:
            if name in self._functions:
                raise ModelError(f"this library already has a function {name!r}; give every function its own name")
        begin = time.perf_counter()
        final = 0 if rarely else self.level
        module = Module(programs, self.layout, host().fused, **CUTS.get(final, {}))
        text = module.text()
        written = time.perf_counter()
        large = not rarely and self.hasty is not None and (soon or module.lines > self.hasty)
        texts = module.pieces() if large else [text]
        keys = tuple(tag_key(_tag(text, final)) for text in texts)
        known = [self.cache.load(key) for key in keys]
        hasty = large and None in known
        level = 0 if hasty else final
        if hasty:
            codes = [cached_object(_tag(text, 0), lambda: emit_object(text, 0), self.cache)]
        else:
            codes = [code or self._made(text, final) for code, text in zip(known, texts, strict=True)]
        made = time.perf_counter()
        sizes = tuple(_sizes(outputs, self.layout) for outputs in programs.values())
        self._place(tuple(programs), sizes, codes, hasty)
        times = written - begin, made - written, time.perf_counter() - made
        quick = tag_key(_tag(text, 0)) if large else ""
        self.builds.append(Build(tuple(programs), None not in known, *times, level, sizes, keys, quick, final))
        if hasty:
            packed = zlib.compress("\0".join(texts).encode(), 1)
            self.cache.store(_texts_key(keys), packed)
            submit(_Later(self, tuple(programs), packed))

    def fetch(self, build: Build) -> bool:
        """Load functions that were built like this before, without their texts; False where something is not there.

        Functions of many operations whose final code is not complete run at level 0 again, until it is.
        """
        begin = time.perf_counter()
        codes = [self.cache.load(key) for key in build.objects]
        hasty = bool(build.quick) and None in codes
        texts: bytes | None = None
        if hasty:
            codes, texts = [self.cache.load(build.quick)], self.cache.load(_texts_key(build.objects))
        if None in codes or (hasty and texts is None):
            return False
        made = time.perf_counter()
        self._place(build.names, build.sizes, [code for code in codes if code], hasty)
        times = 0.0, made - begin, time.perf_counter() - made
        self.builds.append(
            replace(build, cached=not hasty, code=times[1], load=times[2], level=0 if hasty else build.final)
        )
        if texts is not None:
            submit(_Later(self, build.names, texts))
        return True

    def _place(
        self, names: Sequence[str], sizes: Sequence[tuple[int, int, int]], codes: Sequence[bytes], provisional: bool
    ) -> None:
        """Load object files, and offer their functions."""
        addresses = self._machine.load(codes[0], [f"mbd.{name}" for name in names], *codes[1:])
        for name, address, size in zip(names, addresses, sizes, strict=True):
            self._functions[name] = MachineFunction(name, address, size, self, provisional)

    def _made(self, text: str, level: int) -> bytes:
        """The object file of a text that was not in the cache a moment ago."""
        return cached_object(_tag(text, level), lambda: emit_object(text, level), self.cache)

    def replace(self, names: Sequence[str], codes: Sequence[bytes]) -> None:
        """Give provisional functions their final code."""
        machine = Machine()
        addresses = machine.load(codes[0], [f"mbd.{name}" for name in names], *codes[1:])
        self._later.append(machine)
        for name, address in zip(names, addresses, strict=True):
            self._functions[name].finalize(address)

    def address(self, name: str) -> int:
        """Where the code of a function begins."""
        return self[name].address


def _tag(text: str, level: int) -> str:
    return f"level {level}\n{text}"


def _texts_key(objects: Sequence[str]) -> str:
    """Of the texts that these object files are made from, for a process that finds some of them only."""
    return key_of("texts", *objects)


class _Later:
    """The final code of some functions of a library, made piece by piece; for nobody if the library is gone.

    packed : texts of the pieces, which are kept until all of these are there
    """

    def __init__(self, library: Library, names: Sequence[str], packed: bytes) -> None:
        self.library, self.names, self.packed = weakref.ref(library), names, packed
        self.codes, self.texts = list[bytes](), list[str]()

    def step(self) -> bool:
        """Make, or fetch, the next piece; exchange the functions when all are there."""
        library = self.library()
        if library is None:
            return False
        self.texts = self.texts or zlib.decompress(self.packed).decode().split("\0")
        if len(self.codes) < len(self.texts):
            self.codes.append(library._made(self.texts[len(self.codes)], library.level))
            return True
        library.replace(self.names, self.codes)
        return False

    def failed(self, error: Exception) -> None:
        """The functions stay what they are, and somebody may want to know."""
        library = self.library()
        if library is not None:
            library.notes.append(f"{', '.join(self.names)} stay at level 0: {error or type(error).__name__}")
            for name in self.names:
                library[name].finalize(None)


def _sizes(outputs: Sequence[Node], layout: Layout) -> tuple[int, int, int]:
    """Numbers that block, parameters (with tables) and out must hold."""
    parameters = layout.n_parameters
    if outputs and layout.table_offsets:
        last = outputs[0].tape.tables[len(layout.table_offsets) - 1]
        parameters = layout.table_offsets[-1] + 5 * len(last.breaks)
    return layout.size, parameters, len(outputs)
