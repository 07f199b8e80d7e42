"""Derived and compiled mechanisms, kept as long as the model that they were made from is unchanged."""

from __future__ import annotations

import threading
from typing import Any
from weakref import WeakKeyDictionary

from mbd.compile.mechanism import Mechanism
from mbd.equations.derivation import derive

__all__ = ["mechanism_of"]

_KNOWN: WeakKeyDictionary[Any, dict[str, tuple[Any, Mechanism]]] = WeakKeyDictionary()
_LOCK = threading.Lock()


def _description(model: Any) -> Any:
    """What the equations depend on, by identity of the words."""
    words = [getattr(model, kind, ()) for kind in ("joints", "forces", "constraints", "controllers")]
    return tuple(tuple(group) for group in words), *(getattr(model, key, None) for key in ("gravity", "cut", "tunable"))


def _same(old: Any, new: Any) -> bool:
    groups = zip(old[0], new[0], strict=True)
    alike = all(len(a) == len(b) and all(x is y for x, y in zip(a, b, strict=True)) for a, b in groups)
    return alike and old[1:] == new[1:]


def mechanism_of(model: Any, backend: str = "auto") -> Mechanism:
    """The mechanism of a model; derived again only if the model has changed since.

    Parameters
    ----------
    backend : 'auto', 'llvm' (machine code) or 'python' (the plain twin)
    """
    now = _description(model)
    with _LOCK:
        known = _KNOWN.setdefault(model, {}).get(backend)
    if known is not None and _same(known[0], now):
        return known[1]
    made = Mechanism(derive(model), backend)
    with _LOCK:
        _KNOWN[model][backend] = (now, made)
    return made
