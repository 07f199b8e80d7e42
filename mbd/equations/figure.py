"""The stick figure of a model: which frames of each body to join by lines."""

from collections.abc import Callable

from mbd.bodies.base import Body, Frame
from mbd.bodies.link import Link
from mbd.bodies.marker import Marker
from mbd.topology.description import Description

Segments = list[tuple[str, tuple[str, ...]]]
"""(body, its frames in the order of a line); one frame alone is a point. Places are the results 'body.frame.x', …"""


def figure_of(model: Description) -> Callable[[], Segments]:
    """The figure of the model as it is now: a link from start to end, other bodies through the frames in use.

    A body with one frame in use is a star from there to its named points.

    It holds names only: equations are kept as long as the model is there, which they must not keep themselves.
    """
    found = _segments(model)
    return lambda: found


def shown_markers(model: Description) -> tuple[str, ...]:
    """Full names of the named points, which are drawn with their names; what only turns a frame is none."""
    return tuple(frame.full_name for frame in model.markers if frame.landmark is None or isinstance(frame, Marker))


def _segments(model: Description) -> Segments:
    used: dict[str, list[Frame]] = {name: [] for name in model.bodies}
    joints = [frame for joint in model.joints for frame in (joint.child, joint.parent)]
    for frame in [*joints, *(mention for mention in model.mentions() if isinstance(mention, Frame))]:
        used[frame.body.name].append(frame)
    found: Segments = []
    for body in model.bodies.values():
        frames = _distinct(used[body.name])
        if body is model.ground:
            found += [(body.name, (frame.name,)) for frame in frames]
        elif isinstance(body, Link):
            found.append((body.name, ("start", "end")))
            found += [(body.name, ("start", frame.name)) for frame in frames if frame.offset[0] or frame.offset[2]]
        else:
            names = [frame.name for frame in frames] or ["origin"]
            bare = len(names) == 1 and any(body.center.offset)
            found.append((body.name, (*names, "center") if bare else tuple(names)))
            if len(names) == 1:  # a body that floats or turns about a point shows how it is turned by its named points
                found += [(body.name, (names[0], frame.name)) for frame in model.markers if _is_on(frame, body, frames)]
    return found


def _is_on(frame: Frame, body: Body, frames: list[Frame]) -> bool:
    """Whether a named point belongs to a body and lies elsewhere than its frames in use."""
    places = [other.offset for other in frames] or [(0.0, 0.0, 0.0)]
    named = frame.landmark is None or isinstance(frame, Marker)
    return named and frame.body is body and frame.offset not in places


def _distinct(frames: list[Frame]) -> list[Frame]:
    """One frame for each place."""
    places: dict[tuple[float, ...], Frame] = {}
    for frame in frames:
        places.setdefault(frame.offset, frame)
    return list(places.values())
