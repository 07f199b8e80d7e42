"""Derivatives at a state that are no numbers: by which state or input, and of which output, in the user's names."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mbd.analysis.ports import Input, Output
from mbd.arrays import Matrix
from mbd.equations.linearization import LinearTerms
from mbd.equations.ports import PortTerms

__all__ = ["not_finite"]

ADVICE = "; linearize beside it, or make the function smooth there"
"""What to try."""


def not_finite(
    terms: LinearTerms, ports: PortTerms, states: Sequence[str], inputs: Sequence[Input], outputs: Sequence[Output]
) -> list[str]:
    """One sentence for each; `states` are names of places, velocities and first-order states, in this order."""
    n_v = terms.K.shape[1]
    by_place = _columns(terms.K, terms.turning, terms.change_place)
    by_speed = _columns(terms.C) | np.pad(_columns(terms.B, terms.change_speed), (0, len(terms.C) - n_v))
    by_input = _columns(ports.r, ports.h, ports.rate, ports.change)
    names = [*states, *(each.name for each in inputs if each.node is not None)]
    lost = [name for name, bad in zip(names, (*by_place, *by_speed, *by_input), strict=True) if bad]
    found = [f"forces or rows have no finite derivative by {name!r} at this state{ADVICE}" for name in lost]
    of_output = (
        ports.place, ports.speed, ports.state, ports.acceleration, ports.state_rate, ports.multiplier, ports.through,
        ports.y[:, None],
    )  # fmt: skip
    bad_ones = _columns(*(part.T for part in of_output))
    lost = [each.name for each, bad in zip(outputs, bad_ones, strict=True) if bad]
    return found + [f"the output {name!r} has no finite value or derivative at this state{ADVICE}" for name in lost]


def _columns(*parts: Matrix) -> Matrix:
    """Which columns have an entry that is not finite."""
    return np.asarray(np.any([np.any(~np.isfinite(part), axis=0) for part in parts], axis=0))
