"""Results that a study is asked to look at, by name."""

from typing import Any

from mbd.bodies.values import names_given
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.results.trajectory import Trajectory


def names_wanted(wanted: Any, what: str) -> tuple[tuple[str, ...], list[str]]:
    """Names given as the argument `what`, and its faults."""
    names, faults = names_given(wanted, what, "results, such as ['left hip.angle']")
    return names, faults or ([] if names else [f"{what} is empty; give names such as those in run.names"])


def scalars_wanted(run: Trajectory, wanted: Any, what: str, kind: str) -> tuple[str, ...]:
    """Scalars behind them; every wrong name of this kind with the nearest."""
    names, faults = names_wanted(wanted, what)
    if faults:
        raise ModelError(faults)
    wrong = [name for name in names if name not in run]
    if wrong:
        known = (*run.names, *run.columns.vectors)
        raise UnknownNameError([nearest(name, known, kind) for name in wrong])
    return tuple(dict.fromkeys(part for name in names for part in run.columns.components(name)))
