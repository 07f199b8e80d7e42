"""Whether schemes give a length to all the memory that their functions use."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

from mbd.errors import CapabilityError
from mbd.kernel.records import TABLE, Kernel
from mbd.kernel.schemes import contract
from mbd.trees.tree import Call, Field, Function

__all__ = ["check_memory"]


def check_memory(found: Sequence[Function]) -> None:
    """Refuse a scheme whose functions use an array of `MEMORY` for which its entry gives no length."""
    sizes = Kernel(**dict.fromkeys(TABLE.integers, 2))
    for scheme in contract.schemes():
        own = scheme.memory(sizes)
        for hook in (getattr(scheme, name) for name in contract.HOOKS):
            start = f"{hook.__module__.removeprefix('mbd.kernel.')}.{hook.__name__}." if hook else "no hook"
            for function in found:
                if function.symbol.startswith(start):
                    used = [name for name in _fields(function, set()) if name in contract.MEMORY and name not in own]
                    if used:
                        raise CapabilityError(
                            f"the scheme {scheme.name!r}: its {hook.__name__} uses K.{used[0]}, to which its memory "
                            f"gives no length; try memory=lambda K: {{{used[0]!r}: …}} in the entry"
                        )


def _fields(part: Any, seen: set[str]) -> Iterator[str]:
    """Names of the fields that a function and all that it calls use."""
    if isinstance(part, Field):
        yield part.name
    elif isinstance(part, Call):
        yield from _fields(part.function, seen)
        yield from _fields(part.arguments, seen)
        return
    if isinstance(part, Function):
        if part.symbol not in seen:
            seen.add(part.symbol)
            yield from _fields(part.body, seen)
    elif isinstance(part, list | tuple):
        for each in part:
            yield from _fields(each, seen)
    elif is_dataclass(part):
        for each in fields(part):
            yield from _fields(getattr(part, each.name), seen)
