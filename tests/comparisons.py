"""Tests over random examples that count what they compared: an example that ends before it has shown nothing."""

from collections.abc import Callable
from functools import wraps
from typing import Any

_counts: list[int] = []


def compared() -> None:
    """Count an example: what it was made for is compared now."""
    _counts[-1] += 1


def at_least(count: int) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Above `given` or a loop over seeds: fail unless so many examples came to `compared()`."""

    def counting(test: Callable[..., None]) -> Callable[..., None]:
        @wraps(test)
        def run(*given: Any, **named: Any) -> None:
            _counts.append(0)
            try:
                test(*given, **named)
                found = _counts[-1]
            finally:
                _counts.pop()
            assert found >= count, f"{found} examples were compared, expected at least {count}: the others ended early"

        return run

    return counting
