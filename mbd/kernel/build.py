"""The kernel as an object file: compiled once per machine, cached on disk.

The very functions that run interpreted are translated to LLVM IR; from that an object with one C entry
``int64 entry(int64 *table)`` is made. `table` holds the fields of `Kernel` in order, 8 bytes each: integers, reals, and
the addresses of arrays. They do not change while the kernel runs, which the machine code relies on.
"""

from __future__ import annotations

import ast
import ctypes
import hashlib
import sys
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from mbd.kernel.schemes.contract import SCHEMES, dispatch, schemes

__all__ = [
    "MODULES",
    "constants_of",
    "entry",
    "functions_of",
    "kernel_object",
    "kernel_text",
    "modules",
    "object_of",
    "source_digest",
]

ENTRY = "mbd_kernel"

MODULES = (
    "candidate", "linear", "ordered", "orthogonal", "lemke", "redundancy", "saddle", "restart", "pivoting",
    "complementarity", "blow", "impact", "settle", "singular.step_pairs", "singular.gram_norms", "singular.step_size",
    "hermite", "significance", "guards", "pace", "control", "interior", "takeover", "refine", "locate", "switching",
    "nonsmooth", "observe", "starting", "poles", "unresolved", "trying", "crowding", "singular.events", "events",
    "advance",
)  # fmt: skip
"""Those that know no scheme."""

APART = (
    "factor", "solve", "solve_definite", "factor_ordered", "solve_ordered", "factor_pair_ordered", "solve_pair_ordered",
    "leftovers_of_many", "parts_to_take", "locate", "handle_event", "land", "look_closer",
    "find_passed_events", "log_passed_events", "refuses", "scheme_accept",
)  # fmt: skip
"""Their loops keep their shape wherever they are called; where they are not, nobody carries them along.

The last eight are what few steps need: with them inside, the loop over steps would be too large to stay in one piece.
"""

ENTRY_FUNCTION = """
def mbd_kernel(K: Kernel) -> int:
    return advance(K)
"""


def modules() -> tuple[str, ...]:
    """Full names of all modules with functions of the kernel: its own, and those of its schemes."""
    named = (module for path, scheme in zip(SCHEMES, schemes(), strict=True) for module in (path, *scheme.modules))
    return tuple(dict.fromkeys([*(f"mbd.kernel.{module}" for module in MODULES), *named]))


def _source(name: str) -> str:
    inside = name.removeprefix("mbd.kernel.")
    known = Path(__file__).parent.joinpath(*inside.split(".")).with_suffix(".py")
    path = known if inside != name else Path(str(import_module(name).__file__))
    return path.read_text(encoding="utf-8")


def source_digest() -> str:
    """Hash of everything the kernel is made from."""
    digest = hashlib.sha256()
    beside = ("codes", "record", "records", "hooks", "roots", "expressions", "translate", "build", "schemes.contract")
    for name in (*(f"mbd.kernel.{module}" for module in beside), *modules()):
        digest.update(_source(name).encode())
    return digest.hexdigest()


def functions_of(*sources: str) -> dict[str, ast.FunctionDef]:
    """All functions that some modules define, by name."""
    trees = [ast.parse(source) for source in sources]
    return {node.name: node for tree in trees for node in tree.body if isinstance(node, ast.FunctionDef)}


def constants_of(*modules: str) -> dict[str, float]:
    """All numbers in capitals of some modules, by name."""
    found: dict[str, float] = {}
    for module in modules:
        for name, value in vars(import_module(module)).items():
            if name.isupper() and isinstance(value, int | float):
                found[name] = value
    return found


def object_of(text: str, level: int = 2) -> bytes:
    """The object file of an IR text, optimized for this machine; every level from 0 to 3 gives the same bits."""
    from mbd.compile.forking import COMPILING
    from mbd.compile.llvm import host

    with COMPILING:
        return _compiled(text, host(), level)


def _compiled(text: str, here: Any, level: int) -> bytes:
    import llvmlite.binding as llvm

    module = llvm.parse_assembly(text)
    target = llvm.Target.from_triple(here.triple)
    machine = target.create_target_machine(cpu=here.cpu, features=here.features, opt=min(level + 1, 3))
    tuning = llvm.create_pipeline_tuning_options(speed_level=level)
    tuning.loop_vectorization = tuning.loop_unrolling = False  # loops of a few turns
    tuning.slp_vectorization = True
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


def kernel_object() -> bytes:
    """The kernel's object file, with its entry under the name ENTRY."""
    print("mbd: building the stepping kernel, once for this machine …", file=sys.stderr, flush=True)
    return object_of(kernel_text())


def kernel_text() -> str:
    """The kernel in LLVM's words."""
    from mbd.kernel.translate import translate

    functions = functions_of(*map(_source, modules()), dispatch(), ENTRY_FUNCTION)
    return translate(functions, constants_of("mbd.kernel.codes", *modules()), ENTRY, ["kernel"], APART)


@lru_cache(maxsize=1)
def entry() -> Callable[[int], int]:
    """The compiled kernel: ``entry(address of table) → status``."""
    from mbd.compile.llvm import cached_object, load_object

    address = load_object(cached_object(f"kernel {source_digest()}", kernel_object, lasting=True), ENTRY)
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(address)
