"""Solid bodies of a spatial run over time, and the axes about which its joints turn."""

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.equations.shapes import Shape, drawn
from mbd.results.names import AXES
from mbd.results.trajectory import Trajectory
from mbd.view.forms import Form, equal_inertia
from mbd.view.instants import Instants

MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")


@dataclass(frozen=True, eq=False)
class Solid:
    """A body at the instants, in the axes of the scene: its center (F, 3) [m] and quaternion (F, 4) as w, x, y, z.

    The quaternions follow each other without changes of sign. density : of the box around it [kg/m³]
    """

    name: str
    center: Matrix
    turn: Matrix
    form: Form
    density: float = np.inf


@dataclass(frozen=True, eq=False)
class Hinge:
    """An axis about which a joint turns, at the instants: a place on it [m] and its direction, (F, 3)."""

    name: str
    place: Matrix
    axis: Matrix


@dataclass(frozen=True, eq=False)
class Stop:
    """A cone of directions at a joint, at the instants: its tip [m] and its middle, (F, 3); half its angle [rad]."""

    name: str
    place: Matrix
    axis: Matrix
    angle: float


def limbs(run: Trajectory) -> dict[str, float]:
    """Radii of the links that have a moment of inertia about their long axis [m]: of a cylinder, ``r² = 2 I_yy/m``."""
    found = {}
    for shape in run.facts.shapes:
        if shape.kind == "limb":
            mass, (_, along, *_) = _inertia(run, shape)
            found[shape.name] = float(np.sqrt(2.0 * along / mass)) if mass > 0.0 and along > 0.0 else 0.0
    return found


def _inertia(run: Trajectory, shape: Shape) -> tuple[float, list[float]]:
    """Mass and moments of a body with the parameters of the run."""
    moments = [
        run.parameters.get(f"{shape.name}.inertia.{part}", number)
        for part, number in zip(MOMENTS, shape.numbers[1:], strict=True)
    ]
    return run.parameters.get(f"{shape.name}.mass", shape.numbers[0]), moments


def solids(run: Trajectory, instants: Instants, turn: Matrix) -> tuple[Solid, ...]:
    """The bodies whose inertia some solid has; `turn` goes from ground axes to those of the scene."""
    found = []
    for shape in run.facts.shapes:
        if shape.kind != "solid" or not _known(run, shape, "first", "second"):
            continue
        mass, moments = _inertia(run, shape)
        form = equal_inertia(mass, moments, shape.form)
        if form is None:
            continue
        first, second = (_vector(run, instants, drawn(shape.name, what), turn) for what in ("first", "second"))
        axes = np.stack([first, second, np.cross(first, second)], axis=-1)
        center = _vector(run, instants, shape.place, turn)
        found.append(
            Solid(shape.name, center, quaternions(axes @ form.axes), form, mass / float(np.prod(2.0 * form.half)))
        )
    return tuple(found)


def hinges(run: Trajectory, instants: Instants, turn: Matrix) -> tuple[Hinge, ...]:
    """The axes of joints that turn."""
    return tuple(
        Hinge(
            shape.name, _vector(run, instants, shape.place, turn),
            _vector(run, instants, drawn(shape.name, "axis"), turn),
        )
        for shape in run.facts.shapes
        if shape.kind == "hinge" and _known(run, shape, "axis")
    )  # fmt: skip


def stops(run: Trajectory, instants: Instants, turn: Matrix) -> tuple[Stop, ...]:
    """The cones that stop joints."""
    return tuple(
        Stop(
            shape.name, _vector(run, instants, shape.place, turn),
            _vector(run, instants, drawn(shape.name, "axis"), turn), shape.numbers[0],
        )
        for shape in run.facts.shapes
        if shape.kind == "cone" and _known(run, shape, "axis")
    )  # fmt: skip


def _known(run: Trajectory, shape: Shape, *what: str) -> bool:
    """Whether a run has what a shape needs; one that was saved with chosen names may not."""
    return f"{shape.place}.x" in run and all(run.columns.knows(f"{drawn(shape.name, each)}.x") for each in what)


def _vector(run: Trajectory, instants: Instants, name: str, turn: Matrix) -> Matrix:
    return np.asarray(instants.read(run, [name + axis for axis in AXES]) @ turn.T)


def quaternions(R: NDArray[np.float64]) -> Matrix:
    """w, x, y, z (F, 4) of rotations (F, 3, 3), each as near to the one before as its sign allows.

    Of the four ways to divide by a component, the one with the largest is taken (Shepperd 1978).
    """
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    x, y, z = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    xy, yz, zx = R[:, 0, 1] + R[:, 1, 0], R[:, 1, 2] + R[:, 2, 1], R[:, 2, 0] + R[:, 0, 2]
    ways = np.array([
        [1.0 + xx + yy + zz, x, y, z], [x, 1.0 + xx - yy - zz, xy, zx],
        [y, xy, 1.0 - xx + yy - zz, yz], [z, zx, yz, 1.0 - xx - yy + zz],
    ])  # fmt: skip
    largest = np.argmax(np.einsum("kkf->fk", ways), axis=1)
    chosen = ways[largest, :, np.arange(len(R))]
    q = chosen / np.linalg.norm(chosen, axis=1, keepdims=True)
    signs = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(q * np.cumprod(np.concatenate([[1.0], signs]))[:, None])


def rotations(q: Matrix) -> NDArray[np.float64]:
    """Rotations (F, 3, 3) of unit quaternions w, x, y, z (F, 4)."""
    w, x, y, z = q.T
    return np.moveaxis(np.array([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]), -1, 0)  # fmt: skip
