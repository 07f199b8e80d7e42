"""The three-stage Radau IIA method of order 5: its parameters."""

from typing import ClassVar

from mbd.bodies.values import is_number, shown
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError
from mbd.integrators.base import CompiledIntegrator, Integrator, System, completed
from mbd.integrators.extension import OSCULATING, Extension
from mbd.integrators.family import DEFAULT_TOLERANCE


@dataclass(frozen=True)
class RadauIIA(CompiledIntegrator):
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
    between: ClassVar[Extension | str] = OSCULATING
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
