"""How much a foot still pushes, and grips: the least margins over a cycle, and where along a branch they vanish.

A foot that its rule holds until the other one touches down would have to pull where its normal force p is negative; one
that sticks would need more friction than μ where ``μ p − |T| < 0``. Neither changes the events of the walk, so that the
branch goes on; the least value over the cycle is a smooth test function.
"""

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import BRACKET_RTOL
from mbd.errors import GaitError, MbdError
from mbd.gait.continuation import BranchPoint, Continuation, Corrected
from mbd.gait.return_map import ReturnMap, Values
from mbd.gait.special_points import SpecialPoint, zero_between
from mbd.state import State

NEIGHBOUR_ROWS = 3
"""Rows on each side of the smallest one through which a polynomial goes."""

Margins = Mapping[tuple[str, str], float]
"""Least values [N] by kind ('pull' or 'slip') and foot, in the names of a walk without exchange of sides."""


@dataclass(frozen=True)
class Margin:
    """A margin of a foot: p, or μ p − |T| of its rows, while it is closed."""

    kind: str
    contact: str
    place: int
    normal: int
    tangents: tuple[int, ...]
    friction: float

    def of(self, lam: Matrix) -> Vector:
        """The margin at rows of multipliers (R, n_rows) [N]."""
        push = -lam[:, self.normal]
        if self.kind == "pull":
            return push
        return np.asarray(self.friction * push - np.linalg.norm(lam[:, list(self.tangents)], axis=1))


def watched_feet(map_: ReturnMap, friction: float | None) -> list[Margin]:
    """The margins of the feet that rules hold, and of those that stick if a coefficient of friction is given."""
    found: list[Margin] = []
    rows = map_.mechanism.equations.rows
    for place, contact in enumerate(map_.manager.contacts):
        if contact.kind != "unilateral" or contact.name not in map_.feet:
            continue
        normal, *tangents = contact.rows
        if contact.opens_on == "when" and not contact.may_pull:
            found.append(Margin("pull", contact.name, place, normal, (), 0.0))
        if friction is not None and tangents and all(rows[row].friction < 0 for row in tangents):
            found.append(Margin("slip", contact.name, place, normal, tuple(tangents), friction))
    return found


def least_margins(map_: ReturnMap, watched: list[Margin], state: State, values: Values, exact: bool) -> Margins:
    """The least margins over one application of the map.

    exact : from runs to the instants of the least values, in the place of polynomials through rows
    """
    found: dict[tuple[str, str], float] = {}
    for number in range(map_.strides if watched else 0):
        odd = map_.mirror is not None and number % 2 == 1
        table = map_.rows(state, values)
        for margin in watched:
            for value, when in _minima(map_, margin, table):
                least = value if when is None or not exact else _exactly(map_, margin, state, values, when)
                name = map_.mirror.name(margin.contact) if odd and map_.mirror is not None else margin.contact
                key = margin.kind, name
                found[key] = min(found.get(key, np.inf), least)
        if number + 1 < map_.strides:
            state = map_.each([(state, values)], strides=1)[0].state
    return found


def _minima(map_: ReturnMap, margin: Margin, table: Matrix) -> Iterator[tuple[float, float | None]]:
    """The least value between two events, with its instant where it lies between rows."""
    layout = map_.mechanism.layout
    at = 1 + layout.n_q + 2 * layout.n
    time, lam = table[:, 0], table[:, at : at + layout.n_rows]
    closed = table[:, at + layout.n_rows + margin.place] != 0.0
    values = margin.of(lam)
    cuts = [0, *(np.flatnonzero((np.diff(time) <= 0.0) | (closed[1:] != closed[:-1])) + 1), len(time)]
    for start, stop in pairwise(cuts):
        if closed[start] and stop > start + 1:  # the last row is the first of the next return
            yield _least(time[start:stop], values[start:stop])


