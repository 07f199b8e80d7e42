"""How a gait follows a parameter, by the implicit function theorem.

A fixed point ``F(c, p) = c`` of the return map moves by ``dc/dp = (1 − P)⁻¹ ∂F/∂p``, P = ∂F/∂c, and with it period,
way and steps, which the map gives too: ``dT/dp = ∂T/∂c dc/dp + ∂T/∂p``. Multipliers change with P(c, p) along the
tangent (dc/dp, 1) of the branch, by differences of exact derivatives of the map: P is smooth there up to where other
events happen, also beside folds, where the branch itself turns. The differences follow the unit of the parameter: the
gait moves by as much whatever the parameter's unit is.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from scipy.linalg import eig

from mbd.arrays import Matrix, Vector
from mbd.equal import RANK_RTOL
from mbd.errors import GaitError, ModelError, SimulationError, UnknownNameError, nearest
from mbd.gait.extrapolation import extrapolated
from mbd.gait.map_derivative import MapDerivative, Measured, map_derivative, measured
from mbd.gait.return_map import Arrival
from mbd.sensitivity.starts import unknown_name

BESIDE, LEVELS = 1e-3, 3
"""Change of the numbers of the map [m, rad, s, …] to where it is differentiated again, and how many, each twice the one
before."""
CLOSER, TRIES = 0.25, 9
"""Factor of that change where other events happen there or differences disagree, and how often it is tried."""
SURE, DOUBTFUL = 1e-8, 1e-5
"""Error estimate, relative to the derivative or to the change of the gait, at which it ends, and above which there is
none [-]."""
MULTIPLIER_GAP = 1e-7
"""``|wᴴ u|`` of left and right eigenvectors of length 1, or difference of two moduli relative to them, below which two
multipliers meet and their largest has no derivative [-]."""


class Derivatives(Mapping[tuple[str, str], float]):
    """Derivatives of the scalars of a gait (`mbd.gait.cycle`) by parameters, found when they are asked for first."""

    def __init__(self, gait: Any) -> None:
        self._gait = gait
        self._known: dict[tuple[str, str], float] = {}

    def __getitem__(self, key: tuple[str, str]) -> float:
        if not isinstance(key, tuple) or len(key) != 2 or not all(isinstance(name, str) for name in key):
            raise ModelError(f"derivatives are asked for as derivatives['speed', 'hip.mass'], not {key!r}")
        if key not in self._known:
            scalar, parameter = key
            if not self._gait.success:
                raise GaitError(f"no derivatives: {self._gait.outcome}", self._gait)
            if scalar not in self._gait.scalars:
                raise UnknownNameError(nearest(scalar, self._gait.scalars, "number of the gait", "It has"))
            parameter_value(self._gait, parameter)
            require_member(self._gait)
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
    """The value of a parameter, of a function of parameters or of the member's number that a gait may follow.

    Raises
    ------
    UnknownNameError
        for a name that is neither.
    ModelError
        for an exact 0 or ±1 of the model that is part of its equations, and for a parameter of one side of a gait
        that was found with a mirror.
    """
    map_, member = gait.map, gait.given.member
    if member is not None and name == member.kind:
        return float(member.value)
    known = {parameter.name: parameter.value for parameter in map_.mechanism.equations.parameters} | gait.parameters
    if name in known:
        value = float(known[name])
        map_.require_free([name], gait.parameters)
        map_.require_both_sides(name, value, gait.parameters)
        return value
    if name in getattr(map_.model, "parameters", {}):
        raise ModelError(
            f"{name!r} is an exact 0 or ±1 of the model, which is part of its equations; name it in tunable=[…] of "
            "the model"
        )
    raise UnknownNameError(unknown_name(map_.mechanism.equations, name, [*known, *map_.functions], "parameter"))


def require_member(gait: Any) -> None:
    """Raise a `ModelError` for a gait with neighbours of other energy, none of which was asked for."""
    if gait.given.member is None and "energy" in gait.stability_of.trivial:
        raise ModelError(
            f"the gait of {gait.name!r} is one of a family, since nothing takes energy: what another gait keeps is not "
            "told; find it with energy= or speed= of mbd.limit_cycle"
        )


def _beside(gait: Any, name: str, value: float) -> dict[str, float]:
    """The parameters of a gait with another value of one; of the member's number there is none in the model."""
    member = gait.given.member
    return dict(gait.parameters) if member is not None and name == member.kind else {**gait.parameters, name: value}


