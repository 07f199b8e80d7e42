"""How far a run is from another: events matched, quantities compared away from them, event times apart."""

from collections.abc import Mapping, Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.equal import INSTANT_RTOL, ROUND_OFF_RTOL
from mbd.results.matching import apart, matched
from mbd.results.trajectory import Trajectory


@dataclass(frozen=True)
class Difference:
    """What sets a run apart from a reference.

    Parameters
    ----------
    largest, at_end : by quantity, relative to its range: the largest over the instants, and at the end [-]
    event_time : largest shift of an event that both runs have [s]
    same_events : whether the same contacts and events happened, as often
    left_out : share of the instants that lie between an event and its match, where one run has switched and the other
        has not [-]
    """

    largest: Mapping[str, float]
    at_end: Mapping[str, float]
    event_time: float
    same_events: bool
    left_out: float

    @property
    def error(self) -> float:
        """The largest of all quantities and instants [-]."""
        return max([*self.largest.values(), *self.at_end.values()], default=0.0)


def ranges(run: Trajectory, names: Sequence[str], instants: Vector) -> dict[str, float]:
    """Largest less least value of each quantity, by which its error is divided; its size, or 1, where it rests.

    A coordinate or rate that rows hold at zero is round-off of the others: it rests, with their size.
    """
    facts, record, found = run.facts, run.record, {}
    whole = dict.fromkeys(facts.rates, float(np.max(np.abs(record.v), initial=0.0)))
    coordinates = [name for name, _ in facts.coordinates[: facts.coordinate_count]]
    whole |= dict.fromkeys(coordinates, float(np.max(np.abs(record.q), initial=0.0)))
    for name, values in run.at(instants).read(*names).items():
        known, largest = values[np.isfinite(values)], whole.get(name, 0.0)
        swing, size = float(np.ptp(known)) if known.size else 0.0, float(np.max(np.abs(known), initial=0.0))
        rests = not swing > max(1e-9 * size, ROUND_OFF_RTOL * largest)
        found[name] = (size if size > ROUND_OFF_RTOL * largest else largest) or 1.0 if rests else swing
    return found


def differences(run: Trajectory, reference: Trajectory, scales: Mapping[str, float], instants: Vector) -> Difference:
    """Compare a run with a reference at common instants; between its steps a run is what ``run.at`` gives.

    Instants between an event of one run and its match in the other are left out, where values differ by the whole jump
    whatever the scheme; the shift of the event is given by itself. `at_end` compares the last rows, which for runs that
    end by an event are those of two instants.
    """
    begin, end = float(reference.time[0]), min(float(run.time[-1]), float(reference.time[-1]))
    found = matched(run.events, reference.events, begin, end)
    pairs = found.pairs + found.late
    inside = instants[instants <= end]
    keep = apart(inside, pairs, INSTANT_RTOL * (end - begin))
    compared = gaps(run, reference, scales, inside[keep], inside[keep]) if keep.any() else {}
    ends = {} if found.late else gaps(run, reference, scales, run.time[-1:], reference.time[-1:])
    return Difference(
        {name: float(np.nanmax(gap, initial=0.0)) for name, gap in compared.items()},
        {name: float(gap[0]) for name, gap in ends.items() if not np.isnan(gap[0])},
        max((abs(a - b) for a, b in pairs), default=0.0),
        found.alone == 0,
        1.0 - float(np.mean(keep)) if len(keep) else 1.0,
    )


def gaps(
    run: Trajectory, reference: Trajectory, scales: Mapping[str, float], ours: Vector, theirs: Vector
) -> dict[str, Vector]:
    """|difference| over range of each quantity: NaN where neither run has a number, infinite where only one has."""
    first, second = run.at(ours).read(*scales), reference.at(theirs).read(*scales)
    alone = {name: np.isnan(first[name]) != np.isnan(second[name]) for name in scales}
    return {
        name: np.where(alone[name], np.inf, np.abs(first[name] - second[name]) / scale)
        for name, scale in scales.items()
    }
