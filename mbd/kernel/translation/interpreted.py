"""A scheme of the kernel, interpreted: the functions that are translated, called as Python."""

from __future__ import annotations

import traceback
from typing import Any

from mbd.errors import CapabilityError
from mbd.kernel.records import Kernel
from mbd.kernel.schemes.contract import Scheme
from mbd.kernel.stepping.restart import take_consistent
from mbd.kernel.translation.hints import shown


class InterpretedScheme:
    """Hooks of the interpreted kernel: the functions of a scheme, step by step what machine code does."""

    memory = None  # all of it stands in the record

    def __init__(self, scheme: Scheme) -> None:
        self.scheme = scheme
        self.start, self.step, self.accept = (self._within(hook) for hook in (scheme.start, scheme.step, scheme.accept))
        self.resume = self._within(scheme.resume or self._start_there)
        self.error = self._within(scheme.error or self._has_left_its_error)

    def _start_there(self, K: Kernel, h: float) -> int:
        take_consistent(K)
        return self.scheme.start(K)

    def _has_left_its_error(self, K: Kernel, h: float) -> None:
        pass

    def _within(self, hook: Any) -> Any:
        """The hook, in which an index beyond an array or a wrong field is an error by file, line and function."""

        def called(K: Kernel, *more: float) -> Any:
            try:
                return hook(K, *more)
            except (IndexError, AttributeError) as error:
                last = traceback.extract_tb(error.__traceback__)
                place = [each for each in last if each.name not in ("__getattr__", "__setattr__")][-1]
                given = ", ".join(f"{name}: {length}" for name, length in self.scheme.memory(K).items()) or "none"
                memory = f"; the memory of the scheme {self.scheme.name!r} is {given}"
                raise CapabilityError(
                    f"{shown(place.filename)}:{place.lineno}, in {place.name}: {place.line!r}: {error}"
                    + memory * isinstance(error, IndexError)
                ) from error

        return called
