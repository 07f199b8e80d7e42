"""Problems with exact or published answers, and their sources.

The cases are files of `tests/cases/data`, or of `mbd/hardcases/data` where they are hard cases too: definition (SI,
radians), initial values, and quantities, each with its value, the accuracy of that value and how it was found. The
rest are equations of motion written by hand, integrated by an explicit Runge–Kutta method of order 8 (DOP853 of scipy,
Hairer, Nørsett & Wanner 1993), which shares nothing with what is tested.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.hardcases.case import definition

Numbers = NDArray[np.float64]
Motion = Callable[[float, Numbers], Any]
DATA = Path(__file__).parent / "cases" / "data"


@dataclass(frozen=True, eq=False)
class Quantity:
    """A reference value, at the time t where it has one, and how accurate it is."""

    name: str
    value: Any
    t: Any
    accuracy: float


@dataclass(frozen=True, eq=False)
class Case:
    """A reference case; numbers of `definition` and `start` by name."""

    name: str
    definition: Mapping[str, Any]
    start: Mapping[str, Any]
    quantities: Mapping[str, Quantity]

    def __getitem__(self, beginning: str) -> Quantity:
        """The quantity of that name, or the one whose name begins so."""
        if beginning in self.quantities:
            return self.quantities[beginning]
        found = [quantity for name, quantity in self.quantities.items() if name.startswith(beginning)]
        assert len(found) == 1, f"{len(found)} quantities of {self.name} begin with {beginning!r}"
        return found[0]


def _numbers(values: Mapping[str, Any]) -> dict[str, Any]:
    found = {}
    for name, value in values.items():
        try:
            found[name] = float(value)
        except (TypeError, ValueError):
            found[name] = np.array(value) if isinstance(value, list) else value
    return found


@cache
def case(name: str) -> Case:
    """The reference case of that name."""
    own = DATA / f"{name}.json"
    data = json.loads(own.read_text(encoding="utf-8")) if own.is_file() else definition(name)
    quantities = {
        q["name"]: Quantity(
            q["name"],
            np.array(q["value"]) if isinstance(q["value"], list) else q["value"],
            np.array(q["t"]) if isinstance(q.get("t"), list) else q.get("t"),
            q["accuracy"],
        )
        for q in data["quantities"]
    }
    return Case(name, _numbers(data["definition"]), _numbers(data["initial_conditions"]), quantities)


def integrated(motion: Motion, start: Sequence[float], times: Sequence[float] | float) -> Numbers:
    """The state at each time, (n,) or (k, n), of y' = motion(t, y) from `start` at t = 0; DOP853 at 1e-12."""
    from scipy.integrate import solve_ivp

    wanted = np.atleast_1d(times)
    solved = solve_ivp(motion, (0.0, wanted[-1]), start, "DOP853", t_eval=wanted, rtol=1e-12, atol=1e-13)
    assert solved.success, solved.message
    return np.asarray(solved.y.T if np.ndim(times) else solved.y[:, -1])


def pendulum(length: float, gravity: float, damping: float = 0.0) -> Motion:
    """``θ¨ = −(g/L) sin θ − d θ˙`` with the angle from the downward vertical; y = (θ, θ˙)."""
    return lambda t, y: [y[1], -gravity / length * np.sin(y[0]) - damping * y[1]]


def double_pendulum(m1: float, m2: float, L1: float, L2: float, g: float) -> Motion:
    """Two point masses on rods, angles from the downward vertical; y = (θ₁, θ₂, θ₁˙, θ₂˙).

    The two equations of Lagrange solved by Cramer's rule (any textbook, such as Landau & Lifshitz, §5 problem 1).
    """

    def motion(t: float, y: Numbers) -> list[float]:
        a, b, w, u = y
        c, s = np.cos(a - b), np.sin(a - b)
        first = -m2 * L2 * u * u * s - (m1 + m2) * g * np.sin(a)  # (m₁+m₂) L₁ θ₁¨ + m₂ L₂ c θ₂¨
        second = L1 * w * w * s - g * np.sin(b)  # L₁ c θ₁¨ + L₂ θ₂¨
        bottom = m1 + m2 - m2 * c * c
        return [w, u, (first - m2 * c * second) / (L1 * bottom), ((m1 + m2) * second - c * first) / (L2 * bottom)]

    return motion
