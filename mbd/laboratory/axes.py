"""The axes of a file turned into x forward, y up, z to the right."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from mbd.arrays import Matrix
from mbd.errors import ModelError

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def axis_of(word: str, what: str) -> Any:
    """A signed axis of a file, 'z' or '-x'.

    >>> axis_of("-x", "forward").tolist()
    [-1.0, 0.0, 0.0]
    """
    plain = word.removeprefix("+").removeprefix("-") if isinstance(word, str) else ""
    if plain not in AXES:
        raise ModelError(f"{what} must be an axis of the file, 'x', '-x', 'y', '-y', 'z' or '-z', got {word!r}")
    return np.array(AXES[plain]) * (-1.0 if word.startswith("-") else 1.0) + 0.0


def turn_of(markers: Mapping[str, Matrix], up: str | None, forward: str | None, usual: str) -> tuple[Matrix, str]:
    """The rotation (3, 3) from the axes of a file, and how it was found in a sentence.

    up : axis of the file that points up; None: `usual`
    forward : axis that points forward; None: the horizontal axis along which the middle of the markers moves farthest,
        if that is half a meter at least, else the next axis after `up` in the order x, y, z
    """
    vertical = axis_of(usual if up is None else up, "up")
    why = f"the file's {usual if up is None else up} is up"
    why += ", as usual in such files" if up is None else ""
    if forward is not None:
        ahead = axis_of(forward, "forward")
        if abs(ahead @ vertical) > 0.5:
            raise ModelError(f"forward={forward!r} lies along up={up or usual!r}; give a horizontal axis of the file")
        why += f", its {forward} forward"
    else:
        ahead, reason = _ahead(markers, vertical)
        why += f", {reason}"
    turn = np.array([ahead, vertical, np.cross(ahead, vertical)])
    same = np.array_equal(turn, np.eye(3))
    return turn, f"axes: {why}" + ("" if same else "; turned to x forward, y up, z right")


def _ahead(markers: Mapping[str, Matrix], vertical: Any) -> tuple[Any, str]:
    tracks = [track for track in markers.values() if np.isfinite(track).all(axis=1).sum() > 1]
    level = [axis for axis in np.eye(3) if abs(axis @ vertical) < 0.5]
    names = dict(zip(map(tuple, np.eye(3)), "xyz", strict=True))
    if tracks:
        ways = []
        for track in tracks:
            seen = track[np.isfinite(track).all(axis=1)]
            ways.append(seen[-1] - seen[0])
        way = np.median(ways, axis=0)
        axis = max(level, key=lambda each: abs(way @ each))
        if abs(way @ axis) >= 0.5:  # half a metre of travel tells forward
            sign = 1.0 if way @ axis > 0.0 else -1.0
            word = ("-" if sign < 0.0 else "") + names[tuple(axis)]
            return sign * axis + 0.0, f"its {word} forward, along which the markers move {abs(way @ axis):.2g} m"
    place = int(np.argmax(np.abs(vertical)))
    axis = np.eye(3)[0] if place else np.eye(3)[1]
    return axis, f"its {names[tuple(axis)]} is taken as forward, since the markers stay in place"


def turn_words(turn: Matrix, values: Matrix) -> Matrix:
    """Vectors (R, 3) in the turned axes."""
    return np.asarray(values @ turn.T)
