"""Gaps of balls and disks over planes, and of joints that turn freely before cones and twists."""

from dataclasses import replace
from typing import Any

import numpy as np

from mbd.bodies.base import Frame
from mbd.constraints.turning_measures import Cone
from tests.fuzz.bodies import Bodies
from tests.fuzz.gap import Gap
from tests.fuzz.geometry import Array


def over_plane(body: str, p: Array, plane: Any, bodies: Bodies) -> Gap:
    """n · (p − p_F − u t) − offset of a place of a body, pushing back on the body that carries the plane."""
    n = len(bodies.told)
    R, origin = _axes(plane, bodies), np.zeros((n, 3))
    if plane.frame is not None:
        origin = bodies.frame(plane.frame).H[:, :3, 3]
    normal, u = np.asarray(plane.normal), np.asarray(plane.velocity)
    up = R @ normal
    value = np.sum(up * (p - origin), axis=1) - (normal @ u) * bodies.told.time - plane.offset
    points = [(body, p, up)]
    if plane.frame is not None:
        points.append((plane.frame.body.name, p, -up))
    flat = np.sqrt(1.0 - normal[2] ** 2)
    tangents = []
    if flat > 0.05:
        sideways = np.array([-normal[2] * normal[0], -normal[2] * normal[1], flat**2]) / flat
        tangents = [("forward", R @ np.cross(normal, sideways)), ("sideways", R @ sideways)]
    return Gap(value, points, [], np.full(n, -float(normal @ u)), tangents, R @ u)


def _axes(plane: Any, bodies: Bodies) -> Array:
    n = len(bodies.told)
    return np.broadcast_to(np.eye(3), (n, 3, 3)) if plane.frame is None else bodies.frame(plane.frame).H[:, :3, :3]


def ball_gap(measure: Any, bodies: Bodies) -> Gap:
    """n · s_C − r: the lowest point of the ball over the plane."""
    radius = bodies.told.parameters[f"{measure.center.full_name}.radius"]
    up = _axes(measure.ground, bodies) @ np.asarray(measure.ground.normal)
    return over_plane(measure.center.body.name, bodies.place(measure.center) - radius * up, measure.ground, bodies)


def edge_gap(center: Frame, radius: float, axis: Any, plane: Any, bodies: Bodies) -> Gap:
    """n · s_C − r |n × a|, at the lowest point of the edge ``C + r ((n·a) a − n)/|n × a|``; flat, at any one."""
    H = bodies.frame(center).H
    a, n = H[:, :3, :3] @ np.asarray(axis), _axes(plane, bodies) @ np.asarray(plane.normal)
    steep = np.linalg.norm(np.cross(n, a), axis=1)
    lowest = H[:, :3, 3] + radius * (np.sum(n * a, axis=1)[:, None] * a - n) / steep[:, None]
    gap = over_plane(center.body.name, lowest, plane, bodies)
    middle = over_plane(center.body.name, H[:, :3, 3], plane, bodies)
    return replace(gap, value=middle.value - radius * steep, blur=1.0 / np.sqrt(steep))


def turning_gap(measure: Any, bodies: Bodies) -> Gap:
    """limit − ∠(R a, d), or ±(limit − τ), and what the angular velocity in the child's axes makes of them."""
    joint, a = measure.joint, np.asarray(measure.axis)
    H = bodies.between(joint).H[:, :3, :3]
    blur: Any = 0.0
    if isinstance(measure, Cone):
        turned, middle = H @ a, np.asarray(measure.direction)
        across = np.cross(turned, middle)
        sine = np.linalg.norm(across, axis=1)
        value = measure.limit - np.arctan2(sine, turned @ middle)
        grows = np.where(sine > 1e-12, 1.0, 0.0) / np.where(sine > 1e-12, sine, 1.0)
        slope = (np.swapaxes(H, 1, 2) @ (grows[:, None] * across)[:, :, None])[:, :, 0]
    else:
        w, u = _quaternion(H)
        p, sign = u @ a, 1.0 if measure.limit > 0.0 else -1.0
        tau = np.remainder(2.0 * np.arctan2(p, w) + np.pi, 2.0 * np.pi) - np.pi
        value = sign * (measure.limit - tau)
        rates = (w**2)[:, None] * a + w[:, None] * np.cross(a, u) + p[:, None] * u
        slope = -sign * rates / (p**2 + w**2)[:, None]
        blur = 1.0 / np.sqrt(p**2 + w**2)  # where it swings by half a turn the twist is none
    efforts = [(joint.name, k, slope[:, k]) for k in range(3)]
    return Gap(value, [], efforts, np.zeros(len(value)), [], blur=blur)


def _quaternion(R: Array) -> tuple[Array, Array]:
    """w (n,) and u (n, 3) of rotation matrices."""
    from scipy.spatial.transform import Rotation

    x = Rotation.from_matrix(R).as_quat()
    return np.asarray(x[:, 3]), np.asarray(x[:, :3])
