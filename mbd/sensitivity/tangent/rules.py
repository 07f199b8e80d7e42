"""Rules of the tangent pass that are more than arithmetic, in place of `mbd.kernel.tangent_rules`.

Steps are tried, judged and located by values alone. The candidate that is accepted, or that an event takes over, is
taken once more for its derivatives, at values that are known: explicit formulas operation by operation, implicit ones
by the implicit function theorem, ``J δz = −δr`` at the solution z of ``r(z) = 0`` with one factorization of J (Griewank
& Walther 2008, Evaluating Derivatives, ch. 15). Values stay those of the run to the bit.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mbd.kernel.translation.translate import Source, functions_of
from mbd.sensitivity.tangent import (
    follow_accelerations,
    follow_candidates,
    follow_impacts,
    follow_newmark,
    follow_stages,
    words,
)

__all__ = ["FILES", "own_rules"]

PARTS = (words, follow_candidates, follow_newmark, follow_accelerations, follow_stages, follow_impacts)
FILES = tuple(Path(str(part.__file__)) for part in PARTS)
"""Where they stand."""


def own_rules() -> Mapping[str, Source]:
    """The rules as one source, whose functions are ``rules.…``, by the names of the modules that it stands for."""
    functions, names = dict[str, Any](), dict[str, Any]()
    for part in PARTS:
        functions |= functions_of(inspect.getsource(part))
        names |= vars(part)
    found = Source("rules", functions, names)
    return dict.fromkeys(["mbd.kernel.tangent_rules", *(part.__name__ for part in PARTS)], found)
