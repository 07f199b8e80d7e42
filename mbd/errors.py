"""Errors: what was expected, what came, where in the user's words, and what to try."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import Any

__all__ = [
    "AssemblyError",
    "CapabilityError",
    "GaitError",
    "MbdError",
    "MbdWarning",
    "MemoryLimitError",
    "ModelError",
    "SimulationError",
    "TraceError",
    "TrajectoryError",
    "UnknownNameError",
    "nearest",
]


class MbdError(Exception):
    """Base of every error that `mbd` raises on purpose."""


class MbdWarning(UserWarning):
    """What is possible but was hardly meant, or costs more than expected; `warnings.filterwarnings` silences it."""


class TraceError(MbdError, TypeError):
    """A traced function did something that cannot be recorded (a Python ``if`` on a traced value, …)."""


class ModelError(MbdError, ValueError):
    """A model that cannot be simulated; `faults` lists every problem found, one sentence each."""

    def __init__(self, faults: str | Sequence[str]) -> None:
        self.faults: tuple[str, ...] = (faults,) if isinstance(faults, str) else tuple(faults)
        count = len(self.faults)
        every = "\n".join(f"  - {fault}" for fault in self.faults)
        super().__init__(self.faults[0] if count == 1 else f"{count} faults:\n{every}")

    def __reduce__(self) -> tuple[type[ModelError], tuple[tuple[str, ...]]]:
        return type(self), (self.faults,)


class UnknownNameError(ModelError):
    """A name that the model does not have; the message offers the nearest valid ones."""


class AssemblyError(ModelError):
    """Initial values that no motion of the mechanism satisfies."""


class CapabilityError(ModelError):
    """A combination of integrator, formulation and constraint that cannot be honoured.

    Attributes
    ----------
    run : the run whose derivatives, asked for by wrt=, are not known; else None
    """

    run: Any = None


class SimulationError(MbdError, RuntimeError):
    """A run that could not go on; `run` keeps everything computed until then."""

    def __init__(self, message: str, run: Any = None) -> None:
        super().__init__(message)
        self.run = run


class MemoryLimitError(SimulationError):
    """A run whose rows would not fit into memory; `run` has those computed until then."""


class GaitError(MbdError, RuntimeError):
    """A walk that does not repeat itself: it falls, scuffs, misses its event, or no search converged.

    `gait` keeps what was computed: the last state, the outcome of every attempt, a run that shows it.
    """

    def __init__(self, message: str, gait: Any = None) -> None:
        super().__init__(message)
        self.gait = gait


class TrajectoryError(MbdError, ValueError):
    """A question that a run cannot answer: a time outside it, a file that is none."""


def nearest(name: str, valid: Iterable[str], kind: str = "name", known: str = "The model has") -> str:
    """The sentence that offers valid names for a wrong one; `known` introduces the list of them.

    >>> nearest("left hop", ["left hip", "left knee"], "joint")
    "no joint named 'left hop'; did you mean 'left hip'? The model has 'left hip', 'left knee'"
    """
    names, text = sorted(set(valid)), str(name)
    parts = [each for each in names if each.startswith(f"{text}.")]
    if parts:
        return f"no {kind} named {name!r}; it has {_listed(parts)}"
    close = [each for each in names if each.casefold() == text.casefold()]
    close = close or difflib.get_close_matches(text, names, n=1, cutoff=0.6)
    owner = f"{text.rpartition('.')[0]}."
    names = [each for each in names if each.startswith(owner)] or names
    guess = f"; did you mean {close[0]!r}?" if close else ";"
    known = known if close else known[0].lower() + known[1:]
    has = f" {known} {_listed(names)}" if names else f" {known} none"
    return f"no {kind} named {name!r}{guess}{has}"


def _listed(names: Sequence[str]) -> str:
    """The first names of a list, and how many there are."""
    return ", ".join(repr(each) for each in names[:12]) + (f", … ({len(names)} in all)" if len(names) > 12 else "")
