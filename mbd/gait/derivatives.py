"""How a gait follows a parameter, by the implicit function theorem.

A fixed point ``F(c, p) = c`` of the return map moves by ``dc/dp = (1 − P)⁻¹ ∂F/∂p``, P = ∂F/∂c, and with it period,
way and steps, which the map gives too: ``dT/dp = ∂T/∂c dc/dp + ∂T/∂p``. Multipliers have derivatives of P in them;
theirs are differences of gaits found again beside the first, with two Richardson extrapolations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.errors import GaitError, ModelError, UnknownNameError, nearest
from mbd.gait.map_derivative import extrapolated, map_derivative

__all__ = ["Derivatives", "parameter_value"]

BESIDE, LEVELS = 4e-3, 3
"""Least difference of a parameter, over its value or 1, at which gaits are found again, and how many, each twice the
one before."""


class Derivatives(Mapping[tuple[str, str], float]):
    """Derivatives of the scalars of a gait (`mbd.gait.cycle`) by parameters, found when they are asked for first."""

    def __init__(self, gait: Any) -> None:
        self._gait = gait
        self._known: dict[tuple[str, str], float] = {}

    def __getitem__(self, key: tuple[str, str]) -> float:
        if not isinstance(key, tuple) or len(key) != 2:
            raise ModelError(f"derivatives are asked for as derivatives['speed', 'hip.mass'], not {key!r}")
        if key not in self._known:
            scalar, parameter = key
            if not self._gait.success:
                raise GaitError(f"no derivatives: {self._gait.outcome}", self._gait)
            if scalar not in self._gait.scalars:
                raise UnknownNameError(nearest(scalar, self._gait.scalars, "number of the gait", "It has"))
            parameter_value(self._gait, parameter)
            if scalar == "largest multiplier":
                self._known[key] = _beside(self._gait, scalar, parameter)
            else:
                self._known |= {(name, parameter): value for name, value in _implicit(self._gait, parameter).items()}
        return self._known[key]

    def __iter__(self) -> Iterator[tuple[str, str]]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


def parameter_value(gait: Any, name: str) -> float:
    """The value of a parameter or of a function of parameters.

    Raises
    ------
    UnknownNameError
        for a name that is neither.
    ModelError
        for an exact 0 or ±1 of the model that is part of its equations.
    """
    map_ = gait.map
    if name in gait.parameters:
        return float(gait.parameters[name])
    known = {parameter.name: parameter.value for parameter in map_.mechanism.equations.parameters}
    if name in known:
        return float(known[name])
    if name in getattr(map_.model, "parameters", {}):
        raise ModelError(
            f"{name!r} is an exact 0 or ±1 of the model, which is part of its equations; name it in tunable=[…] of "
            "the model"
        )
    raise UnknownNameError(nearest(name, [*known, *map_.functions], "parameter", "There are"))


def motion_of(gait: Any, name: str) -> tuple[Vector, Vector]:
    """(dc/dp, d(numbers)/dp) of the map's numbers along the branch of gaits."""
    assert gait.map_derivative is not None
    values = {**gait.parameters, name: parameter_value(gait, name)}
    size = gait.chart.size
    by = map_derivative(gait.map, gait.chart, np.zeros(size), values, [name], state=False)
    if by.missing:
        raise GaitError(f"no derivative by {name!r}: {by.missing[0]}", gait)
    along, P = by.matrix[:, 0], gait.map_derivative.matrix
    c = np.asarray(np.linalg.lstsq(np.eye(size) - P[:size], along[:size], rcond=1e-9)[0], dtype=float)
    return c, np.asarray(along + P @ c)


def _implicit(gait: Any, name: str) -> dict[str, float]:
    """The derivatives of period, way and steps."""
    _, numbers = motion_of(gait, name)
    size, ways = gait.chart.size, len(gait.map.fixed)
    period, travel = float(numbers[size]), numbers[size + 1 : size + 1 + ways]
    times, lengths = numbers[size + 1 + ways :: 2], numbers[size + 2 + ways :: 2]
    way = gait.way
    distance = float(way @ travel / np.linalg.norm(way)) if np.any(way) else float("nan")
    found = {"period": period, "distance": distance, "speed": (distance - gait.speed * period) / gait.period}
    feet = [foot for foot, _, _ in gait.steps]
    spans = np.diff(np.concatenate([[0.0], times]))
    for foot in dict.fromkeys(feet):
        own = [k for k, other in enumerate(feet) if other == foot]
        found[f"step length of {foot}"] = float(np.mean(lengths[own]))
        found[f"step time of {foot}"] = float(np.mean(spans[own]))
    return found


def _beside(gait: Any, scalar: str, name: str) -> float:
    """The derivative of a scalar by central differences of gaits at parameters beside."""
    value, slopes = parameter_value(gait, name), []
    for level in range(LEVELS):
        h = 2.0**level * BESIDE * (abs(value) or 1.0)
        ends = [gait.at({name: value + sign * h}).scalars[scalar] for sign in (1.0, -1.0)]
        slopes.append(np.array([ends[0] - ends[1]]) / (2.0 * h))
    return float(extrapolated(slopes)[0][0])
