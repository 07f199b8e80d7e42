"""Calling what users wrote."""

from collections.abc import Callable
from typing import Any

from mbd.errors import SimulationError


def call_user(what: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a user's function answers; whatever it raises ends the run, which is kept."""
    try:
        return function(*arguments)
    except Exception as exc:  # the user's code may raise anything; all of it ends the run in one way
        raise SimulationError(f"{what} raised {type(exc).__name__}: {exc}") from exc
