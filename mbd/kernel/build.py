"""The kernel as an object file: compiled once per machine, cached on disk.

The very functions that run interpreted are translated to LLVM IR; from that an object with one C entry
``int64 entry(int64 *table)`` is made. `table` holds the fields of `Kernel` in order, 8 bytes each: integers, reals, and
the addresses of arrays. They do not change while the kernel runs, which the machine code relies on.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING

from mbd import equal
from mbd.compile.fingerprint import sources_of
from mbd.free_memory import no_collection
from mbd.kernel.schemes import contract

if TYPE_CHECKING:  # the trees of the kernel's functions are made only where it is built
    from mbd.compile.host import Host
    from mbd.trees.tree import Function

ENTRY = "mbd_kernel"

APART = (
    "algebra.linear.factor", "algebra.linear.solve", "algebra.linear.solve_definite",
    "algebra.ordered.factor_ordered", "algebra.ordered.solve_ordered",
    "algebra.ordered_complex.factor_pair_ordered", "algebra.ordered_complex.solve_pair_ordered",
    "singular.gram_norms.gram_norms", "events.guard_substeps.parts_to_take", "events.locate.locate",
    "events.handling.handle_event", "events.handling.land", "stepping.resolution.look_closer",
    "singular.events.find_passed_events", "singular.events.log_passed_events", "singular.events.refuses",
    "hooks.scheme_accept", "stepping.trial_step.brief_step", "stepping.trial_step.share_multipliers",
    "singular.newmark_step.singular_newmark_step", "schemes.newton.second_look", "schemes.newton.retreat",
    "schemes.radau.radau_step", "schemes.runge_kutta.runge_kutta_step", "stepping.restart.lower_to_step",
    "contact.cone_steps.come_to_zero", "stepping.advance.advance", "stepping.begin_run.begin_run",
    "stepping.begin_run.judge_start", "stepping.steps_again.steps_again", "schemes.determinant.note_determinant",
)  # fmt: skip
"""Their loops keep their shape wherever they are called; where they are not, nobody carries them along.

All from `parts_to_take` on are what few steps need: with them inside, the loop over steps would be too large to stay
in one piece.
"""

LISTED = contract.SCHEMES
"""The schemes of the package; a kernel with others is built at once, since no other process knows of them."""

ENTRY_FUNCTION = """
def mbd_kernel(K: Kernel) -> int:
    if K.many == 2:
        return judge_start(K)
    if K.many == STEPS_AGAIN:
        return steps_again(K)
    return march_many(K) if K.many == 1 else advance(K)
"""


def source_digest() -> str:
    """Hash of what it is made from: this folder, `mbd.equal`, printers, schemes from elsewhere and what they import."""
    folder, digest = Path(__file__).parent, hashlib.sha256(repr(contract.SCHEMES).encode())  # the order is the number
    own, trees = sources_of(folder.as_posix()), sources_of((folder.parent / "trees").as_posix())
    for path in [*own, str(equal.__file__), *sorted({*trees, *_beside(contract.SCHEMES)})]:
        name = path[len(folder.as_posix()) :] if path in own else path.rpartition("/")[2]
        with open(path, "rb") as file:
            digest.update(f"{name}\n".encode() + file.read())
    return digest.hexdigest()


def _beside(modules: Sequence[str]) -> set[str]:
    """Files of modules outside of this folder, and of those whose functions they use."""
    found: dict[str, str] = {}
    waiting = list(modules)
    while waiting:
        module = waiting.pop()
        if module not in found and not module.startswith("mbd.kernel."):
            found[module] = Path(str(import_module(module).__file__)).as_posix()
            waiting += [
                each.__module__ for each in vars(import_module(module)).values() if isinstance(each, FunctionType)
            ]
    return set(found.values())


def object_of(text: str, level: int = 2) -> bytes:
    """The object file of an IR text, optimized for this machine; every level from 0 to 3 gives the same bits."""
    from mbd.compile.forking import COMPILING
    from mbd.compile.host import host

    with COMPILING:
        return compiled(text, host(), level)


def compiled(text: str, here: Host, level: int) -> bytes:
    """The object file of an IR text for the processor that `here` says, for callers that hold `COMPILING`.

    Level 0 selects instructions one by one, which takes a seventh of the time of level 1; the others take one more of
    LLVM's levels for code than for passes.
    """
    import llvmlite.binding as llvm

    module = llvm.parse_assembly(text)
    target = llvm.Target.from_triple(here.triple)
    machine = target.create_target_machine(cpu=here.cpu, features=here.features, opt=min(level + 1, 3) if level else 0)
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


def tag() -> str:
    """What the optimized kernel is called in the cache."""
    return f"kernel {source_digest()}"


def kernel_text() -> str:
    """The kernel in LLVM's words."""
    from mbd.kernel.translation.llvm import llvm_text

    with no_collection():
        return llvm_text(kernel_functions(), ENTRY)


def kernel_c_source() -> str:
    """The kernel as a C99 file with the function ``int64_t mbd_kernel(int64_t *table)`` (see `mbd.trees.c`)."""
    from mbd.kernel.translation.llvm import PLACES
    from mbd.trees.c import HEAD, c_text

    return f"{HEAD}\n{c_text(kernel_functions(), ENTRY, PLACES)}"


def kernel_functions() -> list[Function]:
    """The kernel as typed trees."""
    from mbd.kernel.schemes.determinant import STEPS_AGAIN
    from mbd.kernel.stepping.advance import advance
    from mbd.kernel.stepping.begin_run import judge_start
    from mbd.kernel.stepping.many_runs import march_many
    from mbd.kernel.stepping.steps_again import steps_again
    from mbd.kernel.translation.memory_check import check_memory
    from mbd.kernel.translation.translate import Source, functions_of, translate

    text, names = contract.dispatch()
    names = {**names, "advance": advance, "march_many": march_many, "judge_start": judge_start}
    names |= {"steps_again": steps_again, "STEPS_AGAIN": STEPS_AGAIN}
    hooks = Source("hooks", functions_of(text, ENTRY_FUNCTION), names)
    found = translate(hooks, ENTRY, ["kernel"], APART, {"mbd.kernel.hooks": hooks})
    check_memory(found)
    return found
