"""A mechanism on the way to a consistent start, as numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.conditions import Condition
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

    def with_conditions(self, h: Vector, B: Matrix, conditions: Sequence[Condition]) -> tuple[Vector, Matrix]:
        """Rows and their Jacobian, followed by those of named conditions."""
        block = self.mechanism.block(self.time, self.q, self.y, self.anchors)
        found = [condition.at(block, self.parameters) for condition in conditions]
        return np.append(h, [r for r, _ in found]), np.vstack([B, *(slope for _, slope in found)])
