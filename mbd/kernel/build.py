"""The kernel as an object file: compiled once per machine, cached on disk, loaded without numba.

numba turns the very functions that run interpreted into LLVM IR; from that an object with one C entry
``int entry(int64 *result, void **unused, int64 *table)`` is made. `table` holds the fields of `Kernel` in order,
8 bytes each: integers, reals, and the addresses of arrays. They do not change while the kernel runs, which the
machine code relies on.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import subprocess
import sys
import tempfile
import types
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from mbd.errors import CapabilityError
from mbd.kernel.fields import INTEGERS, REAL_ARRAYS, REALS, Kernel

__all__ = ["MODULES", "entry", "ir_of_kernel", "object_code", "source_digest"]

ENTRY = "mbd_kernel"

MODULES = (
    "linear", "lemke", "redundancy", "restart", "pivoting", "complementarity", "blow", "impact", "settle", "iteration",
    "passage", "newmark", "hermite", "guards", "locate", "switching", "nonsmooth", "takeover", "advance",
)  # fmt: skip


def source_digest() -> str:
    """Hash of everything the kernel is made from."""
    digest = hashlib.sha256()
    for name in ("fields", "hooks", "build", *MODULES):
        digest.update(Path(__file__).with_name(f"{name}.py").read_bytes())
    return digest.hexdigest()


SHIMS = """
def call(K, number, out):
    call_address(K.code[number], K.block, K.params, out)

def scheme_step(K, h, t1):
    return newmark_step(K, h, t1)

def scheme_accept(K, h):
    newmark_accept(K, h)

def scheme_start(K):
    return newmark_start(K)

def entry(table):
    return advance(as_kernel(table))
