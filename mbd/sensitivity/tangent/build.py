"""The kernel with derivatives as an object file, compiled once for a machine when it is first asked for."""

from __future__ import annotations

import ctypes
import hashlib
import inspect
import sys
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from mbd.compile.llvm import LEVEL
from mbd.kernel import build
from mbd.kernel.schemes import contract
from mbd.kernel.translation.translate import Source, functions_of, translate
from mbd.sensitivity.tangent import rules
from mbd.sensitivity.tangent.printer import tangent_text

__all__ = ["entry", "own_rules"]

ENTRY = "mbd_tangent_kernel"
HELD = (
    "events.locate.locate", "events.locate.find_jump", "hooks.scheme_error", "stepping.restart.refresh_scales",
    "stepping.restart.weigh", "schemes.iteration.residual_size", "schemes.iteration.is_below_floors",
    "events.guards.judge", "events.guards.is_quiet", "events.guard_substeps.parts_to_take",
    "stepping.resolution.judge_change",
)  # fmt: skip
"""Functions without derivatives: instants are found by values, sizes of forces and of errors judge only."""


def entry() -> Callable[[int, int], int]:
    """The compiled kernel with derivatives: ``entry(address of table, address of that of derivatives) → status``."""
    return _loaded(contract.SCHEMES)


@lru_cache(maxsize=4)
def _loaded(schemes: tuple[str, ...]) -> Callable[[int, int], int]:
    from mbd.compile.llvm import Machine, cached_object

    digest = hashlib.sha256(build.source_digest().encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    code = cached_object(f"tangent kernel {LEVEL} {digest.hexdigest()}", _object, lasting=True)
    _machines.append(Machine())
    address = _machines[-1].load(code, [ENTRY])[0]
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)(address)


_machines: list[Any] = []
"""What holds these kernels."""


def _object() -> bytes:
    print("mbd: building the kernel of derivatives, once for this machine …", file=sys.stderr, flush=True)
    return build.object_of(text(), level=LEVEL)


def own_rules() -> Source:
    """`rules`, which take the place of `mbd.kernel.tangent_rules`."""
    return Source("rules", functions_of(inspect.getsource(rules)), vars(rules))


def text() -> str:
    """The kernel with derivatives in LLVM's words."""
    from mbd.kernel.stepping.advance import advance

    dispatched, names = contract.dispatch()
    own = Source("hooks", functions_of(dispatched), {**names, "advance": advance})
    instead = {"mbd.kernel.hooks": own, "mbd.kernel.tangent_rules": own_rules()}
    found = translate(own, "advance", ["kernel"], build.APART, instead)
    return tangent_text(found, ENTRY, HELD)
