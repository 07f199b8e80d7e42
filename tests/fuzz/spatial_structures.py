"""Mechanisms of fuzzed scenes with joints that turn freely: trees, loops, stops, feet, balls and disks in space."""

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np

import mbd
from tests.fuzz.parts import add_loads, any_axis, any_body, any_frame, any_joint
from tests.fuzz.tree_poses import close_loop, pose

Made = tuple[mbd.Model, dict[str, Any]]


def any_orientation(rng: random.Random) -> tuple[float, float, float, float]:
    """A unit quaternion, any as likely."""
    parts = np.array([rng.gauss(0.0, 1.0) for _ in range(4)])
    w, x, y, z = parts / np.linalg.norm(parts)
    return float(w), float(x), float(y), float(z)


def free_joint(rng: random.Random, name: str, a: Any, b: Any, floats: bool) -> Any:
    """A joint that turns freely, with losses or a spring, or one of the others of space."""
    draw = rng.random()
    viscous = mbd.Viscous(rng.uniform(0.02, 0.4))
    if floats and draw < 0.5:
        return mbd.Free(name, a, b, loss=rng.choice([None, {"x": viscous}, {"angular_velocity.z": viscous}]))
    if draw < 0.7:
        loss = rng.choice([None, viscous, {"angular_velocity.y": mbd.Quadratic(0.2)}])
        return mbd.Spherical(name, a, b, loss=loss, stiffness=rng.choice([0.0, 0.0, rng.uniform(1.0, 8.0)]))
    return any_joint(rng, name, a, b, True)


def free_tree(rng: random.Random, bodies: int, most: int = 12, chain: bool = False) -> Made:
    """A tree of bodies, at least one joint of which turns freely, and any pose of it."""
    model = mbd.Model("free tree", gravity=[rng.uniform(-6, 6) for _ in range(3)])
    known: list[Any] = [model.ground]
    position: dict[str, Any] = {}
    velocities = 0
    for k in range(bodies):
        body, onto = any_body(rng, f"body {k}", True), known[-1] if chain else rng.choice(known)
        a, b = any_frame(rng, onto, True), any_frame(rng, body, True)
        if rng.random() < 0.3:
            a, b = b, a
        free = k == 0 or rng.random() < 0.6
        joint = (
            free_joint(rng, f"joint {k}", a, b, onto is model.ground and not chain)
            if free
            else any_joint(rng, f"joint {k}", a, b, True)
        )
        if k == 0 and not isinstance(joint, mbd.Free):
            joint = mbd.Spherical(f"joint {k}", a, b, stiffness=rng.choice([0.0, 3.0]))
        if velocities + len(joint.freedoms) > most:
            break
        velocities += len(joint.freedoms)
        model.connect(joint)
        known.append(body)
        position |= any_place(rng, joint)
    return model, position


def any_place(rng: random.Random, joint: Any) -> dict[str, Any]:
    """Values of its coordinates."""
    found: dict[str, Any] = {}
    for label in joint.labels:
        if label.name.startswith("orientation."):
            found.setdefault(f"{joint.name}.orientation", any_orientation(rng))
        else:
            spread = 2.5 if label.unit == "rad" else 0.6
            found[f"{joint.name}.{label.name}"] = rng.uniform(-spread, spread)
    return found


def _tree(rng: random.Random) -> Made:
    model, position = free_tree(rng, rng.randint(1, 3))
    if rng.random() < 0.7:
        add_loads(rng, model, True)
    if rng.random() < 0.4:
        add_bushing(rng, model)
    return model, position


def add_bushing(rng: random.Random, model: mbd.Model) -> None:
    """A bushing from the last body to the ground."""
    last = list(model.bodies.values())[-1]

    def three(most: float) -> tuple[float, ...]:
        return tuple(rng.uniform(0.1, most) for _ in range(3))

    damping = rng.choice([{}, {"damping": three(2.0), "rotational_damping": three(0.3)}])
    model.apply(
        mbd.Bushing(
            "bushing",
            model.ground.point(0.2, 0.1, -0.3),
            any_frame(rng, last, True),
            three(30.0),
            three(2.0),
            **damping,
        )
    )


def _loop(rng: random.Random) -> Made:
    """A chain whose end is held by a ball joint or another one."""
    model, position = free_tree(rng, 3, 9, chain=True)
    axis = any_axis(rng)
    second = tuple(np.cross(axis, any_axis(rng)))
    freedoms = sum(len(joint.freedoms) for joint in model.joints)
    makers: list[Any] = [
        lambda a, b: mbd.Spherical("closer", a, b, stiffness=rng.choice([0.0, 2.0])),
        lambda a, b: mbd.Cylindrical("closer", a, b, axis=axis),
        lambda a, b: mbd.Universal("closer", a, b, axis=axis, second_axis=second),
        lambda a, b: mbd.Revolute("closer", a, b, axis=axis, loss=mbd.Viscous(0.1)),
        lambda a, b: mbd.Screw("closer", a, b, pitch=0.7, axis=axis),
    ]
    fitting = [make for make, rows in zip(makers, (3, 4, 4, 5, 5), strict=True) if rows < freedoms]
    if len(model.joints) >= 2 and fitting:
        close_loop(rng, model, position, "closer", rng.choice(fitting), True)
    add_loads(rng, model, True)
    return model, position


