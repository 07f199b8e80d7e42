"""The stepping interface: what an integrator promises."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.integrators.extension import HERMITE, Extension
from mbd.integrators.stepping import SchemeMemory, start_of, step_of
from mbd.integrators.system import (
    Point,
    StepReport,
    StepResult,
    System,
    Terms,
    completed,
    composed,
    consistent_rates,
)
from mbd.state import Mode, State

__all__ = [
    "Advance", "CompiledIntegrator", "Integrator", "Point", "StepReport", "StepResult", "System", "Terms", "completed",
    "composed", "consistent_rates",
]  # fmt: skip


@dataclass(frozen=True)
class Advance:
    """Many steps: where they ended, how many, and the report of the last (`rejected`: a guard refused the next)."""

    state: State
    memory: Any
    steps: int
    report: StepReport
    rejected: bool = False


class Integrator(ABC):
    """A scheme: parameters only, never state.

    A subclass gives `order`, `start` and `step`; that suffices to run every model, with events, impacts and
    restarts handled outside. The memory is any value; ``memory.rate`` (n,) and ``memory.lam`` (m,) are read
    as accelerations and multipliers of the results (without them they come from `consistent_rates`).
    """

    any_chart: ClassVar[bool] = False
    """Whether a step moves positions by `System.compose`, in any chart q ⊕ x; False: along q + x only."""
    between: ClassVar[Extension | str] = HERMITE
    """How states between the rows of a run follow from these: one of `mbd.integrators.extension`, or its name."""
    stabilized: bool = True
    """Whether rows on positions are held at velocity level too."""
    scheme: ClassVar[str | None] = None
    """Name of the kernel's scheme that takes its steps (`mbd.kernel.schemes`), None where there is none."""

    @property
    def compiled_scheme(self) -> str | None:
        """The same of this integrator: a subclass with a `step` of its own has none, unless it names one."""
        for kind in type(self).__mro__:
            if "scheme" in vars(kind) or "step" in vars(kind):
                return vars(kind).get("scheme")
        return None

    @classmethod
    def examples(cls) -> dict[str, tuple[Integrator, ...]]:
        """Integrators that stand for all of their kind in tables of what goes with what, by the name of a column."""
        return {}

    def numbers(self) -> dict[str, float]:
        """Its parameters by the names that the kernel has for them (`mbd.kernel.records`)."""
        return {}

    @abstractmethod
    def order(self, system: System | None = None) -> int:
        """The order of accuracy in dt that the scheme promises for this system."""

    @abstractmethod
    def start(self, system: System, state: State, mode: Mode, dt: float) -> Any:
        """Memory at a consistent state; called again after every switch. dt is the step that will follow [s]."""

    @abstractmethod
    def step(self, system: System, state: State, dt: float, mode: Mode, memory: Any) -> StepResult:
        """One step of size dt. Inputs are never mutated; a step that fails says so in its report."""

    def advance(
        self,
        system: System,
        state: State,
        dt: float,
        until: float,
        mode: Mode,
        memory: Any,
        guards: Callable[[State], bool] | None = None,
    ) -> Advance:
        """Steps of dt until `until`; stops before the first that fails or that `guards(state)` rejects."""
        report = StepReport(True)
        start, count = state.time, 0
        while state.time < until - 1e-9 * dt:
            target = min(start + (count + 1) * dt, until)
            result = self.step(system, state, target - state.time, mode, memory)
            report = result.report
            if not report.converged:
                return Advance(state, memory, count, report)
            if guards is not None and not guards(result.state):
                return Advance(state, memory, count, report, rejected=True)
            state, memory, count = result.state, result.memory, count + 1
        return Advance(state, memory, count, report)

    def local_error(self, old: Any, new: Any, dt: float) -> Vector | None:
        """Estimated local error (n_v + n,) of positions x, then of (v, z), of a step of dt from memory `old` to `new`.

        None: the scheme has no estimate, and takes fixed steps only.
        """
        return None

    def error_order(self) -> int:
        """The power of dt with which the estimated error per unit of time falls."""
        return self.order()

    def check_tolerance(self, rows: int) -> str | None:
        """Why this scheme cannot follow a tolerance with that many rows on positions, or None."""
        return f"{self!r} does not estimate its error; use dt=, or one of mbd's own schemes"

    def check(self, rows: int) -> str | None:
        """Why this scheme cannot integrate a mechanism with that many rows on positions, or None."""
        return None


class CompiledIntegrator(Integrator):
    """Parameters of a scheme of the kernel, which it names: machine code in a run, interpreted on any `System`."""

    def start(self, system: System, state: State, mode: Mode, dt: float) -> SchemeMemory:
        """Memory at a consistent state, as the kernel's scheme makes it."""
        return start_of(self, completed(system), state, mode, dt)

    def step(self, system: System, state: State, dt: float, mode: Mode, memory: Any) -> StepResult:
        """One step, as the kernel's scheme takes it."""
        return step_of(self, completed(system), state, dt, mode, memory)

    def local_error(self, old: Any, new: Any, dt: float) -> Vector | None:
        """The estimate made with the step."""
        return np.asarray(new.error)
