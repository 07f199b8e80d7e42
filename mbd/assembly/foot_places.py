"""Places at which feet stand at a start: of feet of no mass, and of points of bodies."""

from collections.abc import Collection, Mapping
from dataclasses import field
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.pose import Posture
from mbd.bodies.values import is_finite_number, shown
from mbd.constraints.touchdown import Touchdown
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.errors import AssemblyError, ModelError, UnknownNameError, nearest
from mbd.state import State


@dataclass(frozen=True)
class FootPlaces:
    """Where feet stand.

    positions : of points of bodies, as `mbd.assemble` takes them by name
    held : what contacts hold whose feet have no body, by name
    heights : y that must follow, by name of the contact: (name of the position, y)
    """

    positions: Mapping[str, float] = field(default_factory=dict)
    held: Mapping[str, Vector] = field(default_factory=dict)
    heights: Mapping[str, tuple[str, float]] = field(default_factory=dict)

    def hold(self, work: Posture) -> None:
        """Write them into the anchors of a start."""
        for contact in work.manager.contacts:
            if contact.name in self.held:
                work.anchors[list(contact.anchors)] = self.held[contact.name]

    def require_heights(self, start: State) -> None:
        """Raise an `AssemblyError` for points of bodies that do not stand at the height of their place."""
        faults = [
            f"anchors: {name!r} stands at y = {start[point]:.6g} m, not at y = {y:.6g} m"
            for name, (point, y) in self.heights.items()
            if abs(start[point] - y) > NOMINAL_RTOL
        ]
        if faults:
            raise AssemblyError(faults)


def foot_places(model: Any, anchors: Any, closed: Collection[str]) -> FootPlaces:
    """What places of feet, by name of their contact, mean for a start.

    Raises
    ------
    UnknownNameError
        for a name that is no contact.
    ModelError
        for what is no place, for a contact that is not closed or stands at no place, and for a foot of no mass off the
        ground.
    """
    if anchors is None:
        return FootPlaces()
    if not isinstance(anchors, Mapping):
        raise ModelError(
            f"anchors must map contacts to places, such as {{'left foot': (0.3, 0.0)}}, got {shown(anchors)}"
        )
    words = {word.name: word for word in getattr(model, "constraints", ()) if word.kind in ("unilateral", "penalty")}
    if unknown := [name for name in anchors if name not in words]:
        raise UnknownNameError(["anchors: " + nearest(str(name), words, "contact") for name in unknown])
    faults = list[str]()
    positions, held, heights = dict[str, float](), dict[str, Vector](), dict[str, tuple[str, float]]()
    for name, place in anchors.items():
        if not isinstance(place, tuple | list | np.ndarray) or len(place) not in (2, 3) or not all(
            is_finite_number(value) for value in place
        ):  # fmt: skip
            faults.append(f"anchors: the place of {name!r} must be (x, y) or (x, y, z) [m], got {shown(place)}")
            continue
        if name not in closed:
            faults.append(f"anchors: {name!r} stands nowhere, as it starts open; name it in closed=[…] too")
            continue
        values, measure = words[name].held_at([float(value) for value in place]), getattr(words[name], "measure", None)
        if values is not None:
            held[name] = np.array(values, dtype=float)
            if abs(float(place[1])) > NOMINAL_RTOL:
                faults.append(f"anchors: {name!r} stands on level ground, y = 0, got y = {float(place[1]):.3g} m")
        elif isinstance(measure, Touchdown):
            point = measure.point.full_name
            positions |= {
                f"{point}.{axis}": float(value) for axis, value in zip("xz", (place[0], *place[2:]), strict=False)
            }
            heights[name] = f"{point}.y", float(place[1])
        else:
            faults.append(
                f"anchors: {name!r} stands at no place that could be given; give positions of its bodies instead"
            )
    if faults:
        raise ModelError(faults)
    return FootPlaces(positions, held, heights)
