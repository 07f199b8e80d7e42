"""What a pass over a run has found: the end and the events, with their derivatives."""

from __future__ import annotations

from dataclasses import field

from mbd.dataclass import dataclass
from mbd.sensitivity.guards import Trigger
from mbd.sensitivity.motion import Mode, Motion, Rates

__all__ = ["Instant", "Passed"]


@dataclass(frozen=True)
class Instant:
    """An event with its derivatives: the rows before and after it, and the motions there."""

    row: int
    fired: Trigger
    before: Motion
    after: Motion


@dataclass
class Passed:
    """What the pass has found: the motion and rates at the end, and the events."""

    motion: Motion
    mode: Mode
    rates: Rates
    instants: list[Instant] = field(default_factory=list)
