"""Programs of equations that were compiled before, found without making them again.

Differentiating equations and writing them for LLVM takes ten times as long as deriving them. What comes of it follows
from the equations and from what is asked of them; so the key of an entry is the equations' `fingerprint`, the question,
and all that machine code depends on. An entry says which object files hold the code, and what else was found on the
way. It is text that is read as data; the object files are checked as any other of the cache. Where either is absent or
damaged, everything is made again.
"""

import json
from collections.abc import Hashable, Mapping
from functools import cached_property
from typing import Any

from mbd.compile.fingerprint import fingerprint
from mbd.equations.equations import Equations

Facts = Mapping[str, Any]
"""What was found besides programs, as JSON has it."""

ENABLED = True
"""Whether anything is looked for or kept."""


class Remembered:
    """What was made of some equations before, for a library of functions.

    It must be asked before anything else is added to the tape: what is there then is what the equations are.
    """

    def __init__(self, equations: Equations, library: Any) -> None:
        keeps = ENABLED and getattr(getattr(library, "cache", None), "directory", None) is not None
        self._library, self._known = library, fingerprint(equations) if keeps else None

    @cached_property
    def _prefix(self) -> str:
        library = self._library
        return f"programs of {self._known} at level {library.level}, hasty {library.hasty}"

    def find(self, question: Hashable) -> Facts | None:
        """Load the functions that answered a question before; what else was found, or None if there is nothing."""
        if self._known is None:
            return None
        from mbd.compile.llvm import Build, tag_key

        data = self._library.cache.load(tag_key(f"{self._prefix}\n{question!r}"))
        try:
            entry = {} if data is None else json.loads(data)
            facts, made = entry["facts"], entry["build"]
            if made is not None:
                names, sizes, objects = made["names"], made["sizes"], made["objects"]
                build = Build(
                    tuple(names), True, 0.0, 0.0, 0.0, made["final"], tuple((a, b, c) for a, b, c in sizes),
                    tuple(objects), made["quick"], made["final"],
                )  # fmt: skip
                if not self._library.fetch(build):
                    return None
        except (ValueError, KeyError, TypeError):
            return None
        return facts if isinstance(facts, dict) else None

    def keep(self, question: Hashable, facts: Facts, built: bool) -> None:
        """Note what answered a question: the functions `built` last, if any, and what else was found."""
        if self._known is None:
            return
        from mbd.compile.llvm import tag_key

        made = None
        if built:
            last = self._library.builds[-1]
            made = {
                "names": last.names, "sizes": last.sizes, "objects": last.objects, "quick": last.quick,
                "final": last.final,
            }  # fmt: skip
        entry = json.dumps({"facts": facts, "build": made}).encode()
        self._library.cache.store(tag_key(f"{self._prefix}\n{question!r}"), entry)
