"""What a pass over a run has found: the end and the events, with their derivatives."""

from dataclasses import field

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.sensitivity.motion import Mode, Motion, Rates


@dataclass(frozen=True)
class Instant:
    """An event: its name, its time [s], and the derivatives (D,) of this, NaN where they have one side only."""

    name: str
    time: float
    of_time: Vector


@dataclass
class Passed:
    """What the pass has found: the motion and rates at the end, and the events."""

    motion: Motion
    mode: Mode
    rates: Rates
    instants: list[Instant] = field(default_factory=list)
