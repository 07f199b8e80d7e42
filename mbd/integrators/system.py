"""A mechanism as numbers: all that integrators see of it, and what they return.

Integrators know nothing but numbers. Anything with an `evaluate` can stand in for a walker.
"""

from abc import abstractmethod
from dataclasses import field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError
from mbd.state import Mode, State


@dataclass(frozen=True)
class Point:
    """Where the balance is evaluated: at q ⊕ x.

    t [s]; q (n_q,) center of the chart; x (n_v,) local increment; y (n,) = (v, z); rate (n,) = (v̇, ż);
    lam (m,) multipliers of the active rows.
    """

    t: float
    q: Vector
    x: Vector
    y: Vector
    rate: Vector
    lam: Vector


@dataclass(frozen=True)
class Terms:
    """The balance ``r(t, q, v, v̇, λ) = M v̇ + f + Bᵀλ`` and its rows at a point.

    Attributes
    ----------
    r : (n,) balance, for first-order states ż − s
    S : (n, n) = M + c_C ∂r/∂y + c_K ∂r/∂x, or None if no tangent was asked for
    h, rate : (m,) row values and their rates ḣ = B v + h_t
    R : (n, m) ∂r/∂λ, equal to Bᵀ unless forces depend on multipliers
    H : (m, n) row tangent: B for index 3 and where c_C = 0, else B + (c_K/c_C) ∂ḣ/∂x; zero columns for z
    scale_r, scale_h, scale_rate : magnitudes term by term before cancellation; None: taken from the values
    velocity : (m,) booleans, rows that hold velocities only: h = 0, `rate` and H = B + (c_K/c_C) ∂rate/∂x in both
        forms; None: no such row
    turning : (m, n_v) ∂ḣ/∂x, the rate of B, zero for rows on velocities, whose H it does not enter then; stabilized
        only; None: singular configurations are not looked for
    blur : part of scale_r that is round-off, whatever the tolerance
    shared : multipliers of dependent rows follow those of the others at each point, which the tangent takes as linear:
        r may rise in an iteration that converges
    """

    r: Vector
    S: Matrix | None = None
    h: Vector = field(default_factory=lambda: np.zeros(0))
    rate: Vector = field(default_factory=lambda: np.zeros(0))
    R: Matrix | None = None
    H: Matrix | None = None
    scale_r: Vector | None = None
    scale_h: Vector | None = None
    scale_rate: Vector | None = None
    velocity: Any = None
    turning: Matrix | None = None
    shared: bool = False
    blur: float = 0.0


@runtime_checkable
class System(Protocol):
    """A mechanism as numbers: everything that integrators ask of it.

    A class that inherits from it gives `evaluate` alone where its positions add and no rows are active; the rest has
    defaults. Integrators take any class with an `evaluate` as well, with those of the other members that it has.

    n_z : how many first-order states stand behind the velocities in y
    constant_mass : whether neither posture nor time enters the mass matrix
    angles : (n_v,) booleans, velocities that turn [rad/s]; None: not known
    """

    n_z: int = 0
    constant_mass: bool = False
    angles: Any = None

    @abstractmethod
    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        """Terms at a point; with ``tangent = (c_C, c_K)``, any two numbers, also S, R and H; (0, 0) gives S = M."""

    def accelerations(self, t: float, q: Vector, y: Vector, mode: Mode) -> tuple[Vector, Vector]:
        """(v̇, ż) (n,) and λ (m,) that satisfy the balance and, at acceleration level, the rows.

        By default r, affine in the rates, is solved for them; a system with active rows gives its own.
        """
        point = Point(t, q, np.zeros(len(y) - self.n_z), y, np.zeros(len(y)), np.zeros(0))
        terms = self.evaluate(point, mode, (0.0, 0.0))
        if len(terms.h):
            raise CapabilityError(
                f"{type(self).__name__} has {len(terms.h)} active rows and no accelerations(t, q, y, mode) of its own; "
                "return (v̇, ż) and λ that satisfy the balance and the second derivatives of the rows"
            )
        return -np.linalg.solve(np.asarray(terms.S), terms.r), np.zeros(0)

    def compose(self, q: Vector, x: Vector) -> Vector:
        """q ⊕ x (n_q,): positions moved by a local increment, q + x by default."""
        return q + x

    def increment_rates(self, x: Vector, v: Vector) -> Vector:
        """ẋ = D(x)⁻¹ v (n_v,) of the motion q ⊕ x(t) with velocities v, by default v (see `mbd.configuration`)."""
        return v

    @property
    def is_vector(self) -> bool:
        """Whether q ⊕ x is q + x everywhere."""
        return type(self).compose is System.compose

    @property
    def follows_charts(self) -> bool:
        """Whether ẋ is known anywhere in a chart; else stages of high order are not of the order that they promise."""
        return self.is_vector or type(self).increment_rates is not System.increment_rates


class _Completed(System):
    """A class with an `evaluate`, and the defaults of `System` for what it lacks."""

    is_vector = True
    follows_charts = True

    def __init__(self, own: Any) -> None:
        self.evaluate = own.evaluate  # type: ignore[method-assign]
        for name in ("n_z", "constant_mass", "angles", "accelerations", "compose", "increment_rates"):
            if hasattr(own, name):
                setattr(self, name, getattr(own, name))
        self.is_vector = not hasattr(own, "compose")
        self.follows_charts = self.is_vector or hasattr(own, "increment_rates")

    def evaluate(self, point: Point, mode: Mode, tangent: tuple[float, float] | None) -> Terms:
        """Its own."""
        raise NotImplementedError


def completed(system: Any) -> System:
    """The system itself, or a class with an `evaluate` made whole by the defaults of `System`."""
    inherits = System in type(system).__mro__  # else every member is looked at, properties evaluated
    return system if inherits or isinstance(system, System) else _Completed(system)


def consistent_rates(system: System, t: float, q: Vector, y: Vector, mode: Mode) -> tuple[Vector, Vector]:
    """(v̇, ż) and λ that satisfy the balance and the rows at acceleration level: `System.accelerations`."""
    return completed(system).accelerations(t, q, y, mode)


def composed(system: System, q: Vector, x: Vector) -> Vector:
    """Positions moved by x, q ⊕ x: `System.compose`."""
    return completed(system).compose(q, x)


@dataclass(frozen=True)
class StepReport:
    """How a step went: converged or why not, Newton iterations, largest residual over its tolerance.

    too_near : the step, or whole ones after it, would end too near to a singular configuration; with another size
        they may not
    """

    converged: bool
    iterations: int = 0
    residual: float = 0.0
    message: str = ""
    too_near: bool = False


@dataclass(frozen=True)
class StepResult:
    """State and memory after a step, and its report; the rates and multipliers that users see are in the memory."""

    state: State
    memory: Any
    report: StepReport