def motion_of(gait: Any, name: str) -> tuple[Vector, Vector]:
    """(dc/dp, d(numbers)/dp) of the map's numbers along the branch of gaits.

    Raises
    ------
    GaitError
        where the gait has none: at a fold, and where the map has no derivative.
    """
    assert gait.map_derivative is not None
    value, member = parameter_value(gait, name), gait.given.member
    values, size, P = _beside(gait, name, value), gait.chart.size, gait.map_derivative.matrix
    if member is not None and name == member.kind:
        by = MapDerivative(np.zeros((len(P), 1)), np.zeros((len(P), 1)), "exact", {})
    else:
        by = map_derivative(gait.map, gait.chart, np.zeros(size), values, [name], state=False)
    if by.missing:
        raise GaitError(f"no derivative by {name!r}: {by.missing[0]}", gait)
    along = by.matrix[:, 0]
    most = float(np.nanmax(np.abs(along), initial=0.0))
    if not float(np.nanmax(by.error, initial=0.0)) <= DOUBTFUL * most and most > 0.0:
        raise GaitError(
            f"no derivative by {name!r}: what the map changes by does not become proportional to the parameter, "
            f"{np.nanmax(by.error):.2g} of {most:.2g} are left; two events may be at one instant there",
            gait,
        )
    fixed, change = np.eye(size) - P[:size], along[:size]
    if member is not None:
        here = measured(gait.map, gait.chart, np.zeros(size), values)
        assert isinstance(here, Measured)
        row = member.slope(gait.map, gait.chart, here, P, values)
        if name == member.kind:
            by_name = -1.0 / member.size
        else:
            by_name = member.by(gait.map, gait.chart, here, along, name, values)
        fixed, change = np.vstack([fixed, row]), np.append(change, -by_name)
    c = np.asarray(np.linalg.lstsq(fixed, change, rcond=RANK_RTOL)[0], dtype=float)
    left = float(np.max(np.abs(fixed @ c - change), initial=0.0))
    if left > DOUBTFUL * float(np.max(np.abs(change), initial=0.0)):
        raise GaitError(f"no derivative by {name!r}: the branch of gaits has a fold here, where it turns back", gait)
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
    spans = step_spans(times, period)
    for foot in dict.fromkeys(feet):
        own = [k for k, other in enumerate(feet) if other == foot]
        found[f"step length of {foot}"] = float(np.mean(lengths[own]))
        found[f"step time of {foot}"] = float(np.mean(spans[own]))
    return found


def step_spans(times: Vector, period: float) -> Vector:
    """Times of the steps that the touchdowns of a cycle end; the first began with the last touchdown of the one before.

    Linear in both, so that derivatives of touchdowns and period give those of the steps.
    """
    return np.diff(np.concatenate([times[-1:] - period, times]))


