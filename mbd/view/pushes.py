"""Forces of the ground on what touches it, as arrows show them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Matrix
from mbd.dataclass import dataclass
from mbd.equations.held import WAYS
from mbd.equations.shapes import Shape, drawn
from mbd.results.names import AXES
from mbd.results.trajectory import Trajectory
from mbd.view.instants import Instants
from mbd.view.scenery import Scenery, plane_of_motion


@dataclass(frozen=True, eq=False)
class Push:
    """The force of the ground on a foot or a wheel over time, in the axes of the scene.

    contact : a name of it; frame : what touches; place (F, 3) [m]; force (F, 3) [N]
    """

    contact: str
    frame: str
    place: Matrix
    force: Matrix


def pushes(run: Trajectory, instants: Instants, turn: Matrix, around: Scenery) -> list[Push]:
    """All of them, those on one frame together."""
    found: dict[str, Push] = {}
    for push in (*_of_contacts(run, instants, turn, around), *_held(run, instants, turn)):
        other = found.get(push.frame)
        found[push.frame] = push if other is None else replace(other, force=other.force + push.force)
    return list(found.values())


def _held(run: Trajectory, instants: Instants, turn: Matrix) -> list[Push]:
    """Those of contacts that never open, −λ along the normal, and of wheels that roll, along the ground."""
    found = []
    for shape in run.facts.shapes:
        wanted = [*(shape.place + axis for axis in AXES), *(drawn(shape.name, way) + a for way in WAYS for a in AXES)]
        forces = _forces(run, shape) if shape.kind == "held" else []
        if not forces or any(name not in run for name in wanted):
            continue
        values = instants.read(run, [*wanted, *forces])
        place, arm, normal, *along = (values[:, k : k + 3] @ turn.T for k in range(0, 15, 3))
        ways = [-normal] if shape.form == "normal" else along
        parts = (values[:, 15 + k : 16 + k] * way for k, way in enumerate(ways[: len(forces)]))
        force = sum(parts, np.zeros_like(normal))
        if np.any(force):
            found.append(Push(shape.name, shape.place, place + arm, np.nan_to_num(force)))
    return found


def _forces(run: Trajectory, shape: Shape) -> Sequence[str]:
    """Results that tell them, in the order of their directions."""
    several = [f"{shape.name}.forward.force", f"{shape.name}.sideways.force"]
    one = [f"{shape.name}.multiplier" if shape.form == "normal" else f"{shape.name}.force"]
    return next((names for names in (several, one) if all(name in run for name in names)), [])


def _of_contacts(run: Trajectory, instants: Instants, turn: Matrix, around: Scenery) -> list[Push]:
    """Those of contacts that open and close: the normal times its force, and its friction along the ground."""
    found = []
    for contact in run.facts.contacts:
        wanted = [*(f"{contact.place}{axis}" for axis in AXES), f"{contact.name}.gap", f"{contact.name}.force"]
        along = [name for name in (f"{contact.name}.friction.{way}" for way in ("forward", "sideways")) if name in run]
        if contact.unit != "m" or not contact.place or any(name not in run for name in wanted):
            continue
        values = instants.read(run, [*wanted, *along])
        directions = around.directions.get(contact.name) or _shown_directions(values, turn)
        if directions is None or not np.any(values[:, 4:]):
            continue
        normal, *ways = directions
        force = values[:, 4:5] * normal
        for column, name in enumerate(along, start=5):
            force = force + values[:, column : column + 1] * ways[name.endswith("sideways")]
        place = values[:, :3] @ turn.T + around.tread(contact.name, contact.place, normal)
        found.append(Push(contact.name, contact.place, place, np.nan_to_num(force)))
    return found


def _shown_directions(values: Matrix, turn: Matrix) -> tuple[Matrix, Matrix, Matrix] | None:
    """Normal, forward and sideways of a plane that only the motion shows."""
    plane = plane_of_motion(values[:, :3], values[:, 3])
    if plane is None:
        return None
    normal = plane[0]
    forward = np.array([normal[1], -normal[0], 0.0])
    normal, forward, sideways = (
        np.tile(turn @ way, (len(values), 1)) for way in (normal, forward, np.cross(forward, normal))
    )
    return normal, forward, sideways
