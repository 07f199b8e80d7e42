"""Whether schemes give a length to all the memory that their functions use."""

from collections.abc import Sequence
from dataclasses import is_dataclass
from typing import Any

from mbd.errors import CapabilityError
from mbd.kernel.records import TABLE, Kernel
from mbd.kernel.schemes import contract
from mbd.trees.tree import Call, Field, Function


def check_memory(found: Sequence[Function]) -> None:
    """Refuse a scheme whose functions use an array of `MEMORY` for which its entry gives no length."""
    sizes, known = Kernel(**dict.fromkeys(TABLE.integers, 2)), dict[str, set[str]]()
    for scheme in contract.schemes():
        own = scheme.memory(sizes)
        for hook in (getattr(scheme, name) for name in contract.HOOKS):
            start = f"{hook.__module__.removeprefix('mbd.kernel.')}.{hook.__name__}." if hook else "no hook"
            for function in found:
                if function.symbol.startswith(start):
                    used = sorted((_fields(function, known) & set(contract.MEMORY)) - set(own))
                    if used:
                        raise CapabilityError(
                            f"the scheme {scheme.name!r}: its {hook.__name__} uses K.{used[0]}, to which its memory "
                            f"gives no length; try memory=lambda K: {{{used[0]!r}: …}} in the entry"
                        )


def _fields(function: Function, known: dict[str, set[str]]) -> set[str]:
    """Names of the fields that a function and all that it calls use, each looked through once."""
    if function.symbol not in known:
        found: set[str] = set()
        waiting: list[Any] = [function.body]
        while waiting:
            part = waiting.pop()
            if isinstance(part, Call):
                found |= _fields(part.function, known)
                waiting += part.arguments
            elif isinstance(part, list | tuple):
                waiting += part
            elif is_dataclass(part):
                found |= {part.name} if isinstance(part, Field) else set()
                waiting += vars(part).values()
        known[function.symbol] = found
    return known[function.symbol]
