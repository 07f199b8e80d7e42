"""Values of what users give: numbers, functions of named things, signals in time; gaps and how they change."""

from collections.abc import Callable
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Frame
from mbd.constraints.disks import DiskTouchdown
from mbd.constraints.measures import Distance, Height, JointMeasure, Separation
from mbd.constraints.sphere_touchdown import SphereTouchdown
from mbd.constraints.touchdown import Touchdown
from mbd.constraints.turning_measures import Cone, Twist
from mbd.constraints.user_measure import UserMeasure
from mbd.joints.base import Joint
from tests.fuzz.bodies import Bodies
from tests.fuzz.gap import Gap
from tests.fuzz.geometry import Array
from tests.fuzz.round_bodies import ball_gap, edge_gap, over_plane, turning_gap

__all__ = ["Gap", "gap_of", "named", "triple", "user_gap", "value_of"]

TINY = 1e-30
"""Imaginary step of derivatives (Squire & Trapp 1998, SIAM Rev. 40:110)."""


def value_of(value: Any, arguments: Any, bodies: Bodies, owner: str, field: str) -> Any:
    """A number, the value of a function at the run's instants, or that of a signal."""
    parameters = bodies.told.parameters
    if f"{owner}.{field}" in parameters:
        return parameters[f"{owner}.{field}"]
    if isinstance(value, mbd.Samples):
        return _signal(value, bodies.told.instants, "spline" if field in ("value", "bias") else "monotone")
    if callable(value):
        return value(*[_argument(label, given, bodies, owner) for label, given in arguments])
    if isinstance(value, int | float):
        return value
    raise NotImplementedError(f"quantities of kind {type(value).__name__}")


def triple(value: Any, arguments: Any, bodies: Bodies, owner: str, field: str) -> Array:
    """Three components (n, 3); two are x and y, a single torque acts about z."""
    n = len(bodies.told)
    if isinstance(value, tuple):
        parts = [value_of(v, arguments, bodies, owner, f"{field}.{a}") for v, a in zip(value, "xyz", strict=True)]
    elif isinstance(value, mbd.Samples):
        parts = [_signal(part, bodies.told.instants) for part in value.components]
    else:
        found = value_of(value, arguments, bodies, owner, field)
        parts = list(found) if isinstance(found, tuple | list) else [0.0, 0.0, found]
    parts = [*parts, 0.0][:3]
    return np.stack([np.broadcast_to(np.asarray(part, dtype=float), (n,)) for part in parts], axis=1)


def _signal(samples: mbd.Samples, time: Array, kind: str = "monotone") -> Array:
    """The signal between its samples, constant beyond them or repeated; `kind` is the curve where none was given."""
    from scipy.interpolate import CubicSpline, PchipInterpolator

    t, values, kind = np.asarray(samples.time), np.asarray(samples.values), samples.kind or kind
    first, last = t[0], t[-1]
    inside = first + np.mod(time - first, last - first) if samples.periodic else np.clip(time, first, last)
    if kind == "linear":
        return np.asarray(np.interp(inside, t, values))
    if kind == "spline":
        ends: Any = "periodic" if samples.periodic else samples.ends
        return np.asarray(CubicSpline(t, values, bc_type=ends)(inside))
    if kind != "monotone":
        raise NotImplementedError(f"samples of kind {kind!r}")
    if samples.periodic:  # slopes at the seam are those of a long table
        t = np.concatenate([t[:-1] - (last - first), t, t[1:] + (last - first)])
        values = np.concatenate([values[:-1], values, values[1:]])
    return np.asarray(PchipInterpolator(t, values)(inside), dtype=float)


def _argument(label: str, given: Any, bodies: Bodies, owner: str) -> Any:
    """What a function is called with: a place (3 arrays), coordinates, a named quantity, a parameter."""
    told = bodies.told
    if isinstance(given, Frame):
        return tuple(bodies.place(given).T)
    if isinstance(given, Joint):
        found = [told[name] for name in given.coordinate_names]
        return found[0] if len(found) == 1 else tuple(found)
    if isinstance(given, str):
        return named(given, bodies)
    return told.parameters[f"{owner}.{label}"]


def named(name: str, bodies: Bodies) -> Array:
    """A named quantity: the time, or what the run reports under the name."""
    told = bodies.told
    if name == "t":
        return told.instants
    if name in told:
        return told[name]
    stem, _, last = name.rpartition(".")
    for joint in bodies.model.joints:
        if joint.name == stem and len(joint.labels) == 1 and last in ("rate", "acceleration"):
            return told[f"{joint.coordinate_names[0]}.{last}"]
    raise NotImplementedError(f"the quantity '{name}'")


