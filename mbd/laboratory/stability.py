"""Margin of stability: how far the extrapolated center of mass lies inside the edge of the support."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.bodies.base import Frame
from mbd.bodies.values import shown
from mbd.errors import ModelError

DIRECTIONS = {
    "forward": (1.0, 0.0), "backward": (-1.0, 0.0), "right": (0.0, 1.0), "left": (0.0, -1.0),
}  # fmt: skip
"""Along x and z of the ground."""


def margin_of_stability(
    motion: Any, support: Mapping[str, Sequence[Frame]] | None = None, direction: str | None = None
) -> Vector:
    """Distance from the extrapolated center of mass to the edge of the support (R,) [m], positive inside.

    ``ξ = c + ċ √(l/g)`` with the height l of the center of mass c (``run["extrapolated center of mass"]``). An inverted
    pendulum that does not step falls where ξ leaves the support (A. L. Hof, M. G. J. Gazendam and W. E. Sinke, J.
    Biomech. 38 (2005) 1). The ground is y = 0, and gravity points down. NaN while nothing stands.

    Parameters
    ----------
    motion : a run, whose closed contacts are the support, or the result of `mbd.inverse_dynamics` with plates
    support : points of the sole by foot, which count while it stands: {'left foot': [left.heel, left.toe], …}, by the
        name of a contact of the run, or of the body that stands on a plate; by default the points of contact alone
    direction : 'forward', 'backward', 'left' or 'right': the margin to the farthest point of the support that way; by
        default the distance to the nearest edge of all, negative outside. Of a support that is a point or a line,
        nothing lies inside

    Raises
    ------
    ModelError
        for another motion, feet that neither stand on a plate nor are contacts, an unknown direction.
    """
    run = getattr(motion, "run", motion)
    plates = tuple(getattr(motion, "plates", ()))
    if not hasattr(run, "facts") or not hasattr(run, "time"):
        raise ModelError(f"margin_of_stability takes a run or the result of inverse_dynamics, got {shown(motion)[:80]}")
    if direction is not None and direction not in DIRECTIONS:
        raise ModelError(f"direction is {', '.join(map(repr, DIRECTIONS))} or None, got {direction!r}")
    standing = _plates(run.time, plates) if plates else _contacts(run)
    if not standing:
        raise ModelError("nothing stands: the run has no contact with the ground, the moments no plates")
    points = _points(run, standing, support)
    xi = run["extrapolated center of mass"][:, [0, 2]]
    found = np.full(len(run.time), np.nan)
    for k in range(len(found)):
        own = np.array([places[k] for acts, places in points if acts[k]])
        if not len(own):
            continue
        if direction is None:
            found[k] = _inside(own, xi[k])
        else:
            way = np.array(DIRECTIONS[direction])
            found[k] = float((own @ way).max() - xi[k] @ way)
    return found


def _contacts(run: Any) -> dict[str, tuple[Any, str]]:
    """By contact: when it is closed, and the name of its place."""
    found = {}
    for k, contact in enumerate(run.facts.contacts):
        if contact.place and contact.unit == "m":
            found[contact.name] = (run.record.closed[:, k] != 0, contact.place)
    return found


def _plates(time: Vector, plates: Sequence[Any]) -> dict[str, tuple[Any, str]]:
    """By body that stands on a plate: when it is loaded, and the name of its frame."""
    found: dict[str, tuple[Any, str]] = {}
    for plate in plates:
        name = plate.foot.body.name
        inside = (time >= plate.record.time[0]) & (time <= plate.record.time[-1])
        acts = np.interp(time, plate.record.time, plate.wrench[:, 1]) > plate.threshold
        before = found[name][0] if name in found else np.zeros(len(time), dtype=bool)
        found[name] = (before | (acts & inside), plate.foot.full_name)
    return found


def _points(
    run: Any, standing: Mapping[str, tuple[Any, str]], support: Mapping[str, Sequence[Frame]] | None
) -> list[tuple[Any, Matrix]]:
    """When each point counts, and where it is along the ground (R, 2)."""
    if support is None:
        return [(acts, run[place][:, [0, 2]]) for acts, place in standing.values()]
    found = []
    for name, frames in support.items():
        if name not in standing:
            known = ", ".join(map(repr, standing))
            raise ModelError(f"support: {name!r} does not stand on the ground; there are {known}")
        frames = [frames] if isinstance(frames, Frame) else frames
        if not isinstance(frames, list | tuple) or not all(isinstance(frame, Frame) for frame in frames):
            raise ModelError(f"support of {name!r} is several points such as foot.heel, got {shown(frames)[:80]}")
        found += [(standing[name][0], run[frame.full_name][:, [0, 2]]) for frame in frames]
    return found


def _inside(points: Matrix, place: Vector) -> float:
    """Signed distance of a place to the convex hull of points in a plane, positive inside."""
    corners = _hull(points)
    if len(corners) == 1:
        return -float(np.linalg.norm(place - corners[0]))
    best, outside = np.inf, len(corners) < 3
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = b - a
        share = float(np.clip((place - a) @ edge / (edge @ edge), 0.0, 1.0))
        best = min(best, float(np.linalg.norm(place - a - share * edge)))
        outside = outside or edge[0] * (place - a)[1] - edge[1] * (place - a)[0] < 0.0
    return -best if outside else best


def _hull(points: Matrix) -> Matrix:
    """Corners of the convex hull, counterclockwise (A. M. Andrew, Inf. Process. Lett. 9 (1979) 216)."""
    ordered = sorted({(float(x), float(z)) for x, z in points})
    if len(ordered) < 3:
        return np.array(ordered)

    def chain(run: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for c in run:
            while len(kept) > 1:
                a, b = kept[-2], kept[-1]
                if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0:
                    break
                kept.pop()
            kept.append(c)
        return kept[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))
