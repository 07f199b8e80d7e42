"""How far apart two runs of one motion are: events matched, coordinates compared at a bounded number of instants.

A run is compared where its rows are, which needs no interpolation on its side, and in the middles between them where
what it gives there is less accurate than its rows. The other run is read by the polynomials of `results.osculating`,
and by steps taken again where these are in doubt.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import INSTANT_RTOL
from mbd.results.columns import ModelColumns
from mbd.results.dense import Restepping
from mbd.results.driving import drives_of, share
from mbd.results.matching import Matches, apart, matched
from mbd.results.osculating import MAX_ERROR_RATIO, osculating
from mbd.results.polynomials import Places, quintic
from mbd.results.record import Record
from mbd.results.trajectory import Trajectory

CHECKED_MIDDLES = 32
"""Middles between rows at which it is compared, about, if what it gives there is in doubt [-]."""
LATE, MAX_PARTS = 0.9, 8
"""The last part of an interval at which forces of drives are compared, and how many parts there are at most [-].

Steps that are taken again err most near their ends; few long ones may hold a jerk that jumps anywhere.
"""
MAX_PLACES = 512
"""Places between rows at which they are compared, about [-]."""
MAX_DOUBT = 0.02
"""Doubt of an interpolated coordinate, over the accuracy that is asked for, from which steps are taken again [-]."""
MAX_DOUBTFUL_SHARE = 0.5
"""Share of the instants up to which those in doubt are left out, as the others tell the error too [-]."""


@dataclass(frozen=True)
class Gap:
    """Largest difference of a coordinate between two runs, which one, and the largest shift of an event [s].

    size : [m, rad], or in its own unit that of a result that was compared in the place of coordinates
    same : whether both runs have the same events
    moved : what coordinates alone differ by [m, rad], without the forces of drives (`mbd.results.driving`)
    """

    size: float
    name: str
    shift: float
    same: bool
    moved: float = 0.0


def gap(run: Trajectory, other: Trajectory, accuracy: float = 0.0, names: tuple[str, ...] = ()) -> Gap:
    """How far apart the coordinates of two runs are, away from their events; also at their ends.

    Where rows with explicit time prescribe a motion, the forces of drives over the forces of the motion count too.

    Parameters
    ----------
    run : read as its user reads it; other : the more accurate one
    accuracy : what matters [m, rad]: far smaller errors of interpolation do no harm
    names : of other results to compare in the place of the coordinates, at rows and in middles between them
    """
    begin, end = float(run.time[0]), min(float(run.time[-1]), float(other.time[-1]))
    pairs = matched(run.events, other.events, begin, end)
    shifted = pairs.pairs + pairs.late
    difference = np.zeros(run.record.q.shape[1])
    beside = INSTANT_RTOL * (end - begin)
    if names:
        return _named(run, other, names, pairs, end)
    rows, middles = _rows(run, end), _middles(run, end, accuracy)
    rows, middles = rows[apart(rows, shifted, beside)], middles[apart(middles, shifted, beside)]
    if len(rows):
        difference = _difference(run, other, rows, middles, accuracy)
    if not pairs.late:
        difference = np.maximum(difference, np.abs(run.record.q[-1] - other.record.q[-1]))
    worst = int(np.argmax(difference)) if difference.size else -1
    equations = run.record.equations
    known = [c.name for c in equations.coordinates] if equations is not None else []
    moved = float(difference[worst]) if worst >= 0 else 0.0
    found = Gap(
        moved, known[worst] if 0 <= worst < len(known) else "", max((abs(a - b) for a, b in shifted), default=0.0),
        pairs.alone == 0, moved,
    )  # fmt: skip
    if not drives_of(run) or not drives_of(other):
        return found
    lower, between = run._model_columns.grid.middles()
    inside = _inside_steps(run.time[lower], between.step)
    times = np.unique(np.concatenate([_rows(run, end)[:-1], inside[inside < end]]))
    size, name = share(run, other, times[apart(times, shifted, beside)])
    return replace(found, size=size, name=name) if size > moved else found


def _named(run: Trajectory, other: Trajectory, names: tuple[str, ...], pairs: Matches, end: float) -> Gap:
    """The same of named results."""
    shifted, beside = pairs.pairs + pairs.late, INSTANT_RTOL * (end - float(run.time[0]))
    times = np.concatenate([_rows(run, end)[:-1], _some_middles(run, end)])
    times = times[apart(times, shifted, beside)]
    both = (run._model_columns, other._model_columns)
    ours, theirs = (columns.at_places(names, columns.grid.places(times)) for columns in both)
    apart_by = {name: float(np.max(np.abs(a - b), initial=0.0)) for name, a, b in zip(names, ours, theirs, strict=True)}
    if not pairs.late:
        last = {name: abs(float(run[name][-1] - other[name][-1])) for name in names}
        apart_by = {name: max(size, last[name]) for name, size in apart_by.items()}
    worst = max(names, key=lambda name: apart_by[name])
    shift = max((abs(a - b) for a, b in shifted), default=0.0)
    return Gap(apart_by[worst], worst, shift, pairs.alone == 0)


def _rows(run: Trajectory, end: float) -> Vector:
    """Times of rows until the end, a bounded number of them."""
    count = int(np.searchsorted(run.time, end, side="right"))
    chosen = np.unique(np.linspace(0, count - 1, min(count, 64)).astype(np.intp))
    return np.append(run.time[chosen], end)


def _some_middles(run: Trajectory, end: float) -> Vector:
    """Times of middles between rows until the end, a bounded number of them."""
    _, between = run._model_columns.grid.middles()
    times = between.time[between.time < end]
    return times[:: len(times) // CHECKED_MIDDLES + 1]


def _inside_steps(begin: Vector, step: Vector) -> Vector:
    """Times within steps, more in longer ones, which err most: none as long as 1/`MAX_PLACES` of all is left out.

    Steps get places in proportion to their length, `MAX_PARTS` of them at most, and at least one if there are enough.
    A step with one place has it at its last part, the next such step at half of that.
    """
    if not len(step):
        return np.zeros(0)
    # places in each step
    parts = np.diff(np.floor(np.cumsum(step) / _spacing(step) + 0.5), prepend=0.0)
    parts = np.clip(parts, 2 * len(step) <= MAX_PLACES, MAX_PARTS).astype(np.intp)
    # where they are
    single = parts == 1
    theta = np.where(np.cumsum(single) % 2 == 1, LATE, 0.5 * LATE)
    times = [begin[single] + theta[single] * step[single]]
    for k in range(MAX_PARTS):
        some = (parts > k) & ~single
        times.append(begin[some] + LATE * (k + 1) / parts[some] * step[some])
    return np.concatenate(times)


def _spacing(step: Vector) -> float:
    """Distance of places in steps of which the longest have `MAX_PARTS`, so that about `MAX_PLACES` are there [s]."""
    full = MAX_PLACES // MAX_PARTS
    longest = np.sort(step)[::-1][:full]
    left = np.maximum(np.sum(step) - np.cumsum(longest) + longest, longest)
    spacing = left / (MAX_PLACES - MAX_PARTS * np.arange(len(longest)))
    fits = np.flatnonzero(longest <= MAX_PARTS * spacing)
    return float(spacing[fits[0]] if len(fits) else longest[-1] / MAX_PARTS)


def _middles(run: Trajectory, end: float, accuracy: float) -> Vector:
    """Middles between rows where what a run gives may be less accurate than its rows: the most doubtful ones."""
    columns, record = run._model_columns, run.record
    polynomials = record.extension.uses_accelerations and columns.equations.compose is None
    if not polynomials or Restepping.serves(columns):
        return np.zeros(0)
    _, places = columns.grid.middles()
    places = places.part(np.flatnonzero(places.time < end)[:: len(places.time) // CHECKED_MIDDLES + 1])
    doubt = _doubt(places, record, quintic(places, record.q, record.v, record.a))
    return places.time[doubt > MAX_DOUBT * accuracy]


def _difference(run: Trajectory, other: Trajectory, rows: Vector, middles: Vector, accuracy: float) -> Vector:
    """Largest difference of each coordinate at rows of a run, and at middles between them (n_q,)."""
    columns = run._model_columns
    ours, sure = _positions(columns, columns.grid.places(rows), accuracy)
    if len(middles):
        record = columns.record
        found = osculating(record.time, columns.grid.places(middles), (record.q, record.v, record.a))
        ours = np.concatenate([ours, found.values[0]])
        sure = np.append(sure, np.ones(len(middles), dtype=bool))
    columns = other._model_columns
    theirs, known = _positions(columns, columns.grid.places(np.append(rows, middles)), accuracy)
    return np.asarray(np.max(np.abs(ours - theirs)[sure & known], axis=0, initial=0.0))


def _doubt(places: Places, record: Record, q: Matrix) -> Vector:
    """How far the worst coordinate of quintic polynomials may be off (k,) [m, rad]."""
    return np.asarray(MAX_ERROR_RATIO * np.max(np.abs(q - places.blend(record.q, record.v)), axis=1, initial=0.0))


def _positions(columns: ModelColumns, places: Places, accuracy: float) -> tuple[Matrix, NDArray[np.bool_]]:
    """Coordinates at places (k, n_q), and where they are known well enough (k,)."""
    record, sure = columns.record, np.ones(len(places.time), dtype=bool)
    if columns.equations.compose is not None:
        return np.asarray(columns.between(places, forces=False).q), sure
    if not record.extension.uses_accelerations:
        return quintic(places, record.q, record.v, record.a), sure
    known = (record.q, record.v, record.a)
    q = quintic(places, *known)
    doubt = _doubt(places, record, q)
    poor = np.flatnonzero(doubt > MAX_DOUBT * accuracy)
    if not len(poor):
        return q, sure
    better = osculating(record.time, places.part(poor), known)
    q[poor], doubt[poor] = better.values[0], better.doubt
    again = poor[doubt[poor] > MAX_DOUBT * accuracy]
    sure[again] = False
    if len(again) > MAX_DOUBTFUL_SHARE * len(sure) and Restepping.serves(columns):
        again = again[np.argsort(-doubt[again], kind="stable")[:16]]
        q[again], sure[again] = columns.between(places.part(again), forces=False).q, True
    elif len(again) > MAX_DOUBTFUL_SHARE * len(sure):
        sure[again] = True  # the polynomials are what there is
    return q, sure
