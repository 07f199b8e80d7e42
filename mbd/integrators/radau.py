"""The three-stage Radau IIA method of order 5: its parameters, and what it does between steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.values import is_number, shown
from mbd.errors import CapabilityError
from mbd.integrators.base import Integrator, StepResult, System, completed, consistent_rates
from mbd.integrators.family import DEFAULT_TOLERANCE
from mbd.integrators.radau_singular import SingularRadauStep
from mbd.integrators.radau_step import RadauMemory, RadauStep
from mbd.state import Mode, State

__all__ = ["RadauIIA", "RadauMemory"]


@dataclass(frozen=True)
class RadauIIA(Integrator):
    """Radau IIA with three stages: order 5, L-stable, for stiff motion and for tight accuracy.

    Rows are held in position and velocity at every stage. Positions and velocities are of order 5, and so are
    accelerations and multipliers, which satisfy the balance and the rows at acceleration level at the end of the step.

    Parameters
    ----------
    tolerance : largest residual of the balance, relative to the sum of its terms, at which Newton stops; tightened down
        to 1e-3 of it where the step is more accurate

    Raises
    ------
    CapabilityError
        for a tolerance outside (0, 1e-3).

    >>> RadauIIA().order()
    5
    """

    any_chart: ClassVar[bool] = True
    between: ClassVar[str] = "quintic"
    scheme: ClassVar[str | None] = "radau"

    tolerance: float = DEFAULT_TOLERANCE

    def __post_init__(self) -> None:
        if not is_number(self.tolerance) or not 0.0 < self.tolerance < 1e-3:
            raise CapabilityError(
                f"tolerance must be a number between 0 and 1e-3, not {shown(self.tolerance)}; leave it out for 1e-9"
            )

    def __repr__(self) -> str:
        return "RadauIIA()" if self.tolerance == DEFAULT_TOLERANCE else f"RadauIIA(tolerance={self.tolerance!r})"

    @classmethod
    def examples(cls) -> dict[str, tuple[Integrator, ...]]:
        """Those of the table of what goes with what."""
        return {"RadauIIA": (cls(),)}

    def order(self, system: System | None = None) -> int:
        """5; 2 where positions do not add and a system does not tell ẋ."""
        return 5 if system is None or completed(system).follows_charts else 2

    def numbers(self) -> dict[str, float]:
        """Newton's tolerance."""
        return {"tolerance": self.tolerance}

    def error_order(self) -> int:
        """3: the estimate falls with dt⁴ in a step."""
        return 3

    def check_tolerance(self, rows: int) -> str | None:
        """It follows any tolerance."""
        return None

    def local_error(self, old: RadauMemory, new: RadauMemory, dt: float) -> Vector:
        """The estimate made with the step."""
        return new.error

    def start(self, system: System, state: State, mode: Mode, dt: float) -> RadauMemory:
        """Stages of a step before it at rates and multipliers that do not change."""
        y = np.concatenate([state.v, state.z])
        rate, lam = consistent_rates(system, state.time, state.q, y, mode)
        n_v = len(state.v)
        stages = np.tile(rate, (3, 1)), np.tile(lam, (3, 1)), np.zeros((3, n_v))
        return RadauMemory(rate, lam, *stages, np.zeros_like(rate), np.zeros_like(lam), dt, np.zeros(n_v + len(rate)))

    def step(self, system: System, state: State, dt: float, mode: Mode, memory: RadauMemory) -> StepResult:
        """One step by Newton's method; the readable twin of the compiled kernel."""
        given = (self.tolerance, system, state, dt, mode, memory)
        step = RadauStep(*given)
        if len(memory.lam) and step.rows_turn():
            return SingularRadauStep(*given).run()
        result = step.run()
        if len(memory.lam) and not result.report.converged and np.isfinite(result.report.residual):
            result = SingularRadauStep(*given).run()
        return result
