"""Values between rows by polynomials through the rows around, with all the derivatives that rows hold.

Between the rows i and i + 1 the polynomial P of degree 8 goes through value, rate and its change of three rows, i − 1
to i + 1 or i to i + 2; where both exist it is their mean, in which the leading errors cancel. Within the interval its
error is 1.5·10⁻⁷ (ω h)⁹ of an oscillation, where that of the quintic Q through the two rows is 2.2·10⁻⁵ (ω h)⁶ and that
of the cubic C of their values and rates 2.6·10⁻³ (ω h)⁴ (Davis 1975, Interpolation and Approximation, 3.1).

Rows beyond a kink, as of a contact force, must not count: where P does not differ from Q less than Q does from C, and
its two sides from each other still less, the side nearer to Q is taken, or Q itself.
"""

from collections.abc import Sequence
from math import perm

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.results.polynomials import CHUNK, Index, Places
from mbd.results.quadrature import stretches

MAX_SIDE_RATIO = 0.25
"""Difference of the two sides, over that from the quintic, below which they see the same motion [-]."""
MAX_ERROR_RATIO = 0.05
"""Error of a polynomial over its difference from the one below, up to ω h = 2 [-]."""
SHORT_STEP_RATIO = 120.0
"""Difference of C and Q over that of Q and P, times (ω h)² [-]."""


@dataclass(frozen=True, eq=False)
class Osculation:
    """Values with their derivatives at places, one (k, n) each, and how far the worst value may be off (k,)."""

    values: tuple[Matrix, ...]
    doubt: Vector


def osculating(time: Vector, places: Places, known: Sequence[Matrix]) -> Osculation:
    """Values at places and as many derivatives as rows hold.

    Parameters
    ----------
    time : (R,) of the rows [s], equal at the two sides of a switch
    places : (k,) where to look
    known : values at the rows (R, n), their rates, and possibly the changes of these
    """
    inside = np.flatnonzero(places.step > 0.0)
    values = tuple(np.array(part[places.lower], dtype=float) for part in known)
    doubt = np.zeros(len(places.time))
    if not len(inside) or not values[0].size:
        return Osculation(values, doubt)
    interval = np.flatnonzero(np.diff(time) > 0.0)
    bounds = stretches(time)
    asked = np.unique(places.lower[inside])
    for part in np.array_split(asked, -(-len(asked) // CHUNK)):
        mine = inside[(places.lower[inside] >= part[0]) & (places.lower[inside] <= part[-1])]
        at = np.searchsorted(interval, part)
        chosen, errors = _chosen(time, part, (bounds[0][at], bounds[1][at]), known)
        which, theta = np.searchsorted(part, places.lower[mine]), places.theta[mine]
        for number, found in enumerate(values):
            found[mine] = _evaluated(chosen, which, theta, places.step[mine], number)
        values[0][mine] += known[0][places.lower[mine]]
        doubt[mine] = (4.0 * theta * (1.0 - theta)) ** 2 * errors[which]
    return Osculation(values, doubt)


def _chosen(
    time: Vector, lower: Index, bounds: tuple[Index, Index], known: Sequence[Matrix]
) -> tuple[Matrix, Vector]:  # fmt: skip
    """Coefficients for each interval, and how far the worst value may be off in its middle (k,)."""
    degree, step = 3 * len(known), time[lower + 1] - time[lower]
    middle, poorer = _halfway(known, lower, step), _halfway(known[:-1], lower, step)
    rough = np.max(np.abs(middle - poorer), axis=1)
    scale = np.sum(np.abs(middle - poorer), axis=1)
    sides, apart = [], []
    for shift in (-1, 0):
        begin = lower + shift
        there = (begin >= bounds[0]) & (begin + 2 <= bounds[1])
        side = np.full((len(lower), degree, middle.shape[1]), np.nan)
        if there.any():
            side[there] = _coefficients(time, begin[there], lower[there], 3, step[there], known)
        sides.append(side)
        apart.append(np.where(there, np.sum(np.abs(_middle(side) - middle), axis=1), np.inf))
    left, right = apart
    use = np.where(left <= right, 0, 1)
    nearest = np.minimum(left, right)
    fine = nearest <= scale
    both = np.isfinite(left) & np.isfinite(right)
    with np.errstate(invalid="ignore"):
        differ = np.sum(np.abs(_middle(sides[0]) - _middle(sides[1])), axis=1)
        both &= differ <= MAX_SIDE_RATIO * np.minimum(left, right)
    chosen = np.zeros((len(lower), degree, middle.shape[1]))
    if not fine.all():
        rest = _coefficients(time, lower[~fine], lower[~fine], 2, step[~fine], known)
        chosen[~fine, : rest.shape[1]] = rest
    for number, side in enumerate(sides):
        mine = fine & ~both & (use == number)
        chosen[mine] = side[mine]
    chosen[fine & both] = 0.5 * (sides[0] + sides[1])[fine & both]
    gained = np.max(np.abs(_middle(chosen) - middle), axis=1)
    turned = SHORT_STEP_RATIO * np.divide(gained, rough, out=np.ones_like(rough), where=rough > 0.0)  # (ω h)²
    errors = MAX_ERROR_RATIO * np.where(fine, gained * np.minimum((turned / 4.0) ** 1.5, 1.0), rough)
    beside = np.pad(errors, 1, mode="edge")  # where the difference passes zero its neighbours tell
    return chosen, np.maximum(errors, np.maximum(beside[:-2], beside[2:]))


def _coefficients(
    time: Vector, begin: Index, lower: Index, count: int, step: Vector, known: Sequence[Matrix]
) -> Matrix:
    """Of the powers of ϑ = (t − t_lower)/h, (k, count·D, n), less the value at `lower`; rows begin, begin + 1, …."""
    rows = begin[:, None] + np.arange(count)
    place = (time[rows] - time[lower, None]) / step[:, None]
    power = np.arange(count * len(known))
    blocks, right = [], []
    for number, part in enumerate(known):
        factor = np.array([float(perm(p, number)) for p in power])
        blocks.append(factor * place[:, :, None] ** np.maximum(power - number, 0))
        column = part[rows] - (part[lower, None] if number == 0 else 0.0)
        right.append(column * step[:, None, None] ** number)
    found: Matrix = np.linalg.solve(np.concatenate(blocks, axis=1), np.concatenate(right, axis=1))
    return found


def _halfway(known: Sequence[Matrix], lower: Index, step: Vector) -> Matrix:
    """In the middle, less the value at `lower`, the polynomial through the two rows with as many derivatives (k, n)."""
    first, last, h = lower, lower + 1, step[:, None]
    found = 0.5 * (known[0][last] - known[0][first])
    if len(known) > 1:
        found += (h / 8.0 if len(known) == 2 else 5.0 * h / 32.0) * (known[1][first] - known[1][last])
    if len(known) > 2:
        found += h * h / 64.0 * (known[2][first] + known[2][last])
    return np.asarray(found)


def _middle(coefficients: Matrix) -> Matrix:
    """The polynomial at ϑ = ½."""
    return np.asarray(np.tensordot(0.5 ** np.arange(coefficients.shape[1]), coefficients, (0, 1)))


def _evaluated(coefficients: Matrix, which: Index, theta: Vector, step: Vector, number: int) -> Matrix:
    """A derivative of the polynomials of the intervals `which` at their fractions theta."""
    total = np.zeros((len(theta), coefficients.shape[2]))
    for power in range(coefficients.shape[1] - 1, number - 1, -1):
        total = total * theta[:, None] + perm(power, number) * coefficients[which, power]
    return np.asarray(total / step[:, None] ** number)
