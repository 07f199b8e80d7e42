"""The classical explicit Runge–Kutta scheme of order 4 (Kutta 1901, Z. Math. Phys. 46:435)."""

from typing import ClassVar

from mbd.dataclass import dataclass
from mbd.integrators.extension import STEPS_OF_ORDER_4, Extension
from mbd.integrators.runge_kutta import ExplicitRungeKutta
from mbd.kernel.schemes.tableau import FOURTH_ORDER, Tableau


@dataclass(frozen=True)
class RungeKutta4(ExplicitRungeKutta):
    """The classical explicit Runge–Kutta scheme of order 4, with an embedded error estimate of order 3.

    See `ExplicitRungeKutta`; it takes four accelerations a step, a third of those of `RungeKutta853`, and is the faster
    of the two where errors of about 1e-3 are small enough, as in pictures and searches. Stiff springs and dampers bound
    its step: with ω the largest frequency, ω dt < 2.82.

    It has no parameters: ``mbd.simulate(model, start, mbd.RungeKutta4(), dt=0.005, until=10.0)``.
    """

    between: ClassVar[Extension | str] = STEPS_OF_ORDER_4
    scheme: ClassVar[str | None] = "runge-kutta-4"
    tableau: ClassVar[Tableau] = FOURTH_ORDER
    full_order: ClassVar[int] = 4
