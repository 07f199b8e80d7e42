"""Functions of later stages that objects in users' hands offer as methods: ``run.plot()``, ``gait.page()``.

A result is data; what draws, writes or judges it is a function of a stage above that takes it. The package's face
registers these functions by name, and a method looks its function up here when it is called, so that no module imports
one above it.
"""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

_PLACES: dict[str, str] = {}


def register(places: Mapping[str, str]) -> None:
    """Say where functions are, as ``{"Trajectory.plot": "mbd.view.plots.histories"}``."""
    _PLACES.update(places)


def later(name: str) -> Callable[..., Any]:
    """The function that is registered under a name; its module is imported now.

    >>> import mbd
    >>> later("Trajectory.summary").__module__
    'mbd.analysis.ending'
    """
    module, _, function = _PLACES[name].rpartition(".")
    return getattr(import_module(module), function)  # type: ignore[no-any-return]
