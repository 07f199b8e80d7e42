"""Where the arrays of a run stand: four shelves, each of which is made and copied at once.

A shelf holds the arrays of one kind that the next step depends on, or those that it does not; each array begins on a
cache line. Lengths follow from the sizes of a mechanism and of a run, so that runs alike share one plan.
"""

from collections.abc import Mapping
from functools import lru_cache
from itertools import accumulate
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.dataclass import dataclass
from mbd.kernel.records import TABLE, Kernel
from mbd.kernel.schemes.contract import MEMORY
from mbd.simulation.run.call_table import ARRAYS

CACHE_LINE_BYTES = 64
"""Length of a cache line [bytes]."""
NUMBER_BYTES = 8
"""Length of a number [bytes]."""
SHELVES: tuple[tuple[tuple[str, ...], Any], ...] = (
    (TABLE.kept_reals, np.float64),
    (TABLE.kept_integers, np.int64),
    (tuple(name for name in TABLE.real_arrays if name not in TABLE.kept_reals), np.float64),
    (tuple(name for name in TABLE.integer_arrays if name not in TABLE.kept_integers), np.int64),
)
"""Names on each shelf, and the kind of its numbers."""
_numbers = itemgetter(*TABLE.integers)


@dataclass(frozen=True, eq=False)
class Plan:
    """Places of arrays.

    lengths : of the shelves
    places : of arrays on their shelves, shelf by shelf
    shelf, offset : of the arrays in the order of the call table: number of the shelf, and bytes from its beginning;
        −1 and 0 of those that stand on none
    """

    lengths: tuple[int, ...]
    places: tuple[dict[str, slice], ...]
    shelf: NDArray[np.int64]
    offset: NDArray[np.int64]


def plan_of(kernel: Kernel, given: Mapping[str, int]) -> Plan:
    """The places of the arrays of a run, whose lengths are given or follow from its sizes."""
    known = {name: 0 for name in TABLE.integers} | vars(kernel)
    return _planned(_numbers(known), tuple(given.items()))


@lru_cache(maxsize=256)
def _planned(numbers: tuple[int, ...], given: tuple[tuple[str, int], ...]) -> Plan:
    asked = dict(given)
    lengths = TABLE.lengths(Kernel(**dict(zip(TABLE.integers, numbers, strict=True))), asked)
    wholes, places = list[int](), list[dict[str, slice]]()
    for names, _ in SHELVES:
        own = {name: max(lengths[name], 1) for name in names if name in lengths}
        lines = (
            -(CACHE_LINE_BYTES // NUMBER_BYTES) * (-length // (CACHE_LINE_BYTES // NUMBER_BYTES))
            for length in own.values()
        )
        *starts, whole = accumulate(lines, initial=0)
        exact = {name: asked.get(name, 0) if name in MEMORY else length for name, length in own.items()}
        places.append({name: slice(o, o + exact[name]) for name, o in zip(own, starts, strict=True)})
        wholes.append(whole)
    where = {name: (k, NUMBER_BYTES * place.start) for k, shelf in enumerate(places) for name, place in shelf.items()}
    shelf, offset = zip(*[where.get(name, (-1, 0)) for name in ARRAYS], strict=True)
    return Plan(tuple(wholes), tuple(places), np.array(shelf), np.array(offset))


class Shelves:
    """Room for the arrays of a run, all of it zero.

    Attributes
    ----------
    arrays : by name
    rooms : the shelves themselves
    known : of the arrays in the order of the call table: each, or None where it stands on no shelf; and its address
    """

    def __init__(self, plan: Plan) -> None:
        self.plan, self.rooms, self.arrays = plan, list[Any](), dict[str, Any]()
        bases = list[int]()
        for (_, kind), length, places in zip(SHELVES, plan.lengths, plan.places, strict=True):
            room = np.zeros(length + CACHE_LINE_BYTES // NUMBER_BYTES - 1, dtype=kind)  # numpy begins anywhere
            address: int = room.ctypes.data
            first = -address % CACHE_LINE_BYTES // NUMBER_BYTES
            shelf = room[first : first + length]
            bases.append(address + NUMBER_BYTES * first)
            self.rooms.append(shelf)
            self.arrays.update({name: shelf[place] for name, place in places.items()})
        bases.append(0)
        self.known = tuple(map(self.arrays.get, ARRAYS)), np.array(bases)[plan.shelf] + plan.offset

    def place_of(self, name: str) -> slice:
        """Where an array stands on its shelf."""
        return next(places[name] for places in self.plan.places if name in places)
