"""How a gait follows a parameter, by the implicit function theorem.

A fixed point ``F(c, p) = c`` of the return map moves by ``dc/dp = (1 − P)⁻¹ ∂F/∂p``, P = ∂F/∂c, and with it period,
way and steps, which the map gives too: ``dT/dp = ∂T/∂c dc/dp + ∂T/∂p``. Multipliers change with P along the branch, by
differences of derivatives of the map with two Richardson extrapolations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.linalg import eig

from mbd.arrays import Matrix, Vector
from mbd.errors import GaitError, ModelError, UnknownNameError, nearest
from mbd.gait.exact_derivative import exact_derivative
from mbd.gait.map_derivative import extrapolated, map_derivative

__all__ = ["Derivatives", "parameter_value"]

BESIDE, LEVELS = 8e-3, 3
"""Least difference of a parameter, over its value or 1, to where the map is differentiated again, and how many, each
twice the one before."""


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
                self._known[key] = _of_largest_multiplier(self._gait, parameter)
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
    way = gait.map.forward * gait.way
    distance = float(way @ travel / np.linalg.norm(way)) if np.any(way) else float("nan")
    found = {"period": period, "distance": distance, "speed": (distance - gait.speed * period) / gait.period}
    feet = [foot for foot, _, _ in gait.steps]
    spans = np.diff(np.concatenate([[0.0], times]))
    for foot in dict.fromkeys(feet):
        own = [k for k, other in enumerate(feet) if other == foot]
        found[f"step length of {foot}"] = float(np.mean(lengths[own]))
        found[f"step time of {foot}"] = float(np.mean(spans[own]))
    return found


def _of_largest_multiplier(gait: Any, name: str) -> float:
    """The derivative of the largest modulus |λ|, with wᴴ P = λ wᴴ, P u = λ u: ``dλ/dp = wᴴ (dP/dp) u / wᴴ u``.

    dP/dp along the branch follows from central differences at ``c ± h dc/dp, p ± h``, which are off the branch by h²
    on both sides alike.
    """
    if not len(gait.stability_of.values):
        return 0.0
    value, size = parameter_value(gait, name), gait.chart.size
    move, _ = motion_of(gait, name)
    P, slopes = gait.map_derivative.matrix[:size], []
    for level in range(LEVELS):
        h = 2.0**level * BESIDE * (abs(value) or 1.0)
        ends = [_slope_beside(gait, sign * h * move, {**gait.parameters, name: value + sign * h}) for sign in (1, -1)]
        slopes.append((ends[0] - ends[1]) / (2.0 * h))
    change = extrapolated([slope.ravel() for slope in slopes])[0].reshape(size, size)
    values, left, right = eig(P, left=True, right=True)
    k = int(np.argmin(np.abs(values - gait.stability_of.values[0])))
    w, u = left[:, k], right[:, k]
    by = (w.conj() @ change @ u) / (w.conj() @ u)
    return float((values[k].conj() * by).real / abs(values[k]))


def _slope_beside(gait: Any, c: Vector, values: Mapping[str, float]) -> Matrix:
    """P beside the gait: exact, or by differences where no pass knows a run's derivative."""
    exact, size = exact_derivative(gait.map, gait.chart, c, values), gait.chart.size
    if exact is not None:
        return exact
    found = map_derivative(gait.map, gait.chart, c, values)
    if found.missing:
        raise GaitError(f"no derivative of the multipliers: beside the gait {next(iter(found.missing.values()))}", gait)
    return found.matrix[:size]
