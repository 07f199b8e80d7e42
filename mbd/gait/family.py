"""Gaits of a family: the member with a given energy or speed.

Where nothing takes energy, gaits are not isolated: with each one there are others of more and less energy, and the
return map has a multiplier 1 along them. One number more, g(c) = g₀, picks a member. Newton's method solves
``F(c) − c = 0`` together with ``g₀ − g(c) = 0``: the rows of P − 1 depend on each other along the family, with ∇g
beside them they do not. Where a square matrix is needed, w ∇gᵀ is added to P − 1, w = ∇E/‖∇E‖, and w times what is left
of g to F(c) − c: as F keeps E, w is across F(c) − c, and both vanish together.
"""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.values import is_finite_number, shown
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.gait.exact_derivative import motion_on_section
from mbd.gait.floquet import Multipliers, multipliers_of
from mbd.gait.map_derivative import MapDerivative, Measured
from mbd.gait.return_map import ReturnMap, Values
from mbd.gait.section import Chart
from mbd.sensitivity.starts import Direction, programs_of
from mbd.state import State

DIFFERENCE_STEP = 1e-5
"""Difference of a value, relative to 1 or it, whose function of parameters has no slopes [-]."""
UNIT_MULTIPLIER_ATOL = 1e-3
"""Distance of a multiplier from 1 within which it may be that of energy that nothing takes [-]."""


@dataclass(frozen=True)
class Member:
    """The number that picks one gait of a family: kind 'energy' T + V [J], or 'speed' [m/s], and its value."""

    kind: Literal["energy", "speed"]
    value: float

    @property
    def unit(self) -> str:
        """'J' or 'm/s'."""
        return "J" if self.kind == "energy" else "m/s"

    @property
    def size(self) -> float:
        """By which its misfit is divided: its value, at least 1."""
        return max(1.0, abs(self.value))

    def number(self, map_: ReturnMap, state: State, numbers: Vector, size: int, values: Values) -> float:
        """Its value at a state from which the map gives these numbers (see `Measured`)."""
        if self.kind == "energy":
            return float(energy_of(map_, [state], values)[0])
        return _speed(map_, numbers[size:])[0]

    def misfit(self, map_: ReturnMap, chart: Chart, c: Vector, found: Measured, values: Values) -> float:
        """(g₀ − g)/size at coordinates from which the map gives the numbers `found`."""
        state = chart.at(c, map_.vector(values)) if self.kind == "energy" else chart.state
        return (self.value - self.number(map_, state, found.numbers, found.size, values)) / self.size

    def slope(self, map_: ReturnMap, chart: Chart, found: Measured, derivative: Matrix, values: Values) -> Vector:
        """∇g/size by the coordinates of the chart, with the derivative of the numbers of the map."""
        if self.kind == "energy":
            return energy_slope(map_, chart, values) / self.size
        return self.by_numbers(map_, found, derivative) / self.size

    def by(self, map_: ReturnMap, chart: Chart, found: Measured, column: Vector, name: str, values: Values) -> float:
        """∂g/∂p/size by a parameter, of which the numbers of the map have the derivative `column`."""
        if self.kind == "speed":
            return float(self.by_numbers(map_, found, column[:, np.newaxis])[0] / self.size)
        return float(energy_slope(map_, chart, values, name)[-1] / self.size)

    def by_numbers(self, map_: ReturnMap, found: Measured, derivative: Matrix) -> Vector:
        """The derivative of the speed from that of the numbers of the map."""
        slope = _speed(map_, found.numbers[found.size :])[1]
        known = np.flatnonzero(slope)  # lengths of steps that are not known are NaN
        return np.asarray(slope[known] @ derivative[found.size :][known])

    def __str__(self) -> str:
        return f"{self.kind} {self.value:g} {self.unit}"


def member_of(energy: Any, speed: Any) -> Member | None:
    """The member that arguments ask for.

    Raises
    ------
    ModelError
        where both are given, and for what is no finite number.
    """
    given = [(kind, value) for kind, value in (("energy", energy), ("speed", speed)) if value is not None]
    faults = [f"{kind} must be a finite number, got {shown(value)}" for kind, value in given
              if not is_finite_number(value)]  # fmt: skip
    if len(given) == 2:
        faults.append("energy and speed each pick one gait of a family; give one of them")
    if faults:
        raise ModelError(faults)
    return Member(given[0][0], float(given[0][1])) if given else None  # type: ignore[arg-type]


