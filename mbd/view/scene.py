"""The geometry of a run for drawing: points over time, the ground they touch, gravity down the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.results.names import AXES

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["Ground", "Instants", "Push", "Scene", "Touch", "scene"]

FIT = 1e-6
"""A plane whose distance reproduces a gap this well is the ground of that contact [m]."""


@dataclass(frozen=True, eq=False)
class Instants:
    """Times to draw, a switch with both its sides: time (F,) [s], after (F,) True on the right side."""

    time: Vector
    after: NDArray[np.bool_]

    @classmethod
    def of(cls, run: Trajectory, count: int) -> Instants:
        """`count` equal intervals of the run, and both sides of every event."""
        time = run.time
        inner = [event.time for event in run.events if time[0] < event.time <= time[-1]]
        even = np.linspace(time[0], time[-1], count + 1) if time[-1] > time[0] else time[:1]
        events = np.unique(inner)
        both = np.concatenate([even[~np.isin(even, events)], events, events])
        after = np.ones(len(both), dtype=bool)
        after[len(both) - 2 * len(events) : len(both) - len(events)] = False
        order = np.lexsort((after, both))
        return cls(both[order], after[order])

    def read(self, run: Trajectory, names: list[str]) -> Matrix:
        """Named scalars at the instants, (F, names)."""
        found = np.empty((len(self.time), len(names)))
        for side, chosen in (("right", self.after), ("left", ~self.after)):
            values = run.at(self.time[chosen], side=side).read(*names)  # type: ignore[arg-type]
            for column, name in enumerate(names):
                found[chosen, column] = values[name]
        return found

    def blend(self, run: Trajectory, column: Vector) -> Vector:
        """A column of the stored rows at the instants."""
        grid = run.columns.grid
        slopes, found = grid.slopes(column), np.empty(len(self.time))
        found[self.after] = grid.places(self.time[self.after], "right").blend(column, slopes)
        found[~self.after] = grid.places(self.time[~self.after], "left").blend(column, slopes)
        return found


@dataclass(frozen=True, eq=False)
class Ground:
    """A plane ``normal · p = offset`` [m], in the axes of the scene."""

    normal: Vector
    offset: float


@dataclass(frozen=True, eq=False)
class Touch:
    """A contact's place while it is closed: where [m] (3,), from begin to end [s]."""

    contact: str
    where: Vector
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class Push:
    """The force of the ground on a foot over time, in the axes of the scene: place (F, 3) [m], force (F, 3) [N]."""

    contact: str
    place: Matrix
    force: Matrix


@dataclass(frozen=True, eq=False)
class Scene:
    """What a picture of a run shows, in axes whose −y is the direction of gravity.

    points : 'body.frame' names; positions (F, P, 3) [m] at the instants
    segments : (body, numbers of its points); masses : mass of each body that has one [kg]
    markers : numbers of the points that are shown with their names
    spatial : whether anything moves out of the x–y plane
    """

    instants: Instants
    points: tuple[str, ...]
    positions: NDArray[np.float64]
    segments: tuple[tuple[str, tuple[int, ...]], ...]
    masses: dict[str, float]
    grounds: tuple[Ground, ...]
    touches: tuple[Touch, ...]
    pushes: tuple[Push, ...]
    markers: tuple[int, ...]
    spatial: bool


def scene(run: Trajectory, count: int) -> Scene:
    """The scene of a run in `count` equal intervals of time and at its events."""
    instants = Instants.of(run, count)
    bodies = [
        (body, [name for frame in frames for name in (f"{body}.{frame}", frame) if f"{name}.x" in run])
        for body, frames in run.facts.segments
    ]
    markers = [name for name in run.facts.markers if f"{name}.x" in run]
    points = tuple(dict.fromkeys([*(point for _, members in bodies for point in members), *markers]))
    number = {point: k for k, point in enumerate(points)}
    lines = ((body, line) for body, members in bodies if members for line in _lines(members))
    segments = tuple((body, tuple(number[point] for point in line)) for body, line in lines)
    scalars = [point + axis for point in points for axis in AXES]
    raw = instants.read(run, scalars).reshape(len(instants.time), len(points), 3)
    turn = upright(run)
    positions = raw @ turn.T
    touches = tuple(_touches(run, turn))
    depth = positions[:, :, 2]
    spatial = bool(points) and float(np.ptp(depth)) > 1e-9 * max(1.0, float(np.ptp(positions)))
    masses = {
        body: run.parameters[f"{body}.mass"] for body, _ in segments if run.parameters.get(f"{body}.mass", 0.0) > 0.0
    }
    grounds = tuple(Ground(turn @ normal, offset) for normal, offset in _grounds(run, instants, raw))
    named = tuple(number[name] for name in markers)
    pushes = tuple(_pushes(run, instants, turn))
    return Scene(instants, points, positions, segments, masses, grounds, touches, pushes, named, spatial)


