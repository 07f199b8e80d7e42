"""What inverse dynamics finds, asked for by name."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equations.net_moments import effort_name, net_moments
from mbd.errors import UnknownNameError, nearest
from mbd.joints.base import Joint
from mbd.joints.free import Free
from mbd.joints.planar import Planar
from mbd.joints.translation import Translation
from mbd.laboratory.force_plate import ForcePlate
from mbd.laboratory.measured_gait import MeasuredGait, gait_of_dynamics
from mbd.results.names import scalars_behind
from mbd.results.tables import library
from mbd.results.trajectory import Trajectory


class InverseDynamics:
    """Moments, powers, reactions and residuals of a motion.

    ``found["left knee.moment"]`` [N m] is what acts on the child about the joint besides the model's own springs,
    losses and motors, positive along the coordinate, and ``'left knee.net_moment'`` all that acts along it but gravity
    and the ground, with these (the net moment of `mbd.gait_report`). Of a joint that slides it is ``'….force'`` [N], of
    one with several coordinates ``'ankle.plantar.moment'``, of a ball joint three components in axes of the child,
    ``'left hip.moment'`` (R, 3). ``'left knee.power'`` [W] is the power of the moment. ``'trunk.x.residual'`` is what a
    coordinate lacks that nothing drives; of a body that floats ``'trunk.residual_force'`` [N] and
    ``'trunk.residual_moment'`` [N m] are the same as vectors (R, 3) in ground axes, about the origin of the joint's
    frame. All other names are those of a run: ``'left knee.reaction_force'``, ``'left shank.end'``,
    ``'left knee.angle'``.

    Attributes
    ----------
    run : the motion as a run, with the multipliers found; ``found.run.page("walk.html")`` shows it
    driven, effort : (n_v,) which velocities are driven, and (R, n_v) what acts along them [N, N m]
    plates : the force plates that pushed
    notes : what was done where the answer is not unique, and with contacts, a sentence each
    """

    def __init__(
        self,
        run: Trajectory,
        joints: Sequence[tuple[Joint | None, str, tuple[int, ...]]],
        driven: NDArray[np.bool_],
        effort: Matrix,
        residual: Matrix,
        notes: tuple[str, ...] = (),
        plates: Sequence[ForcePlate] = (),
        friction: Matrix | None = None,
    ) -> None:
        self.run, self.notes, self.plates = run, notes, tuple(plates)
        self._joints, self.driven = joints, driven
        self.effort, self._residual = effort, residual
        self._friction = np.zeros_like(effort) if friction is None else friction

    @property
    def time(self) -> Vector:
        """Times of the frames (R,) [s]."""
        return self.run.time

    @cached_property
    def _own(self) -> dict[str, Vector]:
        """The columns that no run has."""
        found: dict[str, Vector] = {}
        equations: Any = self.run.record.equations
        units = equations.configuration.velocity_units
        v, net = self.run.record.v, self._net
        for joint, name, places in self._joints:
            if self.driven[places[0]]:
                for k in places:
                    kind = "moment" if units[k].startswith("rad") else "force"
                    for word, values in (kind, self.effort[:, k]), (f"net_{kind}", self.effort[:, k] + net[:, k]):
                        found[effort_name(equations.velocity_names[k], word)] = values
                        if len(places) == 1:
                            found[f"{name}.{word}"] = values
                power = sum((self.effort[:, k] * v[:, k] for k in places), np.zeros(len(v)))
                found[f"{name}.power"] = power
                continue
            for k in places:
                found[f"{equations.velocity_names[k].removesuffix('.rate')}.residual"] = self._residual[:, k]
            found |= self._wrench(joint, name, places)
        return found

    @property
    def _net(self) -> Matrix:
        """(R, n_v) what the model's own springs, losses, motors, stops and loops do along each coordinate."""
        equations: Any = self.run.record.equations
        ground = {contact.name for contact in equations.contacts} | {plate.name for plate in self.plates}
        nodes = net_moments(equations, ground)
        columns: Any = self.run.columns
        if not nodes:
            return np.zeros((len(self.time), 0))
        return np.column_stack(columns.evaluate(nodes, columns.rows)) + self._friction

    def _wrench(self, joint: Joint | None, name: str, places: tuple[int, ...]) -> dict[str, Vector]:
        """Residual force and moment of a joint that leaves its child free, in ground axes."""
        if not isinstance(joint, Free | Planar | Translation):
            return {}
        parts = self._residual[:, list(places)]
        force, moment = np.zeros((len(parts), 3)), np.zeros((len(parts), 3))
        if isinstance(joint, Free):
            equations: Any = self.run.record.equations
            at = [c.name for c in equations.coordinates].index(f"{name}.orientation.w")
            force, moment = parts[:, :3], _turned(self.run.record.q[:, at : at + 4], parts[:, 3:])
        elif isinstance(joint, Planar):
            force[:, :2], moment[:, 2] = parts[:, :2], parts[:, 2]
        else:
            force[:, ["xyz".index(axis) for axis in joint.axes]] = parts
        if joint.parent.rotation is not None:
            turn = np.array(joint.parent.rotation)
            force, moment = force @ turn.T, moment @ turn.T
        return {
            f"{name}.residual_{kind}.{axis}": values[:, k]
            for kind, values in (("force", force), ("moment", moment))
            for k, axis in enumerate("xyz")
        }

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.names)

    def __getitem__(self, name: str) -> Vector:
        """A named quantity at every frame: (R,), or (R, 3) for a vector."""
        parts = scalars_behind(name, self._own.__contains__) if isinstance(name, str) else ()
        if len(parts) > 1:
            return np.column_stack([self._own[part] for part in parts])
        if parts:
            return self._own[parts[0]]
        if isinstance(name, str) and name not in self.run:
            raise UnknownNameError(nearest(name, (*self._own, *self.run.names), "result", "There are"))
        return self.run[name]

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and (bool(scalars_behind(name, self._own.__contains__)) or name in self.run)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """Every named scalar, moments, powers and residuals first."""
        return (*self._own, *self.run.names)

    def to_dataframe(self, names: Sequence[str] | None = None) -> Any:
        """A pandas table with `time` as index; by default of moments, powers and residuals."""
        pandas = library("pandas", "data", "InverseDynamics.to_dataframe()")
        columns: dict[str, Vector] = {}
        for name in self._own if names is None else names:
            value = self[name]
            if value.ndim == 1:
                columns[name] = value
            else:
                columns |= {f"{name}.{axis}": value[:, k] for k, axis in enumerate("xyz")}
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))

    def to_sto(self, path: str | Path, names: Sequence[str] | None = None) -> Path:
        """Write columns as a storage file of OpenSim; by default moments, powers and residuals."""
        from mbd.results.opensim import write_storage

        table = self.to_dataframe(names)
        return write_storage(path, self.run.name, self.time, {name: table[name].to_numpy() for name in table}, False)

    def measured_gait(self) -> MeasuredGait:
        """Its strides and curves for `mbd.gait_report`, with the stances of its plates."""
        return gait_of_dynamics(self)

    def __repr__(self) -> str:
        driven = [name for _, name, places in self._joints if self.driven[places[0]]]
        lines = [f"InverseDynamics of '{self.run.name}': {len(self.time)} frames, {len(driven)} driven joints"]
        efforts = [name for name in self._own if name.endswith((".moment", ".force"))]
        largest = sorted(efforts, key=lambda name: -float(np.abs(self._own[name]).max(initial=0.0)))[:1]
        lines += [f"  largest: {name!r} {np.abs(self._own[name]).max():.3g}" for name in largest]
        floating = [name for _, name, _ in self._joints if f"{name}.residual_force.x" in self._own]
        for name in floating:
            force, moment = (np.linalg.norm(self[f"{name}.residual_{kind}"], axis=1) for kind in ("force", "moment"))
            lines.append(
                f"  residual of {name!r}: {_rms(force):.3g} N and {_rms(moment):.3g} N m (rms), largest "
                f"{force.max():.3g} N and {moment.max():.3g} N m"
            )
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def _turned(q: Matrix, vectors: Matrix) -> Matrix:
    """Vectors in axes of the child turned into those of the parent by quaternions."""
    w, x = q[:, :1], q[:, 1:]
    across = 2.0 * np.cross(x, vectors)
    return np.asarray(vectors + w * across + np.cross(x, across))


def _rms(values: Vector) -> float:
    return float(np.sqrt(np.mean(values * values)))
