"""What inverse kinematics finds, asked for by name."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.equations.equations import Equations
from mbd.errors import quoted
from mbd.forces.smoothing import smoothed
from mbd.laboratory.nearest_posture import Postures, Problem
from mbd.laboratory.quaternion_rates import make_continuous, quaternion_rates
from mbd.laboratory.splines import derivatives
from mbd.results.record import Record
from mbd.results.trajectory import Trajectory


class InverseKinematics:
    """The motion of a model that comes nearest to a recording.

    ``found["left knee.angle"]``, ``'left shank.end'``: all that a run tells of positions and their rates;
    `mbd.inverse_dynamics` takes it as its motion.

    Attributes
    ----------
    run : the motion as a run without forces; ``found.run.page("walk.html")`` shows it
    residual : by marker, the distance of the model's point from the measured one (R,) [m], NaN where it is missing
    standard_error : by coordinate (and by 'left hip.rotation.x' of joints that turn freely, axes of the child), the
        standard error (R,) that the residuals predict for equal and independent errors of all components [m, rad]; NaN
        of what no marker determines
    steps : Gauss–Newton steps of all frames
    notes : what was left out or not determined, a sentence each
    """

    def __init__(
        self, run: Trajectory, residual: dict[str, Vector], standard_error: dict[str, Vector], steps: int,
        notes: tuple[str, ...],
    ) -> None:  # fmt: skip
        self.run, self.residual, self.standard_error = run, residual, standard_error
        self.steps, self.notes = steps, notes

    @classmethod
    def of(
        cls, mechanism: Mechanism, parameters: Vector, time: Vector, found: Postures, problem: Problem,
        markers: Sequence[str], followed: Sequence[str], cutoff: float | None, notes: Sequence[str],
    ) -> InverseKinematics:  # fmt: skip
        """From the postures of all frames."""
        equations = mechanism.equations
        seen = problem.weight > 0.0
        residual = {}
        for k, name in enumerate(markers):
            own = slice(3 * k, 3 * k + 3)
            missing = ~seen[:, own].any(axis=1)
            away = np.where(seen[:, own], found.residual[:, own], 0.0)
            residual[name] = np.where(missing, np.nan, np.linalg.norm(away, axis=1))
        for k, name in enumerate(followed):
            at = 3 * len(markers) + k
            residual[name] = np.where(seen[:, at], np.abs(found.residual[:, at]), np.nan)
        # variance of one component of weight 1, over all frames
        freedoms = equations.n_v - problem.rows
        left = int(seen.sum()) - len(time) * freedoms
        squares = float(((problem.weight * np.where(seen, found.residual, 0.0)) ** 2).sum())
        variance = squares / left if left > 0 else np.nan
        errors = np.sqrt(np.maximum(found.spread, 0.0) * variance)
        errors[:, found.unseen] = np.nan
        names = error_names(equations)
        remarks = list(notes)
        if found.unseen.any():
            hidden = [name for name, free in zip(names, found.unseen, strict=True) if free]
            remarks.append(
                f"markers do not determine {quoted(hidden, 5)} in all frames; what is not determined stays as in the "
                "frame before"
            )
        if found.stopped.any():
            stops = [equations.contacts[k].name for k in stops_of(equations)]
            reached = [name for name, own in zip(stops, found.stopped.T, strict=True) if own.any()]
            remarks.append(f"stops reached: {quoted(reached, 5)}")
        if cutoff is not None:
            remarks.append(f"coordinates filtered at {cutoff:g} Hz before their rates were taken")
        q, v, a = _rates(equations, time, found.q, cutoff)
        run = _run(mechanism, parameters, time, q, v, a)
        return cls(run, residual, dict(zip(names, errors.T, strict=True)), found.steps, tuple(remarks))

    @property
    def time(self) -> Vector:
        """Times of the frames (R,) [s]."""
        return self.run.time

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.names)

    def __getitem__(self, name: str) -> Vector:
        return self.run[name]

    def __contains__(self, name: object) -> bool:
        return name in self.run

    @property
    def names(self) -> tuple[str, ...]:
        """Every named scalar of the motion."""
        return self.run.names

    @cached_property
    def rms(self) -> float:
        """Root mean square of all residuals of markers [m]."""
        every = np.concatenate(list(self.residual.values()))
        return float(np.sqrt(np.nanmean(every * every)))

    @property
    def worst(self) -> tuple[str, float, float]:
        """(marker, time [s], residual [m]) of the largest residual."""
        name = max(self.residual, key=lambda each: float(np.nanmax(self.residual[each], initial=0.0)))
        frame = int(np.nanargmax(self.residual[name]))
        return name, float(self.time[frame]), float(self.residual[name][frame])

    def to_sto(self, path: str | Path, names: Sequence[str] | None = None) -> Path:
        """Write coordinates (or other columns) as a storage file of OpenSim."""
        equations: Any = self.run.record.equations
        return self.run.to_sto(path, [c.name for c in equations.coordinates] if names is None else names)

    def __repr__(self) -> str:
        name, time, size = self.worst
        lines = [
            f"InverseKinematics of '{self.run.name}': {len(self.time)} frames, {len(self.residual)} markers",
            f"  residual {1e3 * self.rms:.3g} mm (rms), largest {1e3 * size:.3g} mm of {name!r} at {time:.4g} s",
        ]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def stops_of(equations: Equations) -> list[int]:
    """Numbers of the contacts that are stops of joints by rows; soft ones may be passed."""
    contacts = enumerate(equations.contacts)
    return [k for k, each in contacts if each.kind == "unilateral" and each.unit == "rad" and not each.is_velocity]


def error_names(equations: Equations) -> list[str]:
    """Names of increments: those of coordinates, and 'ball.rotation.x' of joints that turn freely."""
    found = []
    for place, speed in zip(equations.configuration.places, equations.velocity_names, strict=True):
        owner, _, axis = speed.rpartition(".")
        turned = f"{owner.removesuffix('.angular_velocity')}.rotation.{axis}"
        found.append(equations.coordinates[int(place)].name if place >= 0 else turned)
    return found


def _rates(equations: Equations, time: Vector, q: Matrix, cutoff: float | None) -> tuple[Matrix, Matrix, Matrix]:
    """Coordinates, filtered if asked for, with velocities and accelerations of splines through them."""
    whole = equations.configuration
    q = q.copy()
    for joint, first, _ in whole.charts:
        own = slice(first + joint.adding, first + joint.adding + 4)
        make_continuous(q[:, own].T, f"{joint.name}.orientation")
    if cutoff is not None:
        q = np.column_stack([smoothed(tuple(time), tuple(column), cutoff, False) for column in q.T])
        for joint, first, _ in whole.charts:
            own = slice(first + joint.adding, first + joint.adding + 4)
            q[:, own] /= np.linalg.norm(q[:, own], axis=1, keepdims=True)
    first_rates, second_rates = derivatives(time, q)
    v, a = np.zeros((len(time), whole.n_v)), np.zeros((len(time), whole.n_v))
    adding = whole.places >= 0
    v[:, adding], a[:, adding] = first_rates[:, whole.places[adding]], second_rates[:, whole.places[adding]]
    for joint, first_q, first_v in whole.charts:
        own = slice(first_q + joint.adding, first_q + joint.adding + 4)
        into = slice(first_v + joint.adding, first_v + joint.adding + 3)
        spins = quaternion_rates(q[:, own].T, first_rates[:, own].T, second_rates[:, own].T)
        v[:, into], a[:, into] = (each.T for each in spins)
    return q, v, a


def _run(mechanism: Mechanism, parameters: Vector, time: Vector, q: Matrix, v: Matrix, a: Matrix) -> Trajectory:
    equations, count = mechanism.equations, len(time)
    return Trajectory(
        Record(
            equations, parameters, [each.name for each in equations.parameters], time, q, v,
            np.zeros((count, equations.n_z)), a, np.zeros((count, equations.n_z)),
            np.zeros((count, len(equations.rows))), np.zeros((count, len(equations.contacts)), dtype=np.uint8),
            message="motion from markers", settings={"method": "inverse kinematics"},
            phase=np.zeros((count, len(equations.frictions)), dtype=np.int8),
        )
    )  # fmt: skip
