"""The kernel with derivatives as an object file, compiled once for a machine when it is first asked for."""

import ctypes
import hashlib
import inspect
import sys
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from mbd.compile.llvm import LEVEL
from mbd.free_memory import no_collection
from mbd.kernel import build
from mbd.kernel.schemes import contract
from mbd.kernel.translation.translate import Source, functions_of, translate
from mbd.sensitivity.tangent import (
    follow_accelerations,
    follow_candidates,
    follow_coupled_stages,
    follow_impacts,
    follow_newmark,
    follow_stages,
    printer,
    words,
)
from mbd.sensitivity.tangent.interpreted import Table, interpreted
from mbd.sensitivity.tangent.printer import tangent_text
from mbd.trees.tree import Function

PARTS = (
    words,
    follow_candidates,
    follow_newmark,
    follow_accelerations,
    follow_stages,
    follow_coupled_stages,
    follow_impacts,
)
FILES = tuple(Path(str(part.__file__)) for part in PARTS)
"""Where they stand."""

ENTRY = "mbd_tangent_kernel"
HELD = (
    "stepping.step_retry.tried_step", "stepping.judge_step.tried_part", "stepping.judge_step.find_event",
    "stepping.judge_step.begin_substeps", "stepping.judge_step.passes_events",
    "stepping.judge_step.has_spurious_reaction",    "stepping.starting.still_dependent", "contact.cone_steps.slides_on",
    "contact.cone_steps.slides_at_first", "events.locate.jumps_over_stop", "singular.events.refuses",
    "events.locate.find_jump", "hooks.scheme_error", "stepping.restart.refresh_scales", "stepping.restart.weigh",
    "schemes.iteration.residual_size", "schemes.iteration.is_below_floors", "events.guards.is_quiet",
    "schemes.explicit_error.explicit_error", "schemes.radau_end.estimate_error", "singular.step_size.note_row_norms",
    "stepping.conditioning.known_error", "stepping.contact_step.find_pace", "stepping.control.first_step",
    "events.guard_round_off.guard_round_off", "singular.newmark_step.steps_to_singularity",
    "schemes.iteration.overturns", "schemes.iteration.is_small", "rules.keep_candidate",
    "rules.restore_candidate", "rules.take_again", "rules.keep_stages", "rules.restore_stages", "rules.prepare_metric",
    "rules.prepare_rates", "schemes.explicit_rates.explicit_rates",
    "schemes.explicit_rates.rates_at_end", "schemes.runge_kutta.find_sizes", "schemes.runge_kutta.note_uneven",
    "schemes.runge_kutta.note_velocities",
    "schemes.radau_end.end_rates", "stepping.mass_ratios.polish_with_rows", "stepping.restart.holds_rows",
    "rules.prepare_newton", "rules.prepare_stages", "rules.prepare_coupled",
    "rules.prepare_coupled_stages", "stepping.observe.store_passed_row",
    "rules.follow_factors", "rules.factors_at", "rules.solve_by_value", "algebra.saddle.solve_values",
)  # fmt: skip
"""Functions without derivatives: steps are tried and judged, and instants found, by values alone.

What is accepted is taken once more, with derivatives (`rules.follow_candidate`)."""


def entry() -> Callable[[int, int], int]:
    """The compiled kernel with derivatives: ``entry(address of table, address of that of derivatives) → status``."""
    return _loaded(contract.SCHEMES)


@lru_cache(maxsize=4)
def _loaded(schemes: tuple[str, ...]) -> Callable[[int, int], int]:
    from mbd.compile.cache import default_cache
    from mbd.compile.llvm import Machine, cached_object, tag_key
    from mbd.kernel.first_build import is_allowed, start_build

    first = schemes == build.LISTED and is_allowed()
    if first and default_cache().load(tag_key(_tag(LEVEL)), lasting=True) is None:
        code = cached_object(_tag(0), lambda: _said("; a faster one follows in the background", 0))
        start_build(_loaded.cache_clear, __name__, "keep_optimized")
    else:
        code = cached_object(_tag(LEVEL), lambda: _said("", LEVEL), lasting=True)
    _machines.append(Machine())
    address = _machines[-1].load(code, [ENTRY])[0]
    return ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)(address)


_machines: list[Any] = []
"""What holds these kernels."""


def _tag(level: int) -> str:
    """What the kernel of a level of optimization is called in the cache; all levels give the same bits."""
    digest = hashlib.sha256(build.source_digest().encode())
    for file in (Path(__file__), Path(printer.__file__), *FILES):
        digest.update(file.read_bytes())
    return f"tangent kernel {level} {digest.hexdigest()}"


def _said(then: str, level: int) -> bytes:
    print(f"mbd: building the kernel of derivatives, once for this machine{then} …", file=sys.stderr, flush=True)
    return build.object_of(text(), level=level)


def keep_optimized() -> None:
    """The optimized kernel for the cache, in a process of its own (see `mbd.kernel.first_build`)."""
    from mbd.kernel.first_build import keep

    keep(lambda: _tag(LEVEL), lambda: build.object_of(text(), level=LEVEL))


def text() -> str:
    """The kernel with derivatives in LLVM's words."""
    with no_collection():
        return tangent_text(_trees(), ENTRY, HELD)


def plain_entry() -> Callable[[Table], int]:
    """The kernel with derivatives in Python, where there is no machine code."""
    return _read(contract.SCHEMES)


@lru_cache(maxsize=4)
def _read(schemes: tuple[str, ...]) -> Callable[[Table], int]:
    return interpreted(_trees(), HELD)


def _trees() -> list[Function]:
    """The kernel's functions, with the rules of this folder."""
    from mbd.kernel.stepping.advance import advance

    dispatched, names = contract.dispatch()
    own = Source("hooks", functions_of(dispatched), {**names, "advance": advance})
    instead = {"mbd.kernel.hooks": own, **own_rules()}
    return translate(own, "advance", ["kernel"], build.APART, instead)


# Rules of the tangent pass that are more than arithmetic, in place of `mbd.kernel.tangent_rules`.
#
# Steps are tried, judged and located by values alone. The candidate that is accepted, or that an event takes over, is
# taken once more for its derivatives, at values that are known: explicit formulas operation by operation, implicit ones
# by the implicit function theorem, ``J δz = −δr`` at the solution z of ``r(z) = 0`` with one factorization of J
# (Griewank & Walther 2008, Evaluating Derivatives, ch. 15). Values stay those of the run to the bit.


def own_rules() -> Mapping[str, Source]:
    """The rules as one source, whose functions are ``rules.…``, by the names of the modules that it stands for."""
    functions, names = dict[str, Any](), dict[str, Any]()
    for part in PARTS:
        functions |= functions_of(inspect.getsource(part))
        names |= vars(part)
    found = Source("rules", functions, names)
    return dict.fromkeys(["mbd.kernel.tangent_rules", *(part.__name__ for part in PARTS)], found)
