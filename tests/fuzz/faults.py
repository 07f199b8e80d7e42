"""What a judge found wrong: which law, by how much, where and when."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.fuzz.geometry import Array


@dataclass(frozen=True)
class Fault:
    """A broken law.

    law : its name; what : of which part of the mechanism
    size, limit : how much is wrong, and how much could be round-off or the error of a step
    time : the worst instant [s]; count : at how many instants
    """

    law: str
    what: str
    size: float
    limit: float
    time: float
    count: int = 1

    def __str__(self) -> str:
        place = f"{self.what!r} at t = {self.time:.6g} s"
        return f"{self.law}: {place} off by {self.size:.3g}, allowed {self.limit:.1g} ({self.count} instants)"


@dataclass
class Faults:
    """Collects broken laws; every comparison counts as one trial of its law.

    time : the instants that are compared now (n,) [s]
    """

    time: Array
    found: list[Fault] = field(default_factory=list)
    tried: dict[str, int] = field(default_factory=dict)

    def small(self, law: str, what: str, size: Any, limit: Any, where: Any = True, told: int = 0) -> None:
        """Note where ``|size| ≤ limit`` does not hold, or is not a number; (n,), looked at `where` only.

        As many instants as the run has `told` of in a note may miss it.
        """
        size = np.abs(np.broadcast_to(np.asarray(size, dtype=float), self.time.shape))
        limit = np.broadcast_to(np.asarray(limit, dtype=float), self.time.shape)
        self.tried[law] = self.tried.get(law, 0) + 1
        wrong = ~(size <= limit) & where
        if np.count_nonzero(wrong) <= told:
            return
        excess = np.where(wrong, np.nan_to_num(size / np.maximum(limit, 1e-300), nan=np.inf), 0.0)
        k = int(np.argmax(excess))
        count = int(np.count_nonzero(wrong))
        self.found.append(Fault(law, what, float(size[k]), float(limit[k]), float(self.time[k]), count))

    def at(self, time: Array) -> Faults:
        """The same collection, for other instants."""
        return Faults(time, self.found, self.tried)