def _lines(members: Sequence[str]) -> list[Sequence[str]]:
    """A body of many points as a star about its origin or center if that is one of them, else as one outline."""
    hubs = [point for point in members if point.rpartition(".")[2] in ("origin", "center")]
    if len(members) < 3 or not hubs:
        return [members]
    return [(hubs[0], point) for point in members if point != hubs[0]]


def upright(run: Trajectory) -> Matrix:
    """The rotation R (3, 3) that turns gravity down the page: R g ∥ (0, −1, 0), by the smallest angle."""
    g = np.array([run.parameters.get(f"gravity{axis}", 0.0) for axis in AXES])
    size = float(np.linalg.norm(g))
    if size == 0.0:
        return np.eye(3)
    down = g / size
    axis = np.cross(down, [0.0, -1.0, 0.0])
    sine, cosine = float(np.linalg.norm(axis)), float(-down[1])
    if sine < 1e-12:
        return np.eye(3) if cosine > 0.0 else np.diag([-1.0, -1.0, 1.0])
    x, y, z = axis / sine
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * cross @ cross)


def _touches(run: Trajectory, turn: Matrix) -> list[Touch]:
    """Where and how long each contact with a place stayed closed."""
    found = []
    for column, contact in enumerate(run.facts.contacts):
        closed = run.record.closed[:, column].astype(np.int8)
        if not contact.place or not closed.any():
            continue
        where = run[contact.place]
        change = np.flatnonzero(np.diff(closed, prepend=0, append=0))
        for first, stop in zip(change[::2], change[1::2], strict=True):
            found.append(Touch(contact.name, turn @ where[first], float(run.time[first]), float(run.time[stop - 1])))
    return found


def _pushes(run: Trajectory, instants: Instants, turn: Matrix) -> list[Push]:
    """Forces of contacts with planes: the normal times the contact's force, and its friction along x of the plane."""
    found = []
    for contact in run.facts.contacts:
        wanted = [*(f"{contact.place}{axis}" for axis in AXES), f"{contact.name}.gap", f"{contact.name}.force"]
        along = f"{contact.name}.friction.forward"
        if contact.unit != "m" or not contact.place or any(name not in run for name in wanted):
            continue
        values = instants.read(run, [*wanted, *([along] if along in run else [])])
        plane = _plane(values[:, :3], values[:, 3])
        if plane is None or not np.any(values[:, 4:]):
            continue
        normal = plane[0]
        force = values[:, 4:5] * normal
        if along in run:
            force = force + values[:, 5:6] * np.array([normal[1], -normal[0], 0.0])
        found.append(Push(contact.name, values[:, :3] @ turn.T, np.nan_to_num(force) @ turn.T))
    return found


def _grounds(run: Trajectory, instants: Instants, positions: NDArray[np.float64]) -> list[tuple[Vector, float]]:
    """(normal, offset) of the planes that gaps measure the distance from, found from the motion itself."""
    names = [f"{contact.name}.gap" for contact in run.facts.contacts if contact.unit == "m"]
    known = [name for name in names if name in run]
    planes: list[tuple[Vector, float]] = []
    for gap in instants.read(run, known).T:
        for point in np.moveaxis(positions, 1, 0):
            plane = _plane(point, gap)
            if plane is not None:
                if not any(np.allclose(plane[0], n) and abs(plane[1] - d) < FIT for n, d in planes):
                    planes.append(plane)
                break
    return planes


def _plane(p: Matrix, gap: Vector) -> tuple[Vector, float] | None:
    """normal, offset with ``normal · p − offset = gap`` and a unit normal; None if the motion shows no such plane."""
    if np.max(np.abs(p[:, 1] - gap)) < FIT:
        return np.array([0.0, 1.0, 0.0]), 0.0
    moving = np.ptp(p, axis=0) > FIT
    if moving.sum() < 2:
        return None
    unknowns = np.column_stack([p[:, moving], -np.ones(len(p))])
    solution, _, rank, _ = np.linalg.lstsq(unknowns, gap, rcond=1e-9)
    if rank < unknowns.shape[1] or np.max(np.abs(unknowns @ solution - gap)) > FIT:
        return None
    normal = np.zeros(3)
    normal[moving] = solution[:-1]
    if abs(float(np.linalg.norm(normal)) - 1.0) > FIT:
        return None
    offset = float(solution[-1])
    return normal, offset
