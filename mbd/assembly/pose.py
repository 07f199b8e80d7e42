"""A mechanism on the way to a consistent start, as numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.conditions import Condition
from mbd.assembly.sizes import Sizes, sizes_of
from mbd.compile.mechanism import AccelerationTerms, Mechanism
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.kernel.contact.active_set import ActiveSetManager


@dataclass
class Posture:
    """A mechanism on the way to a consistent start."""

    mechanism: Mechanism
    manager: ActiveSetManager
    parameters: Vector
    q: Vector
    y: Vector
    flags: Any
    anchors: Vector
    places: Sequence[Condition] = ()
    rates: Sequence[Condition] = ()
    time: float = 0.0
    iterations: int = 0
    known: Sizes | None = None

    @property
    def equations(self) -> Equations:
        return self.mechanism.equations

    @property
    def active_rows(self) -> list[int]:
        """Numbers of the rows that act with the contacts that are closed."""
        return list(self.manager.active_rows(self.flags))

    def terms(self, q: Vector | None = None, y: Vector | None = None) -> AccelerationTerms:
        """M, f, R, B, h, ḣ, bias here, or with other positions or rates."""
        q, y = self.q if q is None else q, self.y if y is None else y
        return self.mechanism.acceleration_terms(self.time, q, y, self.parameters, self.anchors)

    @property
    def sizes(self) -> Sizes:
        """Natural units of increments and rows, found where they are first asked for, and shared by copies."""
        if self.known is None:
            self.known = sizes_of(self.mechanism, self.time, self.q, self.y, self.parameters, self.anchors)
        return self.known

    def over_sizes(
        self, rows: Sequence[int], h: Vector, B: Matrix, conditions: Sequence[Condition]
    ) -> tuple[Vector, Matrix]:
        """Values of rows over their sizes and their derivatives by increments over theirs, then those of conditions."""
        block = self.mechanism.block(self.time, self.q, self.y, self.anchors)
        found = [condition.at(block, self.parameters) for condition in conditions]
        size = np.append(self.sizes.rows[list(rows)], [self.condition_size(each) for each in conditions])
        values, slopes = np.append(h, [r for r, _ in found]), np.vstack([B, *(slope for _, slope in found)])
        return values / size, slopes * self.sizes.steps / size[:, None]

    def condition_size(self, condition: Condition) -> float:
        """What a named result is measured by: its largest derivative times the size of the increment, 1 of angles.

        The largest at the posture and at two nearby: derivatives may vanish at one, as where an arm is stretched.
        """
        known = self.sizes.of_conditions
        if condition not in known:
            near, size = np.random.default_rng(5).uniform(-0.1, 0.1, (3, self.equations.n_v)), 0.0
            near[0] = 0.0
            for x in near:
                q = self.equations.configuration.compose(self.q, x * self.sizes.steps)
                block = self.mechanism.block(self.time, q, self.y, self.anchors)
                slope = float(np.max(np.abs(condition.at(block, self.parameters)[1]) * self.sizes.steps, initial=0.0))
                size = max(size, slope) if np.isfinite(slope) else size
            known[condition] = 1.0 if condition.periodic or size == 0.0 else size
        return known[condition]
