"""What one effect costs, carries and changes, as values."""

from collections.abc import Mapping
from dataclasses import field

from mbd.analysis.effects.timing import Timing
from mbd.dataclass import dataclass


@dataclass(frozen=True)
class Change:
    """How a run differs from that of the whole scene.

    Parameters
    ----------
    outputs : largest difference of each output over its range in the whole scene [-], as long as both have the same
        events; instants between an event and the same one of the other run are left out
    event_time : largest shift of an event that both have [s]
    until : time until which the two could be compared [s]
    differs_at : time from which the events are others, so that nothing is compared any more [s]; None: never
    left_out : share of the instants between an event and its match [-]
    ends : how the run ends, where the whole scene does not end so; '' otherwise
    failure : why there is no run; '' after a success
    identical : whether every stored row is the same to the bit
    """

    outputs: Mapping[str, float] = field(default_factory=dict)
    until: float = 0.0
    event_time: float = 0.0
    differs_at: float | None = None
    left_out: float = 0.0
    ends: str = ""
    failure: str = ""
    identical: bool = False

    @property
    def largest(self) -> float:
        """Of all outputs [-]; infinite where there is no run, nan where nothing could be compared."""
        if self.failure:
            return float("inf")
        return max(self.outputs.values(), default=float("nan"))

    @property
    def comparable(self) -> bool:
        """Whether the run has the events and the end of the whole scene."""
        return not self.failure and not self.ends and self.differs_at is None

    @property
    def telling(self) -> bool:
        """Whether it is comparable, and at most of the instants: where events are far apart the others say little."""
        return self.comparable and self.left_out <= 0.5  # else the others say too little of a run

    def within(self, tolerance: float) -> bool:
        """Whether it is the run of the whole scene, but for that much of the ranges."""
        return self.telling and self.largest <= tolerance

    def __str__(self) -> str:
        """What else is to be said of it."""
        if self.failure:
            return f"cannot be left out: {self.failure}"
        texts = ["changes nothing, to the bit"] if self.identical else []
        texts += [self.ends] if self.ends else []
        if self.differs_at is not None:
            texts.append(f"other events from {self.differs_at:.4g} s")
        if self.event_time:
            texts.append(f"events up to {self.event_time:.2g} s off")
        if self.left_out > 0.2:
            texts.append(f"{self.left_out:.0%} of the instants lie between shifted events")
        return "; ".join(texts)


@dataclass(frozen=True)
class Contribution:
    """One effect of a scene.

    Parameters
    ----------
    name : as `Model.without` takes it
    kind : 'joint loss', 'damper', 'friction', 'penalty', 'motor', 'force', 'gravity', 'potential'
    operations : of a Newton iteration that are there for it alone; those of a contact or a dry friction while it acts
    acts : 'always', 'while closed' or 'while sliding': when it takes these operations
    timing : of a step with it and without, over the time in which both have the same events; None: not measured
    energy : that went through it, Σ |ΔE| over the stored rows [J]
    share : of all that went through any element of the ledger [-]
    change : what changes without it
    """

    name: str
    kind: str
    operations: int
    acts: str
    timing: Timing | None
    energy: float
    share: float
    change: Change

    @property
    def time(self) -> str:
        """Nanoseconds a step, or what they are certainly less than; negative where steps without it take longer."""
        if self.timing is None:
            return "–"
        if abs(self.timing.added) <= self.timing.noise:
            return f"< {max(self.timing.noise, 1.0):.0f}"
        return f"{self.timing.added:.0f}"


@dataclass(frozen=True)
class Together:
    """Effects left out at once: their names, those put back before, the change, and the operations that are left."""

    names: tuple[str, ...]
    back: tuple[str, ...]
    change: Change
    operations: int