def gap_of(measure: Any, bodies: Bodies) -> Gap:
    """A measure by its definition.

    Raises
    ------
    NotImplementedError
        for a measure that this judge does not know.
    """
    n = len(bodies.told)
    nothing = np.zeros(n)
    if isinstance(measure, JointMeasure):
        q = bodies.told[measure.joint.coordinate_names[0]]
        return Gap(
            measure.sign * q - measure.offset, [], [(measure.joint.name, 0, np.full(n, measure.sign))], nothing, []
        )
    if isinstance(measure, Height):
        place, up = bodies.place(measure.point), np.tile([0.0, 1.0, 0.0], (n, 1))
        return Gap(place[:, 1], [(measure.point.body.name, place, up)], [], nothing, [])
    if isinstance(measure, Distance):
        a, b = bodies.place(measure.a), bodies.place(measure.b)
        length = np.linalg.norm(b - a, axis=1)
        along = (b - a) / length[:, None]
        return Gap(length, [(measure.b.body.name, b, along), (measure.a.body.name, a, -along)], [], nothing, [])
    if isinstance(measure, Separation):
        a, b = bodies.frame(measure.a).H, bodies.place(measure.b)
        along = a[:, :3, :3] @ np.asarray(measure.direction)
        value = np.sum(along * (b - a[:, :3, 3]), axis=1)
        return Gap(value, [(measure.b.body.name, b, along), (measure.a.body.name, b, -along)], [], nothing, [])
    if isinstance(measure, Touchdown):
        plane = measure.ground if isinstance(measure.ground, mbd.Plane) else None
        if plane is None:
            return _on_surface(measure, bodies)
        return over_plane(measure.point.body.name, bodies.place(measure.point), plane, bodies)
    if isinstance(measure, SphereTouchdown):
        return ball_gap(measure, bodies)
    if isinstance(measure, DiskTouchdown):
        radius = bodies.told.parameters[f"{measure.center.full_name}.radius"]
        return edge_gap(measure.center, radius, measure.axis, measure.ground, bodies)
    if isinstance(measure, Cone | Twist):
        return turning_gap(measure, bodies)
    if isinstance(measure, UserMeasure):
        return user_gap(measure, bodies)
    raise NotImplementedError(f"measures of kind {type(measure).__name__}")


def _on_surface(measure: Touchdown, bodies: Bodies) -> Gap:
    """(y − H)/√(1 + H_x² + H_z²) and its derivatives by complex steps."""
    p, t = bodies.place(measure.point), bodies.told.instants
    surface: Any = measure.ground
    names = surface.arguments

    def height(x: Any, z: Any, t: Any) -> Any:
        known = {"x": x, "z": z, "t": t}
        return surface.function(*[known[name] for name in names])

    def gap(x: Any, y: Any, z: Any, t: Any) -> Any:
        h = 1e-5  # central differences of slopes, complex ones of the rest
        slope_x = (height(x + h, z, t) - height(x - h, z, t)) / (2.0 * h)
        slope_z = (height(x, z + h, t) - height(x, z - h, t)) / (2.0 * h)
        return (y - height(x, z, t)) / np.sqrt(1.0 + slope_x**2 + slope_z**2)

    place = [*p.T, t]
    value = np.asarray(gap(*place), dtype=float)
    slopes = []
    for k in range(4):
        moved = [part + 1j * TINY if j == k else part for j, part in enumerate(place)]
        slopes.append(np.imag(gap(*moved)) / TINY)
    zero = np.zeros_like(t)
    slope = np.imag(np.asarray(height(p[:, 0] + 1j * TINY, p[:, 2], t)) + 0j) / TINY + zero
    forward = np.stack([np.ones_like(slope), slope, zero], axis=1) / np.sqrt(1.0 + slope**2)[:, None]
    direction = np.stack([part + zero for part in slopes[:3]], axis=1)
    tangents = [("forward", forward)]
    if "z" in names:  # across the normal and the first tangent
        normal = np.cross(forward, np.cross(direction, forward))
        tangents.append(("sideways", np.cross(forward, normal / np.linalg.norm(normal, axis=1)[:, None])))
    return Gap(value + zero, [(measure.point.body.name, p, direction)], [], slopes[3] + zero, tangents)


def user_gap(measure: UserMeasure, bodies: Bodies, owner: str = "measure") -> Gap:
    """A function of places, coordinates and time; its derivatives by complex steps."""
    n = len(bodies.told)
    function: Callable[..., Any] = measure.function
    arguments = measure.arguments
    if isinstance(measure.function, str):
        function, arguments = (lambda value: value), ((measure.function, measure.function),)
    values = [_argument(label, given, bodies, owner) for label, given in arguments]
    zero = np.zeros(n)
    gap = Gap(np.asarray(function(*values), dtype=float) + zero, [], [], zero, [])

    def slope(k: int, place: int | None = None) -> Array:
        moved = list(values)
        if place is None:
            moved[k] = values[k] + 1j * TINY
        else:
            moved[k] = tuple(v + 1j * TINY if j == place else v for j, v in enumerate(values[k]))
        return np.imag(np.asarray(function(*moved)) + 0j) / TINY + zero

    joints = {name: (joint.name, j) for joint in bodies.model.joints for j, name in enumerate(joint.coordinate_names)}
    for k, (_, given) in enumerate(arguments):
        if isinstance(given, Frame):
            direction = np.stack([slope(k, j) for j in range(3)], axis=1)
            gap.points.append((given.body.name, bodies.place(given), direction))
        elif isinstance(given, Joint):
            for j in range(len(given.labels)):
                gap.efforts.append((given.name, j, slope(k, j if len(given.labels) > 1 else None)))
        elif given == "t":
            gap.drift = gap.drift + slope(k)
        elif isinstance(given, str) and given in joints:
            gap.efforts.append((*joints[given], slope(k)))
        elif isinstance(given, str) and given.endswith((".x", ".y", ".z")) and given[:-2] in bodies.model.frames:
            frame = bodies.model.frames[given[:-2]]
            axis = np.eye(3)["xyz".index(given[-1])]
            gap.points.append((frame.body.name, bodies.place(frame), slope(k)[:, None] * axis))
        elif isinstance(given, str):
            raise NotImplementedError(f"a measure of '{given}'")
    return gap