def _of_largest_multiplier(gait: Any, name: str) -> float:
    """The derivative of the largest modulus |λ|, with wᴴ P = λ wᴴ, P u = λ u: ``dλ/dp = wᴴ (dP/dp) u / wᴴ u``.

    dP/dp along the branch follows from central differences at ``c ± h dc/dp, p ± h``, which are off the branch by h²
    on both sides alike. Beside a bound of the parameter, such as a damping of 0, they lie on the side that is allowed.

    Raises
    ------
    GaitError
        where two multipliers meet, where all are 0 beside others that are not, and where the events of the walk change
        too near for a difference.
    """
    stability = gait.stability_of
    if not gait.chart.size or (not len(stability.values) and "energy" in stability.trivial):
        return 0.0
    P = gait.map_derivative.matrix[: gait.chart.size]
    change_of, natural = _multiplier_change(gait, P)
    value, (move, numbers) = parameter_value(gait, name), motion_of(gait, name)
    swing = float(max(np.nanmax(np.abs(numbers), initial=0.0), np.max(np.abs(move), initial=0.0)))
    h = BESIDE / swing if swing > 0.0 else gait.map.parameter_steps.get(name, BESIDE * (abs(value) or 1.0))
    best, error, why = 0.0, np.inf, ""
    for _ in range(TRIES):
        slopes: list[float] = []
        faults = [gait.map.faults(_beside(gait, name, value + sign * 2.0 ** (LEVELS - 1) * h)) for sign in (1, -1)]
        sides = [0.0 if fault else sign for sign, fault in zip((1.0, -1.0), faults, strict=True)]
        why = "" if any(sides) else f"on both sides {faults[0][0]}"
        for level in range(0 if why else LEVELS):
            step = 2.0**level * h
            ends = [_slope_beside(gait, sign * step * move, _beside(gait, name, value + sign * step)) if sign else P
                    for sign in sides]  # fmt: skip
            why = next((end for end in ends if isinstance(end, str)), "")
            if why:
                break
            slopes.append(change_of((ends[0] - ends[1]) / ((sides[0] - sides[1]) * step)))  # type: ignore[operator]
        if not why:
            errors = 4.0 if all(sides) else 2.0  # of order h², h⁴ or h, h²
            found, doubt = (float(part[0]) for part in extrapolated([np.array([slope]) for slope in slopes], errors))
            best, error = (found, doubt) if doubt < error else (best, error)
            if error <= SURE * max(abs(best), natural * swing):
                break
        h *= CLOSER
    if not error <= DOUBTFUL * max(abs(best), natural * swing):
        reason = f"beside the gait {why}" if not np.isfinite(error) else (
            f"differences of the derivative of the map leave {error:.2g} of {best:.6g} open; the events of the walk "
            "change too near beside it"
        )  # fmt: skip
        raise GaitError(f"no derivative of the largest multiplier by {name!r}: {reason}", gait)
    if not natural and all(sides) and best > DOUBTFUL * swing:
        raise GaitError(
            f"the largest multiplier has a derivative by {name!r} on one side only: all multipliers are 0 here, and "
            f"beside it {best:.6g} of the change of the parameter", gait,
        )  # fmt: skip
    return best


def _multiplier_change(gait: Any, P: Matrix) -> tuple[Callable[[Matrix], float], float]:
    """What a change of P makes of the largest modulus, and that modulus; a change of P = 0 is itself the new P."""
    if not len(gait.stability_of.values):
        return lambda of: float(np.max(np.abs(np.linalg.eigvals(of)))), 0.0
    values, left, right = eig(P, left=True, right=True)  # type: ignore[misc]
    k = int(np.argmin(np.abs(values - gait.stability_of.values[0])))
    w, u, size = left[:, k], right[:, k], float(abs(values[k]))
    rivals = [z for j, z in enumerate(values) if j != k and abs(z - values[k].conj()) > MULTIPLIER_GAP * size]
    if abs(w.conj() @ u) < MULTIPLIER_GAP or any(abs(abs(z) - size) <= MULTIPLIER_GAP * size for z in rivals):
        raise GaitError(
            f"the largest multiplier has a derivative on one side only: two of modulus {size:.6g} meet here", gait
        )

    def change(of: Matrix) -> float:
        by = (w.conj() @ of @ u) / (w.conj() @ u)
        return float((values[k].conj() * by).real / size) if size else float(abs(by))

    return change, size


def _slope_beside(gait: Any, c: Vector, values: Mapping[str, float]) -> Matrix | str:
    """P beside the gait: exact, or by differences where no pass knows a run's derivative; or why there is none."""
    map_, chart, size = gait.map, gait.chart, gait.chart.size
    try:
        there = measured(map_, chart, c, values)
        if isinstance(there, Arrival):
            return f"it {map_.against(chart.section, there)}"
        if other := map_.other_events(gait.arrival, there.arrival):
            return f"it {other}"
        found = map_derivative(map_, chart, c, values, base=there)
    except SimulationError as error:
        return str(error)
    return f"it has no derivative: {next(iter(found.missing.values()))}" if found.missing else found.matrix[:size]
