"""The geometry of a run for drawing: points over time, the ground they touch, gravity down the page."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.results.facts import ROUND
from mbd.results.names import AXES
from mbd.results.trajectory import Trajectory
from mbd.view.instants import Instants
from mbd.view.pushes import Push, pushes
from mbd.view.scenery import Ball, Ground, Scenery, Wheel, plane_of_motion, scenery
from mbd.view.solids import Hinge, Solid, Stop, hinges, limbs, rotations, solids, stops

RADIUS_RTOL = 0.02
"""Radii that differ less, over the radius, are one [-]."""


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
    around, bodies_seen = _once(around, _solid_ones(bodies_seen, points, positions[0] if points else np.zeros((0, 3))))
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


def _once(around: Scenery, solids: tuple[Solid, ...]) -> tuple[Scenery, tuple[Solid, ...]]:
    """Without the wheels and balls that solids of equal radius show, and without the solids that others stand for.

    A solid has the inertia of its body, a wheel or a ball the radius with which it touches: where these differ, as of a
    wheel of a bicycle, whose mass is at its rim, or a ball that is heavier on one side, what touches is drawn, a ball
    with the tones of its body, by which turning shows.
    """
    hidden: set[str] = set()
    wheels = tuple(each for each in around.wheels if not _shown(each, solids, hidden))
    touching = {ball.name: own for ball in around.balls if (own := _body_of(ball, solids)) is not None}
    balls = tuple(ball for ball in around.balls if ball.name not in touching)
    whole = {own.name: own for own in touching.values()}
    return replace(around, wheels=wheels, balls=balls), tuple(
        whole.get(each.name, each) for each in solids if each.name not in hidden
    )


def _body_of(ball: Ball, solids: Iterable[Solid]) -> Solid | None:
    """The solid of a body that is a ball, in which its center of mass lies anywhere, with the radius that touches."""
    radius = float(ball.radius[0])
    for solid in solids:
        if solid.form.kind == "ball" and ball.name.startswith(f"{solid.name}.") and not np.any(ball.radius != radius):
            away = float(np.max(np.linalg.norm(solid.center - ball.center, axis=1)))
            if away <= NOMINAL_RTOL * radius and abs(float(solid.form.half[0]) - radius) < RADIUS_RTOL * radius:
                return solid
            if away < radius:
                return replace(solid, center=ball.center, form=replace(solid.form, half=np.full(3, radius)))
    return None


def _solid_ones(solids: tuple[Solid, ...], points: Sequence[str], places: Matrix) -> tuple[Solid, ...]:
    """Without those that are lighter than air and larger than all other bodies together, which would hide these: of an
    inertia that was made up, such as that of a hip without mass.

    points : names of the points of the mechanism; places : theirs at one instant (P, 3) [m]
    """
    found = []
    for solid in solids:
        others = [k for k, point in enumerate(points) if point.rpartition(".")[0] != solid.name]
        size = float(np.max(np.ptp(places[others], axis=0), initial=0.0)) if others else 0.0
        # nobody builds a lighter solid [kg/m³]
        if not (solid.density < 1.2 and 0.0 < size < 2.0 * float(np.max(solid.form.half))):
            found.append(solid)
    return tuple(found)


def _shown(wheel: Wheel, solids: Iterable[Solid], hidden: set[str]) -> bool:
    """Whether a solid shows it; one of another radius that lies in it is hidden instead."""
    radius = float(wheel.radius[0])
    for solid in solids:
        own = wheel.name.startswith(f"{solid.name}.")
        if not own or solid.form.kind != "cylinder" or not _along(wheel, solid):
            continue
        if float(np.max(np.abs(solid.center - wheel.center))) > NOMINAL_RTOL * radius:
            continue
        if abs(float(solid.form.half[0]) - radius) < RADIUS_RTOL * radius:
            return True
        hidden.add(solid.name)
    return False


def _along(wheel: Wheel, solid: Solid) -> bool:
    """Whether a wheel's axle is the axis of a cylinder."""
    return bool(abs(float(rotations(solid.turn[:1])[0][:, 2] @ wheel.axle[0])) > 1.0 - RADIUS_RTOL)
