"""Directions in which contacts slide in planes in space, where these are not those of γ (`mbd.kernel.cones`).

They are held while a scheme starts: its difference of accelerations is of forces along the γ of the state itself. Where
sliding begins, γ is zero or slow at first: forces begin along the direction e in which they pulled before, or along the
γ of the row before, and follow γ as it grows, ``λ_T ∥ γ + s (2 − ‖s‖²)²``, s = 10⁻⁷ e.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.equations.equations import Equations
from mbd.kernel.cones import HELD, LEAST, MOVING, ONSET
from mbd.kernel.contact_modes import STILL
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.programs import Programs, paired
from mbd.sensitivity.run_data import unknown

__all__ = ["HELD", "ONSET", "Way", "along_ways", "first_of_pair", "pull_of", "slow_ways", "with_held_directions"]


@dataclass(frozen=True)
class Way:
    """A direction (2,) in a plane, with its derivatives (2, D)."""

    e: Vector
    of_e: Matrix

    @classmethod
    def of(cls, vector: Vector, change: Matrix) -> Way:
        """That of a vector (2,)."""
        size = float(np.hypot(*vector))
        e = vector / size
        return cls(e, (change - np.outer(e, e @ change)) / size)


def first_of_pair(equations: Equations, f: int) -> int:
    """The first of the two directions of a friction."""
    partner = equations.frictions[f].partner
    return min(f, partner) if partner >= 0 else f


def pairs_that_slide(equations: Equations, mode: Mode) -> list[tuple[int, int]]:
    """Both directions of each friction that slides in a plane, whose force follows γ."""
    found = [(f, equations.frictions[f].partner) for f in paired(equations) if mode.slip[f] == 1.0]
    return [(f, p) for f, p in found if f < p]


def speeds_of(programs: Programs, motion: Motion, mode: Mode, rates: Rates) -> tuple[Vector, Matrix, Vector]:
    """γ of all frictions, its derivatives (F, D), and γ̇."""
    equations = programs.equations
    first = 2 * len(equations.contacts) + len(equations.guards)
    here = slice(first, first + len(equations.frictions))
    values, slopes = programs.watched(motion.at(mode, rates.rate, rates.lam))
    Z = motion.tangent.stacked(programs.columns, rates.of_rate, rates.of_lam)
    c, flow = programs.columns, np.zeros(programs.columns.count)
    flow[c.x], flow[c.y], flow[c.t] = motion.y[: c.n_v], rates.rate, 1.0
    return values[here], slopes[here] @ Z, slopes[here] @ flow


def slow_ways(programs: Programs, motion: Motion, mode: Mode, rates: Rates, known: Mapping[int, Way]) -> dict[int, Way]:
    """Directions of the frictions that slide too slowly to follow γ, by the number of the first of two.

    known : directions of pulls, or of rows before

    Raises
    ------
    CapabilityError
        where γ is round-off, and nothing is known.
    """
    found: dict[int, Way] = {}
    pairs = pairs_that_slide(programs.equations, mode)
    if not pairs:
        return found
    speeds, changes, growth = speeds_of(programs, motion, mode, rates)
    for pair in pairs:
        own = list(pair)
        speed = float(np.hypot(*speeds[own]))
        if speed >= MOVING or (speed > STILL and speeds[own] @ growth[own] <= 0.0):
            continue
        if speed >= MOVING * ONSET:
            found[pair[0]] = Way.of(speeds[own], changes[own])
        elif pair[0] in known:
            found[pair[0]] = known[pair[0]]
        else:
            raise unknown(
                f"{programs.equations.frictions[pair[0]].name!r} begins to slide at t = {motion.t:.9g} s, in a "
                "direction that the pass does not know"
            )
    return found


def along_ways(
    programs: Programs, motion: Motion, mode: Mode, ways: Mapping[int, Way], hold: float
) -> tuple[Mode, Motion]:
    """The mode and the motion in which these frictions slide along these directions, held so much."""
    if not ways:
        return mode, replace(motion, tangent=replace(motion.tangent, slips=None))
    pairs, frictions = paired(programs.equations), programs.equations.frictions
    slip, slips = mode.slip.copy(), np.zeros((len(pairs), len(motion.tangent.t)))
    for f, way in ways.items():
        for k, cosine, change in zip((f, frictions[f].partner), way.e, way.of_e, strict=True):
            slip[k] = hold * (cosine if abs(cosine) > LEAST else LEAST)
            slips[pairs.index(k)] = hold * change
    return replace(mode, slip=slip), motion.with_tangent(slips=slips)


def with_held_directions(programs: Programs, motion: Motion, mode: Mode, rates: Rates) -> tuple[Mode, Motion]:
    """The mode and the motion with λ_T along the γ of the motion, whatever it becomes; what is held stays held."""
    pairs = pairs_that_slide(programs.equations, mode)
    if not pairs:
        return mode, motion
    speeds, changes, _ = speeds_of(programs, motion, mode, rates)
    ways = {pair[0]: Way.of(speeds[list(pair)], changes[list(pair)]) for pair in pairs}
    held, moved = along_ways(programs, motion, mode, ways, HELD)
    if motion.tangent.slips is not None and moved.tangent.slips is not None:
        moved = moved.with_tangent(slips=moved.tangent.slips + motion.tangent.slips)
    return held, moved


def pull_of(programs: Programs, rates: Rates, f: int) -> Way:
    """The direction of the force of friction f while it sticks."""
    own = [programs.equations.frictions[k].row for k in (f, programs.equations.frictions[f].partner)]
    return Way.of(rates.lam[own], rates.of_lam[own])
