"""Derivatives of results at every row of a run, and between the rows, instants of events among them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.motion import Mode, Motion, Rates
from mbd.sensitivity.outputs import with_sliding
from mbd.sensitivity.passed import Passed
from mbd.sensitivity.passing import tangent_run
from mbd.sensitivity.programs import Programs
from mbd.sensitivity.run_data import RunRows, refused
from mbd.sensitivity.starts import directions, programs_of, restitutions_of, start_tangent


@dataclass(frozen=True)
class Along:
    """Derivatives of some results along a run.

    times (k,), values (k, results) : of the rows; slopes (k, results, D) : derivatives of the numbers of the rows;
    shifts (k, D) : of their instants, which move with the events before them; starts : times after which the motion is
    smooth until the next; pieces (k,) : in which of these smooth parts each row is; walked : the pass
    """

    times: Vector
    values: Matrix
    slopes: NDArray[np.float64]
    shifts: Matrix
    starts: Vector
    pieces: NDArray[np.intp]
    walked: Passed

    def at(self, times: Vector) -> NDArray[np.float64]:
        """Derivatives at fixed times (len(times), results, D).

        At a row whose instant moves by δt they are δY − Ẏ δt, with Ẏ of a cubic spline through the rows of a smooth
        part of the motion; between the rows they lie on cubic splines too.
        """
        out = np.zeros((len(times), *self.slopes.shape[1:]))
        piece = np.searchsorted(self.starts, times, side="right")
        for number in np.unique(piece):
            rows = np.flatnonzero(self.pieces == number)
            out[piece == number] = self._smooth(rows, times[piece == number])
        return out

    def _smooth(self, rows: NDArray[np.intp], times: Vector) -> NDArray[np.float64]:
        """Derivatives at times within one smooth part of the motion, which has these rows."""
        from scipy.interpolate import make_interp_spline

        degree = min(3, len(rows) - 1)
        if degree < 1:
            return np.repeat(self.slopes[rows[:1]], len(times), axis=0)
        rate = make_interp_spline(self.times[rows], self.values[rows], k=degree).derivative()(self.times[rows])
        fixed = self.slopes[rows] - rate[:, :, None] * self.shifts[rows][:, None, :]
        return np.asarray(make_interp_spline(self.times[rows], fixed, k=degree)(times))

    def of_instant(self, name: str, time: float) -> Vector:
        """Derivatives (D,) of the instant of an event that happened at this time.

        Raises
        ------
        CapabilityError
            where another event at the same instant made it happen.
        """
        for each in self.walked.instants:
            if each.name == name and each.time == time and not np.any(np.isnan(each.of_time)):
                return each.of_time
        raise refused(f"{name!r} happened at t = {time:.9g} s because of another event there")


def along(run: Trajectory, wrt: Sequence[Any], names: Sequence[str], held: Collection[str] = ()) -> Along:
    """The pass over a run with fixed steps, and the derivatives of results at its rows.

    Raises
    ------
    CapabilityError, UnknownNameError
        see `mbd.sensitivities`.
    """
    rows = RunRows(run)
    wanted = directions(rows.mechanism, wrt)
    programs = programs_of(rows.mechanism, wanted, rows.record.parameters)
    seen, slopes, shifts = list[int](), list[Matrix](), list[Vector]()

    def visit(row: int, motion: Motion, mode: Mode, rates: Rates) -> None:
        seen.append(row)
        shifts.append(motion.tangent.t)
        slopes.append(_slopes(programs, motion, mode, rates, names))

    start, restitutions = start_tangent(rows.first, programs, wanted, held), restitutions_of(wanted)
    walked = tangent_run(rows, programs, start, restitutions, visit)
    values = np.array([run[name][seen] for name in names]).reshape(len(names), len(seen)).T
    shape = (len(seen), len(names), len(wanted))
    begins = np.concatenate([[False], np.diff(run.time) == 0.0])  # the second row of an instant begins a new part
    pieces = np.cumsum(begins)[seen]
    slopes_at_rows = np.array(slopes).reshape(shape)
    return Along(run.time[seen], values, slopes_at_rows, np.array(shifts), run.time[begins], pieces, walked)


def _slopes(programs: Programs, motion: Motion, mode: Mode, rates: Rates, names: Sequence[str]) -> Matrix:
    """Derivatives of results at one row (results, D)."""
    full = with_sliding(programs, motion, mode, rates)
    at = motion.at(mode, full.rate, full.lam)
    at.lam = full.lam
    stacked = motion.tangent.stacked(programs.columns, full.of_rate, full.of_lam)
    return programs.results(names, at)[1] @ stacked
