"""The geometry of a run for drawing: points over time, the ground they touch, gravity down the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.results.facts import ROUND
from mbd.results.names import AXES
from mbd.view.instants import Instants
from mbd.view.pushes import Push, pushes
from mbd.view.scenery import Ground, Scenery, plane_of_motion, scenery
from mbd.view.seen_once import once, solid_ones
from mbd.view.solids import Hinge, Solid, Stop, hinges, limbs, solids, stops

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory

__all__ = ["Instants", "Push", "Scene", "Touch", "scene"]


@dataclass(frozen=True, eq=False)
class Touch:
    """A contact's place while it is closed: where [m] (3,), from begin to end [s]."""

    contact: str
    where: Vector
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class Scene:
    """What a picture of a run shows, in axes whose −y is the direction of gravity.

    points : 'body.frame' names; positions (F, P, 3) [m] at the instants
    segments : (body, numbers of its points); masses : mass of each body that has one [kg]
    around : grounds that the model has, wheels, blades; grounds : planes at rest, those that only the motion shows too
    markers : numbers of the points that are shown with their names
    spatial : whether anything moves out of the x–y plane, or could
    solids, hinges, stops : bodies, axes of joints and their cones, of a spatial mechanism
    limbs : radii of links that have one [m]
    turn : from ground axes to those of the scene (3, 3)
    """

    instants: Instants
    points: tuple[str, ...]
    positions: NDArray[np.float64]
    segments: tuple[tuple[str, tuple[int, ...]], ...]
    masses: dict[str, float]
    around: Scenery
    grounds: tuple[Ground, ...]
    touches: tuple[Touch, ...]
    pushes: tuple[Push, ...]
    markers: tuple[int, ...]
    spatial: bool
    solids: tuple[Solid, ...] = ()
    hinges: tuple[Hinge, ...] = ()
    limbs: Mapping[str, float] = field(default_factory=dict)
    turn: Matrix = field(default_factory=lambda: np.eye(3))
    stops: tuple[Stop, ...] = ()


def scene(run: Trajectory, count: int | Instants) -> Scene:
    """The scene of a run in `count` equal intervals of time and at its events, or at instants."""
    instants = count if isinstance(count, Instants) else Instants.of(run, count)
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
    bodies_seen, axes = solids(run, instants, turn), hinges(run, instants, turn)
    deep = points != () and float(np.ptp(depth)) > 1e-9 * max(1.0, float(np.ptp(positions)))
    masses = {
        body: run.parameters[f"{body}.mass"] for body, _ in segments if run.parameters.get(f"{body}.mass", 0.0) > 0.0
    }
    around = scenery(run, instants, turn, raw if points else np.zeros((1, 1, 3)))
    around, bodies_seen = once(around, solid_ones(bodies_seen, points, positions[0] if points else np.zeros((0, 3))))
    shown = (Ground(turn @ normal, offset) for normal, offset in _grounds(run, instants, raw, around))
    named = tuple(number[name] for name in markers)
    pushed = tuple(pushes(run, instants, turn, around))
    grounds = (*around.grounds, *shown)
    return Scene(
        instants, points, positions, segments, masses, around, grounds, touches, pushed, named,
        bool(points) and (deep or bool(bodies_seen or axes) or _is_deep(run)), bodies_seen, axes, limbs(run), turn,
        stops(run, instants, turn),
    )  # fmt: skip


def _is_deep(run: Trajectory) -> bool:
    """Whether a ground of the model rises or falls across the x–y plane."""
    return any(
        "z" in shape.across or (shape.kind == "plane" and abs(shape.numbers[2]) > 1e-12) for shape in run.facts.shapes
    )


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
    """Where and how long each contact with a place of ground at rest stayed closed."""
    found = []
    carried = {name for shape in run.facts.shapes if shape.kind == "moving plane" for name in shape.contacts}
    wheels = {shape.place for shape in run.facts.shapes if shape.kind in ROUND}
    for column, contact in enumerate(run.facts.contacts):
        closed = run.record.closed[:, column].astype(np.int8)
        if not contact.place or not closed.any() or contact.name in carried or contact.place in wheels:
            continue
        where = run[contact.place]
        change = np.flatnonzero(np.diff(closed, prepend=0, append=0))
        for first, stop in zip(change[::2], change[1::2], strict=True):
            found.append(Touch(contact.name, turn @ where[first], float(run.time[first]), float(run.time[stop - 1])))
    return found


def _grounds(
    run: Trajectory, instants: Instants, positions: NDArray[np.float64], around: Scenery
) -> list[tuple[Vector, float]]:
    """(normal, offset) of the planes that gaps without a ground measure the distance from, found from the motion."""
    grounded = {contact for shape in run.facts.shapes for contact in shape.contacts}
    names = [f"{contact.name}.gap" for contact in run.facts.contacts if contact.unit == "m"]
    known = [name for name in names if name in run and name.removesuffix(".gap") not in grounded]
    planes: list[tuple[Vector, float]] = []
    for gap in instants.read(run, known).T:
        for point in np.moveaxis(positions, 1, 0):
            plane = plane_of_motion(point, gap)
            if plane is not None:
                if not any(np.allclose(plane[0], n) and abs(plane[1] - d) < NOMINAL_RTOL for n, d in planes):
                    planes.append(plane)
                break
    turn = upright(run)
    return [
        (normal, offset)
        for normal, offset in planes
        if not any(
            np.allclose(turn @ normal, g.normal) and abs(offset - g.offset) < NOMINAL_RTOL for g in around.grounds
        )
    ]