def _least(time: Vector, values: Vector) -> tuple[float, float | None]:
    """The least value of a smooth curve through points, and its instant; None at an end."""
    k = int(np.argmin(values))
    if k in (0, len(values) - 1) or len(values) < 2 * NEIGHBOUR_ROWS + 1:
        return float(values[k]), None
    first = min(max(k - NEIGHBOUR_ROWS, 0), len(values) - 2 * NEIGHBOUR_ROWS - 1)
    picked = slice(first, first + 2 * NEIGHBOUR_ROWS + 1)
    width = time[k + 1] - time[k - 1]
    polynomial = np.polynomial.Polynomial.fit((time[picked] - time[k]) / width, values[picked], 2 * NEIGHBOUR_ROWS)
    roots = polynomial.deriv().roots()
    near = roots[np.abs(roots.imag) < 1e-9].real
    near = near[np.abs(near) <= 1.0]
    if not len(near):
        return float(values[k]), None
    place = float(near[np.argmin(polynomial(near))])
    return float(polynomial(place)), float(time[k] + width * place)


def _exactly(map_: ReturnMap, margin: Margin, state: State, values: Values, when: float) -> float:
    """The margin at an instant, at which a run ends."""
    layout = map_.mechanism.layout
    at = 1 + layout.n_q + 2 * layout.n
    last = map_.with_step(map_.dt, when).rows(state, values)[-1:]
    return float(margin.of(last[:, at : at + layout.n_rows])[0])


def margin_points(
    given: Continuation, watched: list[Margin], ends: tuple[BranchPoint, BranchPoint], margins: tuple[Margins, Margins],
    ds: float,
) -> list[SpecialPoint]:  # fmt: skip
    """The points between two gaits of a branch at which a margin vanishes; `margins` are those of the two."""
    found = []
    for key in margins[0].keys() & margins[1].keys():
        before, after = margins[0][key], margins[1][key]
        if before * after < 0.0:
            located = _located(given, watched, ends[0], key, (before, after, ds))
            found += [] if located is None else [located]
    return found


def _located(
    given: Continuation, watched: list[Margin], one: BranchPoint, key: tuple[str, str],
    bracket: tuple[float, float, float],
) -> SpecialPoint | None:  # fmt: skip
    """The zero of a margin between its values at 0 and ds along the tangent, by Brent's method; None where it is lost.

    Its error is the width of the bracket, what is left of the gait's equations, and what half the step changes.
    """
    before, after, ds = bracket
    try:
        place, _ = zero_between(lambda place: margin_at(given, watched, one, key, place)[0], bracket, BRACKET_RTOL)
        here, corrected = margin_at(given, watched, one, key, place)
        point = given.point(corrected, given.whole(one))
        finer, corrected_finer = margin_at(given.with_half_steps(), watched, one, key, place)
    except MbdError:
        return None
    moves = given.width * abs(ds / (after - before))  # of the parameter, for a margin that differs by 1 N
    error = given.width * BRACKET_RTOL + moves * (abs(here) + abs(finer - here))
    error += abs(corrected_finer.value - corrected.value) + corrected.left + corrected_finer.left
    return SpecialPoint(key[0], point.value, point, error, key[1])


def margin_at(
    given: Continuation, watched: list[Margin], one: BranchPoint, key: tuple[str, str], place: float
) -> tuple[float, Corrected]:  # fmt: skip
    """The margin at a place along the tangent, and the gait there.

    Raises
    ------
    MbdError
        where there is no gait, or none that has this margin.
    """
    corrected = given.corrected(one, one.tangent, place)
    if not isinstance(corrected, Corrected):
        raise GaitError(str(corrected))
    values = given.with_value(corrected.value)
    margins = least_margins(given.map, watched, corrected.state, values, exact=True)
    if not np.isfinite(margins.get(key, np.nan)):
        raise GaitError(f"{key[1]!r} does not stand there")
    return margins[key], corrected