def turned_four_bar(rng: random.Random) -> Made:
    """A planar four-bar, somewhere in space: three of its rows follow from the others; some bars are thin rods."""
    a, b, c, d = 0.5, 1.2, 0.9, 1.1
    crank = rng.uniform(0.4, 2.6)
    model = mbd.Model("four-bar in space", gravity=[rng.uniform(-6, 6) for _ in range(3)])
    frame = model.ground.origin.turned(rng.uniform(-3.0, 3.0), any_axis(rng))
    tip = np.array([a * math.cos(crank), a * math.sin(crank)])
    across = np.array([d, 0.0]) - tip
    length = float(np.linalg.norm(across))
    bend = math.acos((b * b + length**2 - c * c) / (2.0 * b * length))
    second = math.atan2(across[1], across[0]) + bend
    knee = tip + b * np.array([math.cos(second), math.sin(second)])
    third = math.atan2(-knee[1], d - knee[0])
    turns, headings, ends = [crank, second - crank, third - second], [crank, second, third], frame
    loss = rng.choice([None, mbd.Viscous(0.05)])
    for k, size in enumerate((a, b, c)):
        thin = rng.random() < 0.4
        inertia = (0.0 if thin else 0.02, size**2 / 12.0, size**2 / 12.0)
        bar = mbd.RigidBody(f"bar {k}", rng.uniform(0.5, 2.0), inertia, center=(0.5 * size, 0.0, 0.0))
        model.connect(mbd.Revolute(f"joint {k}", ends, bar.origin, loss=loss))
        ends = bar.point(size, 0.0, 0.0)
    position = {f"joint {k}.angle": math.remainder(turn, 2.0 * math.pi) for k, turn in enumerate(turns)}
    R = np.eye(3) if frame.rotation is None else np.asarray(frame.rotation)
    x, y, z = map(float, R @ [d, 0.0, 0.0])
    far = model.ground.point(x, y, z)
    model.connect(mbd.Revolute("closer", ends, _turned_as(far, R), loss=None))
    position["closer.angle"] = math.remainder(-headings[-1], 2.0 * math.pi)
    return model, position


def _turned_as(point: Any, R: Any) -> Any:
    from scipy.spatial.transform import Rotation

    vector = Rotation.from_matrix(R).as_rotvec()
    angle = float(np.linalg.norm(vector))
    return point.turned(angle, tuple(vector / angle)) if angle > 0.0 else point


def _stops(rng: random.Random) -> Made:
    """Ball joints with cones and twists, open at the start."""
    model, position = free_tree(rng, rng.randint(1, 2), 6)
    balls = [joint for joint in model.joints if isinstance(joint, mbd.Spherical)]
    for joint in balls:
        angle = rng.uniform(0.0, 0.3)
        axis = np.array(any_axis(rng))
        w, u = math.cos(0.5 * angle), math.sin(0.5 * angle) * axis / np.linalg.norm(axis)
        position[f"{joint.name}.orientation"] = (w, *map(float, u))
        limits: list[Any] = [mbd.cone(joint, rng.uniform(0.4, 1.2), any_axis(rng))]
        along = any_axis(rng)
        limits += [mbd.twist(joint, rng.uniform(0.4, 0.9), along), mbd.twist(joint, -rng.uniform(0.4, 0.9), along)]
        for k, measure in enumerate(limits):
            stop: Any = mbd.Unilateral(f"{joint.name} stop {k}", measure, restitution=rng.choice([0.0, 0.3, 0.7]))
            if rng.random() < 0.3:
                stop = mbd.Penalty(f"{joint.name} stop {k}", measure, 10.0 ** rng.uniform(2, 4), damping=1.0)
            model.constrain(stop)
    if rng.random() < 0.5:
        add_loads(rng, model, True)
    return model, position


def any_plane(rng: random.Random, low: float) -> mbd.Plane:
    """A plane below, level or tilted, at rest, running along or rising."""
    normal = (rng.uniform(-0.25, 0.25), 1.0, rng.uniform(-0.25, 0.25)) if rng.random() < 0.6 else (0.0, 1.0, 0.0)
    velocity = rng.choice([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.6, 0.0, -0.4)])
    return mbd.Plane(normal, low, velocity=velocity)