"""


def _numba_types() -> dict[str, Any]:
    """The `Kernel` as numba sees it: a pointer to the table, whose fields are invariant loads."""
    ir: Any = import_module("llvmlite.ir")
    nb: Any = import_module("numba.core.types")
    models: Any = import_module("numba.core.datamodel.models")
    templates: Any = import_module("numba.core.typing.templates")
    extending: Any = import_module("numba.extending")

    reals, integers = nb.CPointer(nb.float64), nb.CPointer(nb.int64)

    class KernelType(nb.Type):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(name="Kernel")

    @extending.register_model(KernelType)
    class KernelModel(models.PrimitiveModel):  # type: ignore[misc]
        def __init__(self, manager: Any, kind: Any) -> None:
            super().__init__(manager, kind, ir.IntType(64).as_pointer())

    def kind_of(name: str) -> Any:
        if name in REAL_ARRAYS:
            return reals
        if name in REALS:
            return nb.float64
        return nb.int64 if name in INTEGERS else integers

    @extending.infer_getattr
    class KernelFields(templates.AttributeTemplate):  # type: ignore[misc]
        key = KernelType

        def generic_resolve(self, kind: Any, name: str) -> Any:
            return kind_of(name)

    @extending.lower_getattr_generic(KernelType)  # type: ignore[untyped-decorator]
    def field(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
        place = builder.gep(value, [ir.Constant(ir.IntType(64), Kernel._fields.index(name))])
        if name in REALS:
            place = builder.bitcast(place, ir.DoubleType().as_pointer())
        loaded = builder.load(place)
        loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
        if name in REALS or name in INTEGERS:
            return loaded
        return builder.inttoptr(loaded, context.get_value_type(kind_of(name)))

    @extending.intrinsic  # type: ignore[untyped-decorator]
    def as_kernel(context: Any, table: Any) -> Any:
        def lower(ctx: Any, builder: Any, signature: Any, args: Any) -> Any:
            return args[0]

        return KernelType()(table), lower

    @extending.intrinsic  # type: ignore[untyped-decorator]
    def call_address(context: Any, address: Any, block: Any, params: Any, out: Any) -> Any:
        def lower(ctx: Any, builder: Any, signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(ir.VoidType(), [value.type for value in args[1:]])
            builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
            return ctx.get_dummy_value()

        return nb.void(nb.int64, block, params, out), lower

    return {"as_kernel": as_kernel, "call_address": call_address, "signature": (integers,)}


def ir_of_kernel() -> tuple[str, str]:
    """LLVM IR of the whole kernel and the name of its entry function (imports numba; takes a while)."""
    numba: Any = import_module("numba")
    namespace: dict[str, Any] = {"__builtins__": __builtins__, **_numba_types()}
    exec(compile(SHIMS, "<kernel>", "exec"), namespace)
    shims = ("call", "scheme_step", "scheme_accept", "scheme_start", "entry")
    functions: dict[str, Any] = {name: namespace[name] for name in shims}
    for module in ("fields", *MODULES):
        source = import_module(f"mbd.kernel.{module}")
        for name, value in vars(source).items():
            if isinstance(value, types.FunctionType) and value.__module__ == source.__name__:
                functions[name] = types.FunctionType(value.__code__, namespace, name, value.__defaults__)
            elif name.isupper() and isinstance(value, int | float):
                namespace[name] = value
    options = {"error_model": "numpy", "boundscheck": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    for name, function in functions.items():
        namespace[name] = numba.njit(**options)(function)
    namespace["entry"].compile(namespace["signature"])
    result = namespace["entry"].overloads[namespace["signature"]]
    return result.library.get_llvm_str(), result.fndesc.llvm_func_name


def object_code(path: str) -> None:
    """Write the kernel's object file, with its entry under the name ENTRY (run in a process of its own)."""
    import llvmlite.binding as llvm

    from mbd.compile.llvm import host

    llvm.set_option("", "-align-all-functions=6")  # a hot loop across two cache lines costs a tenth of a step
    text, mangled = ir_of_kernel()
    module = llvm.parse_assembly(text.replace(mangled, ENTRY))
    for function in module.functions:
        if not function.is_declaration and function.name != ENTRY:
            function.linkage = "internal"
            if re.search(r"e(6factor|5solve)B", function.name):  # their loops keep their shape wherever they are called
                function.add_function_attribute("noinline")
    here = host()
    target = llvm.Target.from_triple(here.triple)
    machine = target.create_target_machine(cpu=here.cpu, features=here.features, opt=3)
    tuning = llvm.create_pipeline_tuning_options(speed_level=2)
    tuning.loop_vectorization = tuning.loop_unrolling = False  # loops of a few turns
    tuning.slp_vectorization = True
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    Path(path).write_bytes(machine.emit_object(module))


def _made() -> bytes:
    """The object file, made by a fresh interpreter so that numba never enters this one."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "kernel.o")
        environment = {**os.environ, "NUMBA_OPT": "0", "NUMBA_LOOP_VECTORIZE": "0", "NUMBA_SLP_VECTORIZE": "0"}
        environment["PYTHONPATH"] = os.pathsep.join(entry for entry in sys.path if entry)
        print("mbd: building the stepping kernel, once for this machine …", file=sys.stderr, flush=True)
        command = [sys.executable, "-c", f"from mbd.kernel.build import object_code; object_code({path!r})"]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            raise CapabilityError(
                f"the stepping kernel could not be built ({last}); it needs numba: pip install numba, "
                "or use simulate(..., backend='python')"
            )
        return Path(path).read_bytes()


@lru_cache(maxsize=1)
def entry() -> Callable[[int], int]:
    """The compiled kernel: ``entry(address of table) → status``."""
    from mbd.compile.llvm import cached_object, load_object

    address = load_object(cached_object(f"kernel {source_digest()}", _made), ENTRY)
    kind = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    function = kind(address)

    def run(table: int) -> int:
        result = ctypes.c_int64()
        unused = ctypes.c_void_p()
        function(ctypes.addressof(result), ctypes.addressof(unused), table)
        return result.value

    return run
