"""What stands or rolls around bodies in a picture: grounds, height functions, wheels, blades."""

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.constraints.surfaces import Plane
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.equations.shapes import HEIGHT, PLACE, Shape, drawn
from mbd.results.facts import ROUND
from mbd.results.names import AXES
from mbd.results.trajectory import Trajectory
from mbd.tape.evaluate import evaluate_arrays
from mbd.view.instants import Instants

FINE, MOST, MOST_MOVING = 100, 4000, 400
"""Points of a curve over the size of the mechanism, and on a whole curve, at rest and moving."""

SURFACE_LINES = 25
"""Lines of a surface in space along each of its directions."""

TIMES, TIMES_IN_SPACE = 200, 40
"""Most pictures of a surface that moves."""


@dataclass(frozen=True, eq=False)
class Ground:
    """A plane at rest, ``normal · p = offset`` [m], in the axes of the scene."""

    normal: Vector
    offset: float


@dataclass(frozen=True, eq=False)
class Deck:
    """A plane that moves, at the instants: a point of its material [m], its normal and forward along it, (F, 3)."""

    place: Matrix
    normal: Matrix
    forward: Matrix


@dataclass(frozen=True, eq=False)
class Sheet:
    """Lines on a surface of given height, in the axes of the scene.

    times (T,) [s], one for ground at rest; lines (T, L, n, 3) [m]
    """

    times: Vector
    lines: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel at the instants, named by its center: that [m], its radius (F,) [m], its spoke and axle (F, 3)."""

    name: str
    center: Matrix
    radius: Vector
    spoke: Matrix
    axle: Matrix


@dataclass(frozen=True, eq=False)
class Ball:
    """A ball that touches, at the instants, named by its center: that [m] and its radius (F,) [m]."""

    name: str
    center: Matrix
    radius: Vector


@dataclass(frozen=True, eq=False)
class Blade:
    """A blade at the instants: its place [m] and the direction along it, (F, 3)."""

    name: str
    place: Matrix
    along: Matrix


@dataclass(frozen=True, eq=False)
class Scenery:
    """All of them.

    directions : normal of the ground of each contact with one, forward and sideways along it, (F, 3)
    arms : from the center of a disk or a ball to where it touches, by contact, (F, 3) [m]
    """

    grounds: tuple[Ground, ...]
    decks: tuple[Deck, ...]
    sheets: tuple[Sheet, ...]
    wheels: tuple[Wheel, ...]
    balls: tuple[Ball, ...]
    blades: tuple[Blade, ...]
    directions: dict[str, tuple[Matrix, Matrix, Matrix]]
    arms: dict[str, Matrix]

    @property
    def rounds(self) -> tuple[Wheel | Ball, ...]:
        """Wheels and balls."""
        return (*self.wheels, *self.balls)

    def tread(self, contact: str, place: str, normal: Matrix) -> Matrix:
        """From a place to where it touches the ground: from the center of a wheel to its rim; (F, 3) [m]."""
        if contact in self.arms:
            return self.arms[contact]
        wheel = next((each for each in self.wheels if each.name == place), None)
        return np.zeros_like(normal) if wheel is None else -wheel.radius[:, None] * normal


def scenery(run: Trajectory, instants: Instants, turn: Matrix, points: NDArray[np.float64]) -> Scenery:
    """What stands around the points (F, P, 3) of a mechanism, in ground axes; `turn` leads to those of the scene."""

    def read(owner: str, what: str) -> Matrix:
        return instants.read(run, [drawn(owner, what) + axis for axis in AXES]) @ turn.T

    grounds, decks, sheets, wheels, balls, blades = [], [], [], [], [], []
    directions: dict[str, tuple[Matrix, Matrix, Matrix]] = {}
    arms: dict[str, Matrix] = {}
    for shape in run.facts.shapes:
        if shape.kind in ("solid", "limb", "hinge", "cone", "held") or not _known(run, shape):
            continue
        if shape.kind == "plane":
            normal = turn @ np.array(shape.numbers[:3])
            grounds.append(Ground(normal, shape.numbers[3]))
            x, y, z = shape.numbers[:3]
            forward, sideways = (turn @ np.array(way) for way in Plane((x, y, z)).along)
            for contact in shape.contacts:
                many = (len(instants.time), 1)
                directions[contact] = np.tile(normal, many), np.tile(forward, many), np.tile(sideways, many)
        elif shape.kind == "moving plane":
            decks.append(Deck(*(read(shape.name, what) for what in ("place", "normal", "forward"))))
        elif shape.kind == "surface":
            sheets.append(_sheet(run, shape, instants, turn, points))
        else:
            place = instants.read(run, [shape.place + axis for axis in AXES]) @ turn.T
            if shape.kind in ROUND:
                radius = instants.read(run, [f"{shape.name}.radius"])[:, 0]
                arms |= {contact: read(contact, "arm") for contact in shape.contacts}
            if shape.kind == "wheel":
                wheels.append(Wheel(shape.place, place, radius, read(shape.name, "spoke"), read(shape.name, "axle")))
            elif shape.kind == "ball":
                balls.append(Ball(shape.place, place, radius))
            else:
                blades.append(Blade(shape.place, place, read(shape.name, "along")))
        if shape.kind in ("moving plane", "surface"):
            for contact in shape.contacts:
                normal, forward, sideways = (read(contact, way) for way in ("normal", "forward", "sideways"))
                directions[contact] = normal, forward, sideways
    return Scenery(
        tuple(grounds), tuple(decks), tuple(sheets), tuple(wheels), tuple(balls), tuple(blades), directions, arms
    )  # fmt: skip


def _known(run: Trajectory, shape: Shape) -> bool:
    """Whether a run has what a shape needs; one that was saved with chosen names may not."""
    model = run.columns.between_rows
    if shape.kind == "plane":
        return True
    if shape.kind == "surface":
        return model is not None and model.knows(drawn(shape.name, HEIGHT))
    if shape.kind == "ball":
        return all(f"{name}.x" in run for name in (shape.place, *(drawn(each, "arm") for each in shape.contacts)))
    what = {"moving plane": "place", "wheel": "spoke"}.get(shape.kind, "along")
    return f"{drawn(shape.name, what)}.x" in run and (not shape.place or f"{shape.place}.x" in run)


def _sheet(run: Trajectory, shape: Shape, instants: Instants, turn: Matrix, points: NDArray[np.float64]) -> Sheet:
    """A surface around where the points are: a curve in a plane, a patch of lines along x and z in space."""
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    size = float(np.max(np.ptp(points, axis=1), initial=0.0))
    travel = float(np.max(high - low))
    reach = max(4.0 * size, 2.0 * travel) or 1.0
    spatial = bool(high[2] - low[2] > 1e-9 * max(1.0, travel))
    moves, fine = "t" in shape.across, (high[0] - low[0] + 2.0 * reach) / max(size, 0.12 * travel, 1e-9) * FINE
    count = int(np.clip(fine, 200, MOST_MOVING if moves else MOST))
    if spatial:
        count, reach = 2 * SURFACE_LINES - 1, 0.25 * reach
    x = np.linspace(low[0] - reach, high[0] + reach, count)
    z = np.linspace(low[2] - reach, high[2] + reach, count) if spatial else low[2:]
    along = np.stack(np.broadcast_arrays(x[None, :], z[:: 2 if spatial else 1, None]), axis=-1)
    lines = [along.reshape(-1, count, 2)]
    if spatial:
        lines.append(np.stack(np.broadcast_arrays(x[::2, None], z[None, :]), axis=-1))
    places = np.concatenate(lines)
    chosen = np.zeros(1, dtype=int)
    if moves:
        most = min(TIMES_IN_SPACE if spatial else TIMES, len(instants.time))
        chosen = np.unique(np.linspace(0, len(instants.time) - 1, most).round().astype(int))
    times = instants.time[chosen]
    heights = _heights(run, shape, places, times)
    lines3 = np.stack(np.broadcast_arrays(places[None, ..., 0], heights, places[None, ..., 1]), axis=-1)
    there = np.where(np.isfinite(heights)[..., None], lines3, np.nan)
    return Sheet(times, np.asarray(there @ turn.T, dtype=np.float64))


def _heights(run: Trajectory, shape: Shape, places: NDArray[np.float64], times: Vector) -> NDArray[np.float64]:
    """H at places (L, n, (x, z)) and times, (T, L, n)."""
    model = run.columns.between_rows
    assert model is not None
    t = times.reshape(-1, 1, 1)
    inputs = {(PLACE, 0): places[None, ..., 0], (PLACE, 1): places[None, ..., 1], ("t", 0): t}
    node = model.node(drawn(shape.name, HEIGHT))
    return np.asarray(evaluate_arrays(node, inputs), dtype=np.float64)


def plane_of_motion(p: Matrix, gap: Vector) -> tuple[Vector, float] | None:
    """normal, offset with ``normal · p − offset = gap`` and a unit normal; None if the motion shows no such plane."""
    if np.max(np.abs(p[:, 1] - gap)) < NOMINAL_RTOL:
        return np.array([0.0, 1.0, 0.0]), 0.0
    moving = np.ptp(p, axis=0) > NOMINAL_RTOL
    if moving.sum() < 2:
        return None
    unknowns = np.column_stack([p[:, moving], -np.ones(len(p))])
    solution, _, rank, _ = np.linalg.lstsq(unknowns, gap, rcond=1e-9)
    if rank < unknowns.shape[1] or np.max(np.abs(unknowns @ solution - gap)) > NOMINAL_RTOL:
        return None
    normal = np.zeros(3)
    normal[moving] = solution[:-1]
    if abs(float(np.linalg.norm(normal)) - 1.0) > NOMINAL_RTOL:
        return None
    return normal, float(solution[-1])