def energy_of(map_: ReturnMap, states: Sequence[State], values: Values) -> Vector:
    """T + V of states [J], with what closed penalty contacts and spring legs hold."""
    parameters = map_.vector(values)
    inputs = {name: np.stack([getattr(state, name) for state in states]) for name in ("q", "v", "z")}
    inputs |= {"t": np.zeros(len(states)), "anchor": np.stack([state.anchors for state in states])}
    kinetic, potential = map_.mechanism.energies(inputs, parameters)
    total = np.asarray(kinetic + potential, dtype=float)
    held, contacts = _held(map_)
    if contacts:
        out = np.zeros(len(contacts))
        for k, state in enumerate(states):
            y = np.concatenate([state.v, state.z])
            held(map_.mechanism.block(0.0, state.q, y, state.anchors), parameters, out)
            total[k] += sum(value for name, value in zip(contacts, out, strict=True) if name in state.mode.closed)
    return total


def energy_slope(map_: ReturnMap, chart: Chart, values: Values, name: str = "") -> Vector:
    """∇(T + V) along the section, and its derivative by a parameter, with which the state keeps on the section."""
    mechanism, parameters, section = map_.mechanism, map_.vector(values), chart.section
    rates = map_.rates_of(name, values) if name else {}
    if rates is None:  # of a function whose slopes are lost to round-off beside a parameter that passes zero
        h = DIFFERENCE_STEP * max(1.0, abs(values[name]))
        high, low = (map_.vector({**values, name: values[name] + sign * h}) for sign in (1.0, -1.0))
        every = [each.name for each in mechanism.equations.parameters]
        rates = {every[k]: float(high[k] - low[k]) / (2.0 * h) for k in np.flatnonzero(high != low)}
    programs = programs_of(mechanism, [Direction(name, parameters=rates)], parameters)
    p = np.zeros((len(rates), chart.size + int(bool(name))))
    p[:, chart.size :] = np.array(list(rates.values())).reshape(len(rates), int(bool(name)))
    motion, mode = motion_on_section(chart, chart.at(np.zeros(chart.size), parameters), programs, p)
    equations, closed = mechanism.equations, section.mode.closed
    with equations.tape.lock:
        energy = equations.kinetic + equations.potential
        for effect in equations.effects:
            if effect.elastic is not None and equations.contacts[effect.contact].name in closed:
                energy = energy + effect.elastic
    still = np.zeros(programs.columns.n), np.zeros(programs.columns.rows)
    slopes = programs.derivatives_of(f"energy with {sorted(closed)}", [energy], motion.at(mode, *still))
    return np.asarray(slopes[0] @ motion.tangent.stacked(programs.columns))


def across(map_: ReturnMap, chart: Chart, values: Values) -> Vector:
    """w = ∇E/‖∇E‖, across which the map leads nowhere; zeros where the energy does not depend on the state."""
    slope = energy_slope(map_, chart, values)
    size = float(np.linalg.norm(slope))
    return slope / size if np.isfinite(size) and size > 0.0 else np.zeros(chart.size)


def floquet(map_: ReturnMap, chart: Chart, derivative: MapDerivative, values: Values) -> Multipliers:
    """The multipliers of P, that of energy apart where nothing takes any."""
    P, error = derivative.matrix[: chart.size, : chart.size], derivative.error[: chart.size, : chart.size]
    found = multipliers_of(P, error)
    if np.min(np.abs(found.values - 1.0), initial=1.0) > UNIT_MULTIPLIER_ATOL:
        return found
    w = across(map_, chart, values)
    return multipliers_of(P, error, w if np.any(w) else None)


def _held(map_: ReturnMap) -> tuple[ScalarFunction, tuple[str, ...]]:
    """The program of the energies that penalty contacts can give back, and their names."""
    equations = map_.mechanism.equations
    memory = equations.memory
    if "energies of contacts" not in memory:
        with equations.tape.lock:
            effects = [effect for effect in equations.effects if effect.elastic is not None]
            nodes = [effect.elastic for effect in effects if effect.elastic is not None]
            names = tuple(equations.contacts[effect.contact].name for effect in effects)
            program = scalar_function(nodes, map_.mechanism.layout, "energies of contacts")
            memory["energies of contacts"] = program, names
    found: tuple[ScalarFunction, tuple[str, ...]] = memory["energies of contacts"]
    return found


def _speed(map_: ReturnMap, numbers: Vector) -> tuple[float, Vector]:
    """The speed of one application and its derivative by (period, travel, times and lengths of steps)."""
    ways = len(map_.fixed)
    period, travel, lengths = numbers[0], numbers[1 : 1 + ways], numbers[2 + ways :: 2]
    slope = np.zeros(len(numbers))
    if ways:
        way = map_.forward * travel
        distance = float(np.linalg.norm(way))
        slope[1 : 1 + ways] = map_.forward * way / (distance or 1.0)
    else:
        distance = float(np.sum(lengths))
        slope[2 + ways :: 2] = 1.0
    slope[0] = -distance / period
    return distance / period, slope / period