def any_foot(rng: random.Random, name: str, measure: Any) -> Any:
    """A law of a foot in space."""
    if rng.random() < 0.15:
        return mbd.Penalty(name, measure, 10.0 ** rng.uniform(3, 4.5), damping=20.0, release="pull")
    friction = rng.choice([None, 0.0, rng.uniform(0.1, 0.9), rng.uniform(0.1, 0.9)])
    restitution = rng.choice([0.0, 0.0, 0.4])
    return mbd.Unilateral(name, measure, restitution=0.0 if friction is None else restitution, friction=friction)


def _feet(rng: random.Random) -> Made:
    """One or two bodies with points over a plane that sticks, rubs, runs or lies askew."""
    model, position = free_tree(rng, rng.randint(1, 2), 9)
    model.gravity = (0.0, -9.81, 0.0)
    moving = [body for body in model.bodies.values() if body is not model.ground]
    feet = [body.point(rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6)) for body in moving]
    bodies = pose(model, position)
    bodies.told.parameters.update({k: v for foot in feet for k, v in foot.parameters().items()})  # type: ignore[attr-defined]
    plane = any_plane(rng, 0.0)
    heights = [float(np.dot(plane.normal, bodies.place(foot)[0])) for foot in feet]
    plane = mbd.Plane(plane.normal, min(heights) - rng.uniform(0.02, 0.2), velocity=plane.velocity)
    for k, foot in enumerate(feet):
        model.constrain(any_foot(rng, f"foot {k}", mbd.touchdown(foot, plane)))
    return model, position


def _round(rng: random.Random) -> Made:
    """A ball or a disk that falls on a plane, rolls, slips and spins."""
    model = mbd.Model("round", gravity=(0.0, -9.81, 0.0))
    r = rng.uniform(0.05, 0.3)
    across, along = rng.uniform(0.2, 0.4) * r * r, rng.uniform(0.3, 0.5) * r * r
    body = mbd.RigidBody("body", rng.uniform(0.3, 2.0), (across, across, min(along, 2.0 * across)))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    plane = any_plane(rng, 0.0)
    drop = rng.uniform(0.005, 0.1)
    if rng.random() < 0.5:
        touch: Any = mbd.sphere_touchdown(body.origin, r, plane)
        turned = any_orientation(rng)
    else:
        touch = mbd.disk_touchdown(body.origin, r, (0, 0, 1), plane)
        lean = rng.uniform(-0.7, 0.7)
        turned = (math.cos(0.5 * lean), math.sin(0.5 * lean), 0.0, 0.0)
    model.constrain(any_foot(rng, "touch", touch))
    high = (r + drop) / plane.normal[1]
    return model, {"float.x": 0.0, "float.y": high, "float.z": 0.0, "float.orientation": turned}


def _rolling(rng: random.Random) -> Made:
    """A disk that rolls all the time."""
    model = mbd.Model("rolling", gravity=(rng.uniform(-2, 2), -9.81, rng.uniform(-2, 2)))
    r = rng.uniform(0.1, 0.4)
    body = mbd.RigidBody("body", rng.uniform(0.3, 2.0), (0.25 * r * r, 0.25 * r * r, 0.5 * r * r))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    plane = any_plane(rng, 0.0)
    lean, axis = rng.uniform(-0.6, 0.6), (0.0, 0.0, 1.0)
    model.constrain(mbd.Bilateral("edge", mbd.disk_touchdown(body.origin, r, axis, plane)))
    model.constrain(mbd.Rolling("grip", body.origin, r, plane, axis=axis))
    turned = (math.cos(0.5 * lean), math.sin(0.5 * lean), 0.0, 0.0)
    return model, {"float.x": 0.0, "float.z": 0.0, "float.orientation": turned}


def _light(rng: random.Random) -> Made:
    """A chain of ball joints whose middle link is light between heavy ones."""
    model = mbd.Model("light link", gravity=(0.0, -9.81, 0.0))
    end, position = model.ground.origin, {}
    for k, mass in enumerate((rng.uniform(1.0, 5.0), 10.0 ** rng.uniform(-6.0, -2.0), rng.uniform(1.0, 20.0))):
        inertia = tuple(mass * part for part in (0.05, 0.03, 0.06))
        body = mbd.RigidBody(f"body {k}", mass, inertia, center=(0.0, -0.2, 0.05))
        model.connect(mbd.Spherical(f"joint {k}", end, body.origin))
        position[f"joint {k}.orientation"] = any_orientation(rng)
        end = body.point(0.0, -0.4, 0.0)
    return model, position


SPATIAL_KINDS: dict[str, tuple[Callable[[random.Random], Made], bool]] = {
    "free tree": (_tree, False),
    "free loop": (_loop, True),
    "redundant loop": (turned_four_bar, True),
    "stops of balls": (_stops, False),
    "feet in space": (_feet, False),
    "balls and disks": (_round, False),
    "rolling disk": (_rolling, True),
    "light link": (_light, False),
}
"""By name: what makes it, and whether rows tie its coordinates together."""
