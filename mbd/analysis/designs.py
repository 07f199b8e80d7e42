"""Points in a box of parameters for `mbd.sweep`: Latin hypercubes and Sobol sequences.

Both spread points better than independent draws: a Latin hypercube has one point in each of n slices of every parameter
(McKay, Beckman & Conover, Technometrics 21, 1979); a Sobol sequence fills boxes evenly in all parameters together, best
where n is a power of two (Sobol 1967; scrambled as in Owen, J. Complexity 14, 1998). `scipy.stats.qmc` makes them.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbd.bodies.values import is_number, shown
from mbd.errors import ModelError

Design = dict[tuple[str, ...], list[tuple[float, ...]]]
"""Names that change together, and their values in each run."""


def latin_hypercube(ranges: Mapping[str, tuple[float, float]], count: int, seed: int = 0) -> Design:
    """Values for `mbd.sweep`: a Latin hypercube in the ranges of some parameters.

    Parameters
    ----------
    ranges : lowest and highest value by name, ``{"hip.mass": (8.0, 12.0), "left leg.mass": (4.0, 6.0)}``
    count : of points
    seed : the same seed gives the same points

    Returns
    -------
    dict
        ``{names: [values of a run, …]}``, to be given to `mbd.sweep` as it is, alone or beside others.

    Raises
    ------
    ModelError
        for ranges that are none, and a count or seed that is no whole number.

    >>> import mbd
    >>> [(names, values)] = mbd.latin_hypercube({"rod.mass": (1.0, 2.0), "rod.length": (0.5, 0.6)}, 4).items()
    >>> names, sorted(int(4.0 * (mass - 1.0)) for mass, _ in values)
    (('rod.mass', 'rod.length'), [0, 1, 2, 3])
    """
    return _spread("LatinHypercube", ranges, count, seed)


def sobol(ranges: Mapping[str, tuple[float, float]], count: int, seed: int = 0) -> Design:
    """Values for `mbd.sweep`: the first points of a scrambled Sobol sequence in the ranges of some parameters.

    Parameters, what comes and what is raised are those of `latin_hypercube`; a count that is a power of two fills the
    ranges evenly.

    >>> import mbd
    >>> [(names, values)] = mbd.sobol({"rod.mass": (1.0, 2.0)}, 8).items()
    >>> sorted(int(8.0 * (mass - 1.0)) for mass, in values)
    [0, 1, 2, 3, 4, 5, 6, 7]
    """
    return _spread("Sobol", ranges, count, seed)


def _spread(kind: str, ranges: Any, count: Any, seed: Any) -> Design:
    _check(ranges, count, seed)
    from scipy.stats import qmc

    low, high = np.array(list(ranges.values()), dtype=float).T
    sampler = getattr(qmc, kind)(d=len(ranges), seed=seed)
    if kind == "Sobol":  # random() warns of counts that are no powers of two
        points = sampler.random_base2(math.ceil(math.log2(count)))[:count]
    else:
        points = sampler.random(count)
    return {tuple(ranges): [tuple(map(float, point)) for point in low + (high - low) * points]}


def _check(ranges: Any, count: Any, seed: Any) -> None:
    """Every fault of a design at once."""
    faults = []
    if not isinstance(ranges, Mapping) or not ranges or not all(isinstance(name, str) for name in ranges):
        faults.append(
            f"ranges must map names to a lowest and a highest value, {{'rod.mass': (1.0, 2.0)}}, not {shown(ranges)}"
        )
        ranges = {}
    for name, pair in ranges.items():
        numbers = isinstance(pair, tuple | list) and len(pair) == 2 and all(map(is_number, pair))
        if not numbers or not all(map(math.isfinite, pair)) or not pair[0] < pair[1]:
            faults.append(f"the range of {name!r} must be two numbers, the lower one first, not {shown(pair)}")
    for title, value, least in (("count", count, 1), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value < 2**31:
            faults.append(f"{title} of a design must be a whole number from {least} on, not {shown(value)}")
    if faults:
        raise ModelError(faults)
